//! The inference backend of the rear camera's network. It is loaded only by commands that may run
//! the network.

use std::path::Path;
use std::time::Duration;

use closecall_scenarios::Scenario;
use closecall_sensors::camera::{Backend, Camera, CameraConfig, Classifier, ClassifierError, Pipeline};
use closecall_sensors::{SensorMode, inference_backend, set_inference_backend};
use closecall_simulation::Arm;
use closecall_simulation::controller::exec::{Child, ExecError, ExecSettings};
use closecall_simulation::controller::native::command;
use closecall_traffic::input;

use super::CliError;
use crate::exit_code::ExitCode;

/// Chooses the backend without loading it.
pub(super) fn choose_backend(onnxruntime: Option<&Path>) {
    set_inference_backend(Backend::choose(onnxruntime, None));
}

/// Loads the chosen backend, so that a bad path is reported before any work is done. Does nothing
/// if `is_used` is false.
pub(super) fn check_backend(is_used: bool) -> Result<(), CliError> {
    let backend = inference_backend();
    if is_used && *backend != Backend::Tract {
        if let Backend::OnnxRuntime(library) = backend {
            must_be_readable(library)?;
            try_to_load(library, backend)?;
        }
        Classifier::shipped(backend)?;
    }
    Ok(())
}

/// Refuses a library that does not exist, or is a folder.
fn must_be_readable(library: &Path) -> Result<(), ClassifierError> {
    let opened = input::open(library).map(drop);
    opened.map_err(|error| ClassifierError::Read { path: library.display().to_string(), reason: error.to_string() })
}

/// Longest time in which ONNX Runtime is loaded, as for a controller that is a library. An
/// assumption: 30 times the time on a fast disk.
const LOAD_TIMEOUT: Duration = Duration::from_secs(10);
/// Memory of the process that tries it (MiB): several times the memory of the network and of ONNX
/// Runtime.
const LOAD_MEMORY_MIB: u64 = 8_192;

/// Loads the library in a separate process. A library that ends its process, or hangs, must not end
/// this program with success.
fn try_to_load(library: &Path, backend: &Backend) -> Result<(), ClassifierError> {
    let words = command(&["onnxruntime", &library.display().to_string()]);
    // A word with a NUL character, which cannot be quoted, names no file.
    let command = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_default();
    let settings = ExecSettings { command, timeout_ms: 0, memory_mib: LOAD_MEMORY_MIB };
    let fail = |reason: String| ClassifierError::Load { backend: backend.clone(), reason };
    let answer = Child::start(&settings, None).and_then(|mut child| child.request_within(Vec::new(), LOAD_TIMEOUT));
    match answer {
        Ok(Some(_)) => Ok(()),
        Ok(None) => {
            Err(fail(format!("it is not loaded within {} s: its constructor may wait or loop", LOAD_TIMEOUT.as_secs())))
        }
        // The library cannot be loaded: this process meets the same error, and reports it.
        Err(ExecError::Ended { status, .. }) if status.code() == Some(ExitCode::SampleError as i32) => Ok(()),
        Err(error) => Err(fail(error.to_string())),
    }
}

/// Loads the networks of the scenario's own that classify crops, if there are any, and the Mask R-CNN of each camera.
pub(super) fn check_networks<'a>(
    files: impl IntoIterator<Item = &'a str>,
    cameras: impl IntoIterator<Item = &'a CameraConfig>,
) -> Result<(), CliError> {
    files.into_iter().try_for_each(|file| Classifier::of(Some(file), inference_backend()).map(drop))?;
    check_cameras(cameras)
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
        scenario.sensors.rear_cameras().try_for_each(check_camera)?;
    }
    check_backend(is_used)
}

/// Loads the network that the pipeline of a camera needs, if it is not the one that ships for crops.
pub(super) fn check_camera(camera: &Camera) -> Result<(), CliError> {
    if camera.pipeline == Pipeline::MaskRcnn {
        camera.mask_rcnn.detector(inference_backend())?;
    }
    if camera.pipeline == Pipeline::CropClassifier && camera.model.is_some() {
        Classifier::of(camera.model, inference_backend())?;
    }
    Ok(())
}
