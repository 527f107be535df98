//! Many samples at a time, handed on in their order, with a watch over those that never end.
//!
//! ```text
//!  numbers ─▶ window ─▶ jobs ─▶ worker ─▶ results ─▶ put in order ─▶ take
//!                └────────────── no further than this ──────────────┘
//!                        watch: a worker that is late is given up, and another takes its place
//! ```
//!
//! Runs are begun no more than a window ahead of the last one handed on: that bounds what waits in memory for its turn,
//! and what a program that is killed has to do again. A thread cannot be ended from outside. One that is late is left
//! to itself until the program ends: whatever it still answers is thrown away.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::record::{ArmRecord, Record, SampleFailure};
use super::runner::{ArmRun, Work};
use closecall_simulation::SampleError;

/// Runs that each worker may be ahead of the last one handed on.
const WINDOW_PER_WORKER: usize = 128;
/// Longest time between two looks for workers that are late.
const WATCH_EVERY: Duration = Duration::from_millis(50);

/// How many samples are run at a time, and how long each may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Workers {
    /// Threads.
    pub jobs: NonZeroUsize,
    /// Longest wall time of a sample in one arm; one that takes longer is an error.
    pub sample_timeout: Duration,
}

/// Wall time that a sample may take in one arm unless another is set.
const SAMPLE_TIMEOUT: Duration = Duration::from_secs(300);

impl Default for Workers {
    /// One thread for each processor, and 300 s for each sample.
    fn default() -> Self {
        let jobs = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Self { jobs, sample_timeout: SAMPLE_TIMEOUT }
    }
}

/// The worker threads could not be started.
#[derive(Debug, thiserror::Error)]
#[error("failed to start {jobs} worker threads: {source}")]
pub struct WorkersError {
    /// How many were asked for.
    pub jobs: usize,
    /// The system's reason.
    pub source: std::io::Error,
}

/// A sample with what it cost.
#[derive(Clone, Debug)]
pub struct Finished {
    /// What came of it.
    pub record: Record,
    /// Wall time of each arm [s].
    pub wall_s: Vec<f64>,
}

impl Workers {
    /// Runs the given samples, and hands them on in the order given, until `take` breaks off.
    ///
    /// # Errors
    /// Whatever `take` answers, and [`WorkersError`]: no further sample is handed on.
    pub fn run<E: From<WorkersError>>(
        &self,
        work: &Arc<Work>,
        samples: impl Iterator<Item = u64>,
        mut take: impl FnMut(Finished) -> Result<ControlFlow<()>, E>,
    ) -> Result<(), E> {
        let arms = work.arms.len();
        let mut runs = samples.flat_map(|sample| (0..arms).map(move |arm| (sample, arm)));
        let mut crew = Crew::start(*self, work)?;
        let mut order = Order { arms, next: 0, waiting: BTreeMap::new() };
        loop {
            while crew.is_short(order.next)
                && let Some((sample, arm)) = runs.next()
            {
                crew.begin(sample, arm);
            }
            if order.next == crew.begun {
                return Ok(());
            }
            for (place, done) in crew.wait()? {
                order.waiting.insert(place, done);
            }
            while let Some(finished) = order.next_whole(work) {
                if take(finished)?.is_break() {
                    return Ok(());
                }
            }
        }
    }
}

/// One run to be done.
#[derive(Clone, Copy, Debug)]
struct Job {
    place: u64,
    sample: u64,
    arm: usize,
}

/// A run that is done.
struct Done {
    sample: u64,
    run: ArmRun,
}

/// What a worker is at, and since when. Whoever empties it answers for that job: the worker, or the watch.
type Slot = Arc<Mutex<Option<(Job, Instant)>>>;

/// A panic of the simulation is caught within a run; no lock is held there.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Crew {
    workers: Workers,
    work: Arc<Work>,
    jobs: Sender<Job>,
    open: Arc<Mutex<Receiver<Job>>>,
    answers: Receiver<(u64, Done)>,
    answer: Sender<(u64, Done)>,
    slots: Vec<Slot>,
    begun: u64,
    watched: Instant,
}

