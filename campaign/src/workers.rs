//! Runs samples on several threads, returns their results in order, and gives up runs that exceed
//! their time limit.
//!
//! ```text
//!  sample numbers ─▶ window ─▶ jobs ─▶ worker ─▶ results ─▶ reorder ─▶ caller
//!                      └────────── at most this many runs ──────────┘
//!                   watch: a worker that exceeds the time limit is abandoned and replaced
//! ```
//!
//! A run starts only if it is at most one window ahead of the last result returned. The window
//! bounds the results that wait in memory, and the runs that a killed program has to repeat.
//!
//! A thread cannot be ended from outside. A worker that exceeds the time limit goes on until its
//! run or the program ends, and its result is discarded.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::Outcome;
use closecall_simulation::{Arm, SampleError};

use super::campaign_error::CampaignError;
use super::record::{ArmRecord, Record, SampleFailure};
use super::runner::{ArmRun, OnOutcome, Work};
use super::stop::StopFlag;

pub use super::campaign_error::WorkersError;

/// Number of runs, for each worker, that may be ahead of the last result returned.
const WINDOW_PER_WORKER: usize = 128;
/// Time that running samples have to end after a stop was requested. Those that take longer are run
/// again on resuming.
const STOP_TIMEOUT: Duration = Duration::from_secs(5);
/// Time that the threads of a pool have to end what they have started: the last process may be
/// given half a second.
const END_TIMEOUT: Duration = Duration::from_secs(2);
/// Interval at which the time limit of running samples is checked.
const WATCH_EVERY: Duration = Duration::from_millis(50);

/// The number of worker threads, and the time limit of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Workers {
    /// Number of threads.
    pub jobs: NonZeroUsize,
    /// Longest wall time of a sample in one arm. A sample that takes longer is an error.
    pub sample_timeout: Duration,
}

/// Default time limit of a sample in one arm.
const SAMPLE_TIMEOUT: Duration = Duration::from_secs(300);

impl Default for Workers {
    /// Returns one thread for each processor, and 300 s for each sample.
    fn default() -> Self {
        let jobs = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Self { jobs, sample_timeout: SAMPLE_TIMEOUT }
    }
}

impl Workers {
    /// Returns this number of threads, or one for each processor, and 300 s for each sample.
    pub fn with_jobs(jobs: Option<u16>) -> Self {
        let default = Self::default();
        Self { jobs: jobs.and_then(|jobs| NonZeroUsize::new(jobs.into())).unwrap_or(default.jobs), ..default }
    }
}

/// The result of one sample with its wall times.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The result in every arm.
    pub record: Record,
    /// Wall time of each arm (s).
    pub wall_s: Vec<f64>,
    /// Wall time of the validity checks in all arms (s).
    pub check_s: f64,
}

/// Samples that workers can run.
pub(crate) trait Samples: Send + Sync + 'static {
    /// Returns the scenario's name, under which the results are filed.
    fn scenario(&self) -> &str;
    /// Returns the arms in which each sample runs.
    fn arms(&self) -> &[Arm];
    /// Runs one sample in one arm. `limit` is its time limit, after which nothing waits for it.
    /// `on_outcome` gets the run before its validity checks, if it is checked in this process.
    fn run(&self, sample: u64, arm: usize, limit: Duration, on_outcome: &OnOutcome<'_>) -> ArmRun;
    /// Ends what this thread has started to run the samples, after the last one.
    fn end(&self) {}
}

/// Samples without validity checks, which a function runs.
pub(crate) struct UncheckedSamples<R> {
    scenario: String,
    arms: Vec<Arm>,
    run: R,
}

impl<R: Fn(u64, &Arm) -> Result<Outcome, SampleFailure> + Send + Sync + 'static> UncheckedSamples<R> {
    /// Returns samples of a scenario. `run` runs one sample in one arm.
    pub(crate) fn new(file: &ScenarioFile, arms: Vec<Arm>, run: R) -> Self {
        Self { scenario: file.config().name.clone(), arms, run }
    }
}

