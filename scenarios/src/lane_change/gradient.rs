//! The gradient criterion: both marking distances jump against each other.

use closecall_traffic::{Lane, Side, Time, Trajectory};

use super::crossings::Crossing;
use super::geometry::LanePlace;
use crate::recordings::MarkingDistances;

/// A distance jumps where it changes by at least this share of the lane's width between two frames.
const JUMP_SHARE: f64 = 0.5;

/// Frames further apart than this are not compared: a vehicle moves half a lane aside in it.
const LONGEST_GAP: Time = Time::from_ms(1_000);

/// Widths that lanes have [m]; other sums of both distances are those of mistaken markings.
const LANE_WIDTH_M: std::ops::RangeInclusive<f64> = 2.0..=6.0;

/// One frame with both markings in view.
#[derive(Clone, Copy, Debug)]
struct View {
    time: Time,
    left_m: f64,
    right_m: f64,
    d_m: f64,
    lane: Lane,
}

impl View {
    fn width_m(&self) -> f64 {
        self.left_m + self.right_m
    }
}

fn views<'a>(track: &'a Trajectory, seen: &'a [MarkingDistances]) -> impl Iterator<Item = View> + 'a {
    track.points.iter().zip(seen).filter_map(|(point, seen)| {
        let (left_m, right_m) = seen.left_m.zip(seen.right_m)?;
        let view = View { time: point.time, left_m, right_m, d_m: point.d_m, lane: point.lane };
        LANE_WIDTH_M.contains(&view.width_m()).then_some(view)
    })
}

/// The jumps of both distances against each other, in the order of time.
pub(super) fn jumps(track: &Trajectory, seen: &[MarkingDistances]) -> Vec<Crossing> {
    let mut found = Vec::new();
    let mut before: Option<View> = None;
    for view in views(track, seen) {
        if let Some(crossing) = before.and_then(|before| jump(&before, &view)) {
            found.push(crossing);
        }
        before = Some(view);
    }
    found
}

fn jump(before: &View, after: &View) -> Option<Crossing> {
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

/// The median width of the lane, where both markings are seen at all [m].
pub(super) fn lane_width_m(track: &Trajectory, seen: &[MarkingDistances]) -> Option<f64> {
    let mut widths: Vec<f64> = views(track, seen).map(|view| view.width_m()).collect();
    widths.sort_by(f64::total_cmp);
    widths.get(widths.len() / 2).copied()
}

/// For each point of a smoothed track, the lane that the distances told in the frame nearest to it, up to half of
/// `period` away.
pub(super) fn lane_places(
    track: &Trajectory,
    seen: &[MarkingDistances],
    smoothed: &Trajectory,
    period: Time,
) -> Vec<Option<LanePlace>> {
    let views: Vec<View> = views(track, seen).collect();
    let mut nearest = 0;
    let place = |time: Time| {
        let away = |view: &View| (view.time - time).ns().abs();
        while nearest + 1 < views.len() && away(&views[nearest + 1]) <= away(&views[nearest]) {
            nearest += 1;
        }
        let view = views.get(nearest).filter(|view| 2 * away(view) <= period.ns())?;
        // Half the difference of both distances is how far the vehicle is to the left of the lane's centre.
        let centre_m = view.d_m - 0.5 * (view.right_m - view.left_m);
        Some(LanePlace { lane: view.lane, centre_m, width_m: view.width_m() })
    };
    smoothed.points.iter().map(|point| point.time).map(place).collect()
}
