//! Points of the input space as samples that workers can run, here or elsewhere.

use std::fmt;
use std::sync::Arc;

use closecall_simulation::{Arm, NoObserver, RunKey, SampleError};
use closecall_traffic::Check;

use super::problem::Point;
use crate::campaign_error::CampaignError;
use crate::runner::{Work, guarded, run_guarded};
use crate::stop::StopFlag;
use crate::workers::{OnFinished, Samples, UncheckedSamples};

/// Returns points of a scenario, ready to run. The number of a sample is the index of its point.
pub(crate) fn point_samples(work: &Work, points: &[Point]) -> impl Samples + use<> {
    let (file, seed, points) = (work.file.clone(), work.sampling.seed, points.to_vec());
    UncheckedSamples::new(&work.file, work.arms.clone(), move |sample: u64, arm: &Arm| {
        let point = usize::try_from(sample).ok().and_then(|index| points.get(index));
        let point = point.ok_or_else(|| SampleError::Panic { message: "there is no such point".to_owned() })?;
        let parameters = file.space().at_normals(&point.normals);
        let scenario = guarded(|| file.config().check(&parameters).map_err(SampleError::Scenario))?;
        let scenario = file.with_program_folder(scenario);
        Ok(run_guarded(&scenario, RunKey { seed, sample: point.noise }, arm, &mut NoObserver)?)
    })
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
