//! The progress of a long command as lines of text, for a standard error that is no terminal, such
//! as the log of a CI job.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

/// Time between two lines. CI servers end a job that is silent for ten minutes.
const INTERVAL: Duration = Duration::from_secs(30);
/// Stack of the thread that prints (bytes). It only formats a line; the usual 2 MiB are not needed.
const STACK_BYTES: usize = 256 << 10;

/// Number of heartbeats of a part of a command. While there is one, the heartbeat of the whole
/// command is silent.
static OF_PARTS: AtomicUsize = AtomicUsize::new(0);

/// Prints a line about the progress every 30 s until it is dropped.
#[derive(Debug)]
pub struct Heartbeat {
    /// `None` if no thread could be started: the work does not depend on it.
    running: Option<(Sender<()>, JoinHandle<()>)>,
    is_of_part: bool,
}

impl Heartbeat {
    /// Starts to `print` lines. `progress` returns the number of finished samples, and the number
    /// of all samples.
    pub fn start(progress: impl Fn() -> [u64; 2] + Send + 'static, print: impl Fn(&str) + Send + 'static) -> Self {
        Self::of("samples", progress, print)
    }

    /// Starts to `print` lines about something else than samples, such as `fits`.
    pub fn of(
        unit: &'static str,
        progress: impl Fn() -> [u64; 2] + Send + 'static,
        print: impl Fn(&str) + Send + 'static,
    ) -> Self {
        Self::every(INTERVAL, move |elapsed| line(progress(), unit, elapsed), print)
    }

    /// Starts to `print` lines about work whose length is not known, such as `reading traffic.csv`.
    pub fn during(work: String, print: impl Fn(&str) + Send + 'static) -> Self {
        Self::every(INTERVAL, move |elapsed| line_during(&work, elapsed), print)
    }

    /// Starts to `print` lines about a whole command, while no other heartbeat prints about a part
    /// of it.
    pub fn of_command(command: String, print: impl Fn(&str) + Send + 'static) -> Self {
        Self::of_command_every(INTERVAL, command, print)
    }

    fn of_command_every(interval: Duration, command: String, print: impl Fn(&str) + Send + 'static) -> Self {
        let line = move |elapsed| (OF_PARTS.load(Ordering::Relaxed) == 0).then(|| line_during(&command, elapsed));
        Self { running: beat(interval, line, print), is_of_part: false }
    }

    fn every(
        interval: Duration,
        line: impl Fn(Duration) -> String + Send + 'static,
        print: impl Fn(&str) + Send + 'static,
    ) -> Self {
        OF_PARTS.fetch_add(1, Ordering::Relaxed);
        Self { running: beat(interval, move |elapsed| Some(line(elapsed)), print), is_of_part: true }
    }
}

/// Starts the thread that prints a line after each interval, if there is one then.
fn beat(
    interval: Duration,
    line: impl Fn(Duration) -> Option<String> + Send + 'static,
    print: impl Fn(&str) + Send + 'static,
) -> Option<(Sender<()>, JoinHandle<()>)> {
    let (sender, receiver) = channel();
    let started = Instant::now();
    let thread = Builder::new().stack_size(STACK_BYTES).spawn(move || {
        while receiver.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
            if let Some(line) = line(started.elapsed()) {
                print(&line);
            }
        }
    });
    Some((sender, thread.ok()?))
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        if self.is_of_part {
            OF_PARTS.fetch_sub(1, Ordering::Relaxed);
        }
        if let Some((sender, thread)) = self.running.take() {
            drop(sender);
            drop(thread.join());
        }
    }
}

/// Returns a rate with two digits.
pub fn rate_text(rate: f64) -> String {
    match rate {
        rate if rate >= 9.95 => format!("{rate:.0}"),
        rate if rate >= 0.995 => format!("{rate:.1}"),
        _ => format!("{rate:.2}"),
    }
}

