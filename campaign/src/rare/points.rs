//! Points of the input space as samples that workers can run, here or elsewhere.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use closecall_scenarios::ScenarioFile;
use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};
use closecall_traffic::Check;

use super::problem::Point;
use crate::campaign_error::CampaignError;
use crate::record::{ArmRecord, SampleFailure};
use crate::runner::{ArmRun, OnOutcome, Work, guarded, run_guarded};
use crate::stop::StopFlag;
use crate::workers::{OnFinished, Samples};

/// Points of a scenario, ready to run. The number of a sample is the index of its point.
pub(crate) struct PointSamples {
    file: ScenarioFile,
    arms: Vec<Arm>,
    seed: u64,
    points: Vec<Point>,
}

impl PointSamples {
    /// Returns these points of a scenario.
    pub(crate) fn of(work: &Work, points: &[Point]) -> Self {
        Self { file: work.file.clone(), arms: work.arms.clone(), seed: work.sampling.seed, points: points.to_vec() }
    }
}

impl Samples for PointSamples {
    fn scenario(&self) -> &str {
        &self.file.config().name
    }

    fn arms(&self) -> &[Arm] {
        &self.arms
    }

    fn run(&self, sample: u64, arm: usize, _: Duration, _: &OnOutcome<'_>) -> ArmRun {
        let (arm, started) = (&self.arms[arm], Instant::now());
        let result = usize::try_from(sample).ok().and_then(|index| self.points.get(index)).map_or_else(
            || Err(SampleError::Panic { message: "there is no such point".to_owned() }),
            |point| {
                let parameters = self.file.space().at_normals(&point.normals);
                let scenario = guarded(|| self.file.config().check(&parameters).map_err(SampleError::Scenario))?;
                let key = RunKey { seed: self.seed, sample: point.noise };
                run_guarded(&scenario, key, arm, &mut NoObserver)
            },
        );
        let record = ArmRecord::new(arm.controller.name().to_owned(), result.map_err(SampleFailure::from));
        ArmRun { record, wall_s: started.elapsed().as_secs_f64(), check_s: 0.0 }
    }
}

/// Runs points elsewhere than on threads of this process.
pub trait PointRunner: Send + Sync + fmt::Debug {
    /// Runs the given points of the scenario `work`, which is given with its index in the campaign,
    /// and passes each result to `on_finished` in the order of `points`. If `stop` is set, the rest
    /// is given up.
    ///
    /// # Errors
    /// The error of `on_finished`, or another [`CampaignError`]. No further result is passed on
    /// then.
    fn run_points(
        &self,
        work: (usize, &Arc<Work>),
        points: &[Point],
        stop: &StopFlag,
        on_finished: &mut OnFinished<'_>,
    ) -> Result<(), CampaignError>;
}
