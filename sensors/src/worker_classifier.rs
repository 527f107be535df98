//! The camera's classifier in the simulation loop, with one network per worker thread.
//!
//! A network takes long to set up and is locked while it runs. A run never changes its thread, so each thread keeps one
//! network and uses it for all of its runs. The network is stateless: earlier runs do not change its results.

use std::cell::RefCell;
use std::sync::OnceLock;

use closecall_traffic::Stream;

use crate::camera::{Backend, Camera, CropClassifier, ExposureKey, ImageMemory};
use crate::full::DetectionClassifier;
use crate::{Detection, NoiseKey, Scene, SensorError};

/// Name of the camera's random stream.
const CHANNEL: &str = "rear-camera";

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
}

impl WorkerClassifier {
    /// Creates the camera of one run, whose exposure noise is keyed by `key`.
    pub(crate) fn new(camera: Camera, key: &NoiseKey) -> Self {
        Self { camera, exposures: key.stream(CHANNEL), memory: ImageMemory::default() }
    }
}

impl DetectionClassifier for WorkerClassifier {
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError> {
        // The key is drawn even if nothing is detected, so that both arms of a pair get the same exposures.
        let key = ExposureKey::draw(&mut self.exposures);
        NETWORK.with_borrow_mut(|slot| {
            if slot.as_ref().is_none_or(|(camera, _)| *camera != self.camera) {
                let backend = inference_backend();
                let network = CropClassifier::new(self.camera, backend)
                    .map_err(|error| SensorError::Classifier { reason: error.to_string() })?;
                *slot = Some((self.camera, network));
            }
            match slot {
                Some((_, network)) => network.classify_detections(scene, key, &mut self.memory, detections).map(|_| ()),
                None => Ok(()),
            }
        })
    }
}
