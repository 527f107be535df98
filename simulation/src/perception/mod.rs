//! A perception of the user's own as a separate process, written in any language:
//! `sensors.perception = "exec:COMMAND"`. A shared library, `"lib:PATH"`, and an object of a Python
//! program are such processes, too: see `perception/library` and [`hosted`].
//!
//! ```text
//!  closecall ── hello, one line per control step with scans ──▶ standard input  ┐
//!            ◀── hello, one line of detections or tracks ────── standard output │ COMMAND, one process per run
//!            ◀── last lines, for error messages ─────────────── standard error  ┘
//! ```
//!
//! The process is a child, as a controller is ([`exec`](crate::controller::exec)), with the same
//! framing, limits and errors: one line of JSON per message, at most 1 MiB long in an answer. The
//! arrays of a scan are base64 of little-endian numbers, so that a point costs 30 bytes instead of
//! some 60 as JSON numbers, and NumPy reads an array in one call. Each answer must repeat the
//! `time_ns` of its question.
//!
//! # Protocol, version 1
//! 1. Closecall sends
//!    `{"type":"hello","kind":"perception","protocol":1,"control_step_s":0.04,"latency_s":…,"ego":{…},"road":{…}, "lidars":[…],"radars":[…]}`.
//! 2. The process answers `{"type":"hello","protocol":1,"answers":"detections"|"tracks"}` within 10
//!    s, optionally with `name` and `version`.
//! 3. At each control step in which a scan of some LiDAR is due, Closecall sends
//!    `{"type":"scans","time_s":…,"time_ns":…,"odometry":{…}, "pose":{…},"scans":[…],"radar_scans":[…]}`.
//!    A run without rear radars has neither `radars` nor `radar_scans`.
//! 4. The process answers `{"time_ns":…,"detections":[…]}` or `{"time_ns":…,"tracks":[…]}`, as it
//!    has announced.
//! 5. At the end of the run Closecall closes the standard input, and reads what is left, which must
//!    be nothing. The process ends, or is killed half a second later. A crash is an error.
//!
//! `docs/reference/perception.md` has every key.

mod answer;
pub mod hosted;
mod library;
mod message;
mod process;
mod question;

pub use library::{probe as probe_library, serve as serve_library};
pub(crate) use process::PerceptionProcess;
pub use process::{identify_program, try_program};
