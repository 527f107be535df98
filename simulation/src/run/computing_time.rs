//! The computing time of a controller from outside.
//!
//! A command takes effect at a stated time after its input: the *budget* of the controller is that
//! time, or the control period if the command takes effect at once. The loop waits for the answer,
//! however long it takes. A controller that computes for longer than its budget could not do so in
//! a vehicle. Such a run is an error.
//!
//! A machine with other work delays single steps. Three figures of the run decide, so that its
//! delays do not count for the controller:
//!
//! | figure | what may exceed the budget |
//! |---|---|
//! | processor time of a step, of the thread that answers, by a quarter | one step of a run, besides the first |
//! | wall time of a step, without the time for which a thread waits for a processor | 1 % of the steps, or 4 |
//! | mean wall time | nothing |
//!
//! The processor time is the controller's own: it hardly depends on what else the machine does. It misses the time of
//! another thread, of another process, of a file or of the network: the second figure has it. Linux
//! counts both times for each thread (`schedstat`, proc(5)). They are read in every 25th step
//! and after each slow one, because a controller in this process may answer in a microsecond. On
//! other systems the first figure is left out.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::time::{Duration, Instant};

use closecall_controllers::ControllerError;
use closecall_traffic::{CONTROL_STEP, Time};

/// Number of steps from which on the mean and the share count during a run (-): five seconds. An
/// assumption; 25 to 250 are plausible.
const LEAST_STEPS: u32 = 125;

/// Number of steps from which on they count at the end of a run (-): one second. An assumption; 10
/// to 125 are plausible.
const LEAST_STEPS_OF_A_RUN: u32 = 25;

/// Largest share of steps that may exceed the budget by their wall time (-): a vehicle's controller
/// has less. An assumption; 0.005 to 0.02 are plausible.
const MOST_LATE: f64 = 0.01;

/// The same for scans of a perception (-), whose latency the tracker has in any case. An assumption;
/// 0.02 to 0.15 are plausible.
const MOST_LATE_SCANS: f64 = 0.1;

/// Number of steps that may exceed the budget by their wall time in any run (-): a machine may delay
/// a step in ways that Linux does not count. An assumption; 2 to 10 are plausible.
const LATE_IN_ANY_RUN: u32 = 4;

/// Number of steps that may exceed the budget by their processor time (-): a program may load or
/// compile once what it needs, when it needs it first. An assumption; 0 to 3 are plausible.
const MOST_COMPUTED: u32 = 1;

/// Ratio of processor time to budget from which on a step counts by it (-): other work shares caches
/// and, with hyper-threads, the processor, so that the same computation takes longer. An
/// assumption; 1.1 to 1.5 are plausible.
const SHARED_PROCESSOR: f64 = 1.25;

/// Number of steps after which the times of the threads are read again (-): an assumption. A read
/// takes as long as a fast controller's step.
const READ_EVERY: u32 = 25;

/// Adds up the computing time of a run.
#[derive(Debug)]
pub(crate) struct ComputingTime {
    budget: Duration,
    most_late: f64,
    most_computed: u32,
    spent: Duration,
    steps: u32,
    /// Number of steps whose wall time, without waiting, exceeded the budget.
    late: u32,
    /// Number of steps whose processor time exceeded the budget.
    computed: u32,
    /// The thread that answers.
    thread: Thread,
    has_begun: bool,
}

/// Returns the period of the controller as a duration.
pub(super) fn control_period() -> Duration {
    Duration::from_secs_f64(CONTROL_STEP.s())
}

impl ComputingTime {
    /// Returns the meter of a run whose steps may take this long.
    pub(crate) fn new(budget: Duration) -> Self {
        let (spent, thread) = (Duration::ZERO, Thread::default());
        let (most_late, most_computed) = (MOST_LATE, MOST_COMPUTED);
        Self { budget, most_late, most_computed, spent, steps: 0, late: 0, computed: 0, thread, has_begun: false }
    }

    /// Returns the meter of a perception whose scans are this far apart, and which runs in the process
    /// with this number. Its processor time does not count.
    pub(crate) fn of_perception(period: Duration, process: u32) -> Self {
        let meter = Self::new(period.max(control_period()));
        Self { most_late: MOST_LATE_SCANS, most_computed: u32::MAX, thread: Thread::of(Some(process)), ..meter }
    }

    /// Calls `step`, and adds the time that it takes. `process` returns the process that answers; `None`
    /// if this thread does.
    ///
    /// # Errors
    /// The error of `step`, or [`ControllerError::Late`] if the computing time exceeds the budget.
    pub(super) fn of<T, S>(
        &mut self,
        time: Time,
        stepped: &mut S,
        step: impl FnOnce(&mut S) -> Result<T, ControllerError>,
        process: impl FnOnce(&S) -> Option<u32>,
    ) -> Result<T, ControllerError> {
        let begun = Instant::now();
        let command = step(stepped)?;
        let spent = begun.elapsed();
        if !self.has_begun {
            self.thread = Thread::of(process(stepped));
        }
        late(self.exceeded(spent), time)?;
        Ok(command)
    }

