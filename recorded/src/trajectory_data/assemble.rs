//! Assembly of consecutive rows into gapless tracks.

use closecall_traffic::{Dimensions, Lane, Time, Trajectory, TrajectoryPoint};

use super::continuity::{FrameClock, is_jump};
use super::data::RecordedTrack;
use super::error::TrajectoryFileProblem;
use super::source::{Clock, ReadError, Row};

/// Permitted deviation of a time step, as a share of the period. Files round their times.
const UNEVENNESS: f64 = 0.02;

/// The relation between two consecutive rows of one vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// The second row is the next frame.
    Next,
    /// At least one frame is missing between the rows.
    Gap,
}

/// Determines whether `row` is the next frame after `before`. `row` is the later one in time.
///
/// # Errors
/// Fails if both rows describe the same instant, or if time and frame number disagree.
pub(super) fn step(before: &Row, row: &Row, clock: FrameClock) -> Result<Step, ReadError> {
    let period = clock.period;
    let (later, earlier) = if row.line > before.line { (row, before) } else { (before, row) };
    let (frames, step) = (row.frame - before.frame, row.time - before.time);
    if frames == 0 && (step == Time::ZERO || row.clock != Clock::MayRestart) {
        let (vehicle, frame, first_line) = (row.number, row.frame, earlier.line);
        let problem = if is_jump(before, row) {
            TrajectoryFileProblem::SharedNumber { vehicle, frame, first_line }
        } else {
            TrajectoryFileProblem::DuplicateRow { vehicle, frame, first_line }
        };
        return Err(ReadError::new(later.line, problem));
    }
    let needed_ns = period.ns().saturating_mul(frames) / clock.frames;
    let is_near =
        |needed_ns: i64| step.ns().saturating_sub(needed_ns).unsigned_abs() as f64 <= UNEVENNESS * period.ns() as f64;
    if frames >= 1 && is_near(needed_ns) {
        return Ok(if frames == clock.frames { Step::Next } else { Step::Gap });
    }
    if row.clock == Clock::MayRestart && step > period && !is_near(period.ns()) {
        return Ok(Step::Gap);
    }
    let problem = TrajectoryFileProblem::UnevenTime {
        vehicle: row.number,
        frame_before: before.frame,
        line_before: before.line,
        frame: row.frame,
        step_s: step.s(),
        needed_s: Time::from_ns(needed_ns).s(),
    };
    Err(ReadError::new(row.line, problem))
}

/// Builds the track of `rows`, which follow one another without gaps. Returns `None` if there are
/// no rows.
pub(super) fn assemble_track(track_id: u64, rows: &[Row], start: Time) -> Option<RecordedTrack> {
    let first = rows.first()?;
    let height_m = first.class.typical_dimensions().height_m;
    let speed = |row: &Row| row.speed_mps;
    let lateral_speeds: Vec<f64> = (0..rows.len()).map(|k| derivative(rows, k, |row| row.d_m)).collect();
    let point = |(k, row): (usize, &Row)| TrajectoryPoint {
        time: row.time - start,
        s_m: row.s_m,
        d_m: row.d_m,
        speed_mps: row.speed_mps,
        acceleration_mps2: row.acceleration_mps2.unwrap_or_else(|| derivative(rows, k, speed)),
        lateral_speed_mps: lateral_speeds[k],
        lateral_acceleration_mps2: derivative_by_index(rows, k, |k| lateral_speeds[k]),
        lane: Lane(row.lane),
    };
    let trajectory = Trajectory {
        track_id,
        vehicle_id: first.vehicle_id,
        class: first.class,
        dimensions: Dimensions { length_m: first.length_m, width_m: first.width_m, height_m },
        points: rows.iter().enumerate().map(point).collect(),
    };
    let sees_markings = rows.iter().any(|row| row.marking_distances.is_seen());
    Some(RecordedTrack {
        trajectory,
        lines: rows.iter().map(|row| row.line).collect(),
        markings: if sees_markings { rows.iter().map(|row| row.marking_distances).collect() } else { Vec::new() },
    })
}

/// Returns the derivative of `value` at row `k`, by central differences, one-sided at both ends.
fn derivative(rows: &[Row], k: usize, value: impl Fn(&Row) -> f64) -> f64 {
    derivative_by_index(rows, k, |k| value(&rows[k]))
}

/// Works like [`derivative`], for values given by row index.
fn derivative_by_index(rows: &[Row], k: usize, value: impl Fn(usize) -> f64) -> f64 {
    let (left, right) = (k.saturating_sub(1), (k + 1).min(rows.len() - 1));
    if left == right {
        return 0.0;
    }
    (value(right) - value(left)) / (rows[right].time - rows[left].time).s()
}
