//! The camera's classifier in the loop: one network for each worker thread.
//!
//! A network takes long to set up and is locked while it runs. A run stays on the thread that it began on, so each
//! thread keeps one, and hands it to whatever run it is at. The network has no memory: which runs it has served before
//! does not change what it answers.

use std::cell::RefCell;
use std::sync::OnceLock;

use closecall_traffic::Stream;

use crate::camera::{Backend, Camera, CropClassifier, ExposureKey};
use crate::full::DetectionClassifier;
use crate::{Detection, NoiseKey, Scene, SensorError};

/// The channel of the camera's random stream.
const CHANNEL: &str = "rear-camera";

/// The noise of each exposure of a run's rear camera, scan by scan: with it a picture can be drawn again.
pub fn rear_exposures(key: &NoiseKey) -> impl Iterator<Item = ExposureKey> + use<> {
    let mut exposures = key.stream(CHANNEL);
    std::iter::repeat_with(move || ExposureKey::draw(&mut exposures))
}

/// What runs the networks of this process.
static BACKEND: OnceLock<Backend> = OnceLock::new();

thread_local! {
    static NETWORK: RefCell<Option<(Camera, CropClassifier)>> = const { RefCell::new(None) };
}

/// Chooses what runs the networks of this process; tract where nobody chooses. Only the first choice counts.
pub fn use_inference_backend(backend: Backend) {
    BACKEND.get_or_init(|| backend);
}

/// What runs the networks of this process.
pub fn inference_backend() -> &'static Backend {
    BACKEND.get_or_init(Backend::default)
}

/// One run's camera, which looks with its thread's network.
pub(crate) struct WorkerClassifier {
    camera: Camera,
    exposures: Stream,
}

impl WorkerClassifier {
    /// The camera of one run, with noise of its own under `key`.
    pub(crate) fn new(camera: Camera, key: &NoiseKey) -> Self {
        Self { camera, exposures: key.stream(CHANNEL) }
    }
}

impl DetectionClassifier for WorkerClassifier {
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError> {
        // Drawn whether anything is seen or not, so that both arms of a pair meet the same exposures.
        let key = ExposureKey::draw(&mut self.exposures);
        NETWORK.with_borrow_mut(|slot| {
            if slot.as_ref().is_none_or(|(camera, _)| *camera != self.camera) {
                let backend = inference_backend();
                let network = CropClassifier::new(self.camera, backend)
                    .map_err(|error| SensorError::Classifier { reason: error.to_string() })?;
                *slot = Some((self.camera, network));
            }
            match slot {
                Some((_, network)) => network.classify_detections(scene, key, detections).map(|_| ()),
                None => Ok(()),
            }
        })
    }
}
