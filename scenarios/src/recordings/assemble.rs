//! Rows in any order to tracks without gaps.

use std::collections::BTreeMap;

use closecall_traffic::{Dimensions, Lane, Time, Trajectory, TrajectoryPoint, VehicleClass};

use super::{RecordingProblem, ngsim};

/// Whether frame numbers may start again within one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clock {
    /// One count of frames for the whole file.
    Continuous,
    /// Original NGSIM files put one behind the other: vehicle and frame numbers recur at later times.
    MayRestart,
}

/// One vehicle at one frame, in SI units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Rows of the same number and origin belong to one track, before it is split at gaps.
    pub(super) number: u64,
    /// Time of frame 0, where it tells apart several recordings in one file; zero where it does not.
    pub(super) origin: Time,
    pub(super) vehicle_id: u64,
    pub(super) frame: i64,
    pub(super) time: Time,
    pub(super) clock: Clock,
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) lane: u8,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: Option<f64>,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) class: VehicleClass,
    pub(super) line: u64,
}

/// The line to blame, and what is wrong.
pub(super) type Blame = (u64, RecordingProblem);

/// Steps of time may differ from the period by this share: files round their times.
const UNEVENNESS: f64 = 0.02;

/// Times from here on count from 1970, not from the recording's start: one day.
const EPOCH_TIMES_FROM: Time = Time::from_ms(86_400_000);

/// Recordings in one file whose times overlap are laid apart by this, so that their vehicles never meet.
const APART: Time = Time::from_ms(10_000);

/// Rows by number and origin.
#[derive(Default)]
pub(super) struct Assembly {
    groups: BTreeMap<(u64, Time), Vec<Row>>,
}

impl Assembly {
    pub(super) fn push(&mut self, row: Row) {
        self.groups.entry((row.number, row.origin)).or_default().push(row);
    }

    /// The tracks in the order of their numbers, and the time between two frames.
    pub(super) fn finish(mut self) -> Result<(Vec<Trajectory>, Time), Blame> {
        for rows in self.groups.values_mut() {
            rows.sort_by_key(|row| (row.time, row.frame, row.line));
        }
        self.lay_apart();
        let period = self.period();
        let start = self.start();
        let mut next_id = self.groups.keys().next_back().map_or(0, |(largest, _)| largest + 1);
        let mut latest = None;
        let mut tracks = Vec::with_capacity(self.groups.len());
        for ((number, _), rows) in self.groups {
            for range in pieces(&rows, period)? {
                let is_first = latest != Some(number);
                let track_id = if is_first { number } else { next_id };
                next_id += u64::from(!is_first);
                latest = Some(number);
                tracks.push(track(track_id, &rows[range], start));
            }
        }
        tracks.sort_by_key(|track| track.track_id);
        Ok((tracks, period))
    }

    /// Shifts recordings of different origin to later times, so that none overlaps the one before.
    fn lay_apart(&mut self) {
        let mut spans: BTreeMap<Time, (Time, Time)> = BTreeMap::new();
        for ((_, origin), rows) in &self.groups {
            let (Some(first), Some(last)) = (rows.first(), rows.last()) else { continue };
            let span = spans.entry(*origin).or_insert((first.time, last.time));
            *span = (span.0.min(first.time), span.1.max(last.time));
        }
        let mut shifts = BTreeMap::new();
        let mut free_from = None;
        for (origin, (first, last)) in spans {
            let shift = free_from.map_or(Time::ZERO, |from: Time| (from - first).max(Time::ZERO));
            free_from = Some(last + shift + APART);
            shifts.insert(origin, shift);
        }
        for ((_, origin), rows) in &mut self.groups {
            let shift = shifts.get(origin).copied().unwrap_or_default();
            rows.iter_mut().for_each(|row| row.time += shift);
        }
    }

