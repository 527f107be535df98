//! The camera's classifier in the simulation loop, with one network per worker thread.
//!
//! A network takes long to set up and is locked while it runs. A run never changes its thread, so
//! each thread keeps one network and uses it for all of its runs. The network is stateless: earlier
//! runs do not change its results.

use std::cell::RefCell;
use std::sync::OnceLock;

use closecall_traffic::{Environment, Road, Stream, Time};

use crate::camera::CameraFault;
use crate::camera::{Backend, Camera, CropClassifier, ExposureKey, ImageMemory, ImagedScene};
use crate::detection_classifier::DetectionClassifier;
use crate::faults::{FaultList, NOTICED_AFTER_SCANS};
use crate::{Detection, Health, NoiseKey, Scene, SceneVehicle, SensorError};

/// Name of the camera's random stream.
pub(crate) const CHANNEL: &str = "rear-camera";

/// Returns the noise keys of the rear camera's exposures in one run, scan by scan.
///
/// With the key of an exposure, its image can be rendered again.
pub fn rear_exposures(key: &NoiseKey) -> impl Iterator<Item = ExposureKey> + use<> {
    let mut exposures = key.stream(CHANNEL);
    std::iter::repeat_with(move || ExposureKey::draw(&mut exposures))
}

/// The inference backend of this process.
static BACKEND: OnceLock<Backend> = OnceLock::new();

thread_local! {
    /// The thread's network with the camera that it was built for.
    static NETWORK: RefCell<Option<(Camera, CropClassifier)>> = const { RefCell::new(None) };
}

/// Sets the inference backend of this process; the default is tract.
///
/// The call has no effect once a backend was set or used.
pub fn set_inference_backend(backend: Backend) {
    BACKEND.get_or_init(|| backend);
}

/// Returns the inference backend of this process.
pub fn inference_backend() -> &'static Backend {
    BACKEND.get_or_init(Backend::default)
}

/// The camera of one run. It classifies with the network of its thread.
pub(crate) struct WorkerClassifier {
    camera: Camera,
    exposures: Stream,
    memory: ImageMemory,
    faults: FaultList<CameraFault>,
    /// The latest image before the camera froze.
    held: Option<HeldImage>,
    /// Number of latest successive steps in which the camera delivered no image, or the same one
    /// again.
    failed_steps: u32,
}

/// The scene of an image, and the key of its noise.
pub(crate) struct HeldImage {
    time: Time,
    environment: Environment,
    road: Road,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
    pub(crate) key: ExposureKey,
}

impl HeldImage {
    pub(crate) fn of(scene: &Scene<'_>, key: ExposureKey) -> Self {
        let Scene { time, ego, .. } = *scene;
        Self { time, environment: *scene.environment, road: *scene.road, ego, others: scene.others.to_vec(), key }
    }

    pub(crate) fn scene(&self) -> Scene<'_> {
        Scene { time: self.time, road: &self.road, environment: &self.environment, ego: self.ego, others: &self.others }
    }
}

impl WorkerClassifier {
    /// Creates the camera of one run, whose exposure noise is keyed by `key`.
    pub(crate) fn new(camera: Camera, key: &NoiseKey) -> Self {
        Self {
            camera,
            exposures: key.stream(CHANNEL),
            memory: ImageMemory::default(),
            faults: FaultList::default(),
            held: None,
            failed_steps: 0,
        }
    }

    /// Returns the same camera with faults.
    pub(crate) fn with_faults(self, faults: FaultList<CameraFault>) -> Self {
        Self { faults, ..self }
    }
}

impl DetectionClassifier for WorkerClassifier {
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError> {
        // The key is drawn even if nothing is detected, so that both arms of a pair get the same
        // exposures.
        let key = ExposureKey::draw(&mut self.exposures);
        let fault = if self.faults.is_empty() { None } else { self.faults.at(scene.time) };
        let (is_dead, is_frozen) = fault.map_or((false, false), |fault| (fault.is_dead, fault.is_frozen));
        self.failed_steps = if is_dead || is_frozen { self.failed_steps.saturating_add(1) } else { 0 };
        self.held = is_frozen.then(|| self.held.take().unwrap_or_else(|| HeldImage::of(scene, key)));
        if is_dead {
            return Ok(());
        }
        let held = self.held.as_ref().map(|held| (held.scene(), held.key));
        let (imaged, key) = held.as_ref().map_or((scene, key), |(scene, key)| (scene, *key));
        let seen = ImagedScene { now: scene, imaged, fault: fault.as_ref() };
        let memory = &mut self.memory;
        NETWORK.with_borrow_mut(|slot| {
            if slot.as_ref().is_none_or(|(camera, _)| *camera != self.camera) {
                let backend = inference_backend();
                let network = CropClassifier::new(self.camera, backend)
                    .map_err(|error| SensorError::Classifier { reason: error.to_string() })?;
                *slot = Some((self.camera, network));
            }
            match slot {
                Some((_, network)) => network
                    .classify_with(seen, key, memory, detections)
                    .map(|_| ())
                    .map_err(|error| SensorError::Classifier { reason: error.to_string() }),
                None => Ok(()),
            }
        })
    }

    fn health(&self) -> Health {
        if self.failed_steps >= NOTICED_AFTER_SCANS { Health::Failed } else { Health::Ok }
    }
}
