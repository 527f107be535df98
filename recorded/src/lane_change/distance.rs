//! The distance criterion: a lane change is the transition from one kept lane to another.

use closecall_traffic::{Lane, Side, Trajectory};

use super::LaneChange;
use super::dwell::MIN_DWELL;
use super::geometry::LaneGeometry;
use super::manoeuvre::{MIN_SHIFT_M, Sampled, sign};
use crate::filters::PERIOD;

/// Time by which the lateral shift is measured before the start and after the end, to include the
/// slow parts of the manoeuvre (samples): 1.5 s.
const SETTLED_SAMPLES: f64 = 7.5;

/// Consecutive samples within the band of one lane.
struct LaneRun {
    lane: Lane,
    first: usize,
    last: usize,
}

/// Detects the lane changes of a smoothed track; `lane_at` returns the lane that contains a sample.
pub(super) fn by_distance(track: &Trajectory, lane_at: impl Fn(usize) -> Option<LaneGeometry>) -> Vec<LaneChange> {
    let Some(sampled) = Sampled::new(track) else { return Vec::new() };
    let kept = kept_lanes(track, &lane_at);
    let changes = kept.windows(2).filter(|pair| pair[0].lane != pair[1].lane);
    changes.flat_map(|pair| lane_changes(&sampled, &pair[0], &pair[1], &lane_at)).collect()
}

/// Returns the lanes that the vehicle keeps for at least [`MIN_DWELL`], in order of time.
/// Successive runs in the same lane are joined.
fn kept_lanes(track: &Trajectory, lane_at: &impl Fn(usize) -> Option<LaneGeometry>) -> Vec<LaneRun> {
    let in_band = |k: usize| {
        let position = lane_at(k)?;
        let band_m = 0.5 * (position.width_m - track.dimensions.width_m).max(0.0);
        ((track.points[k].d_m - position.centre_m).abs() <= band_m).then_some(position.lane)
    };
    let mut runs: Vec<LaneRun> = Vec::new();
    let mut previous = None;
    for k in 0..track.points.len() {
        let lane = in_band(k);
        match (lane, runs.last_mut()) {
            (Some(lane), Some(run)) if previous == Some(lane) => {
                debug_assert_eq!(run.lane, lane);
                run.last = k;
            }
            (Some(lane), _) => runs.push(LaneRun { lane, first: k, last: k }),
            (None, _) => {}
        }
        previous = lane;
    }
    let mut kept: Vec<LaneRun> = Vec::new();
    for run in runs.into_iter().filter(|run| PERIOD * (run.last - run.first + 1) as i64 >= MIN_DWELL) {
        match kept.last_mut() {
            Some(last) if last.lane == run.lane => last.last = run.last,
            _ => kept.push(run),
        }
    }
    kept
}

/// Returns the lane changes between two kept lanes: one for each marking between them.
fn lane_changes(
    sampled: &Sampled<'_>,
    before: &LaneRun,
    after: &LaneRun,
    lane_at: &impl Fn(usize) -> Option<LaneGeometry>,
) -> Vec<LaneChange> {
    let direction = if after.lane < before.lane { Side::Left } else { Side::Right };
    let markings = before.lane.0.abs_diff(after.lane.0);
    let beyond = |lane: Lane, passed: u8| match direction {
        Side::Left => lane.0 <= before.lane.0 - passed,
        Side::Right => lane.0 >= before.lane.0 + passed,
    };
    let crossing = |passed: u8| {
        let within = (before.last + 1)..=after.first;
        within
            .into_iter()
            .find(|&k| lane_at(k).is_some_and(|position| beyond(position.lane, passed)))
            .unwrap_or(after.first)
    };
    let step = |passed: u8| match direction {
        Side::Left => before.lane.0 - passed,
        Side::Right => before.lane.0 + passed,
    };
    let change = |passed: u8| LaneChange {
        from_lane: step(passed - 1),
        to_lane: step(passed),
        ..lane_change(sampled, direction, &Samples { start: before.last, crossing: crossing(passed), end: after.first })
    };
    (1..=markings).map(change).collect()
}

/// The samples of a track at which a lane change starts, crosses the marking and ends.
struct Samples {
    start: usize,
    crossing: usize,
    end: usize,
}

fn lane_change(sampled: &Sampled<'_>, direction: Side, samples: &Samples) -> LaneChange {
    let &Samples { start, crossing, end } = samples;
    let track = sampled.track;
    let span = [start as f64, end as f64];
    let settled = [span[0] - SETTLED_SAMPLES, span[1] + SETTLED_SAMPLES];
    let lateral_shift_m = sampled.shift_m(direction, settled);
    let duration_s = (span[1] - span[0]) * PERIOD.s();
    let speeds = track.points[start..=end].iter().map(|point| sign(direction) * point.lateral_speed_mps);
    LaneChange {
        track_id: track.track_id,
        vehicle_id: track.vehicle_id,
        vehicle_class: track.class,
        direction,
        from_lane: 0,
        to_lane: 0,
        start_s: sampled.time_s(span[0]),
        midpoint_s: sampled.time_s(sampled.sample_of_share(0.5, span)),
        crossing_s: sampled.time_s(crossing as f64),
        end_s: sampled.time_s(span[1]),
        duration_s,
        width_s: duration_s,
        speed_mps: track.points[crossing].speed_mps,
        peak_speed_mps: sampled.peak_speed_mps(direction, span),
        peak_lateral_speed_mps: speeds.fold(f64::NEG_INFINITY, f64::max),
        lateral_shift_m,
        overlapping: false,
        double: false,
        complete: settled[0] >= 0.0 && settled[1] <= sampled.last() && lateral_shift_m >= MIN_SHIFT_M,
    }
}
