//! The inference backend of the rear camera's network. It is loaded only by commands that may run the network.

use std::path::Path;

use closecall_scenarios::Scenario;
use closecall_sensors::camera::{Backend, Camera, CameraConfig, Classifier, Pipeline};
use closecall_sensors::{SensorMode, inference_backend, set_inference_backend};
use closecall_simulation::Arm;

use super::CliError;

/// Chooses the backend without loading it.
pub(super) fn choose_backend(onnxruntime: Option<&Path>) {
    set_inference_backend(Backend::choose(onnxruntime, None));
}

/// Loads the chosen backend, so that a bad path is reported before any work is done. Does nothing if `is_used` is false.
pub(super) fn check_backend(is_used: bool) -> Result<(), CliError> {
    let backend = inference_backend();
    if is_used && *backend != Backend::Tract {
        Classifier::shipped(backend)?;
    }
    Ok(())
}

/// Loads the Mask R-CNN of each camera.
pub(super) fn check_cameras<'a>(cameras: impl IntoIterator<Item = &'a CameraConfig>) -> Result<(), CliError> {
    cameras.into_iter().try_for_each(|camera| Ok(camera.check_network(inference_backend())?))
}

/// Works like [`check_backend`], for runs of a scenario.
pub(super) fn check_backend_of(scenario: &Scenario, arms: &[Arm]) -> Result<(), CliError> {
    let is_full = |arm: &Arm| arm.sensors.unwrap_or(scenario.sensors.mode()) == SensorMode::Full;
    let is_used = arms.iter().any(is_full);
    if is_used {
        check_camera(scenario.sensors.camera())?;
    }
    check_backend(is_used)
}

/// Loads the Mask R-CNN of a camera that has that pipeline.
pub(super) fn check_camera(camera: &Camera) -> Result<(), CliError> {
    if camera.pipeline == Pipeline::MaskRcnn {
        camera.mask_rcnn.detector(inference_backend())?;
    }
    Ok(())
}