impl Crew {
    fn start(workers: Workers, work: &Arc<Work>) -> Result<Self, WorkersError> {
        let ((jobs, open), (answer, answers)) = (channel(), channel());
        let open = Arc::new(Mutex::new(open));
        let slots = Vec::with_capacity(workers.jobs.get());
        let (work, watched) = (work.clone(), Instant::now());
        let mut crew = Self { workers, work, jobs, open, answers, answer, slots, begun: 0, watched };
        for _ in 0..workers.jobs.get() {
            let slot = crew.hire()?;
            crew.slots.push(slot);
        }
        Ok(crew)
    }

    /// Starts a thread that works until there are no more jobs, or until it is given up.
    fn hire(&self) -> Result<Slot, WorkersError> {
        let slot = Slot::default();
        let (own, work, open, answer) = (slot.clone(), self.work.clone(), self.open.clone(), self.answer.clone());
        let body = move || {
            loop {
                let Ok(job) = lock(&open).recv() else { return };
                *lock(&own) = Some((job, Instant::now()));
                let run = work.run(job.sample, job.arm);
                let is_given_up = lock(&own).take().is_none();
                if is_given_up || answer.send((job.place, Done { sample: job.sample, run })).is_err() {
                    return;
                }
            }
        };
        let started = std::thread::Builder::new().name("sample".to_owned()).spawn(body);
        started.map_err(|source| WorkersError { jobs: self.workers.jobs.get(), source })?;
        Ok(slot)
    }

    /// True where another run may be begun, with all before `handed_on` over.
    fn is_short(&self, handed_on: u64) -> bool {
        let window = WINDOW_PER_WORKER * self.workers.jobs.get();
        self.begun - handed_on < window as u64
    }

    fn begin(&mut self, sample: u64, arm: usize) {
        // The other end is held by this very struct.
        self.jobs.send(Job { place: self.begun, sample, arm }).ok();
        self.begun += 1;
    }

    /// Waits for something to be over, or to be late.
    fn wait(&mut self) -> Result<Vec<(u64, Done)>, WorkersError> {
        let mut done = Vec::new();
        match self.answers.recv_timeout(WATCH_EVERY) {
            Ok(answer) => {
                done.push(answer);
                done.extend(self.answers.try_iter());
            }
            // This very struct holds a sender.
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
        if self.watched.elapsed() >= WATCH_EVERY {
            self.watched = Instant::now();
            self.give_up_the_late(&mut done)?;
        }
        Ok(done)
    }

    fn give_up_the_late(&mut self, done: &mut Vec<(u64, Done)>) -> Result<(), WorkersError> {
        let limit = self.workers.sample_timeout;
        for place in 0..self.slots.len() {
            let late = lock(&self.slots[place]).take_if(|(_, since)| since.elapsed() >= limit);
            if let Some((job, since)) = late {
                let failure = SampleFailure::from(SampleError::Timeout { limit_s: limit.as_secs_f64() });
                let controller = self.work.arms[job.arm].controller.name().to_owned();
                let record = ArmRecord { controller, result: Err(failure), checks: None };
                let run = ArmRun { record, wall_s: since.elapsed().as_secs_f64() };
                done.push((job.place, Done { sample: job.sample, run }));
                self.slots[place] = self.hire()?;
            }
        }
        Ok(())
    }
}

/// Puts what is done in the order in which it was begun.
struct Order {
    arms: usize,
    next: u64,
    waiting: BTreeMap<u64, Done>,
}

impl Order {
    /// The next sample, where all of its arms are done.
    fn next_whole(&mut self, work: &Work) -> Option<Finished> {
        let places = self.next..self.next + self.arms as u64;
        if self.arms == 0 || !places.clone().all(|place| self.waiting.contains_key(&place)) {
            return None;
        }
        self.next = places.end;
        let done: Vec<Done> = places.filter_map(|place| self.waiting.remove(&place)).collect();
        Some(Finished {
            wall_s: done.iter().map(|done| done.run.wall_s).collect(),
            record: Record {
                scenario: work.file.config().name.clone(),
                sample: done.first()?.sample,
                arms: done.into_iter().map(|done| done.run.record).collect(),
            },
        })
    }
}
