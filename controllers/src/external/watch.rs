//! Ends a worker process whose controller does not answer.
//!
//! A thread that is blocked in foreign code cannot be ended. The process therefore ends after it
//! has reported the sample.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use closecall_traffic::Time;

/// Number of calls that have begun and ended: odd while the process is in a call.
static CALLS: AtomicU64 = AtomicU64::new(0);
/// Time of the control step of the latest call (ns).
static STEP: AtomicI64 = AtomicI64::new(0);

/// True if the latest call creates a controller.
static IS_START: AtomicBool = AtomicBool::new(false);

/// Time that the creation of a controller may take at least. It may first have to read its files,
/// as the greeting of a process.
const START_LIMIT: Duration = Duration::from_secs(10);

/// Interval at which the calls are looked at.
const INTERVAL: Duration = Duration::from_millis(10);

/// A call of foreign code, which ends when this value is dropped.
#[derive(Debug)]
pub struct Call(());

impl Call {
    /// Begins a call in the control step at `time`. A process makes one call at a time.
    pub fn begin(time: Time) -> Self {
        Self::of(time, false)
    }

    /// Begins the call that creates a controller, which may take 10 s.
    pub fn begin_start(time: Time) -> Self {
        Self::of(time, true)
    }

    fn of(time: Time, is_start: bool) -> Self {
        STEP.store(time.ns(), Ordering::Relaxed);
        IS_START.store(is_start, Ordering::Relaxed);
        CALLS.fetch_add(1, Ordering::Relaxed);
        Self(())
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        CALLS.fetch_add(1, Ordering::Relaxed);
    }
}

/// Starts a thread that calls `report` with the time of the control step and the limit, and then
/// ends the process, as soon as a call takes longer than `limit`.
///
/// # Errors
/// The error of the system if the thread cannot be started.
pub fn start(limit: Duration, report: impl Fn(Time, Duration) + Send + 'static) -> std::io::Result<()> {
    let body = move || {
        let (mut seen, mut since) = (0, Instant::now());
        loop {
            thread::sleep(INTERVAL);
            let calls = CALLS.load(Ordering::Relaxed);
            if calls != seen || calls.is_multiple_of(2) {
                (seen, since) = (calls, Instant::now());
                continue;
            }
            let limit = if IS_START.load(Ordering::Relaxed) { limit.max(START_LIMIT) } else { limit };
            if since.elapsed() >= limit {
                report(Time::from_ns(STEP.load(Ordering::Relaxed)), limit);
                std::process::abort();
            }
        }
    };
    thread::Builder::new().name("watch".to_owned()).spawn(body).map(drop)
}
