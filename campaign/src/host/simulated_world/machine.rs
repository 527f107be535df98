//! The machine of a schedule: it runs the samples of a campaign with the program's client and
//! simulated processes.

use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use closecall_simulation::controller::exec::ExecError;
use rand::RngExt;

use super::process::{Process, State, Truth, lock};
use super::schedule::Violation;
use crate::campaign_error::CampaignError;
use crate::host::client::{Client, Trouble, World, read};
use crate::host::{Answer, Question};
use crate::record::{Record, SampleFailure};
use crate::runner::Work;
use crate::stop::StopFlag;
use crate::validity::Invariance;
use crate::workers::{Finished, OnFinished, SampleRunner, Samples};

/// The time limit of a sample.
const LIMIT: Duration = Duration::from_secs(1);

/// How answers are read and retries recorded: as the program does it, or with one of its checks
/// removed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reader {
    OfTheProgram,
    /// Takes every answer that can be read.
    Believing,
    /// Does not record that a sample was run again after a crash.
    Silent,
    /// Takes a check that took too long for a defect of the simulator.
    Blaming,
}

/// Simulated processes and a simulated clock.
struct SimulatedWorld {
    state: Arc<Mutex<State>>,
    truth: Arc<Truth>,
    reader: Reader,
}

impl World for SimulatedWorld {
    type Peer = Process;

    fn start(&self, _: &Work, arm: usize) -> Result<(Process, String), ExecError> {
        let mut state = lock(&self.state);
        // Most faults happen later.
        if state.has_fault() && state.has_fault() {
            state.crashes += 1;
            return Err(ExecError::Start {
                program: "closecall".to_owned(),
                reason: None,
                source: io::ErrorKind::OutOfMemory.into(),
            });
        }
        let process = Process::new(Arc::clone(&self.state), Arc::clone(&self.truth), arm);
        let task = process.task.clone();
        Ok((process, task))
    }

    fn now(&self) -> Duration {
        lock(&self.state).now
    }

    fn read(&self, work: &Work, question: &Question, line: &[u8]) -> Result<Answer, Trouble> {
        match self.reader {
            Reader::OfTheProgram | Reader::Silent => read(work, question, line),
            Reader::Believing => serde_json::from_slice(line).map_err(|error| {
                Trouble::Other(SampleFailure { kind: "controller".to_owned(), message: error.to_string() })
            }),
            Reader::Blaming => {
                let mut answer = read(work, question, line)?;
                if let Some(checks) = &mut answer.record.checks
                    && checks.not_checked.take().is_some()
                {
                    checks.broken.push(Invariance::Mirror);
                }
                Ok(answer)
            }
        }
    }
}

/// Runs samples one after the other.
pub(super) struct Machine {
    state: Arc<Mutex<State>>,
    client: Mutex<Client<SimulatedWorld>>,
    reader: Reader,
    /// The first violation that the machine itself has seen.
    pub(super) violation: Mutex<Option<Violation>>,
}

impl Machine {
    pub(super) fn new(state: State, truth: &Arc<Truth>, reader: Reader) -> Self {
        let state = Arc::new(Mutex::new(state));
        let world = SimulatedWorld { state: Arc::clone(&state), truth: Arc::clone(truth), reader };
        Self { state, client: Mutex::new(Client::new(world)), reader, violation: Mutex::default() }
    }

    /// Returns the number of faults so far.
    pub(super) fn faults(&self) -> u64 {
        lock(&self.state).faults
    }
}

impl SampleRunner for Machine {
    fn run(
        &self,
        (_, work): (usize, &Arc<Work>),
        samples: &mut dyn Iterator<Item = u64>,
        stop: &StopFlag,
        on_finished: &mut OnFinished<'_>,
    ) -> Result<(), CampaignError> {
        for sample in samples {
            if stop.is_set() {
                return Ok(());
            }
            let run = |arm: usize| {
                if lock(&self.state).has_signal() {
                    stop.set();
                }
                lock(&self.state).crashes = 0;
                let mut run = self.client.lock().unwrap().run((work, arm, sample), LIMIT, &|_| ());
                if self.reader == Reader::Silent {
                    run.record.flaky = None;
                }
                let (crashes, told) =
                    (lock(&self.state).crashes, run.record.flaky.as_ref().map_or(0, |flaky| flaky.crashes));
                if run.record.result.is_ok() && crashes != told {
                    let violation = Violation::SilentRetry { arm, sample, crashes, told };
                    self.violation.lock().unwrap().get_or_insert(violation);
                }
                run
            };
            let runs: Vec<_> = (0..work.arms.len()).map(run).collect();
            // Samples that run may take too long to be waited for.
            if stop.is_set() && lock(&self.state).random.random() {
                return Ok(());
            }
            let wall_s = runs.iter().map(|run| run.wall_s).collect();
            let arms = runs.into_iter().map(|run| run.record).collect();
            let record = Record { scenario: work.scenario().to_owned(), sample, arms };
            if on_finished(Finished { record, wall_s, check_s: 0.0 })?.is_break() {
                return Ok(());
            }
        }
        Ok(())
    }
}
