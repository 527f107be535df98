//! A simulated worker process: it answers from a table of true records, unless the schedule has a
//! fault for it.

use std::collections::{BTreeMap, VecDeque};
use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use closecall_simulation::controller::exec::ExecError;
use closecall_traffic::Stream;
use rand::RngExt;

use crate::host::client::Peer;
use crate::host::{Answer, Question, Stage};
use crate::record::{ArmRecord, SampleFailure};
use crate::validity::ArmChecks;

/// Time that a sample takes, without a fault.
const ANSWER_TIME: Duration = Duration::from_millis(10);
/// The signal that ends a process that crashes: SIGSEGV.
const SIGSEGV: i32 = 11;

/// The true records: by arm, then by sample.
pub(super) type Truth = Vec<Vec<ArmRecord>>;

/// The common state of all processes of a schedule.
pub(super) struct State {
    /// The clock.
    pub(super) now: Duration,
    pub(super) random: Stream,
    /// Probability of a fault at each question (-).
    pub(super) rate: f64,
    /// Probability of a signal that ends the program, at each question (-).
    pub(super) signal_rate: f64,
    /// Number of faults and signals so far.
    pub(super) faults: u64,
    /// Number of crashes so far in the run that the present question asks for: one sample in one
    /// arm.
    pub(super) crashes: u32,
}

impl State {
    /// Draws whether there is a fault now.
    pub(super) fn has_fault(&mut self) -> bool {
        self.draw(self.rate)
    }

    /// Draws whether a signal arrives now.
    pub(super) fn has_signal(&mut self) -> bool {
        self.draw(self.signal_rate)
    }

    fn draw(&mut self, rate: f64) -> bool {
        let happens = rate > 0.0 && self.random.random_bool(rate);
        self.faults += u64::from(happens);
        happens
    }
}

pub(super) fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An arrival in the pipe.
enum Arrival {
    Line(Vec<u8>),
    /// A line that says that a call hangs and that the process ends.
    LastLine(Vec<u8>),
    TooLong,
    /// The process has ended.
    End,
}

/// A simulated process.
pub(super) struct Process {
    pub(super) state: Arc<Mutex<State>>,
    pub(super) truth: Arc<Truth>,
    pub(super) arm: usize,
    pub(super) task: String,
    /// The arrivals, by time (ns) and by the order in which they were written.
    pipe: BTreeMap<(u128, usize), Arrival>,
    /// Number of messages that were written.
    written: usize,
    /// Number of answers that were taken.
    answered: u64,
    /// The questions so far, the last one first.
    earlier: VecDeque<Question>,
}

/// What a process does instead of one right answer.
#[derive(Clone, Copy)]
enum Fault {
    /// The process answers twice.
    Twice,
    /// An earlier answer comes once more, before the right one.
    EarlierAgain,
    /// A copy of the process (`fork`) has run ahead, and answers the next sample.
    AnotherSample,
    /// The process repeats the question, and gives the record of another sample.
    AnotherRecord,
    /// The process gives the record of the other arm.
    AnotherArm,
    /// The process answers for another campaign.
    AnotherTask,
    /// A copy of the process answers, and says that it is a copy.
    Copy,
    /// Both the process and its copy answer, in either order.
    ProcessAndCopy,
    /// The process ends in the middle of its answer.
    Cut,
    /// The process prints a line that is no answer.
    Print,
    TooLong,
    CrashBefore,
    CrashAfter,
    Hang,
    /// The process answers after the time limit.
    Late,
    /// The process reports that a call hangs, and ends.
    HangingCall,
    /// The process reports that a call hangs in a validity check, and ends. The sample already has
    /// its outcome.
    HangingCheck,
    /// The process gives the outcome, and the answer with the checks after the time limit.
    SlowChecks,
    /// The process gives the outcome, and ends in the checks.
    CrashInCheck,
    /// The process gives the outcome, and a copy of it the answer with the checks.
    CopyInCheck,
    /// The process gives the outcome twice.
    OutcomeTwice,
}

