//! A controller that runs as a separate process, written in any language:
//! `--controller exec:COMMAND`.
//!
//! ```text
//!  closecall ── hello, one line per control step ──▶ standard input  ┐
//!            ◀── hello, one line per step ────────── standard output │ COMMAND, one process per sample
//!            ◀── last lines, for error messages ──── standard error  ┘
//! ```
//!
//! COMMAND is split into words by the rules of a shell, including quotes, but no shell is started.
//! Each sample starts a new process, so that no state is carried over between samples; with several
//! jobs, several processes run at once. At the end of the sample, Closecall closes the process's
//! standard input. If the process has not ended half a second later, it is killed. Its descendants
//! are killed with it: its process group and, if the program has called [`adopt_orphans`], also
//! those that have left the group. A sample that never calls its controller starts no process.
//!
//! # Protocol, version 1
//! Each message is one line of JSON in UTF-8, at most 1 MiB long and terminated by `\n`. Numbers
//! are written so that reading them as 64-bit floats restores the same bits. Keys contain the
//! units. Both sides ignore unknown keys.
//!
//! 1. Closecall sends
//!    `{"type":"hello","protocol":1,"control_step_s":0.04,"settings":{…},"road":{…}}`. `settings`
//!    are the settings of the scenario's `ego-stack` (`acc`, `aeb`, `mis`, `automated`; `null` if
//!    absent), `road` has `lanes`, `lane_width_m` (of the ego's lane), `lane_widths_m` (of each lane,
//!    from lane 1 on), `curvature_per_m`, `speed_limit_mps` and `overtaking_side`.
//! 2. The process answers `{"type":"hello","protocol":1}` within 10 s, or within the timeout of 4.
//!    if that is longer. The answer may have `name` and `version`, which a campaign keeps: it is
//!    not resumed with a process that states others.
//! 3. At each control step, Closecall sends
//!    `{"type":"step","time_s":…,"time_ns":…,"odometry":{…},"front":{…}|null,"tracks":[…], "sensors":{…}}`.
//!    `odometry` has the fields of [`Odometry`](closecall_controllers::Odometry), `front` the
//!    fields of [`Front`](closecall_controllers::Front): the lead vehicle, selected as in the
//!    built-in controllers. A track has `id`, `source` (`front`, `surround`, `rear`), `status`
//!    (`tentative`, `confirmed`, `coasting`), `time_s`, `x_m`, `y_m` (its centre in the ego's
//!    frame: x ahead, y to the left), `vx_mps`, `vy_mps` (over ground), `covariance` (4 × 4, of
//!    these four), `heading_rad`, `length_m`, `width_m`, `class` {`car`, `truck`, `motorcycle`,
//!    `background`}, `existence`, and `lane` {`left`, `own`, `right`}. `sensors` has `front`,
//!    `surround`, `rear`: whether each works.
//! 4. The process answers `{"acceleration_mps2":-0.4,"state":"following"}`, within
//!    `--controller-timeout-ms`. `state` is one of `following`, `increasing`, `holding`,
//!    `releasing`, `emergency-braking`. The answer may repeat the `time_ns` of its step, which is
//!    then compared.
//! 5. At the end of the run Closecall closes the standard input and reads the rest of the output. A
//!    line without a question is an error, here and before each step: another line may have been
//!    taken for the answer to another step. So is an end by a signal, unless Closecall itself kills
//!    the process half a second later.
//!
//! # Errors
//! If the process does not give a valid answer, the sample ends as an error with a message that
//! states the cause ([`ExecError`]). The process is killed, and the campaign goes on. Timeouts are
//! measured by the wall clock: a slow machine can turn a sample into an error, but never changes an
//! outcome.

mod child;
mod controller;
mod error;
mod group;
mod late;
mod lines;
mod processes;
mod protocol;
mod settings;
mod start;
pub(crate) mod unique;

pub use child::Child;
pub use closecall_controllers::external::Identity;
pub(crate) use controller::START_TIMEOUT;
pub use controller::{ExecFactory, identify};
pub use error::ExecError;
pub(crate) use error::{ANSWERS_ALONE, is_other_text};
pub use late::{keep_left_over, take_bad_ends, take_left_over};
pub use lines::NEW_SAMPLE;
pub(crate) use lines::excerpt;
pub use processes::{adopt_orphans, end_all};
pub(crate) use protocol::{PROTOCOL, check_hello, to_line};
pub use settings::{DEFAULT_MEMORY_MIB, DEFAULT_TIMEOUT_MS, ExecSettings, NAME};
