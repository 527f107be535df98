//! Tests that tract in this process gives the same probabilities as ONNX Runtime in Python for the
//! same crops.
//!
//! `xtask/training/golden.py` writes the crops and Python's probabilities to `onnx_golden/`.
//! Another backend needs another process, and therefore another test binary: `onnx_runtime.rs`.

#[path = "onnx_golden/agreement.rs"]
mod onnx_golden;

use closecall_sensors::camera::{Backend, Classifier};

#[test]
fn tract_agrees_with_python() {
    let mut classifier = Classifier::shipped(&Backend::Tract).unwrap();
    onnx_golden::assert_agrees(&mut classifier);
}
