//! A controller as a process of its own, in any language: `--controller exec:COMMAND`.
//!
//! ```text
//!  closecall ── hello, one line per control step ──▶ standard input  ┐
//!            ◀── hello, one line per answer ──────── standard output │ COMMAND, one process per sample
//!            ◀── the last lines, for error messages ─ standard error ┘
//! ```
//!
//! COMMAND is split into words as a shell does it, quotes included, but no shell is started. Each sample starts a process
//! of its own, so that nothing is carried over from one to the next; with several jobs, several run at once. At the end of
//! the sample its standard input is closed, and what has not ended half a second later is killed, with everything in its
//! process group. Samples that need no process start none.
//!
//! # Protocol, version 1
//! Lines of JSON in UTF-8, each at most 1 MiB long and ended by `\n`; numbers are written so that reading them as 64-bit
//! floats gives the same bits. Units stand in the keys. Unknown keys are to be ignored, in both directions.
//!
//! 1. Closecall: `{"type":"hello","protocol":1,"control_step_s":0.04,"settings":{…},"road":{…}}`. `settings` are those of the
//!    scenario's `ego-stack` (`acc`, `aeb`, `mis`, `automated`; `null` where absent), `road` has `lanes`, `lane_width_m`,
//!    `curvature_per_m`, `speed_limit_mps` and `overtaking_side`.
//! 2. The process: `{"type":"hello","protocol":1}`, within 10 s.
//! 3. At each control step Closecall: `{"type":"step","time_s":…,"time_ns":…,"odometry":{…},"front":{…}|null,"tracks":[…],
//!    "sensors":{…}}`. `odometry` has the fields of [`Odometry`](closecall_controllers::Odometry), `front` those of
//!    [`Front`](closecall_controllers::Front): the vehicle ahead as the built-in controllers understand it. A track has
//!    `id`, `source` (`front`, `surround`, `rear`), `status` (`tentative`, `confirmed`, `coasting`), `time_s`, `x_m`, `y_m`
//!    (its centre in E's frame: x ahead, y to the left), `vx_mps`, `vy_mps` (over ground), `covariance` (4 × 4, of these
//!    four), `heading_rad`, `length_m`, `width_m`, `class` {`car`, `truck`, `motorcycle`, `background`}, `existence`, and
//!    `lane` {`left`, `own`, `right`}. `sensors` has `front`, `surround`, `rear`: whether each works.
//! 4. The process: `{"acceleration_mps2":-0.4,"state":"following"}`, within `--controller-timeout-ms`. `state` is one of
//!    `following`, `increasing`, `holding`, `releasing`, `emergency-braking`.
//!
//! # What goes wrong
//! Whatever keeps the process from a proper answer ends that sample as an error with a message of its own ([`ExecError`]);
//! the process is killed, and the campaign goes on. Waiting is measured by the wall clock: a slow machine can turn a sample
//! into an error, but never into another outcome.

mod child;
mod controller;
mod error;
mod lines;
mod protocol;
mod settings;

pub use controller::ExecFactory;
pub use error::ExecError;
pub use settings::{DEFAULT_MEMORY_MIB, DEFAULT_TIMEOUT_MS, ExecSettings};

/// The name of such a controller in every report, and what its `--controller` begins with.
pub const NAME: &str = "exec";
