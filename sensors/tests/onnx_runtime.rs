//! ONNX Runtime loaded into this process and in Python give the same probabilities for the same crops.
//!
//! Needs the shared library of the `onnxruntime` wheel: `CLOSECALL_ONNXRUNTIME=…/onnxruntime/capi/libonnxruntime.so.1.x.y`.

#[path = "onnx_golden/mod.rs"]
mod onnx_golden;

use std::io::Write;

use closecall_sensors::camera::{Backend, Classifier};

#[test]
fn onnx_runtime_agrees_with_python() {
    let backend = Backend::choose(None, std::env::var_os("CLOSECALL_ONNXRUNTIME").map(Into::into));
    if backend == Backend::Tract {
        // Not by `eprintln!`, which the test harness keeps to itself: a skipped test must show.
        let said =
            writeln!(std::io::stderr(), "skipped: CLOSECALL_ONNXRUNTIME does not name ONNX Runtime's shared library");
        return said.unwrap();
    }
    let mut classifier = Classifier::shipped(&backend).unwrap();
    onnx_golden::assert_agrees(&mut classifier);
}
