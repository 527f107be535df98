//! The worker processes of a thread.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;
use std::time::{Duration, Instant};

use closecall_sensors::camera::Backend;
use closecall_sensors::inference_backend;
use closecall_simulation::SampleError;
use closecall_simulation::controller::exec::{Child, ExecError, keep_left_over};
use closecall_simulation::controller::isolated::Isolated;
use closecall_simulation::perception::hosted;

use super::{Answer, Question, Refusal, Stage, Task, task_identity};
use crate::manifest::version;
use crate::record::{ArmRecord, Flaky, SampleFailure};
use crate::runner::{ArmRun, OnOutcome, Work};
use crate::validity::{ALWAYS_CHECKED, ArmChecks, Invariance};

/// The kind of a failure of the controller.
const KIND: &str = "controller";

/// A process with its pipes.
pub(super) trait Peer {
    /// Sends a line and waits for its answer. Returns `None` if there is none within `limit`.
    ///
    /// # Errors
    /// [`ExecError`] if the process ends, writes what nobody has asked for, or does not keep to its
    /// limits.
    fn request_within(&mut self, line: Vec<u8>, limit: Duration) -> Result<Option<Vec<u8>>, ExecError>;

    /// Waits for one more answer to the last line. Returns `None` if there is none within `limit`.
    ///
    /// # Errors
    /// [`ExecError`] if the process ends, or does not keep to its limits.
    fn more_within(&mut self, limit: Duration) -> Result<Option<Vec<u8>>, ExecError>;

    /// Lets the process end. `name` is the name of its controller in messages.
    ///
    /// # Errors
    /// [`ExecError`] if a line is left over.
    fn finish(&mut self, name: &str) -> Result<(), ExecError>;

    /// Lets the process be killed without time to end by itself.
    fn condemn(&mut self);
}

impl Peer for Child {
    fn request_within(&mut self, line: Vec<u8>, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        Self::request_within(self, line, limit)
    }

    fn more_within(&mut self, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        Self::more_within(self, limit)
    }

    fn finish(&mut self, name: &str) -> Result<(), ExecError> {
        self.finish_unloading(name)
    }

    fn condemn(&mut self) {
        Self::condemn(self);
    }
}

/// The processes and the clock that a client uses: real or simulated.
pub(super) trait World {
    /// A process.
    type Peer: Peer;

    /// Starts a worker process for an arm, gives it its task, and returns it with the identity of
    /// the task.
    ///
    /// # Errors
    /// [`ExecError`] if it cannot be started.
    fn start(&self, work: &Work, arm: usize) -> Result<(Self::Peer, String), ExecError>;

    /// Returns the time since some moment.
    fn now(&self) -> Duration;

    /// Reads the answer to a question, and checks that it is one.
    fn read(&self, work: &Work, question: &Question, line: &[u8]) -> Result<Answer, Trouble> {
        read(work, question, line)
    }
}

/// A worker process, and its task.
struct Worker<P> {
    peer: P,
    /// The identity of its task.
    task: String,
    /// Number of questions so far.
    asked: u64,
}

/// The worker processes of a thread.
pub(super) struct Client<W: World> {
    world: W,
    /// The processes by the address of the work and the index of the arm. A thread of a campaign
    /// serves one work, and keeps it alive.
    workers: BTreeMap<(usize, usize), Worker<W::Peer>>,
}

thread_local! {
    static CLIENT: RefCell<Client<OperatingSystem>> = RefCell::new(Client::new(OperatingSystem(Instant::now())));
}

/// The reason for which a process has not run a sample. The process is gone.
pub(super) enum Trouble {
    /// The process crashed or hung. Another process may succeed.
    Crash(SampleFailure),
    /// The time of the sample is over. It may have its run, without the checks.
    Late(Option<Box<ArmRun>>),
    /// The process cannot be trusted.
    Other(SampleFailure),
}

