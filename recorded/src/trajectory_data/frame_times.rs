//! The clock that a file keeps although its times are rounded, or jitter.
//!
//! ```text
//!   frame   0        1        2        3        4
//!   tick    ┼────────┼────────┼────────┼────────┼──▶  t = t₀ + frame · T, fitted over all rows
//!   time    ●        ●       ●          ●       ●      rounded to its last digit
//! ```
//!
//! A recording of 30 Hz with times in milliseconds has steps of 33 and 34 ms, and one in hundredths of
//! a second has steps of 0.03 and 0.04 s. No single step shows the period. The line that fits all
//! rows does: its period is exact to the error of a time divided by the number of frames. A time near
//! its tick is replaced by the tick, so that the errors of times do not add up and all vehicles of a
//! frame share its time.
//!
//! A frame that is missing although the numbers of frames go on, or that is there twice under two
//! numbers, moves the later times by a whole step. Of the two times beside it, one is at least half a
//! step off its tick, and is no longer near it.

use closecall_traffic::Time;
use closecall_traffic::statistics::quantiles::median;

use super::assemble::step;
use super::continuity::FrameClock;
use super::error::TrajectoryFileProblem;
use super::source::{ReadError, Row};

/// Largest distance of a time from its tick, as a share of the step (-). Up to half a step, a time
/// belongs to one frame alone. A quarter leaves the same distance again to the next frame. An
/// assumption with a plausible range of 0.2 to 0.4.
const NEAR_SHARE: f64 = 0.25;
/// The same (s). Times in hundredths of a second are up to 5 ms off, and computers that stamp frames
/// are some milliseconds late. A vehicle at 30 m/s moves 0.3 m within it, which is below the errors of
/// recorded positions. An assumption with a plausible range of 5 to 20 ms.
const NEAR_S: f64 = 0.010;
/// Least share of the rows that are near their ticks (-). An assumption with a plausible range of 0.9
/// to 0.99.
const LEAST_NEAR: f64 = 0.95;
/// Least number of rows to which a line is fitted.
const LEAST_ROWS: usize = 10;
/// Number of times that the line is fitted to the rows near it.
const REFINEMENTS: usize = 3;

/// Share of uneven steps above which the clock of a file is irregular (-), and the least number of
/// them: fewer are single rows with wrong times. Assumptions with plausible ranges of 0.02 to 0.2 and
/// 10 to 100.
const IRREGULAR_SHARE: f64 = 0.05;
const LEAST_UNEVEN: usize = 20;

/// Share of the period by which a time may be off a line through the first row without a closer look
/// (-): half of what two successive rows may differ by.
const EXACT_SHARE: f64 = 0.01;

/// The clock of a file whose times are rounded, or jitter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ticks {
    /// A frame, and its time by the fitted line.
    frame: i64,
    time: Time,
    period_s: f64,
    /// Time by which all ticks are moved: none is negative, and the first one is 0 if it is near 0.
    shift: Time,
}

/// The number of a row's frame after the first one, and its time after the first row's (s).
#[derive(Clone, Copy)]
struct Sample {
    frames: f64,
    time_s: f64,
}

/// A line through samples.
#[derive(Clone, Copy)]
struct Line {
    offset_s: f64,
    period_s: f64,
}

impl Line {
    /// Returns the line through the middle of the samples, which single wrong times do not move. The
    /// samples are sorted by frame. `None` if too few frames differ.
    fn through(samples: &[Sample]) -> Option<Self> {
        let half = samples.len() / 2;
        let steps = samples.iter().zip(&samples[half..]).filter(|(before, after)| after.frames > before.frames);
        let periods: Vec<f64> =
            steps.map(|(before, after)| (after.time_s - before.time_s) / (after.frames - before.frames)).collect();
        if periods.len() < LEAST_ROWS / 2 {
            return None;
        }
        let period_s = median(periods);
        let offset_s = median(samples.iter().map(|sample| sample.time_s - period_s * sample.frames).collect());
        Some(Self { offset_s, period_s })
    }

    fn near_s(self) -> f64 {
        NEAR_S.min(NEAR_SHARE * self.period_s)
    }

    fn is_near(self, sample: Sample) -> bool {
        (sample.time_s - self.offset_s - self.period_s * sample.frames).abs() <= self.near_s()
    }