    /// Adds the time of a step. The time of the first does not count: a program starts in it. Returns a
    /// message if the computing time exceeds the budget.
    pub(crate) fn exceeded(&mut self, spent: Duration) -> Option<String> {
        if !std::mem::replace(&mut self.has_begun, true) {
            self.thread.read();
            return None;
        }
        self.spent += spent;
        self.steps += 1;
        if spent > self.budget {
            let Times { computed, waited } = self.thread.read();
            self.add_slow(spent, computed, waited);
        } else if self.steps.is_multiple_of(READ_EVERY) {
            self.thread.read();
        }
        self.judged(LEAST_STEPS)
    }

    /// Adds a step whose wall time exceeds the budget.
    fn add_slow(&mut self, spent: Duration, computed: Duration, waited: Duration) {
        self.late += u32::from(spent.saturating_sub(waited) > self.budget);
        self.computed += u32::from(spent.min(computed) > self.budget.mul_f64(SHARED_PROCESSOR));
    }

    /// Judges a run that is over, and may have been short.
    ///
    /// # Errors
    /// [`ControllerError::Late`] as in [`ComputingTime::of`].
    pub(super) fn finish(&self, time: Time) -> Result<(), ControllerError> {
        late(self.judged(LEAST_STEPS_OF_A_RUN), time)
    }

    /// Returns a message if the computing time exceeds the budget. The mean and the share of steps
    /// count from `least_steps` on.
    fn judged(&self, least_steps: u32) -> Option<String> {
        let budget_ms = 1e3 * self.budget.as_secs_f64();
        if self.computed > self.most_computed {
            return Some(format!(
                "computes for more than its {budget_ms:.0} ms in {} of {} steps, by a quarter of them and by its own processor time, and may \
                 in one",
                self.computed, self.steps
            ));
        }
        if self.steps < least_steps {
            return None;
        }
        let steps = f64::from(self.steps);
        let mean_ms = 1e3 * self.spent.as_secs_f64() / steps;
        if mean_ms > budget_ms {
            return Some(format!(
                "computes for {mean_ms:.0} ms in the mean of {steps} steps, and has {budget_ms:.0} ms"
            ));
        }
        (self.late > LATE_IN_ANY_RUN && f64::from(self.late) > self.most_late * steps).then(|| {
            let most = 100.0 * self.most_late;
            format!(
                "computes for more than its {budget_ms:.0} ms in {} of {steps} steps, and may in {most:.0} %",
                self.late
            )
        })
    }
}

/// Returns a message as the error of a controller that is late.
fn late(message: Option<String>, time: Time) -> Result<(), ControllerError> {
    match message {
        Some(message) => Err(ControllerError::Late { reason: format!("the controller {message}"), time }),
        None => Ok(()),
    }
}

/// The times of the threads that a step needs, which the system counts.
#[derive(Debug, Default)]
struct Thread {
    /// The times of the thread that answers, if the system has them.
    answering: Option<(File, Times)>,
    /// The times of this thread, if another one answers.
    asking: Option<(File, Times)>,
}

/// The times of a thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Times {
    /// Time on a processor.
    computed: Duration,
    /// Time for which it waited for a processor while it could have run.
    waited: Duration,
}

impl Thread {
    /// Returns the times of the main thread of a process, or of this thread.
    fn of(process: Option<u32>) -> Self {
        let open = |path: &str| Some((File::open(path).ok()?, Times::default()));
        let mut thread = match process {
            Some(process) => Self {
                answering: open(&format!("/proc/{process}/schedstat")),
                asking: open("/proc/thread-self/schedstat"),
            },
            None => Self { answering: open("/proc/thread-self/schedstat"), asking: None },
        };
        thread.read();
        thread
    }

    /// Returns the times since the last read: what the answering thread has computed, and what both
    /// have waited.
    fn read(&mut self) -> Times {
        let since = |thread: &mut Option<(File, Times)>| {
            let Some((file, before)) = thread else { return Times::default() };
            let Some(now) = times(file) else { return Times::default() };
            let Times { computed, waited } = std::mem::replace(before, now);
            Times { computed: now.computed.saturating_sub(computed), waited: now.waited.saturating_sub(waited) }
        };
        let (answering, asking) = (since(&mut self.answering), since(&mut self.asking));
        Times { waited: answering.waited + asking.waited, ..answering }
    }
}