/// Runs one sample of an isolated arm in a worker process of this thread. `limit` is the time limit
/// of the sample. `on_outcome` gets the result before the run is repeated, if it is.
pub(crate) fn run(run: (&Work, usize, u64), limit: Duration, on_outcome: &OnOutcome<'_>) -> ArmRun {
    CLIENT.with_borrow_mut(|client| client.run(run, limit, on_outcome))
}

/// Ends the worker processes that this thread has for a work whose samples are all done.
pub(crate) fn end(work: &Work) {
    CLIENT.with_borrow_mut(|client| client.end(work));
}

impl<W: World> Client<W> {
    /// Returns a client without processes.
    pub(super) const fn new(world: W) -> Self {
        Self { world, workers: BTreeMap::new() }
    }

    /// Ends the processes of a work.
    fn end(&mut self, work: &Work) {
        for (index, arm) in work.arms.iter().enumerate() {
            let name = arm.controller.name();
            if let Err(error) = self.end_worker(work, index) {
                keep_left_over(name, &error);
            }
        }
    }

    /// Ends the process of an arm, if there is one.
    fn end_worker(&mut self, work: &Work, arm: usize) -> Result<(), ExecError> {
        let worker = self.workers.remove(&key(work, arm));
        worker.map_or(Ok(()), |mut worker| worker.peer.finish(work.arms[arm].controller.name()))
    }

    /// Runs one sample in a worker process.
    ///
    /// A process that crashes or hangs costs the sample that it runs. Only if the work says so is
    /// the sample run again in a new process, and its record then says that it is flaky.
    pub(super) fn run(
        &mut self,
        (work, arm, sample): (&Work, usize, u64),
        limit: Duration,
        on_outcome: &OnOutcome<'_>,
    ) -> ArmRun {
        let started = self.world.now();
        let mut first: Option<SampleFailure> = None;
        let mut crashes = 0;
        let failure = loop {
            let left = limit.saturating_sub(self.world.now() - started);
            // The message does not depend on the time that the process has taken to start.
            let late = SampleError::Timeout { limit_s: limit.as_secs_f64() };
            let mut run = match self.ask((work, arm, sample), left, Some(on_outcome)) {
                Ok(Answer { record, wall_s, check_s, .. }) => ArmRun { record, wall_s, check_s },
                Err(Trouble::Late(Some(run))) => run.unchecked(&late),
                Err(Trouble::Late(None)) => break late.into(),
                Err(Trouble::Other(failure)) => break failure,
                Err(Trouble::Crash(failure)) => {
                    crashes += 1;
                    first.get_or_insert(failure);
                    match first.take_if(|_| crashes > work.retry_crashed) {
                        Some(failure) => break failure,
                        None => continue,
                    }
                }
            };
            run.record.flaky = first.map(|first| Flaky { crashes, first });
            let left = limit.saturating_sub(self.world.now() - started);
            self.repeat_in_new_process(work, arm, sample, &mut run, left, on_outcome);
            return run;
        };
        ArmRun {
            record: ArmRecord::new(work.arms[arm].controller.name().to_owned(), Err(failure)),
            wall_s: (self.world.now() - started).as_secs_f64(),
            check_s: 0.0,
        }
    }

