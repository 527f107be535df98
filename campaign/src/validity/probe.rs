//! One sample run again under changes that must not matter.

use std::thread;

use closecall_sensors::SensorMode;

use super::mirror::is_mirror_image;
use super::{ArmChecks, Invariance};
use crate::runner::run_guarded;
use closecall_simulation::outcome::Outcome;
use closecall_simulation::scenario::Scenario;
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};

/// One sample in one arm.
#[derive(Clone, Copy)]
pub(crate) struct Subject<'a> {
    /// What is run.
    pub(crate) scenario: &'a Scenario,
    /// Which sample it is.
    pub(crate) key: RunKey,
    /// In which arm.
    pub(crate) arm: &'a Arm,
}

type Run = Result<Outcome, SampleError>;

impl Subject<'_> {
    /// Checks this sample, which came to `outcome`.
    ///
    /// The order of the actors and the number of threads are changed at once, in one run on a fresh thread beside those
    /// that the campaign has; only where that makes a difference is it looked for which of the two did.
    pub(crate) fn check(&self, outcome: &Outcome) -> ArmChecks {
        let reversed = self.scenario.reversed();
        let (elsewhere, halved) =
            beside(|| self.run(&reversed, self.arm), || self.run(&self.scenario.at_half_step(), self.arm));
        let mut broken = Vec::new();
        if !is_same(&elsewhere, outcome) {
            broken.push(self.culprit(&reversed, outcome));
        }
        if !self.is_mirrored(outcome) {
            broken.push(Invariance::Mirror);
        }
        if halved.is_err() {
            broken.push(Invariance::HalfStep);
        }
        ArmChecks { collided_at_half_step: halved.ok().map(|halved| halved.ego_collided()), broken }
    }

    fn run(&self, scenario: &Scenario, arm: &Arm) -> Run {
        run_guarded(scenario, self.key, arm, &mut NoObserver)
    }

    /// What made the difference. Where no single change does it again, the run does not even repeat itself.
    fn culprit(&self, reversed: &Scenario, outcome: &Outcome) -> Invariance {
        let differs = |run: Run| !is_same(&run, outcome);
        if differs(self.run(self.scenario, self.arm)) {
            Invariance::Repetition
        } else if differs(self.run(reversed, self.arm)) {
            Invariance::ActorOrder
        } else if differs(beside(|| self.run(self.scenario, self.arm), || ()).0) {
            Invariance::Threads
        } else {
            Invariance::Repetition
        }
    }

    /// True where the mirrored world comes to the mirrored outcome, or there is none. The full sensors are replaced by
    /// object-level ones: the LiDAR's scan pattern has no mirror image.
    fn is_mirrored(&self, outcome: &Outcome) -> bool {
        let Some(mirrored) = self.scenario.mirrored() else { return true };
        let mode = self.arm.sensors.unwrap_or(self.scenario.sensors.mode());
        if mode != SensorMode::Full {
            return self.run(&mirrored, self.arm).is_ok_and(|image| is_mirror_image(&image, outcome));
        }
        let arm = Arm { sensors: Some(SensorMode::Object), ..self.arm.clone() };
        match (self.run(self.scenario, &arm), self.run(&mirrored, &arm)) {
            (Ok(object), Ok(image)) => is_mirror_image(&image, &object),
            (object, image) => object == image,
        }
    }
}

fn is_same(run: &Run, outcome: &Outcome) -> bool {
    run.as_ref().is_ok_and(|again| again.has_same_bits(outcome))
}

/// Does one thing on a fresh thread while another is done here. Where no thread can be had, both are done here.
fn beside<T: Send, U>(there: impl Fn() -> T + Sync, here: impl FnOnce() -> U) -> (T, U) {
    thread::scope(|scope| {
        let fresh = thread::Builder::new().name("check".to_owned()).spawn_scoped(scope, &there);
        let here = here();
        let there = fresh.ok().and_then(|fresh| fresh.join().ok()).unwrap_or_else(&there);
        (there, here)
    })
}
