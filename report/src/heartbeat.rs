//! The progress of a long command as lines of text, for a standard error that is no terminal, such
//! as the log of a CI job.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two lines. CI servers end a job that is silent for ten minutes.
const INTERVAL: Duration = Duration::from_secs(30);

/// Prints a line about the progress every 30 s until it is dropped.
#[derive(Debug)]
pub struct Heartbeat {
    running: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Heartbeat {
    /// Starts to `print` lines. `progress` returns the number of finished samples, and the number
    /// of all samples.
    pub fn start(progress: impl Fn() -> [u64; 2] + Send + 'static, print: impl Fn(&str) + Send + 'static) -> Self {
        Self::every((INTERVAL, "samples"), progress, print)
    }

    /// Starts to `print` lines about something else than samples, such as `fits`.
    pub fn of(
        unit: &'static str,
        progress: impl Fn() -> [u64; 2] + Send + 'static,
        print: impl Fn(&str) + Send + 'static,
    ) -> Self {
        Self::every((INTERVAL, unit), progress, print)
    }

    fn every(
        (interval, unit): (Duration, &'static str),
        progress: impl Fn() -> [u64; 2] + Send + 'static,
        print: impl Fn(&str) + Send + 'static,
    ) -> Self {
        let (sender, receiver) = channel();
        let started = Instant::now();
        let thread = std::thread::spawn(move || {
            while receiver.recv_timeout(interval) == Err(RecvTimeoutError::Timeout) {
                let [done, all] = progress();
                print(&line([done, all], unit, started.elapsed()));
            }
        });
        Self { running: Some((sender, thread)) }
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
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

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn a_line_states_the_progress() {
        assert_eq!(
            line([50, 200], "samples", Duration::from_secs(10)),
            "50 of 200 samples after 10 s, 5.0 samples/s, 30 s left"
        );
        assert_eq!(line([0, 200], "samples", Duration::from_secs(30)), "0 of 200 samples after 30 s");
        assert_eq!(line([3, 6], "fits", Duration::from_secs(3)), "3 of 6 fits after 3 s, 1.0 fits/s, 3 s left");
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
        let heartbeat = Heartbeat::every((Duration::from_millis(1), "samples"), || [0, 5], print);
        assert!(lines.recv().unwrap().starts_with("0 of 5 samples"));
        drop(heartbeat);
        while lines.try_recv().is_ok() {}
        assert!(lines.recv().is_err(), "the thread has ended");
    }
}