    /// Runs one of the first samples again in a new process, if it is checked, and notes a different
    /// outcome. A controller whose answers depend on its process, such as on its number or on its
    /// environment, repeats itself in one process. `limit` is the time that is left.
    ///
    /// The first process ends before: a licence or a device may serve one process at a time. A line
    /// that it leaves over is an error of the sample.
    fn repeat_in_new_process(
        &mut self,
        work: &Work,
        arm: usize,
        sample: u64,
        run: &mut ArmRun,
        limit: Duration,
        on_outcome: &OnOutcome<'_>,
    ) {
        let is_repeatable =
            |checks: &ArmChecks| checks.not_checked.is_none() && !checks.broken.contains(&Invariance::Repetition);
        if sample >= ALWAYS_CHECKED || !run.record.checks.as_ref().is_some_and(is_repeatable) {
            return;
        }
        on_outcome(run);
        let started = self.world.now();
        if let Err(error) = self.end_worker(work, arm) {
            run.record = ArmRecord::new(run.record.controller.clone(), Err(failure(&error)));
            return;
        }
        let answer = self.ask((work, arm, sample), limit, None);
        run.check_s += (self.world.now() - started).as_secs_f64();
        let (Ok(outcome), Some(checks)) = (&run.record.result, &mut run.record.checks) else { return };
        let failure = match answer.map(|answer| answer.record.result) {
            Ok(Ok(again)) => {
                checks.broken.extend((!again.has_same_bits(outcome)).then_some(Invariance::Repetition));
                return;
            }
            Ok(Err(failure)) | Err(Trouble::Crash(failure) | Trouble::Other(failure)) => failure.message,
            Err(Trouble::Late(_)) => "the time of the sample is over".to_owned(),
        };
        checks.not_checked = Some(format!("{}: {failure}", Invariance::Repetition.name()));
    }

    /// Asks the process of an arm for one sample. Starts a process if there is none. Only a process
    /// that has answered is kept. `limit` is the time that is left. `on_outcome` gets the outcome if
    /// checks follow; a run without it only repeats the sample.
    fn ask(
        &mut self,
        (work, arm, sample): (&Work, usize, u64),
        limit: Duration,
        on_outcome: Option<&OnOutcome<'_>>,
    ) -> Result<Answer, Trouble> {
        let asked_at = self.world.now();
        let is_repetition = on_outcome.is_none();
        let key = key(work, arm);
        let mut worker = match self.workers.remove(&key) {
            Some(worker) => worker,
            None => {
                let started = self.world.start(work, arm).map_err(|error| Trouble::Crash(failure(&error)))?;
                Worker { peer: started.0, task: started.1, asked: 0 }
            }
        };
        worker.asked += 1;
        let question = Question { task: worker.task.clone(), arm, sample, number: worker.asked, is_repetition };
        let mut received = worker.peer.request_within(line(&question), limit);
        let mut outcome = None;
        let answer = loop {
            let answer = match received {
                Ok(Some(line)) => self.world.read(work, &question, &line),
                Ok(None) => Err(Trouble::Late(outcome.take())),
                Err(error @ (ExecError::OutOfTurn { .. } | ExecError::LongLine { .. })) => {
                    Err(Trouble::Other(failure(&error)))
                }
                Err(error) => Err(Trouble::Crash(failure(&error))),
            };
            match answer {
                Ok(Answer { stage: Stage::ChecksFollow, record, wall_s, check_s, .. }) if outcome.is_none() => {
                    let run = ArmRun { record, wall_s, check_s };
                    on_outcome.iter().for_each(|on_outcome| on_outcome(&run));
                    outcome = Some(Box::new(run));
                    received = worker.peer.more_within(limit.saturating_sub(self.world.now() - asked_at));
                }
                Ok(Answer { stage: Stage::ChecksFollow, .. }) => break Err(wrong("it has the outcome twice")),
                answer => break answer,
            }
        };
        match &answer {
            Ok(answer) if answer.stage != Stage::Last => drop(self.workers.insert(key, worker)),
            Ok(_) => {}
            // A process that has answered another question may go on writing.
            Err(_) => worker.peer.condemn(),
        }
        answer
    }
}

/// Returns the key of a process.
fn key(work: &Work, arm: usize) -> (usize, usize) {
    (std::ptr::from_ref(work) as usize, arm)
}

fn wrong(difference: impl fmt::Display) -> Trouble {
    let message = format!("the answer of the controller's process does not belong to the sample: {difference}");
    Trouble::Other(SampleFailure { kind: KIND.to_owned(), message })
}