impl<R: Fn(u64, &Arm) -> Result<Outcome, SampleFailure> + Send + Sync + 'static> Samples for UncheckedSamples<R> {
    fn scenario(&self) -> &str {
        &self.scenario
    }

    fn arms(&self) -> &[Arm] {
        &self.arms
    }

    fn run(&self, sample: u64, arm: usize, _: Duration, _: &OnOutcome<'_>) -> ArmRun {
        let (arm, started) = (&self.arms[arm], Instant::now());
        let record = ArmRecord::new(arm.controller.name().to_owned(), (self.run)(sample, arm));
        ArmRun { record, wall_s: started.elapsed().as_secs_f64(), check_s: 0.0 }
    }
}

/// Runs the samples of a campaign elsewhere than on threads of this process.
pub trait SampleRunner: Send + Sync {
    /// Runs the given samples of the scenario `work`, which is given with its index in the
    /// campaign, and passes each result to `on_finished` in the order of `samples`, as
    /// [`Workers::run`] does.
    ///
    /// # Errors
    /// The error of `on_finished`, or another [`CampaignError`]. No further result is passed on
    /// then.
    fn run(
        &self,
        work: (usize, &Arc<Work>),
        samples: &mut dyn Iterator<Item = u64>,
        stop: &StopFlag,
        on_finished: &mut OnFinished<'_>,
    ) -> Result<(), CampaignError>;
}

/// Takes the next result. The run ends if it breaks.
pub type OnFinished<'a> = dyn FnMut(Finished) -> Result<ControlFlow<()>, CampaignError> + 'a;

impl Workers {
    /// Runs the given samples, and passes each result to `on_finished` in the order of `samples`.
    /// Stops when `on_finished` breaks. If `stop` is set, no further sample starts, and those that
    /// run are given a few seconds, or none if it is abandoned.
    ///
    /// # Errors
    /// The error of `on_finished`, or [`WorkersError`]. No further result is passed on then.
    pub fn run<E: From<WorkersError>>(
        &self,
        work: &Arc<Work>,
        samples: impl Iterator<Item = u64>,
        stop: &StopFlag,
        on_finished: impl FnMut(Finished) -> Result<ControlFlow<()>, E>,
    ) -> Result<(), E> {
        self.run_samples(work, samples, stop, on_finished)
    }

    /// Does the same as [`Self::run`] for samples of any kind.
    pub(crate) fn run_samples<E: From<WorkersError>, S: Samples>(
        &self,
        work: &Arc<S>,
        samples: impl Iterator<Item = u64>,
        stop: &StopFlag,
        on_finished: impl FnMut(Finished) -> Result<ControlFlow<()>, E>,
    ) -> Result<(), E> {
        let mut pool = WorkerPool::new(*self, work, stop)?;
        pool.run(samples, on_finished)?;
        pool.end();
        Ok(())
    }
}

/// One run to be done.
#[derive(Clone, Copy, Debug)]
struct Job {
    /// Index in the order of submission.
    index: u64,
    sample: u64,
    arm: usize,
}

/// A run that is done.
struct Done {
    /// Index in the order of submission.
    index: u64,
    sample: u64,
    run: ArmRun,
}

/// The job of a worker. Whichever empties the slot reports the job: the worker that has finished
/// it, or the watch that has found it late.
type Slot = Arc<Mutex<Option<Running>>>;

/// A job that a worker runs.
struct Running {
    job: Job,
    started: Instant,
    /// The run, once only its validity checks are left.
    outcome: Option<ArmRun>,
}

/// Locks a mutex, poisoned or not: panics of the simulation are caught inside the run, when no lock
/// is held.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Threads that run samples, with the worker processes that each of them has. They end when this
/// value is dropped.
pub(crate) struct WorkerPool<S> {
    workers: Workers,
    work: Arc<S>,
    stop: StopFlag,
    jobs: Sender<Job>,
    job_queue: Arc<Mutex<Receiver<Job>>>,
    results: Receiver<Done>,
    result_sender: Sender<Done>,
    slots: Vec<Slot>,
    /// Each thread that has ended what it has started says so.
    ends: Receiver<()>,
    end_sender: Sender<()>,
    /// Number of runs submitted so far.
    submitted: u64,
    /// Number of runs whose results have been returned.
    returned: u64,
    /// Time of the last check of the time limits.
    checked: Instant,
}

