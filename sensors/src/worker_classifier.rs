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
use crate::{Detection, Health, NoiseKey, Scene, SensorError};

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
    exposures: Exposures,
    memory: ImageMemory,
}

impl WorkerClassifier {
    /// Creates the camera of one run, whose exposure noise is keyed by `key`.
    pub(crate) fn new(camera: Camera, key: &NoiseKey, faults: FaultList<CameraFault>) -> Self {
        Self { camera, exposures: Exposures::new(key, faults), memory: ImageMemory::default() }
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
        NETWORK.with_borrow_mut(|slot| {
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
