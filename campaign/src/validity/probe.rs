//! Runs one sample again under changes that must not matter.

use std::thread;

use closecall_scenarios::Scenario;
use closecall_scenarios::outcome::Outcome;
use closecall_sensors::SensorMode;
use closecall_sensors::lidar::ClusteringCheck;
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};

use super::mirror::is_mirror_image;
use super::{ArmChecks, Invariance};
use crate::record::NobodyComing;
use crate::runner::run_guarded;

/// One sample in one arm, to be checked.
#[derive(Clone, Copy)]
pub(crate) struct CheckedRun<'a> {
    /// The concrete scenario.
    pub(crate) scenario: &'a Scenario,
    /// The seed and the number of the sample.
    pub(crate) key: RunKey,
    /// The arm.
    pub(crate) arm: &'a Arm,
}

type Run = Result<Outcome, SampleError>;

impl CheckedRun<'_> {
    /// Checks this run, whose outcome is `outcome`.
    ///
    /// One run on a new thread changes the order of the actors and the number of threads together,
    /// and clusters each scan of the LiDARs twice. Only if its outcome differs do further runs
    /// determine the cause.
    pub(crate) fn check(&self, outcome: &Outcome) -> ArmChecks {
        self.check_with(ClusteringCheck::default(), outcome)
    }

    /// Runs this sample without the vehicles behind the ego, and with vehicles behind that do not
    /// approach. `None` if nobody is behind, or if nothing was measured in these runs.
    pub(crate) fn with_nobody_coming(&self) -> Option<NobodyComing> {
        let changed = [self.scenario.with_nobody_behind()?, self.scenario.with_nobody_approaching()?];
        let measured = changed.iter().filter_map(|scenario| match self.run(scenario, self.arm) {
            Ok(outcome) => outcome.cost.map(|cost| NobodyComing::of(Some(cost.unprompted_deficit_mps))),
            Err(error) if error.is_late() => Some(NobodyComing::LATE),
            Err(_) => Some(NobodyComing::of(None)),
        });
        measured.reduce(NobodyComing::worse)
    }

    fn check_with(&self, clustering: ClusteringCheck, outcome: &Outcome) -> ArmChecks {
        let changed = self.scenario.reversed().with_clustering_check(clustering);
        let (changed, halved) =
            on_new_thread(|| self.run(&changed, self.arm), || self.run(&self.scenario.at_half_step(), self.arm));
        let (mut broken, mut late) = (Vec::new(), Vec::new());
        match &changed {
            Err(error) if error.is_late() => late.push((Invariance::ActorOrder, error.clone())),
            changed if !is_same(changed, outcome) => broken.push(self.cause(clustering, outcome)),
            _ => {}
        }
        match self.is_mirrored(outcome) {
            Err(error) => late.push((Invariance::Mirror, error)),
            Ok(is_mirrored) => broken.extend((!is_mirrored).then_some(Invariance::Mirror)),
        }
        match &halved {
            Err(error) if error.is_late() => late.push((Invariance::HalfStep, error.clone())),
            halved => broken.extend(halved.is_err().then_some(Invariance::HalfStep)),
        }
        let not_checked = late.first().map(|(check, error)| format!("{}: {error}", check.name()));
        ArmChecks { collided_at_half_step: halved.ok().map(|halved| halved.ego_collided()), broken, not_checked }
    }

    fn run(&self, scenario: &Scenario, arm: &Arm) -> Run {
        run_guarded(scenario, self.key, arm, &mut NoObserver)
    }

    /// Returns the change that makes the outcome differ. If no single change does so again, the run
    /// is not repeatable.
    fn cause(&self, clustering: ClusteringCheck, outcome: &Outcome) -> Invariance {
        // A run that took too long says nothing.
        let differs = |run: Run| in_time(run).is_ok_and(|run| !is_same(&run, outcome));
        if differs(self.run(self.scenario, self.arm)) {
            Invariance::Repetition
        } else if differs(self.run(&self.scenario.with_clustering_check(clustering), self.arm)) {
            Invariance::Clustering
        } else if differs(self.run(&self.scenario.reversed(), self.arm)) {
            Invariance::ActorOrder
        } else if differs(on_new_thread(|| self.run(self.scenario, self.arm), || ()).0) {
            Invariance::Threads
        } else {
            Invariance::Repetition
        }
    }

    /// Returns true if the mirrored scenario has the mirrored outcome, or if the scenario has no
    /// mirror image.
    ///
    /// Object-level sensors replace the full sensor simulation, since the LiDAR's scan pattern has
    /// no mirror image.
    ///
    /// # Errors
    /// The error of a run that took too long.
    fn is_mirrored(&self, outcome: &Outcome) -> Result<bool, SampleError> {
        let Some(mirrored) = self.scenario.mirrored() else { return Ok(true) };
        let mode = self.arm.sensors.unwrap_or(self.scenario.sensors.mode());
        if mode != SensorMode::Full {
            let image = in_time(self.run(&mirrored, self.arm))?;
            return Ok(image.is_ok_and(|image| is_mirror_image(&image, outcome)));
        }
        let arm = Arm { sensors: Some(SensorMode::Object), ..self.arm.clone() };
        Ok(match (in_time(self.run(self.scenario, &arm))?, in_time(self.run(&mirrored, &arm))?) {
            (Ok(object), Ok(image)) => is_mirror_image(&image, &object),
            (object, image) => object == image,
        })
    }
}

/// Returns a run that took too long as an error, and any other as it is.
fn in_time(run: Run) -> Result<Run, SampleError> {
    match run {
        Err(error) if error.is_late() => Err(error),
        run => Ok(run),
    }
}

fn is_same(run: &Run, outcome: &Outcome) -> bool {
    run.as_ref().is_ok_and(|again| again.has_same_bits(outcome))
}

/// Runs `there` on a new thread and then `here` on this one, so that a check keeps one processor
/// busy. If no thread can be started, this thread runs both.
fn on_new_thread<T: Send, U>(there: impl Fn() -> T + Sync, here: impl FnOnce() -> U) -> (T, U) {
    thread::scope(|scope| {
        let handle = thread::Builder::new().name("check".to_owned()).spawn_scoped(scope, &there);
        let there = handle.ok().and_then(|handle| handle.join().ok()).unwrap_or_else(&there);
        (there, here())
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_scenarios::ScenarioFile;
    use closecall_sensors::lidar::ClusteredPoints;
    use closecall_simulation::controller::BuiltIn;

    use super::*;

    #[test]
    fn another_clustering_of_the_scans_breaks_the_check() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library/low-thw-overtake.toml");
        let settings = ["sensors.rear-camera.pipeline=off".parse().unwrap(), "duration-s=4".parse().unwrap()];
        let file = ScenarioFile::load(&path, &settings).unwrap();
        let scenario = &file.concrete(&file.space().nominal()).unwrap();
        let arm = &Arm { controller: BuiltIn::Mis.factory(), sensors: Some(SensorMode::Full) };
        let checked = CheckedRun { scenario, key: RunKey { seed: 1, sample: 0 }, arm };
        let outcome = checked.run(scenario, arm).unwrap();
        assert_eq!(checked.check(&outcome).broken, []);
        let planted = ClusteringCheck { core_points: Some(ClusteredPoints::CORE_POINTS + 1) };
        assert_eq!(checked.check_with(planted, &outcome).broken, [Invariance::Clustering]);
    }
}
