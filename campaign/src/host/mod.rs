//! Worker processes that run whole samples with a controller that may crash or hang: a library, an
//! FMU, or an object of the program that has Closecall as a library.
//!
//! ```text
//!  campaign, one thread per job                         worker process: `closecall host samples`
//!    Work::run ──▶ task: scenario, arm, checks ──────▶ standard input  ─▶ Work ─▶ controller in the same process
//!              ──▶ question: task, arm, sample ──────▶                        └─▶ simulate, validity checks
//!              ◀── the question, record of the arm ◀─ standard output
//! ```
//!
//! A thread keeps its process for all its samples, so that a control step costs a function call. A
//! process that crashes, ends, hangs or outgrows its memory costs the sample that it runs: the
//! record says how, and the next sample starts a new process. Only if the campaign asks for it is
//! such a sample run again, and its record then says that it is flaky.
//!
//! An answer repeats its question. Foreign code can copy its process (`fork`) and so answer twice:
//! an answer to another question, an answer of a copy, and a line that is left over before the next
//! question each end the process and the sample with an error. A line that is left over at the end
//! of a process makes the campaign INVALID.
//!
//! A sample whose checks follow has its outcome in an answer of its own, before the answer with the
//! checks: if the checks take too long, the sample keeps its outcome.
//!
//! A process that starts late may find another file, or be another version of this program. It then
//! refuses its task, which ends the campaign.
//!
//! When all samples are done, a thread ends its process, which then unloads its library. A crash as
//! it does so hits no sample: the command says it at its end.
//!
//! Records travel as lines of JSON, whose numbers read back to the same bits. A message says
//! nothing about earlier samples of the same process, so that it does not depend on the number of
//! jobs.

mod client;
mod serve;
#[cfg(test)]
mod simulated_world;

pub(crate) use client::{end, run};
pub use serve::serve;

use std::fmt;
use std::path::PathBuf;

use closecall_sensors::SensorMode;
use closecall_simulation::controller::isolated::Isolated;
use serde::{Deserialize, Serialize};

use super::record::{ArmRecord, Record, SampleFailure};
use super::sampling::Sampling;
use super::validity::CheckPlan;

/// The kind of a sample's failure if a worker process has refused to run it, because the program or
/// a file differs from the start of the campaign.
const CHANGED: &str = "refused";
/// The kind of the failure of a sample whose controller a worker process cannot read.
const UNREADABLE: &str = "unreadable";

/// A worker process's refusal to run a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusal<'a> {
    /// The reason.
    pub(crate) reason: &'a str,
    /// True if something is another one than at the start, false if the controller cannot be read.
    pub(crate) has_changed: bool,
}

impl<'a> Refusal<'a> {
    /// Returns why a worker process has refused to run a sample; `None` if the failure is another
    /// one.
    fn of(failure: &'a SampleFailure) -> Option<Self> {
        let has_changed = failure.kind == CHANGED;
        (has_changed || failure.kind == UNREADABLE).then_some(Self { reason: &failure.message, has_changed })
    }
}

/// Returns why a worker process has refused to run the sample of a record; `None` if it has run it.
pub(crate) fn refusal(record: &Record) -> Option<Refusal<'_>> {
    record.arms.iter().filter_map(|arm| arm.result.as_ref().err()).find_map(Refusal::of)
}

/// The task of a worker process, which it needs before its first sample.
#[derive(Serialize, Deserialize)]
struct Task {
    /// The version of the program that gives the task.
    version: String,
    /// The scenario file's path, to which the paths in it are relative.
    path: PathBuf,
    /// The content of the scenario file, with all settings applied.
    text: String,
    sampling: Sampling,
    checks: CheckPlan,
    controller: Isolated,
    sensors: Option<SensorMode>,
    /// The library of ONNX Runtime that runs the networks, if it does.
    onnxruntime: Option<PathBuf>,
    /// The folder in which the perception program of the scenario runs.
    program_folder: Option<String>,
    /// The name of the perception that is an object of the program, with the words that start its
    /// process.
    hosted_perception: Option<(String, Vec<String>)>,
}

/// Returns the identity of a task: a hash of its line, which holds the scenario, the seed, the
/// checks and the controller.
fn task_identity(line: &[u8]) -> String {
    const DIGITS: usize = 16;
    blake3::hash(line).to_hex()[..DIGITS].to_owned()
}

/// A question to a worker process, which its answer repeats.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Question {
    /// The identity of the task: [`task_identity`].
    task: String,
    /// The index of the arm.
    arm: usize,
    /// The sample's number.
    sample: u64,
    /// The number of the question to this process, from 1 on.
    number: u64,
    /// Whether the run only repeats the sample, without checks.
    is_repetition: bool,
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { task, arm, sample, number, .. } = self;
        write!(f, "question {number} (sample {sample}, arm {arm}, task {task})")
    }
}

/// The result of one sample.
#[derive(Serialize, Deserialize)]
struct Answer<Q = Question> {
    /// The question as it was asked.
    question: Q,
    /// The number of the process that was copied, if the answer comes from a copy; `None`
    /// otherwise.
    copied_from: Option<u32>,
    record: ArmRecord,
    /// Wall time, without the validity checks (s).
    wall_s: f64,
    /// Wall time of the validity checks (s).
    check_s: f64,
    /// Whether another answer follows, or none at all.
    stage: Stage,
}

/// What follows an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Stage {
    /// The answer has the outcome alone: the answer with the checks of the sample follows.
    ChecksFollow,
    /// The sample is done.
    Done,
    /// The sample is done, and the process ends.
    Last,
}