/// Returns a time in the unit that gives it two digits, up to a year.
pub fn duration_text(seconds: f64) -> String {
    const UNITS: [(f64, &str); 3] = [(86_400.0, "days"), (3_600.0, "h"), (60.0, "min")];
    if !(seconds < 365.0 * 86_400.0) {
        return "more than a year".to_owned();
    }
    let unit = UNITS.into_iter().find(|(unit_s, _)| seconds >= 2.0 * unit_s);
    unit.map_or_else(|| format!("{seconds:.0} s"), |(unit_s, name)| format!("{:.0} {name}", seconds / unit_s))
}

fn line([done, all]: [u64; 2], unit: &str, elapsed: Duration) -> String {
    let elapsed_s = elapsed.as_secs_f64();
    if done >= all {
        return format!("all {all} {unit} are done, the results are written: {} so far", duration_text(elapsed_s));
    }
    let per_second = done as f64 / elapsed_s;
    let left = match done {
        0 => String::new(),
        _ => {
            let left_s = (all.saturating_sub(done)) as f64 / per_second;
            format!(", {} {unit}/s, {} left", rate_text(per_second), duration_text(left_s))
        }
    };
    format!("{done} of {all} {unit} after {}{left}", duration_text(elapsed_s))
}

fn line_during(work: &str, elapsed: Duration) -> String {
    format!("{work}: {} so far", duration_text(elapsed.as_secs_f64()))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, channel};

    use super::*;

    #[test]
    fn a_line_states_the_progress() {
        assert_eq!(
            line([50, 200], "samples", Duration::from_secs(10)),
            "50 of 200 samples after 10 s, 5.0 samples/s, 30 s left"
        );
        assert_eq!(line([0, 200], "samples", Duration::from_secs(30)), "0 of 200 samples after 30 s");
        assert_eq!(line([3, 6], "fits", Duration::from_secs(3)), "3 of 6 fits after 3 s, 1.0 fits/s, 3 s left");
        assert_eq!(
            line([200, 200], "samples", Duration::from_secs(40)),
            "all 200 samples are done, the results are written: 40 s so far"
        );
    }

    #[test]
    fn a_time_has_the_unit_that_a_reader_grasps() {
        for (seconds, text) in [
            (0.4, "0 s"),
            (119.0, "119 s"),
            (120.0, "2 min"),
            (7_200.0, "2 h"),
            (172_800.0, "2 days"),
            (3.2e7, "more than a year"),
            (f64::INFINITY, "more than a year"),
            (f64::NAN, "more than a year"),
        ] {
            assert_eq!(duration_text(seconds), text);
        }
        let of_many = line([10, 1_000_000_000_000], "samples", Duration::from_secs(10));
        assert!(of_many.ends_with("1.0 samples/s, more than a year left"), "{of_many}");
    }

    #[test]
    fn lines_come_until_the_heartbeat_ends() {
        let (sender, lines) = channel();
        let print = move |line: &str| drop(sender.send(line.to_owned()));
        let heartbeat = Heartbeat::every(Duration::from_millis(1), |elapsed| line([0, 5], "samples", elapsed), print);
        assert!(lines.recv().unwrap().starts_with("0 of 5 samples"));
        drop(heartbeat);
        while lines.try_recv().is_ok() {}
        assert!(lines.recv().is_err(), "the thread has ended");
    }

    #[test]
    fn the_heartbeat_of_a_command_is_silent_while_a_part_of_it_has_its_own() {
        assert_eq!(
            line_during("closecall minimize out 0", Duration::from_secs(30)),
            "closecall minimize out 0: 30 s so far"
        );
        let (sender, lines): (_, Receiver<String>) = channel();
        let print = move |line: &str| drop(sender.send(line.to_owned()));
        let of_command =
            Heartbeat::of_command_every(Duration::from_millis(1), "closecall explain out".to_owned(), print);
        assert!(lines.recv().unwrap().starts_with("closecall explain out: 0 s so far"));
        let part = Heartbeat::during("reading traffic.csv".to_owned(), |_| ());
        // A line may have been on its way.
        std::thread::sleep(Duration::from_millis(50));
        while lines.try_recv().is_ok() {}
        std::thread::sleep(Duration::from_millis(50));
        assert!(lines.try_recv().is_err(), "two heartbeats print");
        drop(part);
        assert!(lines.recv().is_ok(), "the part has ended");
        drop(of_command);
    }
}