const FAULTS: [Fault; 21] = [
    Fault::Twice,
    Fault::EarlierAgain,
    Fault::AnotherSample,
    Fault::AnotherRecord,
    Fault::AnotherArm,
    Fault::AnotherTask,
    Fault::Copy,
    Fault::ProcessAndCopy,
    Fault::Cut,
    Fault::Print,
    Fault::TooLong,
    Fault::CrashBefore,
    Fault::CrashAfter,
    Fault::Hang,
    Fault::Late,
    Fault::HangingCall,
    Fault::HangingCheck,
    Fault::SlowChecks,
    Fault::CrashInCheck,
    Fault::CopyInCheck,
    Fault::OutcomeTwice,
];

impl Process {
    pub(super) fn new(state: Arc<Mutex<State>>, truth: Arc<Truth>, arm: usize) -> Self {
        let task = format!("task of arm {arm}");
        let (pipe, earlier) = (BTreeMap::new(), VecDeque::new());
        Self { state, truth, arm, task, pipe, written: 0, answered: 0, earlier }
    }

    fn write(&mut self, at: Duration, arrival: Arrival) {
        self.pipe.insert((at.as_nanos(), self.written), arrival);
        self.written += 1;
    }

    /// Returns the answer to a question with the record of a sample in an arm.
    fn answer(&self, question: &Question, arm: usize, sample: u64) -> Answer {
        let records = &self.truth[arm];
        let record = records[usize::try_from(sample).unwrap() % records.len()].clone();
        let (question, stage) = (question.clone(), Stage::Done);
        Answer { question, copied_from: None, record, wall_s: 0.01, check_s: 0.0, stage }
    }

    /// Runs a sample: writes the lines of the process into the pipe, each with its time of arrival.
    fn serve(&mut self, state: &mut State, question: &Question, limit: Duration) {
        let right = self.answer(question, self.arm, question.sample);
        let outcome = Answer { stage: Stage::ChecksFollow, ..self.answer(question, self.arm, question.sample) };
        let at = state.now + ANSWER_TIME;
        let line = |answer: &Answer| Arrival::Line(serde_json::to_vec(answer).unwrap());
        if !state.has_fault() {
            // Some samples are checked.
            if question.sample.is_multiple_of(2) {
                self.write(at, line(&outcome));
            }
            return self.write(at, line(&right));
        }
        // A time before the next question, or during it.
        let soon = at + ANSWER_TIME.mul_f64(2.0 * state.random.random::<f64>());
        let before = state.now + ANSWER_TIME.mul_f64(state.random.random::<f64>());
        let other = question.sample + 1;
        let copy = Answer { copied_from: Some(1), ..self.answer(question, self.arm, question.sample) };
        match FAULTS[state.random.random_range(0..FAULTS.len())] {
            Fault::Twice => {
                self.write(at, line(&right));
                self.write(soon, line(&right));
            }
            Fault::EarlierAgain => {
                let earlier = self.earlier.front().unwrap_or(question).clone();
                let again = self.answer(&earlier, self.arm, earlier.sample);
                self.write(before, line(&again));
                self.write(at, line(&right));
            }
            Fault::AnotherSample => {
                let next = Question { sample: other, number: question.number + 1, ..question.clone() };
                let answer = self.answer(&next, self.arm, other);
                self.write(at, line(&answer));
            }
            Fault::AnotherRecord => {
                let answer = self.answer(question, self.arm, other);
                self.write(at, line(&answer));
            }
            Fault::AnotherArm => {
                let answer = self.answer(question, 1 - self.arm, question.sample);
                self.write(at, line(&answer));
            }
            Fault::AnotherTask => {
                let question = Question { task: "another task".to_owned(), ..question.clone() };
                let answer = self.answer(&question, self.arm, question.sample);
                self.write(at, line(&answer));
            }
            Fault::Copy => self.write(at, line(&copy)),
            Fault::ProcessAndCopy => {
                let [first, second] = if state.random.random() { [&right, &copy] } else { [&copy, &right] };
                self.write(at, line(first));
                self.write(soon, line(second));
            }
            Fault::Cut => {
                let mut bytes = serde_json::to_vec(&right).unwrap();
                bytes.truncate(state.random.random_range(1..bytes.len()));
                self.write(at, Arrival::Line(bytes));
                self.write(at, Arrival::End);
            }
            Fault::Print => {
                self.write(before, Arrival::Line(b"warning: no map".to_vec()));
                self.write(at, line(&right));
            }
            Fault::TooLong => self.write(at, Arrival::TooLong),
            Fault::CrashBefore => self.write(at, Arrival::End),
            Fault::CrashAfter => {
                self.write(at, line(&right));
                self.write(soon, Arrival::End);
            }
            Fault::Hang => {}
            Fault::Late => self.write(state.now + limit + ANSWER_TIME, line(&right)),
            Fault::HangingCall => {
                let failure = SampleFailure { kind: "controller".to_owned(), message: "no answer in time".to_owned() };
                let record = ArmRecord::new(right.record.controller.clone(), Err(failure));
                let last = Answer { record, stage: Stage::Last, ..right };
                self.write(at, Arrival::LastLine(serde_json::to_vec(&last).unwrap()));
            }
            Fault::HangingCheck => {
                let not_checked = Some("mirror: no answer in time".to_owned());
                let checks = Some(ArmChecks { not_checked, ..ArmChecks::default() });
                let record = ArmRecord { checks, ..right.record };
                let last = Answer { record, stage: Stage::Last, ..right };
                self.write(at, line(&last));
            }
            Fault::SlowChecks => {
                self.write(at, line(&outcome));
                self.write(state.now + limit + ANSWER_TIME, line(&right));
            }
            Fault::CrashInCheck => {
                self.write(at, line(&outcome));
                self.write(soon, Arrival::End);
            }
            Fault::CopyInCheck => {
                self.write(at, line(&outcome));
                self.write(soon, line(&copy));
            }
            Fault::OutcomeTwice => {
                self.write(at, line(&outcome));
                self.write(soon, line(&outcome));
                self.write(soon, line(&right));
            }
        }
    }

