//! The camera's classifier in the simulation loop, with one network per worker thread.
//!
//! A network takes long to set up and is locked while it runs. A run never changes its thread, so
//! each thread keeps one network and uses it for all of its runs. The network is stateless: earlier
//! runs do not change its results.

use std::cell::RefCell;
use std::sync::OnceLock;

use crate::camera::{Backend, Camera, CameraFault, CropClassifier, ImageMemory, ImagedScene};
use crate::detection_classifier::DetectionClassifier;
use crate::exposures::Exposures;
use crate::faults::FaultList;
use crate::several_cameras::MAX_CAMERAS;
use crate::{Detection, Health, NoiseKey, Scene, SensorError};

/// The inference backend of this process.
static BACKEND: OnceLock<Backend> = OnceLock::new();

thread_local! {
    /// The thread's networks, in the order of the scenario's cameras, each with the camera that it
    /// was built for.
    static NETWORKS: RefCell<[Option<(Camera, CropClassifier)>; MAX_CAMERAS]> =
        const { RefCell::new([const { None }; MAX_CAMERAS]) };
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
    /// Number of the camera in the scenario.
    number: usize,
    camera: Camera,
    exposures: Exposures,
    memory: ImageMemory,
}

impl WorkerClassifier {
    /// Creates the camera of one run with its number in the scenario. `key` is the key of its noise.
    pub(crate) fn new(number: usize, camera: Camera, key: &NoiseKey, faults: FaultList<CameraFault>) -> Self {
        let exposures = Exposures::new((number, &camera), key, faults);
        Self { number, camera, exposures, memory: ImageMemory::default() }
    }
}

impl DetectionClassifier for WorkerClassifier {
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError> {
        let exposure = self.exposures.next_exposure(scene);
        if exposure.is_dead() {
            return Ok(());
        }
        let imaged = self.exposures.imaged(scene);
        let seen = ImagedScene { now: scene, imaged: &imaged, fault: exposure.fault.as_ref() };
        let memory = &mut self.memory;
        NETWORKS.with_borrow_mut(|slots| {
            let slot = &mut slots[self.number];
            if slot.as_ref().is_none_or(|(camera, _)| *camera != self.camera) {
                let backend = inference_backend();
                let network = CropClassifier::new(self.camera, backend)
                    .map_err(|error| SensorError::Classifier { reason: error.to_string() })?;
                *slot = Some((self.camera, network));
            }
            match slot {
                Some((_, network)) => network
                    .classify_with(seen, exposure.key, memory, detections)
                    .map(|_| ())
                    .map_err(|error| SensorError::Classifier { reason: error.to_string() }),
                None => Ok(()),
            }
        })
    }

    fn health(&self) -> Health {
        self.exposures.health()
    }
}
