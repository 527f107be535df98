//! Runs one sample in one arm. A panic, for example of the controller, becomes an error of that
//! sample.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_simulation::{Arm, NoObserver, Observer, RunKey, SampleError, simulate};
use closecall_traffic::Check;

use super::attribution;
use super::host;
use super::identity::Identity;
use super::partition::Partition;
use super::record::{ArmRecord, NobodyComing, SampleFailure};
use super::validity::{ArmChecks, CheckPlan, CheckedRun};
use super::workers::Samples;

pub use super::sampling::Sampling;

/// A scenario with all that its runs need: how its samples are drawn, and the arms in which each
/// sample runs.
#[derive(Clone)]
pub struct Work {
    /// The scenario.
    pub file: ScenarioFile,
    /// How its samples are drawn.
    pub sampling: Sampling,
    /// The arms: the baseline first if there are several, the arm under test last, references
    /// between them.
    pub arms: Vec<Arm>,
    /// The samples that are checked for validity.
    pub checks: CheckPlan,
    /// How often a sample runs again in a new process after its worker process has crashed or hung.
    /// The record of such a sample says that the sample is flaky.
    pub retry_crashed: u32,
}

impl fmt::Debug for Work {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Work")
            .field("scenario", &self.file.config().name)
            .field("sampling", &self.sampling)
            .finish_non_exhaustive()
    }
}

impl Work {
    /// Returns the properties that the records of the scenario with its arms must have.
    pub(crate) fn identity(&self) -> Identity<'_, impl Iterator<Item = &str> + Clone> {
        let arms = self.arms.iter().map(|arm| arm.controller.name());
        Identity { file: &self.file, sampling: self.sampling, arms }
    }

    /// Returns the number of samples of the design. A grid may have another number than was
    /// requested.
    pub fn count(&self) -> u64 {
        self.file.space().samples(self.sampling.design, self.sampling.samples)
    }

    /// Returns the numbers of the samples in a part of the campaign, or of all samples, in
    /// ascending order.
    pub fn samples(&self, part: Option<Partition>) -> impl Iterator<Item = u64> + use<> {
        (0..self.count()).filter(move |&sample| part.is_none_or(|part| part.contains(sample)))
    }
}

impl Samples for Work {
    fn scenario(&self) -> &str {
        &self.file.config().name
    }

    fn arms(&self) -> &[Arm] {
        &self.arms
    }

    /// Runs one sample in one arm, in a worker process if its controller is isolated, and checks it
    /// if the plan of the checks includes it.
    fn run(&self, sample: u64, index: usize, limit: Duration, on_outcome: &OnOutcome<'_>) -> ArmRun {
        let arm = &self.arms[index];
        if arm.controller.isolated().is_some() {
            return host::run((self, index, sample), limit, on_outcome);
        }
        let mut done = None;
        arm.controller.in_thread(&mut || done = Some(self.run_here(sample, arm, on_outcome)));
        done.unwrap_or_else(|| self.run_here(sample, arm, on_outcome))
    }

    fn end(&self) {
        host::end(self);
    }
}

impl Work {
    /// Runs one sample in one arm in this thread. `on_outcome` gets the result before the checks
    /// and the run without vehicles behind, if there are any.
    fn run_here(&self, sample: u64, arm: &Arm, on_outcome: &OnOutcome<'_>) -> ArmRun {
        let key = RunKey { seed: self.sampling.seed, sample };
        let started = Instant::now();
        let scenario = guarded(|| concrete(&self.file, self.sampling, sample));
        let run = scenario.as_ref().map(|scenario| CheckedRun { scenario, key, arm });
        let result = match &run {
            Ok(run) => run_guarded(run.scenario, key, arm, &mut NoObserver),
            Err(error) => Err((*error).clone()),
        };
        let wall_s = started.elapsed().as_secs_f64();
        let record = ArmRecord::new(arm.controller.name().to_owned(), result.map_err(SampleFailure::from));
        let mut done = ArmRun { record, wall_s, check_s: 0.0 };
        let [is_checked, is_attributed] =
            [self.checks.includes(key), attribution::includes(&self.file.config().requirements, key)];
        if let (Ok(run), Ok(outcome), true) = (&run, done.record.result.clone(), is_checked || is_attributed) {
            // What stays if a run without vehicles behind takes too long.
            let is_followed = is_attributed && run.scenario.with_nobody_behind().is_some();
            done.record.nobody_behind = is_followed.then_some(NobodyComing::LATE);
            on_outcome(&done);
            done.record.checks = is_checked.then(|| run.check(&outcome));
            done.record.nobody_behind = is_attributed.then(|| run.with_nobody_coming()).flatten();
            done.check_s = started.elapsed().as_secs_f64() - wall_s;
        }
        done
    }
}

/// The result of one sample in one arm, with its wall time.
#[derive(Clone, Debug)]
pub(crate) struct ArmRun {
    pub(crate) record: ArmRecord,
    /// Wall time, without the validity checks (s).
    pub(crate) wall_s: f64,
    /// Wall time of the validity checks (s).
    pub(crate) check_s: f64,
}

/// Takes the run of a sample that has its outcome, before its validity checks.
pub(crate) type OnOutcome<'a> = dyn Fn(&ArmRun) + Sync + 'a;

impl ArmRun {
    /// Returns the run if its checks have no result, because of this error.
    pub(crate) fn unchecked(mut self, error: &SampleError) -> Self {
        self.record.checks = Some(ArmChecks { not_checked: Some(error.to_string()), ..ArmChecks::default() });
        self
    }
}

/// Returns the concrete scenario of one sample.
///
/// # Errors
/// [`SampleError::Scenario`] if the sampled values contradict each other.
pub fn concrete(file: &ScenarioFile, sampling: Sampling, sample: u64) -> Result<Scenario, SampleError> {
    let parameters = file.space().sample(sampling.design, sampling.seed, sample, sampling.samples);
    let scenario = file.config().check(&parameters).map_err(SampleError::Scenario)?;
    Ok(file.with_program_folder(scenario))
}

/// Runs one sample in one arm. A panic is returned as an error of the sample.
///
/// # Errors
/// [`SampleError`] if the sample has no outcome.
pub fn run_guarded(
    scenario: &Scenario,
    key: RunKey,
    arm: &Arm,
    observer: &mut dyn Observer,
) -> Result<Outcome, SampleError> {
    guarded(|| simulate(scenario, key, arm, observer))
}

/// Runs code that may panic. A panic is returned as an error of the sample.
///
/// # Errors
/// The error of `run`, or [`SampleError::Panic`].
pub(crate) fn guarded<T>(run: impl FnOnce() -> Result<T, SampleError>) -> Result<T, SampleError> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let message = panic
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned())
            .or_else(|| panic.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "without a message".to_owned());
        Err(SampleError::Panic { message })
    })
}