impl<S: Samples> WorkerPool<S> {
    /// Starts the threads.
    ///
    /// # Errors
    /// [`WorkersError`] if the system refuses one.
    pub(crate) fn new(workers: Workers, work: &Arc<S>, stop: &StopFlag) -> Result<Self, WorkersError> {
        let ((jobs, job_queue), (result_sender, results), (end_sender, ends)) = (channel(), channel(), channel());
        let job_queue = Arc::new(Mutex::new(job_queue));
        let slots = Vec::with_capacity(workers.jobs.get());
        let (work, stop, checked) = (work.clone(), stop.clone(), Instant::now());
        let mut pool = Self {
            workers,
            work,
            stop,
            jobs,
            job_queue,
            results,
            result_sender,
            slots,
            ends,
            end_sender,
            submitted: 0,
            returned: 0,
            checked,
        };
        for _ in 0..workers.jobs.get() {
            let slot = pool.spawn()?;
            pool.slots.push(slot);
        }
        Ok(pool)
    }

    /// Does the same as [`Workers::run`]. A pool that has not passed on all results is not used
    /// again.
    ///
    /// # Errors
    /// The errors of [`Workers::run`].
    pub(crate) fn run<E: From<WorkersError>>(
        &mut self,
        samples: impl Iterator<Item = u64>,
        mut on_finished: impl FnMut(Finished) -> Result<ControlFlow<()>, E>,
    ) -> Result<(), E> {
        let (work, stop) = (self.work.clone(), self.stop.clone());
        let arms = work.arms().len();
        let mut runs = samples.flat_map(|sample| (0..arms).map(move |arm| (sample, arm)));
        let mut order = Reorder { arms, next: self.submitted, waiting: BTreeMap::new() };
        let mut stopped: Option<Instant> = None;
        loop {
            if stop.is_set() {
                stopped.get_or_insert_with(Instant::now);
            }
            while stopped.is_none()
                && self.has_room(order.next)
                && let Some((sample, arm)) = runs.next()
            {
                self.submit(sample, arm);
            }
            if order.next == self.submitted {
                self.returned = order.next;
                return Ok(());
            }
            let is_idle = self.is_idle();
            let results = self.wait()?;
            if stop.is_abandoned() {
                return Ok(());
            }
            let is_over = stopped.is_some_and(|at| is_idle && results.is_empty() || at.elapsed() >= STOP_TIMEOUT);
            for done in results {
                order.waiting.insert(done.index, done);
            }
            while let Some(finished) = order.pop(&*work) {
                if on_finished(finished)?.is_break() {
                    return Ok(());
                }
            }
            if is_over {
                return Ok(());
            }
        }
    }

    /// Ends the threads, if all runs are done, and waits a short time until each has ended what it
    /// has started. Threads of a pool that ends early end by themselves.
    fn end(self) {
        if self.returned != self.submitted || self.stop.is_set() {
            return;
        }
        drop(self.jobs);
        let started = Instant::now();
        for _ in &self.slots {
            if self.ends.recv_timeout(END_TIMEOUT.saturating_sub(started.elapsed())).is_err() {
                return;
            }
        }
    }

    /// Starts a thread that works until there are no more jobs, or until it is abandoned.
    fn spawn(&self) -> Result<Slot, WorkersError> {
        let slot = Slot::default();
        let (own_slot, work, stop) = (slot.clone(), self.work.clone(), self.stop.clone());
        let (job_queue, result_sender) = (self.job_queue.clone(), self.result_sender.clone());
        let end_sender = self.end_sender.clone();
        let limit = self.workers.sample_timeout;
        let body = move || {
            loop {
                // The other threads get the lock before this one ends.
                let job = lock(&job_queue).recv();
                let Ok(job) = job else {
                    work.end();
                    // Nobody may wait for it.
                    end_sender.send(()).ok();
                    return;
                };
                if stop.is_set() {
                    return;
                }
                *lock(&own_slot) = Some(Running { job, started: Instant::now(), outcome: None });
                let keep = |run: &ArmRun| {
                    // The slot is empty once the job has been found late.
                    if let Some(running) = &mut *lock(&own_slot) {
                        running.outcome = Some(run.clone());
                    }
                };
                let run = work.run(job.sample, job.arm, limit, &keep);
                let is_abandoned = lock(&own_slot).take().is_none();
                let done = Done { index: job.index, sample: job.sample, run };
                if is_abandoned || result_sender.send(done).is_err() {
                    return;
                }
            }
        };
        let started = std::thread::Builder::new().name("sample".to_owned()).spawn(body);
        started.map_err(|source| WorkersError { jobs: self.workers.jobs.get(), source })?;
        Ok(slot)
    }

