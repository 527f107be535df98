//! Tract in this process and ONNX Runtime in Python give the same probabilities for the same crops.
//!
//! The crops and Python's answers are files of `onnx_golden/`, written by `training/golden.py`. Another backend needs
//! another process, and so another test binary: `onnx_runtime.rs`.

#[path = "onnx_golden/mod.rs"]
mod onnx_golden;

use closecall_sensors::camera::{Backend, Classifier};

#[test]
fn tract_agrees_with_python() {
    let mut classifier = Classifier::shipped(&Backend::Tract).unwrap();
    onnx_golden::assert_agrees(&mut classifier);
}