    /// Returns the line with the least squares to the samples near this line.
    fn refined(self, samples: &[Sample]) -> Option<Self> {
        let near = || samples.iter().filter(move |sample| self.is_near(**sample));
        let count = near().count() as f64;
        let mean = |value: fn(&Sample) -> f64| near().map(value).sum::<f64>() / count;
        let (mean_frames, mean_s) = (mean(|sample| sample.frames), mean(|sample| sample.time_s));
        let (mut squares, mut products) = (0.0, 0.0);
        for sample in near() {
            let frames = sample.frames - mean_frames;
            squares += frames * frames;
            products += frames * (sample.time_s - mean_s);
        }
        let period_s = products / squares;
        // NaN, of no rows or of a single frame, is no period.
        (period_s > 0.0).then_some(Self { offset_s: mean_s - period_s * mean_frames, period_s })
    }
}

impl Ticks {
    /// Fits a clock to rows. Returns `None` if too many rows are not near it.
    fn of(rows: &[Row]) -> Option<Self> {
        let first = rows.iter().min_by_key(|row| (row.frame, row.time))?;
        if rows.len() < LEAST_ROWS || rows.iter().any(|row| row.origin != first.origin) {
            return None;
        }
        let sample =
            |row: &Row| Sample { frames: (row.frame - first.frame) as f64, time_s: (row.time - first.time).s() };
        let mut samples: Vec<Sample> = rows.iter().map(sample).collect();
        samples.sort_by(|a, b| a.frames.total_cmp(&b.frames).then(a.time_s.total_cmp(&b.time_s)));
        let mut line = Line::through(&samples)?;
        for _ in 0..REFINEMENTS {
            line = line.refined(&samples)?;
        }
        let near = samples.iter().filter(|sample| line.is_near(**sample)).count();
        let time = first.time + Time::from_s(line.offset_s);
        let is_near_zero = time.s().abs() <= line.near_s();
        let shift = if is_near_zero || time < Time::ZERO { Time::ZERO - time } else { Time::ZERO };
        let is_clock = near as f64 >= LEAST_NEAR * samples.len() as f64;
        is_clock.then_some(Self { frame: first.frame, time, period_s: line.period_s, shift })
    }

    /// Returns the clock of the ticks in a file whose rows follow as in `clock`.
    pub(super) fn clock(&self, clock: FrameClock) -> FrameClock {
        FrameClock { period: Time::from_s(self.period_s * clock.frames as f64), ..clock }
    }

    /// Replaces a time near its tick by the tick.
    pub(super) fn snap(&self, row: &mut Row) {
        let tick = self.time + Time::from_s(self.period_s * (row.frame - self.frame) as f64);
        let near_s = NEAR_S.min(NEAR_SHARE * self.period_s);
        if (row.time - tick).s().abs() <= near_s {
            row.time = tick + self.shift;
        }
    }
}

/// Returns the ticks that replace the times of a file with these rows, or `None` if its times are even
/// without them, or no more even with them.
///
/// # Errors
/// The times follow no clock.
pub(super) fn ticks(rows: &[Row], clock: FrameClock) -> Result<Option<Ticks>, ReadError> {
    if is_exact(rows, clock) {
        return Ok(None);
    }
    let before = Unevenness::of(rows, clock);
    if before.errors == 0 {
        return Ok(None);
    }
    let Some(ticks) = Ticks::of(rows) else { return before.judge(None) };
    let mut snapped = rows.to_vec();
    snapped.iter_mut().for_each(|row| ticks.snap(row));
    let after = Unevenness::of(&snapped, ticks.clock(clock));
    if after.errors < before.errors { after.judge(Some(ticks)) } else { before.judge(None) }
}

/// Returns true if all times lie on a line through the first row.
fn is_exact(rows: &[Row], clock: FrameClock) -> bool {
    let Some(first) = rows.first() else { return true };
    let frame_s = clock.period.s() / clock.frames as f64;
    rows.iter().all(|row| {
        let needed_s = frame_s * (row.frame - first.frame) as f64;
        row.origin == first.origin && ((row.time - first.time).s() - needed_s).abs() <= EXACT_SHARE * clock.period.s()
    })
}

/// The steps between rows that contradict their numbers of frames.
#[derive(Default)]
struct Unevenness {
    steps: usize,
    errors: usize,
    first: Option<ReadError>,
}

impl Unevenness {
    fn of(rows: &[Row], clock: FrameClock) -> Self {
        let mut sorted: Vec<&Row> = rows.iter().collect();
        sorted.sort_by_key(|row| (row.number, row.origin, row.time, row.frame, row.line));
        let mut all = Self::default();
        for pair in sorted.windows(2) {
            let [before, row] = pair else { continue };
            if (before.number, before.origin) != (row.number, row.origin) {
                continue;
            }
            all.steps += 1;
            if let Err(error) = step(before, row, clock)
                && matches!(error.problem, TrajectoryFileProblem::UnevenTime { .. })
            {
                all.errors += 1;
                if all.first.as_ref().is_none_or(|first| error.line < first.line) {
                    all.first = Some(error);
                }
            }
        }
        all
    }