    /// Returns true if another run may be submitted. `returned` is the number of runs whose results
    /// have been returned.
    fn has_room(&self, returned: u64) -> bool {
        let window = WINDOW_PER_WORKER * self.workers.jobs.get();
        self.submitted - returned < window as u64
    }

    /// Returns true if no worker is running a sample.
    fn is_idle(&self) -> bool {
        self.slots.iter().all(|slot| lock(slot).is_none())
    }

    fn submit(&mut self, sample: u64, arm: usize) {
        // Sending cannot fail: this struct owns the receiver.
        self.jobs.send(Job { index: self.submitted, sample, arm }).ok();
        self.submitted += 1;
    }

    /// Waits until a run has finished or the interval of the watch is over. Returns the finished
    /// and the abandoned runs.
    fn wait(&mut self) -> Result<Vec<Done>, WorkersError> {
        let mut done = Vec::new();
        match self.results.recv_timeout(WATCH_EVERY) {
            Ok(result) => {
                done.push(result);
                done.extend(self.results.try_iter());
            }
            // `Disconnected` cannot occur: this struct owns a sender.
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
        if self.checked.elapsed() >= WATCH_EVERY {
            self.checked = Instant::now();
            self.abandon_late_runs(&mut done)?;
        }
        Ok(done)
    }

    fn abandon_late_runs(&mut self, done: &mut Vec<Done>) -> Result<(), WorkersError> {
        let limit = self.workers.sample_timeout;
        for index in 0..self.slots.len() {
            let late = lock(&self.slots[index]).take_if(|running| running.started.elapsed() >= limit);
            if let Some(Running { job, started, outcome }) = late {
                let error = SampleError::Timeout { limit_s: limit.as_secs_f64() };
                let run = match outcome {
                    // The sample has its outcome: the time is over for its checks.
                    Some(run) => {
                        ArmRun { check_s: started.elapsed().as_secs_f64() - run.wall_s, ..run.unchecked(&error) }
                    }
                    None => {
                        let controller = self.work.arms()[job.arm].controller.name().to_owned();
                        let record = ArmRecord::new(controller, Err(SampleFailure::from(error)));
                        ArmRun { record, wall_s: started.elapsed().as_secs_f64(), check_s: 0.0 }
                    }
                };
                done.push(Done { index: job.index, sample: job.sample, run });
                self.slots[index] = self.spawn()?;
            }
        }
        Ok(())
    }
}

/// Puts finished runs into the order in which they were submitted, and joins the arms of each
/// sample.
struct Reorder {
    arms: usize,
    /// Index of the next run to return.
    next: u64,
    waiting: BTreeMap<u64, Done>,
}

impl Reorder {
    /// Removes and returns the next sample. Returns `None` if a run of that sample is missing.
    fn pop(&mut self, work: &impl Samples) -> Option<Finished> {
        let indices = self.next..self.next + self.arms as u64;
        if self.arms == 0 || !indices.clone().all(|index| self.waiting.contains_key(&index)) {
            return None;
        }
        self.next = indices.end;
        let done: Vec<Done> = indices.filter_map(|index| self.waiting.remove(&index)).collect();
        Some(Finished {
            wall_s: done.iter().map(|done| done.run.wall_s).collect(),
            check_s: done.iter().map(|done| done.run.check_s).sum(),
            record: Record {
                scenario: work.scenario().to_owned(),
                sample: done.first()?.sample,
                arms: done.into_iter().map(|done| done.run.record).collect(),
            },
        })
    }
}
