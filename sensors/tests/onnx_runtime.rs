//! Tests that ONNX Runtime in this process gives the same probabilities as ONNX Runtime in Python for the same crops.
//!
//! The test needs the shared library of the `onnxruntime` wheel:
//! `CLOSECALL_ONNXRUNTIME=…/onnxruntime/capi/libonnxruntime.so.1.x.y`.

#[path = "onnx_golden/mod.rs"]
mod onnx_golden;

use std::io::Write;

use closecall_sensors::camera::{Backend, Classifier};

#[test]
fn onnx_runtime_agrees_with_python() {
    let backend = Backend::choose(None, std::env::var_os("CLOSECALL_ONNXRUNTIME").map(Into::into));
    if backend == Backend::Tract {
        // The test harness captures `eprintln!`, but a skipped test must be visible.
        let written =
            writeln!(std::io::stderr(), "skipped: CLOSECALL_ONNXRUNTIME does not name ONNX Runtime's shared library");
        return written.unwrap();
    }
    let mut classifier = Classifier::shipped(&backend).unwrap();
    onnx_golden::assert_agrees(&mut classifier);
}