    /// Takes the earliest arrival, if it is not later than `until`.
    fn take(&mut self, until: Duration) -> Option<(Duration, Arrival)> {
        let first = self.pipe.first_entry().filter(|first| first.key().0 <= until.as_nanos())?;
        let at = Duration::from_nanos(u64::try_from(first.key().0).unwrap());
        Some((at, first.remove()))
    }

    /// Receives the next arrival, or none within `limit`.
    fn receive(&mut self, state: &mut State, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        let until = state.now + limit;
        let Some((at, arrival)) = self.take(until) else {
            state.now = until;
            return Ok(None);
        };
        state.now = at.max(state.now);
        match arrival {
            Arrival::LastLine(line) => {
                state.crashes += 1;
                Ok(Some(line))
            }
            Arrival::Line(line) => {
                self.answered += 1;
                Ok(Some(line))
            }
            Arrival::TooLong => Err(ExecError::LongLine { limit: 1 }),
            Arrival::End => Err(self.ended(state)),
        }
    }

    fn ended(&self, state: &mut State) -> ExecError {
        state.crashes += 1;
        ExecError::Ended { status: ExitStatus::from_raw(SIGSEGV), answered: self.answered, stderr: String::new() }
    }
}

impl Peer for Process {
    /// Treats a line that arrived before the question as a line without a question, as for a
    /// process of the operating system.
    fn request_within(&mut self, line: Vec<u8>, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        let shared = Arc::clone(&self.state);
        let mut state = lock(&shared);
        let (now, answered) = (state.now, self.answered);
        match self.take(now) {
            None => {}
            Some((_, Arrival::Line(line) | Arrival::LastLine(line))) => {
                let line = String::from_utf8_lossy(&line).into_owned();
                return Err(ExecError::OutOfTurn { answered, line });
            }
            Some((_, Arrival::TooLong)) => return Err(ExecError::LongLine { limit: 1 }),
            Some((_, Arrival::End)) => return Err(self.ended(&mut state)),
        }
        let question: Question = serde_json::from_slice(&line).unwrap();
        self.serve(&mut state, &question, limit);
        self.earlier.push_front(question);
        self.receive(&mut state, limit)
    }

    fn more_within(&mut self, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        let shared = Arc::clone(&self.state);
        self.receive(&mut lock(&shared), limit)
    }

    fn finish(&mut self, _: &str) -> Result<(), ExecError> {
        match self.take(Duration::MAX) {
            Some((_, Arrival::Line(line) | Arrival::LastLine(line))) => {
                let line = String::from_utf8_lossy(&line).into_owned();
                Err(ExecError::OutOfTurn { answered: self.answered, line })
            }
            _ => Ok(()),
        }
    }

    fn condemn(&mut self) {}
}
