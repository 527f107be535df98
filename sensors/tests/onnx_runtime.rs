//! ONNX Runtime loaded into this process and in Python give the same probabilities for the same
//! crops.
//!
//! Needs the shared library of the `onnxruntime` wheel:
//! `CLOSECALL_ONNXRUNTIME=…/onnxruntime/capi/libonnxruntime.so.1.x.y`.

#[path = "onnx_golden/agreement.rs"]
mod onnx_golden;

use closecall_sensors::camera::{Backend, Classifier};

#[test]
fn onnx_runtime_agrees_with_python() {
    let Some(library) = closecall_testing::onnxruntime() else { return };
    let mut classifier = Classifier::shipped(&Backend::OnnxRuntime(library)).unwrap();
    onnx_golden::assert_agrees(&mut classifier);
}
