//! Running samples: each alone, many at a time, handed on in the order of their numbers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use closecall_scenarios::sampling::Design;
use closecall_traffic::Check;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::record::{ArmRecord, Record, SampleFailure};
use crate::outcome::Outcome;
use crate::scenario::{Scenario, ScenarioFile};
use crate::simulation::{Arm, NoObserver, Observer, RunKey, SampleError, simulate};

/// Samples that each worker is given before the results are handed on.
const SAMPLES_PER_WORKER: u64 = 16;
/// One sample in so many is run twice: its outcomes must be the same to the last bit.
const REPEATED: u64 = 100;

/// How the samples of a campaign are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Sampling {
    /// The campaign's seed.
    pub seed: u64,
    /// How the values of the parameters are laid out.
    #[serde(with = "design_by_name")]
    pub design: Design,
    /// Samples of each scenario.
    pub samples: u64,
}

mod design_by_name {
    use closecall_scenarios::sampling::Design;
    use serde::{Deserialize, Deserializer, Serializer, de};

    pub(super) fn serialize<S: Serializer>(design: &Design, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(design.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Design, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

/// A sample with what it cost.
#[derive(Clone, Debug)]
pub struct Finished {
    /// What came of it.
    pub record: Record,
    /// Wall time of each arm [s].
    pub wall_s: Vec<f64>,
    /// True where the sample was repeated and came out differently.
    pub is_invalid: bool,
}

/// The concrete scenario of one sample.
///
/// # Errors
/// [`SampleError::Scenario`] where the sampled values contradict each other.
pub fn concrete(file: &ScenarioFile, sampling: Sampling, sample: u64) -> Result<Scenario, SampleError> {
    let parameters = file.space().sample(sampling.design, sampling.seed, sample, sampling.samples);
    file.config().check(&parameters).map_err(SampleError::Scenario)
}

/// Runs one sample in one arm; a panic is an error of this sample.
///
/// # Errors
/// [`SampleError`] where the sample has no outcome.
pub fn run_guarded(
    scenario: &Scenario,
    key: RunKey,
    arm: &Arm,
    observer: &mut dyn Observer,
) -> Result<Outcome, SampleError> {
    catch_unwind(AssertUnwindSafe(|| simulate(scenario, key, arm, observer))).unwrap_or_else(|panic| {
        let message = panic
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned())
            .or_else(|| panic.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "without a message".to_owned());
        Err(SampleError::Panic { message })
    })
}

/// Runs one sample in every arm.
pub fn run_sample(file: &ScenarioFile, sampling: Sampling, arms: &[Arm], sample: u64) -> Finished {
    let key = RunKey { seed: sampling.seed, sample };
    let scenario = concrete(file, sampling, sample);
    let mut finished = Finished {
        record: Record { scenario: file.config().name.clone(), sample, arms: Vec::with_capacity(arms.len()) },
        wall_s: Vec::with_capacity(arms.len()),
        is_invalid: false,
    };
    for arm in arms {
        let started = Instant::now();
        let run = || match &scenario {
            Ok(scenario) => run_guarded(scenario, key, arm, &mut NoObserver),
            Err(error) => Err(error.clone()),
        };
        let result = run().map_err(SampleFailure::from);
        finished.wall_s.push(started.elapsed().as_secs_f64());
        if sample.is_multiple_of(REPEATED) {
            finished.is_invalid |= match (run().map_err(SampleFailure::from), &result) {
                (Ok(again), Ok(outcome)) => !again.has_same_bits(outcome),
                (again, result) => again != *result,
            };
        }
        finished.record.arms.push(ArmRecord { controller: arm.controller.name().to_owned(), result });
    }
    finished
}

/// Runs the given samples of a scenario on a pool, and hands them on in their order.
///
/// # Errors
/// Whatever `take` answers: the samples after it are not run.
pub fn run_samples<E>(
    pool: &ThreadPool,
    file: &ScenarioFile,
    sampling: Sampling,
    arms: &[Arm],
    samples: std::ops::Range<u64>,
    mut take: impl FnMut(Finished) -> Result<(), E>,
) -> Result<(), E> {
    let block = SAMPLES_PER_WORKER * pool.current_num_threads() as u64;
    let mut first = samples.start;
    while first < samples.end {
        let last = samples.end.min(first.saturating_add(block));
        let finished: Vec<Finished> = pool
            .install(|| (first..last).into_par_iter().map(|sample| run_sample(file, sampling, arms, sample)).collect());
        finished.into_iter().try_for_each(&mut take)?;
        first = last;
    }
    Ok(())
}