/// Reads the answer to a question, and checks that it is one.
pub(super) fn read(work: &Work, question: &Question, line: &[u8]) -> Result<Answer, Trouble> {
    let answer: Answer =
        serde_json::from_slice(line).map_err(|error| wrong(format_args!("it cannot be read: {error}")))?;
    if let Some(process) = answer.copied_from {
        return Err(wrong(format_args!(
            "a copy of the process gave it, because the controller has forked process {process} and both go on"
        )));
    }
    if answer.record.result.as_ref().err().and_then(Refusal::of).is_some() {
        return Ok(answer);
    }
    if answer.question != *question {
        return Err(wrong(format_args!("it answers {} instead of {question}", answer.question)));
    }
    let name = work.arms[question.arm].controller.name();
    if answer.record.controller != name {
        let there = &answer.record.controller;
        return Err(wrong(format_args!("it comes from the controller `{there}` instead of `{name}`")));
    }
    work.identity().check_arm(&answer.record, question.sample, &mut None).map_err(wrong)?;
    match (&answer.record.result, answer.stage) {
        // The process hangs in a call, and ends after this answer.
        (Err(failure), Stage::Last) => Err(Trouble::Crash(failure.clone())),
        _ => Ok(answer),
    }
}

/// The processes and the clock of the operating system. The moment is the one from which the clock
/// counts.
struct OperatingSystem(Instant);

impl World for OperatingSystem {
    type Peer = Child;

    fn start(&self, work: &Work, arm: usize) -> Result<(Child, String), ExecError> {
        let controller = &work.arms[arm].controller;
        let not_isolated = || ExecError::Command { command: controller.name().to_owned() };
        let isolated = controller.isolated().ok_or_else(not_isolated)?;
        start(work, arm, &isolated)
    }

    fn now(&self) -> Duration {
        self.0.elapsed()
    }
}

/// Starts a worker process, and gives it its task.
fn start(work: &Work, arm: usize, isolated: &Isolated) -> Result<(Child, String), ExecError> {
    let onnxruntime = match inference_backend() {
        Backend::Tract => None,
        Backend::OnnxRuntime(library) => Some(library.clone()),
    };
    let hosted_perception = work.file.program().and_then(|program| {
        let name = program.name();
        hosted::words(&name).map(|words| (name, words))
    });
    let child = Child::start(&isolated.process(&["samples"]), None)?;
    let task = line(&Task {
        version: version(),
        path: work.file.path().to_owned(),
        text: work.file.text().to_owned(),
        sampling: work.sampling,
        checks: work.checks,
        controller: isolated.clone(),
        sensors: work.arms[arm].sensors,
        onnxruntime,
        program_folder: work.file.program_folder().map(str::to_owned),
        hosted_perception,
    });
    let identity = task_identity(task.strip_suffix(b"\n").unwrap_or(&task));
    child.send(task);
    Ok((child, identity))
}

fn line(message: &impl serde::Serialize) -> Vec<u8> {
    // Serialising structs of numbers and texts cannot fail.
    let mut line = serde_json::to_vec(message).unwrap_or_default();
    line.push(b'\n');
    line
}

/// Returns the failure of a sample whose process has ended. Its message does not depend on the
/// samples before.
fn failure(error: &ExecError) -> SampleFailure {
    let message = match error {
        // Neither does the number of answers belong in it, nor the line, which names another
        // question.
        ExecError::OutOfTurn { .. } => {
            "the controller failed: its process wrote a line that nobody had asked for".to_owned()
        }
        other => other.end_of_isolated("the controller").unwrap_or_else(|| format!("the controller failed: {other}")),
    };
    SampleFailure { kind: KIND.to_owned(), message }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of jobs decides how many samples a process has run before.
    #[test]
    fn the_message_of_a_line_too_many_does_not_depend_on_the_samples_before() {
        let messages = [1, 7].map(|answered| {
            let line = format!("{{\"question\":{{\"number\":{answered}}}}}");
            failure(&ExecError::OutOfTurn { answered, line }).message
        });
        assert_eq!(messages[0], messages[1]);
        assert!(messages[0].contains("a line that nobody had asked for"), "{}", messages[0]);
    }
}
