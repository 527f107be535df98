//! For tests only: finds the requirements of a test on the machine, and skips or fails the test if
//! the machine lacks one. Also has [`dbscan_by_definition`], the reference implementation for the
//! clustering.
//!
//! A few tests compare Closecall with other programs, or read trajectory data that is not part of
//! the repository. On a machine that lacks one of these, such a test says `skipped (NEED): REASON`
//! and passes. The environment variable `CLOSECALL_REQUIRE` lists needs, separated by commas, that
//! must not be lacking: `CLOSECALL_REQUIRE=viewer,data`. A test that lacks one of them fails. A
//! word that is not a need fails every test that asks for one, so that a misspelt variable cannot
//! go unnoticed.
//!
//! | need | found by |
//! |---|---|
//! | `viewer` | `CLOSECALL_RERUN` names the Rerun viewer's program |
//! | `onnxruntime` | `CLOSECALL_ONNXRUNTIME` names the shared library of ONNX Runtime |
//! | `display` | `xvfb-run` is installed and the viewer can draw on its display |
//! | `data` | `CLOSECALL_DATA` names the folder of trajectory data |
//! | `python` | `python3` is installed; for a comparison with Python's ONNX Runtime, `CLOSECALL_ONNXRUNTIME` lies in a Python environment that has it; to query recordings, `CLOSECALL_RERUN` lies in one with datafusion, pandas and matplotlib |
//! | `browser` | Chromium or Google Chrome is installed |
//! | `exchange` | `CLOSECALL_EXCHANGE` names a Python interpreter with the checkers and readers of exchange formats |
//!
//! ```no_run
//! let Some(viewer) = closecall_testing::viewer() else { return };
//! ```

mod dbscan;
mod find;
mod need;
mod require;

pub use dbscan::dbscan_by_definition;
pub use find::{
    browser, data, has_display, has_python, onnxruntime, python_with, python_with_exchange, python_with_onnxruntime,
    python_with_rerun, viewer,
};
pub use need::Need;
pub use require::skip;
