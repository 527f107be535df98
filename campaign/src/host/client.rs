//! The worker processes of a thread.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use closecall_sensors::camera::Backend;
use closecall_sensors::inference_backend;
use closecall_simulation::SampleError;
use closecall_simulation::controller::exec::{Child, ExecError};
use closecall_simulation::controller::isolated::Isolated;

use super::{Answer, Question, REFUSED, Task, task_identity};
use crate::identity::of_work;
use crate::manifest::version;
use crate::record::{ArmRecord, Flaky, SampleFailure};
use crate::runner::{ArmRun, Work};

/// The kind of a failure of the controller.
const KIND: &str = "controller";

/// A worker process, and what it is asked.
struct Worker {
    child: Child,
    /// The identity of its task.
    task: String,
    /// Number of questions so far.
    asked: u64,
}

thread_local! {
    /// The processes of this thread, by the address of the work and the index of the arm. A thread of a campaign serves one work,
    /// and keeps it alive.
    static WORKERS: RefCell<BTreeMap<(usize, usize), Worker>> = const { RefCell::new(BTreeMap::new()) };
}

/// Why a process has not run a sample. The process is gone.
enum Trouble {
    /// It crashed or hung: another process may not.
    Crash(SampleFailure),
    /// It is not to be trusted, or the time of the sample is over.
    Other(SampleFailure),
}

/// Runs one sample in a worker process. `arm` is the index of the arm, and its controller. `limit` is the time limit of the sample.
///
/// A process that crashes or hangs costs the sample that it runs. Only if the work says so is the sample run again in a new process,
/// and its record then says that it is flaky.
pub(crate) fn run(work: &Work, (arm, isolated): (usize, Isolated), sample: u64, limit: Duration) -> ArmRun {
    let started = Instant::now();
    let mut first: Option<SampleFailure> = None;
    let mut crashes = 0;
    let failure = loop {
        let left = limit.saturating_sub(started.elapsed());
        match ask(work, (arm, &isolated), (sample, left)) {
            Ok(Answer { record, wall_s, check_s, .. }) => {
                let flaky = first.map(|first| Flaky { crashes, first });
                return ArmRun { record: ArmRecord { flaky, ..record }, wall_s, check_s };
            }
            Err(Trouble::Other(failure)) => break failure,
            Err(Trouble::Crash(failure)) => {
                crashes += 1;
                first.get_or_insert(failure);
            }
        }
        if let Some(failure) = first.take_if(|_| crashes > work.retry_crashed) {
            break failure;
        }
    };
    ArmRun {
        record: ArmRecord::new(isolated.name().to_owned(), Err(failure)),
        wall_s: started.elapsed().as_secs_f64(),
        check_s: 0.0,
    }
}

/// Asks the process of this thread for one sample. Starts a process if there is none. Only a process that has answered is kept.
fn ask(work: &Work, (arm, isolated): (usize, &Isolated), (sample, limit): (u64, Duration)) -> Result<Answer, Trouble> {
    let key = (std::ptr::from_ref(work) as usize, arm);
    let kept = WORKERS.with_borrow_mut(|workers| workers.remove(&key));
    let mut worker = match kept {
        Some(worker) => worker,
        None => start(work, arm, isolated).map_err(|error| Trouble::Crash(failure(&error)))?,
    };
    worker.asked += 1;
    let question = Question { task: worker.task.clone(), arm, sample, number: worker.asked };
    let answer = match worker.child.request_within(line(&question), limit) {
        Ok(Some(line)) => read(work, &question, &line),
        Ok(None) => Err(Trouble::Other(SampleError::Timeout { limit_s: limit.as_secs_f64() }.into())),
        Err(error @ (ExecError::OutOfTurn { .. } | ExecError::LongLine { .. })) => Err(Trouble::Other(failure(&error))),
        Err(error) => Err(Trouble::Crash(failure(&error))),
    };
    match &answer {
        Ok(answer) if !answer.is_last => drop(WORKERS.with_borrow_mut(|workers| workers.insert(key, worker))),
        Ok(_) => {}
        // A process that has answered another question may go on writing.
        Err(_) => worker.child.condemn(),
    }
    answer
}

/// Reads the answer to a question, and checks that it is one.
fn read(work: &Work, question: &Question, line: &[u8]) -> Result<Answer, Trouble> {
    let wrong = |what: String| {
        let message = format!("the answer of the controller's process is not that of the sample: {what}");
        Trouble::Other(SampleFailure { kind: KIND.to_owned(), message })
    };
    let answer: Answer = serde_json::from_slice(line).map_err(|error| wrong(format!("it cannot be read: {error}")))?;
    if let Some(process) = answer.copied_from {
        return Err(wrong(format!(
            "a copy of the process gave it, because the controller has forked process {process} and both go on"
        )));
    }
    let refused = answer.record.result.as_ref().err().filter(|failure| failure.kind == REFUSED);
    if refused.is_some() {
        return Ok(answer);
    }
    if answer.question != *question {
        return Err(wrong(format!("it answers {}, asked was {question}", answer.question)));
    }
    let name = work.arms[question.arm].controller.name();
    if answer.record.controller != name {
        return Err(wrong(format!("it is of the controller `{}`, asked was `{name}`", answer.record.controller)));
    }
    of_work(work).check_arm(&answer.record, question.sample, &mut None).map_err(wrong)?;
    match (&answer.record.result, answer.is_last) {
        // It hangs in a call, and ends after this answer.
        (Err(failure), true) => Err(Trouble::Crash(failure.clone())),
        _ => Ok(answer),
    }
}

/// Starts a worker process, and gives it its task.
fn start(work: &Work, arm: usize, isolated: &Isolated) -> Result<Worker, ExecError> {
    let library = match inference_backend() {
        Backend::Tract => None,
        Backend::OnnxRuntime(library) => Some(library.display().to_string()),
    };
    let backend = library.iter().flat_map(|library| ["--onnxruntime", library.as_str()]);
    let arguments: Vec<&str> = std::iter::once("samples").chain(backend).collect();
    let child = Child::start(&isolated.process(&arguments), None)?;
    let task = line(&Task {
        version: version(),
        path: work.file.path().to_owned(),
        text: work.file.text().to_owned(),
        sampling: work.sampling,
        checks: work.checks,
        controller: isolated.clone(),
        sensors: work.arms[arm].sensors,
    });
    let identity = task_identity(task.strip_suffix(b"\n").unwrap_or(&task));
    child.send(task);
    Ok(Worker { child, task: identity, asked: 0 })
}

fn line(message: &impl serde::Serialize) -> Vec<u8> {
    // Serialising structs of numbers and texts cannot fail.
    let mut line = serde_json::to_vec(message).unwrap_or_default();
    line.push(b'\n');
    line
}

/// Returns the failure of a sample whose process has ended. Its message does not depend on the samples before.
fn failure(error: &ExecError) -> SampleFailure {
    let wrote = |stderr: &str| if stderr.is_empty() { String::new() } else { format!("; it last wrote: {stderr}") };
    let message = match error {
        ExecError::Ended { status, stderr, .. } => {
            // Whether the system keeps a memory dump depends on its settings.
            let status = status.to_string().replace(" (core dumped)", "");
            format!("the controller ended its process ({status}){}", wrote(stderr))
        }
        ExecError::Closed { stderr, .. } => format!("the controller closed the output of its process{}", wrote(stderr)),
        other => format!("the controller failed: {other}"),
    };
    SampleFailure { kind: KIND.to_owned(), message }
}
