//! Runs blocks of a campaign on the machine that an engine has chosen.

use std::fmt;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use closecall_sensors::camera::Backend;
use closecall_sensors::set_inference_backend;
use tempfile::TempDir;

use super::answer;
use super::content::Content;
use super::error::RemoteError;
use super::shipment::Shipment;
use crate::campaign_error::WorkersError;
use crate::folder::FolderError;
use crate::host::{Refusal, refusal};
use crate::manifest::{Manifest, version};
use crate::plan::Plan;
use crate::rare::{Point, point_samples};
use crate::runner::Work;
use crate::saved::works;
use crate::saved_error::SavedError;
use crate::stop::StopFlag;
use crate::workers::{Finished, WorkerPool, Workers};

/// The variable that names the library of ONNX Runtime, as for the command line.
const BACKEND_VARIABLE: &str = "ORT_DYLIB_PATH";

/// A campaign, ready to run blocks of its samples.
pub struct BlockRunner {
    works: Vec<Arc<Work>>,
    workers: Workers,
    /// The thread of the latest scenario, with the scenario's index. It keeps its worker processes
    /// from block to block.
    pool: Mutex<Option<(usize, WorkerPool<Work>)>>,
    version: String,
    configuration: String,
    /// The files of the controllers.
    _folder: Option<TempDir>,
}

impl fmt::Debug for BlockRunner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BlockRunner").field("configuration", &self.configuration).finish_non_exhaustive()
    }
}

impl BlockRunner {
    /// Prepares the campaign of a shipment, and checks that this machine runs the same one: the
    /// same version of the program, scenarios, networks and controllers.
    ///
    /// # Errors
    /// [`RemoteError`] with what differs.
    pub fn prepare(shipment: &Shipment) -> Result<Self, RemoteError> {
        let here = version();
        if shipment.version != here {
            return Err(RemoteError::Version { there: shipment.version.clone(), here });
        }
        let sent: Manifest = serde_json::from_str(&shipment.manifest)?;
        set_inference_backend(Backend::choose(None, std::env::var_os(BACKEND_VARIABLE).map(Into::into)));
        let folder = shipment.unpack()?;
        let unpacked = folder.as_ref().map(|folder| folder.path().to_owned());
        let local = Manifest { working_folder: unpacked.or_else(|| sent.working_folder.clone()), ..sent.clone() };
        let works = works(Path::new(""), &local)?;
        let too_long = |error: std::time::TryFromFloatSecsError| {
            let (path, message) = ("manifest.json".into(), format!("sample_timeout_s: {error}"));
            RemoteError::Folder(FolderError::Content { path, line: 1, message })
        };
        let sample_timeout = Duration::try_from_secs_f64(sent.sample_timeout_s).map_err(too_long)?;
        let files: Vec<_> = works.iter().map(|work| work.file.clone()).collect();
        sent.arms.iter().try_for_each(|arm| arm.try_in(local.controller_folder()))?;
        let mut plan = Plan::new_in(local.controller_folder(), files, sent.sampling, sent.arms.clone())?;
        plan.use_sensors(sent.sensors).map_err(SavedError::from)?;
        plan.partition = sent.partition;
        plan.checks = sent.checks;
        plan.inference = sent.inference;
        plan.workers = Workers { jobs: NonZeroUsize::MIN, sample_timeout };
        plan.retry_crashed = sent.retry_crashed;
        plan.without_effect.clone_from(&sent.without_effect);
        plan.left_out.clone_from(&sent.left_out);
        let manifest = plan.manifest_in(sent.command.clone(), local.controller_folder())?;
        let differences = sent.differences(&manifest);
        if !differences.is_empty() {
            return Err(RemoteError::Different { differences });
        }
        let configuration = Manifest { working_folder: sent.working_folder, ..manifest }.configuration();
        let pool = Mutex::default();
        Ok(Self { works, workers: plan.workers, pool, version: here, configuration, _folder: folder })
    }

    /// Runs a block of the scenario with index `work` in one thread, and returns its records.
    /// `numbers` are those with which the block was submitted.
    ///
    /// # Errors
    /// [`RemoteError`] if there is no such scenario, sample or point, or no thread can be started.
    pub fn run(&self, work: usize, numbers: &[u64]) -> Result<Vec<u8>, RemoteError> {
        let (Some(scenario_work), Some(content)) = (self.works.get(work), Content::read(numbers)) else {
            return Err(RemoteError::NoBlock { work });
        };
        let mut results: Vec<Finished> = Vec::with_capacity(content.len());
        let on_finished = |finished| results.push(finished);
        let done = match &content {
            Content::Samples(samples) if samples.iter().any(|&sample| sample >= scenario_work.count()) => {
                return Err(RemoteError::NoBlock { work });
            }
            Content::Samples(samples) => self.run_in_pool(work, scenario_work, samples, on_finished),
            Content::Points(points) => self.run_points(scenario_work, points, on_finished),
        };
        done.map_err(|error| super::EngineError { message: error.to_string(), is_input: false })?;
        if let Some(Refusal { reason, .. }) = results.iter().find_map(|finished| refusal(&finished.record)) {
            return Err(super::EngineError { message: reason.to_owned(), is_input: true }.into());
        }
        Ok(answer::encode(&self.version, &self.configuration, &results)?)
    }

    fn run_points(
        &self,
        work: &Work,
        points: &[Point],
        mut on_finished: impl FnMut(Finished),
    ) -> Result<(), WorkersError> {
        let samples = Arc::new(point_samples(work, points));
        self.workers.run_samples(&samples, 0..points.len() as u64, &StopFlag::default(), |finished| {
            on_finished(finished);
            Ok::<_, WorkersError>(ControlFlow::Continue(()))
        })
    }

    fn run_in_pool(
        &self,
        number: usize,
        work: &Arc<Work>,
        samples: &[u64],
        mut on_finished: impl FnMut(Finished),
    ) -> Result<(), WorkersError> {
        let mut kept = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        let mut pool = match kept.take() {
            Some((same, pool)) if same == number => pool,
            _ => WorkerPool::new(self.workers, work, &StopFlag::default())?,
        };
        pool.run(samples.iter().copied(), |finished| {
            on_finished(finished);
            Ok::<_, WorkersError>(ControlFlow::Continue(()))
        })?;
        *kept = Some((number, pool));
        Ok(())
    }
}
