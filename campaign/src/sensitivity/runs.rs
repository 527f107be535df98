//! The runs of a design: points of the unit cube, run in every arm.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::Outcome;
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};
use closecall_traffic::Check;

use super::factor::FactorRange;
use super::output::values;
use crate::campaign_error::WorkersError;
use crate::record::SampleFailure;
use crate::runner::{guarded, run_guarded};
use crate::stop::StopFlag;
use crate::workers::{Samples, UncheckedSamples, Workers};

/// Number of random numbers that the factor `chance` distinguishes. The numbers of the designs have
/// no more bits.
const CHANCES: f64 = (1_u64 << 24) as f64;

/// The errors of runs, by kind.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunErrors {
    /// The number of points that have no output, since an arm ended in an error.
    pub points: u64,
    /// The number of runs and the first message of each kind of error.
    pub kinds: BTreeMap<String, (u64, String)>,
}

impl RunErrors {
    /// Adds the failure of a run to the errors of its kind.
    pub(crate) fn add_failure(&mut self, failure: &SampleFailure) {
        self.kinds.entry(failure.kind.clone()).or_insert_with(|| (0, failure.message.clone())).0 += 1;
    }

    /// Adds other errors.
    pub fn add(&mut self, other: &Self) {
        self.points += other.points;
        for (kind, (count, message)) in &other.kinds {
            self.kinds.entry(kind.clone()).or_insert_with(|| (0, message.clone())).0 += count;
        }
    }
}

/// The mapping from points of the unit cube to runs. The coordinates are the varying parameters,
/// then the ranges, then chance.
#[derive(Clone, Debug)]
pub(super) struct Cube {
    /// The scenario, with every range at its middle.
    pub(super) file: ScenarioFile,
    /// The text without the ranges.
    pub(super) text: String,
    pub(super) ranges: Vec<FactorRange>,
    pub(super) seed: u64,
}

impl Cube {
    /// Returns the scenario file with the values of the ranges at a point.
    fn file(&self, ranges: &[f64]) -> Result<Cow<'_, ScenarioFile>, SampleFailure> {
        if self.ranges.is_empty() {
            return Ok(Cow::Borrowed(&self.file));
        }
        let fail = |message: String| SampleFailure { kind: "scenario".to_owned(), message };
        let settings: Result<Vec<_>, _> = self.ranges.iter().zip(ranges).map(|(range, u)| range.at(*u)).collect();
        let settings = settings.map_err(|error| fail(error.to_string()))?;
        let parsed = ScenarioFile::parse(self.file.path(), &self.text, &settings);
        parsed.map(Cow::Owned).map_err(|error| fail(error.to_string()))
    }

    /// Runs the sample at a point in one arm.
    fn run(&self, point: &[f64], arm: &Arm) -> Result<Outcome, SampleFailure> {
        let (parameters, rest) = point.split_at(self.file.space().varying().count());
        let file = self.file(rest)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to the number of chances")]
        let sample = rest.last().map_or(0, |u| (u * CHANCES) as u64);
        let key = RunKey { seed: self.seed, sample };
        let scenario = guarded(|| file.config().check(&file.space().at(parameters)).map_err(SampleError::Scenario))?;
        Ok(run_guarded(&scenario, key, arm, &mut NoObserver)?)
    }

    /// Returns the points of a design, ready to run. `point` returns a point by its number.
    pub(super) fn samples<P: Fn(usize) -> Vec<f64> + Send + Sync + 'static>(
        self: &Arc<Self>,
        arms: Vec<Arm>,
        point: P,
    ) -> impl Samples + use<P> {
        let cube = Arc::clone(self);
        UncheckedSamples::new(&self.file, arms, move |sample: u64, arm: &Arm| {
            cube.run(&point(usize::try_from(sample).unwrap_or(usize::MAX)), arm)
        })
    }
}

/// The results of the runs of a design.
#[derive(Debug, Default)]
pub(super) struct Ran {
    /// The outputs of each point; `None` if an arm ended in an error.
    pub(super) outputs: Vec<Option<Vec<f64>>>,
    pub(super) errors: RunErrors,
}

impl Ran {
    /// Returns one output of every point.
    pub(super) fn of(&self, output: usize) -> Vec<Option<f64>> {
        self.outputs.iter().map(|values| Some(values.as_ref()?[output])).collect()
    }
}

/// Runs the first `count` points. `None` if `stop` has ended the runs early. `on_point` is called
/// after each point.
///
/// # Errors
/// [`WorkersError`] if no threads can be started.
pub(super) fn run(
    points: impl Samples,
    count: usize,
    workers: Workers,
    stop: &StopFlag,
    on_point: &mut dyn FnMut(),
) -> Result<Option<Ran>, WorkersError> {
    let mut ran = Ran::default();
    workers.run_samples(&Arc::new(points), 0..count as u64, stop, |finished| {
        let outputs = values(&finished.record);
        ran.errors.points += u64::from(outputs.is_none());
        for failure in finished.record.arms.iter().filter_map(|arm| arm.result.as_ref().err()) {
            ran.errors.add_failure(failure);
        }
        ran.outputs.push(outputs);
        on_point();
        Ok::<_, WorkersError>(ControlFlow::Continue(()))
    })?;
    Ok((ran.outputs.len() == count).then_some(ran))
}
