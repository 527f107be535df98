//! The worker processes of a thread.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use closecall_sensors::camera::Backend;
use closecall_sensors::inference_backend;
use closecall_simulation::SampleError;
use closecall_simulation::controller::exec::{Child, ExecError};
use closecall_simulation::controller::isolated::Isolated;

use super::{Answer, Task};
use crate::manifest::version;
use crate::record::{ArmRecord, SampleFailure};
use crate::runner::{ArmRun, Work};

/// The kind of a failure of the controller.
const KIND: &str = "controller";

thread_local! {
    /// The processes of this thread, by the address of the work and the index of the arm. A thread of a campaign serves one work,
    /// and keeps it alive.
    static PROCESSES: RefCell<BTreeMap<(usize, usize), Child>> = const { RefCell::new(BTreeMap::new()) };
}

/// Runs one sample in a worker process. `arm` is the index of the arm, and its controller. `limit` is the time limit of the sample.
pub(crate) fn run(work: &Work, (arm, isolated): (usize, Isolated), sample: u64, limit: Duration) -> ArmRun {
    let started = Instant::now();
    let name = isolated.name().to_owned();
    let answer = PROCESSES.with_borrow_mut(|processes| in_process(processes, work, (arm, isolated), (sample, limit)));
    match answer {
        Ok(Answer { record, wall_s, check_s, .. }) => ArmRun { record, wall_s, check_s },
        Err(failure) => ArmRun {
            record: ArmRecord { controller: name, result: Err(failure), checks: None },
            wall_s: started.elapsed().as_secs_f64(),
            check_s: 0.0,
        },
    }
}

fn in_process(
    processes: &mut BTreeMap<(usize, usize), Child>,
    work: &Work,
    (index, isolated): (usize, Isolated),
    (sample, limit): (u64, Duration),
) -> Result<Answer, SampleFailure> {
    let key = (std::ptr::from_ref(work) as usize, index);
    loop {
        let (mut process, is_new) = match processes.remove(&key) {
            Some(process) => (process, false),
            None => (start(work, index, &isolated).map_err(|error| failure(&error))?, true),
        };
        match process.request_within(line(&sample), limit) {
            Ok(Some(line)) => {
                let answer: Answer = serde_json::from_slice(&line).map_err(|error| SampleFailure {
                    kind: KIND.to_owned(),
                    message: format!("the process of the controller gave an answer that cannot be read: {error}"),
                })?;
                match (answer.is_last, is_new) {
                    (false, _) => drop(processes.insert(key, process)),
                    // It hangs in a call.
                    (true, false) => continue,
                    (true, true) => {}
                }
                return Ok(answer);
            }
            Ok(None) => return Err(SampleError::Timeout { limit_s: limit.as_secs_f64() }.into()),
            // Earlier samples may have left something behind in the process, such as memory that it has written over or not given back: what
            // this sample does shows in a new one.
            Err(_) if !is_new => {}
            Err(error) => return Err(failure(&error)),
        }
    }
}

/// Starts a worker process, and gives it its task.
fn start(work: &Work, arm: usize, isolated: &Isolated) -> Result<Child, ExecError> {
    let library = match inference_backend() {
        Backend::Tract => None,
        Backend::OnnxRuntime(library) => Some(library.display().to_string()),
    };
    let backend = library.iter().flat_map(|library| ["--onnxruntime", library.as_str()]);
    let arguments: Vec<&str> = std::iter::once("samples").chain(backend).collect();
    let process = Child::start(&isolated.process(&arguments), None)?;
    process.send(line(&Task {
        version: version(),
        path: work.file.path().to_owned(),
        text: work.file.text().to_owned(),
        sampling: work.sampling,
        checks: work.checks,
        controller: isolated.clone(),
        sensors: work.arms[arm].sensors,
    }));
    Ok(process)
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