/// Returns the times that a file `schedstat` tells: its first two numbers (ns).
fn times(file: &File) -> Option<Times> {
    /// Space for three numbers of 20 digits.
    const MOST_BYTES: usize = 64;
    let mut bytes = [0; MOST_BYTES];
    let read = file.read_at(&mut bytes, 0).ok()?;
    let text = std::str::from_utf8(&bytes[..read]).ok()?;
    let mut numbers = text.split_whitespace().map_while(|number| number.parse().ok().map(Duration::from_nanos));
    Some(Times { computed: numbers.next()?, waited: numbers.next()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// Returns the step that is refused, of 300 that take as long as stated, and whether they
    /// compute for that long.
    fn refused(took_ms: impl Fn(u32) -> u64, computes: bool) -> Option<u32> {
        let mut computing = ComputingTime::new(control_period());
        (0..300).find(|&step| add(&mut computing, ms(took_ms(step)), computes).is_some())
    }

    /// Adds a step without a look at the threads of this test.
    fn add(computing: &mut ComputingTime, spent: Duration, computes: bool) -> Option<String> {
        let message = computing.exceeded(spent);
        if computing.steps > 0 && spent > computing.budget {
            computing.computed += u32::from(computes);
        }
        message.or_else(|| computing.judged(LEAST_STEPS))
    }

    #[test]
    fn a_controller_that_needs_longer_than_the_control_period_is_refused() {
        assert_eq!(refused(|_| 60, false), Some(LEAST_STEPS));
        assert_eq!(refused(|_| 60, true), Some(2));
        assert_eq!(refused(|_| 39, true), None);
    }

    #[test]
    fn a_slow_start_and_single_delays_are_not() {
        assert_eq!(refused(|step| if step == 0 { 9_000 } else { 2 }, true), None);
        assert_eq!(refused(|step| if step % 75 == 7 { 900 } else { 2 }, false), None);
        assert_eq!(refused(|step| if step == 7 { 900 } else { 2 }, true), None);
    }

    #[test]
    fn sixty_milliseconds_in_every_fiftieth_step_are_refused() {
        // The fifth late step of more than 1 %, if it only waits.
        assert_eq!(refused(|step| if step % 50 == 7 { 60 } else { 2 }, false), Some(207));
        assert_eq!(refused(|step| if step % 50 == 7 { 60 } else { 2 }, true), Some(57));
        assert_eq!(refused(|step| if step % 140 == 7 { 60 } else { 2 }, true), Some(147));
    }

    #[test]
    fn a_short_run_is_judged_at_its_end() {
        let ended_after = |steps: u32, took_ms: u64| {
            let mut computing = ComputingTime::new(control_period());
            (0..=steps).for_each(|_| assert_eq!(computing.exceeded(ms(took_ms)), None));
            computing.finish(Time::ZERO)
        };
        assert!(ended_after(LEAST_STEPS_OF_A_RUN, 60).is_err());
        assert!(ended_after(LEAST_STEPS_OF_A_RUN - 1, 60).is_ok());
        assert!(ended_after(LEAST_STEPS - 1, 2).is_ok());
    }

    #[test]
    fn a_stated_budget_takes_the_place_of_the_control_period() {
        let refused = |budget_ms: u64| {
            let mut computing = ComputingTime::new(ms(budget_ms));
            (0..300).find(|_| computing.exceeded(ms(25)).is_some())
        };
        assert_eq!((refused(20), refused(30)), (Some(LEAST_STEPS), None));
    }

    #[test]
    fn bursts_that_keep_the_mean_are_refused() {
        assert_eq!(refused(|step| if step % 5 == 0 { 150 } else { 0 }, false), Some(LEAST_STEPS));
        assert_eq!(refused(|step| if step % 8 == 0 { 300 } else { 0 }, false), Some(LEAST_STEPS));
        // Fast for six seconds, and late from then on.
        assert_eq!(refused(|step| if step > 150 { 60 } else { 1 }, false), Some(155));
    }

    #[test]
    fn waiting_for_a_processor_counts_for_the_machine() {
        let mut computing = ComputingTime::new(control_period());
        for _ in 0..LEAST_STEPS {
            computing.steps += 1;
            computing.add_slow(ms(60), ms(5), ms(30));
        }
        assert_eq!((computing.late, computing.computed), (0, 0));
        computing.add_slow(ms(60), ms(45), ms(2));
        assert_eq!((computing.late, computing.computed), (1, 0));
        computing.add_slow(ms(60), ms(55), ms(2));
        assert_eq!((computing.late, computing.computed), (2, 1));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_counts_what_a_thread_computes() {
        let mut thread = Thread::of(None);
        thread.read();
        let begun = Instant::now();
        let mut sum = 0_u64;
        while begun.elapsed() < ms(20) {
            sum = std::hint::black_box(sum.wrapping_add(1));
        }
        let busy = thread.read();
        std::thread::sleep(ms(20));
        let asleep = thread.read();
        // A test does not rely on a wall time: the machine may be busy.
        assert!(busy.computed > asleep.computed, "{busy:?}, {asleep:?}");
    }
}
