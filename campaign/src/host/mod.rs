//! Worker processes that run whole samples with a controller that may crash or hang: a library, an FMU, or an object of the
//! program that has Closecall as a library.
//!
//! ```text
//!  campaign, one thread per job                         worker process: `closecall host samples`
//!    Work::run ──▶ task: scenario, arm, checks ──────▶ standard input  ─▶ Work ─▶ controller in the same process
//!              ──▶ sample number ────────────────────▶                        └─▶ simulate, validity checks
//!              ◀── record of the arm ◀─────────────── standard output
//! ```
//!
//! A thread keeps its process for all its samples, so that a control step costs a function call. A process that crashes, ends,
//! hangs or outgrows its memory costs the sample that it runs: the record says how, and the next sample starts a new process.
//!
//! A process that starts late may find another file, or be another version of this program. It then refuses its task, which ends
//! the campaign.
//!
//! Records travel as lines of JSON, whose numbers read back to the same bits. A message says nothing about earlier samples of
//! the same process, so that it does not depend on the number of jobs.

mod client;
mod serve;

pub(crate) use client::run;
pub use serve::serve;

use std::path::PathBuf;

use closecall_sensors::SensorMode;
use closecall_simulation::controller::isolated::Isolated;
use serde::{Deserialize, Serialize};

use super::record::{ArmRecord, Record};
use super::runner::Sampling;
use super::validity::CheckPlan;

/// The kind of the failure of a sample that a worker process has refused to run.
const REFUSED: &str = "refused";

/// Returns why a worker process has refused to run the sample of a record; `None` if it has run it.
pub(crate) fn refusal(record: &Record) -> Option<&str> {
    let failures = record.arms.iter().filter_map(|arm| arm.result.as_ref().err());
    failures.into_iter().find(|failure| failure.kind == REFUSED).map(|failure| failure.message.as_str())
}

/// What a worker process has to know before its first sample.
#[derive(Serialize, Deserialize)]
struct Task {
    /// The version of the program that gives the task.
    version: String,
    /// The scenario file's path, to which the paths in it are relative.
    path: PathBuf,
    /// Its content, with all settings applied.
    text: String,
    sampling: Sampling,
    checks: CheckPlan,
    controller: Isolated,
    sensors: Option<SensorMode>,
}

/// The result of one sample.
#[derive(Serialize, Deserialize)]
struct Answer {
    record: ArmRecord,
    /// Wall time, without the validity checks (s).
    wall_s: f64,
    /// Wall time of the validity checks (s).
    check_s: f64,
    /// True if the process ends after this answer.
    is_last: bool,
}