    /// Returns the ticks, or an error if too many steps are uneven in spite of them.
    fn judge(self, ticks: Option<Ticks>) -> Result<Option<Ticks>, ReadError> {
        let Self { steps, errors, first } = self;
        match first {
            Some(ReadError { line, column, problem })
                if errors >= LEAST_UNEVEN && errors as f64 > IRREGULAR_SHARE * steps as f64 =>
            {
                let problem = TrajectoryFileProblem::IrregularClock { first: Box::new(problem), uneven: errors, steps };
                Err(ReadError { line, column, problem })
            }
            _ => Ok(ticks),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use crate::trajectory_data::{ReadOptions, TrajectoryData, TrajectoryFileProblem, open_from};

    const HEADER: &str = "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n";

    /// Reads three vehicles over 200 frames, whose times `written` gives as text.
    fn read(written: impl Fn(i32) -> String) -> Result<TrajectoryData, TrajectoryFileProblem> {
        let mut text = HEADER.to_owned();
        for track in 1..=3 {
            for frame in 0..200 {
                let (time_s, s_m) = (written(frame), 60.0 * f64::from(track) + f64::from(frame));
                writeln!(text, "{track},{frame},{time_s},{s_m},1.8,1,30,0,4.5,1.8,car").unwrap();
            }
        }
        let tracks = open_from(text.as_bytes(), Path::new("a.csv"), ReadOptions::default(), usize::MAX);
        tracks.and_then(|tracks| tracks.collect_all()).map_err(|error| error.problem)
    }

    /// A number between -1 and 1 that looks random.
    fn noise(frame: i32) -> f64 {
        closecall_traffic::maths::sin(f64::from(frame) * 12.9898)
    }

    #[test]
    fn times_that_are_rounded_or_jitter_are_read_as_ticks() {
        let rates: [(f64, usize); 4] = [(30.0, 3), (29.97, 3), (30.0, 2), (24.0, 2)];
        for (rate_hz, digits) in rates {
            let data = read(|frame| format!("{:.digits$}", f64::from(frame) / rate_hz)).unwrap();
            let off_s = (data.period.s() - 1.0 / rate_hz).abs();
            assert!(off_s < 1e-5 && data.trajectories.len() == 3, "{rate_hz} Hz, {digits} digits: {off_s} s");
            let points = &data.trajectories[0].points;
            let off_ns = points.windows(2).map(|pair| (pair[1].time - pair[0].time - data.period).ns().abs()).max();
            // Steps that differ by less than 2 % stay as they are written.
            assert!(off_ns.unwrap() * 50 <= data.period.ns(), "{rate_hz} Hz, {digits} digits: {off_ns:?} ns");
        }
        for jitter_s in [0.001, 0.003, 0.005] {
            let data = read(|frame| format!("{:.6}", 5.0 + f64::from(frame) / 30.0 + jitter_s * noise(frame))).unwrap();
            assert_eq!((data.trajectories.len(), data.trajectories[0].points.len()), (3, 200), "{jitter_s} s");
        }
    }

    #[test]
    fn exact_times_stay_as_they_are() {
        let data = read(|frame| format!("{:.4}", f64::from(frame) / 30.0)).unwrap();
        assert_eq!(data.trajectories[0].points[1].time.ns(), 33_300_000);
    }

    #[test]
    fn frames_that_are_missing_or_doubled_and_mixed_steps_are_found() {
        // From frame 100 on, and near the end, the times are a whole step late or early.
        for from in [100, 195] {
            for steps in [1.0, -1.0, 3.0] {
                let late_s = |frame: i32| if frame >= from { steps / 30.0 } else { 0.0 };
                let problem = read(|frame| format!("{:.3}", 5.0 + f64::from(frame) / 30.0 + late_s(frame)));
                assert!(problem.is_err(), "{steps} steps from frame {from}");
            }
        }
        let mixed = |frame: i32| 0.1 * f64::from(frame) + 0.1 * f64::from(frame / 2);
        let problem = read(|frame| format!("{:.1}", mixed(frame))).unwrap_err();
        assert!(matches!(problem, TrajectoryFileProblem::IrregularClock { .. }), "{problem}");
        assert!(!problem.affects_one_row());
    }
}
