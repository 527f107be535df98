//! The gradient criterion: the distances to the left and right marking jump in opposite directions.

use closecall_traffic::{Lane, Side, Time, Trajectory};

use super::crossings::Crossing;
use super::geometry::LaneGeometry;
use crate::trajectory_data::MarkingDistances;

/// Least change of a distance between two frames that counts as a jump, as a share of the lane
/// width (-).
const JUMP_SHARE: f64 = 0.5;

/// Longest time between two frames that are compared: in a longer time a vehicle can move sideways
/// by half a lane.
const LONGEST_GAP: Time = Time::from_ms(1_000);

/// Plausible lane widths (m). If the sum of both distances is outside, the markings were mistaken.
const LANE_WIDTH_M: std::ops::RangeInclusive<f64> = 2.0..=6.0;

/// One frame in which both markings were measured.
#[derive(Clone, Copy, Debug)]
struct MarkingView {
    time: Time,
    left_m: f64,
    right_m: f64,
    d_m: f64,
    lane: Lane,
}

impl MarkingView {
    fn width_m(&self) -> f64 {
        self.left_m + self.right_m
    }
}

/// Iterates over the frames of a track in which both markings were measured with a plausible lane
/// width.
fn views<'a>(track: &'a Trajectory, distances: &'a [MarkingDistances]) -> impl Iterator<Item = MarkingView> + 'a {
    track.points.iter().zip(distances).filter_map(|(point, measured)| {
        let (left_m, right_m) = measured.left_m.zip(measured.right_m)?;
        let view = MarkingView { time: point.time, left_m, right_m, d_m: point.d_m, lane: point.lane };
        LANE_WIDTH_M.contains(&view.width_m()).then_some(view)
    })
}

/// Returns a crossing for each jump of both distances in opposite directions, in order of time.
pub(super) fn jumps(track: &Trajectory, distances: &[MarkingDistances]) -> Vec<Crossing> {
    let mut crossings = Vec::new();
    let mut previous: Option<MarkingView> = None;
    for view in views(track, distances) {
        if let Some(crossing) = previous.and_then(|previous| jump(&previous, &view)) {
            crossings.push(crossing);
        }
        previous = Some(view);
    }
    crossings
}

/// Returns the crossing between two frames, or `None` if the distances do not jump.
fn jump(before: &MarkingView, after: &MarkingView) -> Option<Crossing> {
    let least_m = JUMP_SHARE * before.width_m();
    let (left_m, right_m) = (after.left_m - before.left_m, after.right_m - before.right_m);
    let direction = match (left_m >= least_m, right_m <= -least_m, left_m <= -least_m, right_m >= least_m) {
        (true, true, ..) => Side::Left,
        (.., true, true) => Side::Right,
        _ => return None,
    };
    let is_near = after.time - before.time <= LONGEST_GAP;
    let to = if before.lane == after.lane { super::detect::beside(before.lane, direction) } else { after.lane };
    is_near.then_some(Crossing { time: after.time, from: before.lane, to })
}

/// Returns the median lane width (m), or `None` if both markings were never measured together.
pub(super) fn lane_width_m(track: &Trajectory, distances: &[MarkingDistances]) -> Option<f64> {
    let mut widths: Vec<f64> = views(track, distances).map(|view| view.width_m()).collect();
    widths.sort_by(f64::total_cmp);
    widths.get(widths.len() / 2).copied()
}

/// Returns, for each point of a smoothed track, the lane according to the distances in the frame
/// nearest in time.
///
/// An entry is `None` if that frame is more than half of `period` away.
pub(super) fn measured_lanes(
    track: &Trajectory,
    distances: &[MarkingDistances],
    smoothed: &Trajectory,
    period: Time,
) -> Vec<Option<LaneGeometry>> {
    let views: Vec<MarkingView> = views(track, distances).collect();
    let mut nearest = 0;
    let lane_at = |time: Time| {
        let away = |view: &MarkingView| (view.time - time).ns().abs();
        while nearest + 1 < views.len() && away(&views[nearest + 1]) <= away(&views[nearest]) {
            nearest += 1;
        }
        let view = views.get(nearest).filter(|view| 2 * away(view) <= period.ns())?;
        // Half the difference of both distances is the displacement of the vehicle to the left of
        // the lane's centre.
        let centre_m = view.d_m - 0.5 * (view.right_m - view.left_m);
        Some(LaneGeometry { lane: view.lane, centre_m, width_m: view.width_m() })
    };
    smoothed.points.iter().map(|point| point.time).map(lane_at).collect()
}