    /// The mean step over the group with the most rows; NGSIM's, where no vehicle has two frames.
    fn period(&self) -> Time {
        let longest = self.groups.values().rev().max_by_key(|rows| rows.len());
        let Some([first, .., last]) = longest.map(Vec::as_slice) else { return ngsim::PERIOD };
        let frames = last.frame - first.frame;
        let step_ns = if frames > 0 { (last.time - first.time).ns() / frames } else { 0 };
        if first.clock == Clock::MayRestart || step_ns <= 0 { ngsim::PERIOD } else { Time::from_ns(step_ns) }
    }

    /// What is taken off all times.
    fn start(&self) -> Time {
        let earliest = self.groups.values().filter_map(|rows| Some(rows.first()?.time)).min();
        earliest.filter(|time| *time >= EPOCH_TIMES_FROM).unwrap_or(Time::ZERO)
    }
}

/// Splits sorted rows where frames are missing.
fn pieces(rows: &[Row], period: Time) -> Result<Vec<std::ops::Range<usize>>, Blame> {
    let mut pieces = Vec::new();
    let mut start = 0;
    for (k, pair) in rows.windows(2).enumerate() {
        let [before, row] = pair else { continue };
        if is_gap(before, row, period)? {
            pieces.push(start..k + 1);
            start = k + 1;
        }
    }
    pieces.push(start..rows.len());
    Ok(pieces)
}

/// True where at least one frame is missing between two rows that follow each other in time.
fn is_gap(before: &Row, row: &Row, period: Time) -> Result<bool, Blame> {
    let (later, earlier) = if row.line > before.line { (row, before) } else { (before, row) };
    let (frames, step) = (row.frame - before.frame, row.time - before.time);
    if frames == 0 && (step == Time::ZERO || row.clock == Clock::Continuous) {
        let problem =
            RecordingProblem::DuplicateRow { vehicle: row.number, frame: row.frame, first_line: earlier.line };
        return Err((later.line, problem));
    }
    let is_near = |count: i64| ((step - period * count).ns().abs() as f64) <= UNEVENNESS * period.ns() as f64;
    if frames >= 1 && is_near(frames) {
        return Ok(frames > 1);
    }
    if row.clock == Clock::MayRestart && step > period && !is_near(1) {
        return Ok(true);
    }
    let problem = RecordingProblem::UnevenTime {
        vehicle: row.number,
        frame_before: before.frame,
        line_before: before.line,
        frame: row.frame,
        step_s: step.s(),
        needed_s: (period * frames).s(),
    };
    Err((row.line, problem))
}

fn track(track_id: u64, rows: &[Row], start: Time) -> Trajectory {
    let first = &rows[0];
    let height_m = first.class.typical_dimensions().height_m;
    let speed = |row: &Row| row.speed_mps;
    let lateral_speeds: Vec<f64> = (0..rows.len()).map(|k| slope(rows, k, |row| row.d_m)).collect();
    let point = |(k, row): (usize, &Row)| TrajectoryPoint {
        time: row.time - start,
        s_m: row.s_m,
        d_m: row.d_m,
        speed_mps: row.speed_mps,
        acceleration_mps2: row.acceleration_mps2.unwrap_or_else(|| slope(rows, k, speed)),
        lateral_speed_mps: lateral_speeds[k],
        lateral_acceleration_mps2: slope_of(rows, k, |k| lateral_speeds[k]),
        lane: Lane(row.lane),
    };
    Trajectory {
        track_id,
        vehicle_id: first.vehicle_id,
        class: first.class,
        dimensions: Dimensions { length_m: first.length_m, width_m: first.width_m, height_m },
        points: rows.iter().enumerate().map(point).collect(),
    }
}

/// The derivative of `value` at row `k` by central differences, one-sided at both ends.
fn slope(rows: &[Row], k: usize, value: impl Fn(&Row) -> f64) -> f64 {
    slope_of(rows, k, |k| value(&rows[k]))
}

fn slope_of(rows: &[Row], k: usize, value: impl Fn(usize) -> f64) -> f64 {
    let (left, right) = (k.saturating_sub(1), (k + 1).min(rows.len() - 1));
    if left == right {
        return 0.0;
    }
    (value(right) - value(left)) / (rows[right].time - rows[left].time).s()
}
