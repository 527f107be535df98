//! Lateral manoeuvres, as peaks of the lateral speed.

use closecall_traffic::{Side, Time, Trajectory, TrajectoryPoint};

use super::peaks::{find_peaks, peak_at, peak_width};
use crate::filters::PERIOD;

/// Least prominence of a peak of lateral speed (m/s); see the module documentation.
pub const MIN_PROMINENCE_MPS: f64 = 0.15;

/// Least lateral shift of a complete lane change (m): most of a lane, because a vehicle need not
/// end at the lane's centre.
pub const MIN_SHIFT_M: f64 = 2.5;

/// A lateral manoeuvre: a peak of lateral speed, in fractional samples of its track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Manoeuvre {
    /// Direction of the movement.
    pub(super) direction: Side,
    /// Lateral speed at the peak (m/s).
    pub(super) peak_mps: f64,
    /// Width of the peak (samples).
    pub(super) width: f64,
    /// Estimated start; it may lie before the track (samples).
    pub(super) start: f64,
    /// Estimated end; it may lie after the track (samples).
    pub(super) end: f64,
}

/// Returns the width of the peak of lateral speed of a quintic lane change, as a share of its
/// duration (-): √(1 − √h).
///
/// The width is measured at the height h = `height_share`, as a share of the peak (-).
pub fn quintic_width_share(height_share: f64) -> f64 {
    (1.0 - height_share.sqrt()).sqrt()
}

/// Returns the height at which the width of a peak is measured: h = (w_vehicle / w_lane) / 2, a
/// share of the peak (-).
pub(super) fn height_share(track: &Trajectory, lane_width_m: f64) -> f64 {
    0.5 * (track.dimensions.width_m / lane_width_m).min(1.0)
}

/// Returns the manoeuvres of a track, those to the left first.
pub(super) fn manoeuvres(track: &Trajectory, lane_width_m: f64) -> Vec<Manoeuvre> {
    let height_share = height_share(track, lane_width_m);
    let mut both_sides = manoeuvres_to(track, Side::Left, height_share);
    both_sides.extend(manoeuvres_to(track, Side::Right, height_share));
    both_sides
}

fn manoeuvres_to(track: &Trajectory, direction: Side, height_share: f64) -> Vec<Manoeuvre> {
    let sign = sign(direction);
    // A lateral speed of 0 before and after the track turns its end into a peak if the manoeuvre is
    // cut off there.
    let mut speeds = Vec::with_capacity(track.points.len() + 2);
    speeds.push(0.0);
    speeds.extend(track.points.iter().map(|point| sign * point.lateral_speed_mps));
    speeds.push(0.0);
    let peaks = find_peaks(&speeds, MIN_PROMINENCE_MPS);
    speeds.iter_mut().for_each(|speed| *speed = speed.max(0.0));
    let manoeuvre = |peak: super::Peak| {
        let cut = peak_width(&speeds, &peak_at(&speeds, peak.index), 1.0 - height_share);
        let (left, right) = (cut.left - 1.0, cut.right - 1.0);
        let width = right - left;
        let beyond = 0.5 * (width / quintic_width_share(height_share) - width);
        Manoeuvre { direction, peak_mps: peak.height, width, start: left - beyond, end: right + beyond }
    };
    peaks.into_iter().filter(|peak| peak.height > 0.0).map(manoeuvre).collect()
}

/// Joins the manoeuvres in one direction that overlap in time: a slow lane change with a pause has
/// several peaks.
pub(super) fn sweeps(mut manoeuvres: Vec<Manoeuvre>) -> Vec<Manoeuvre> {
    manoeuvres.sort_by(|a, b| {
        (a.direction == Side::Right).cmp(&(b.direction == Side::Right)).then(a.start.total_cmp(&b.start))
    });
    let mut joined: Vec<Manoeuvre> = Vec::with_capacity(manoeuvres.len());
    for next in manoeuvres {
        match joined.last_mut() {
            Some(sweep) if sweep.direction == next.direction && next.start < sweep.end => {
                // The slow ends of the first and the last peak stay as they are.
                let ends = 0.5 * ((sweep.end - sweep.start - sweep.width) + (next.end - next.start - next.width));
                sweep.end = sweep.end.max(next.end);
                sweep.width = sweep.end - sweep.start - ends;
                sweep.peak_mps = sweep.peak_mps.max(next.peak_mps);
            }
            _ => joined.push(next),
        }
    }
    joined
}

/// Returns +1 to the left, where lateral positions increase, and −1 to the right.
pub(super) const fn sign(direction: Side) -> f64 {
    match direction {
        Side::Left => 1.0,
        Side::Right => -1.0,
    }
}

/// A track on the common clock, addressed by fractional samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampled<'a> {
    pub(super) track: &'a Trajectory,
}

impl<'a> Sampled<'a> {
    /// Returns `None` if the track has no points.
    pub(super) fn new(track: &'a Trajectory) -> Option<Self> {
        (!track.points.is_empty()).then_some(Self { track })
    }

    /// Returns the last sample.
    pub(super) fn last(&self) -> f64 {
        (self.track.points.len() - 1) as f64
    }

    /// Returns the time of a sample (s).
    pub(super) fn time_s(&self, sample: f64) -> f64 {
        self.track.points[0].time.s() + sample * PERIOD.s()
    }

    /// Returns the sample at `time`.
    pub(super) fn sample(&self, time: Time) -> f64 {
        (time - self.track.points[0].time).s() / PERIOD.s()
    }

    /// Returns the index of the point at or before `sample`, clamped to the track.
    pub(super) fn index(&self, sample: f64) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the track's samples")]
        let index = sample.clamp(0.0, self.last()) as usize;
        index
    }

    /// Returns the point at or before `sample`, clamped to the track.
    pub(super) fn point(&self, sample: f64) -> &'a TrajectoryPoint {
        &self.track.points[self.index(sample)]
    }

    /// Returns the recorded lateral shift towards `direction` between two samples (m).
    pub(super) fn shift_m(&self, direction: Side, [start, end]: [f64; 2]) -> f64 {
        sign(direction) * (self.point(end.ceil()).d_m - self.point(start.floor()).d_m)
    }

    /// Returns the speed along the road at the largest lateral speed towards `direction` between
    /// two samples (m/s). Of two equal manoeuvres the earlier counts.
    pub(super) fn peak_speed_mps(&self, direction: Side, [start, end]: [f64; 2]) -> f64 {
        let points = &self.track.points[self.index(start.floor())..=self.index(end.ceil())];
        let lateral = |point: &TrajectoryPoint| sign(direction) * point.lateral_speed_mps;
        points.iter().rev().max_by(|a, b| lateral(a).total_cmp(&lateral(b))).map_or(0.0, |point| point.speed_mps)
    }

    /// Returns the first sample at which the given share of the lateral shift between two samples
    /// is done.
    pub(super) fn sample_of_share(&self, share: f64, [start, end]: [f64; 2]) -> f64 {
        let (first, last) = (self.index(start.floor()), self.index(end.ceil()));
        let points = &self.track.points[first..=last];
        let (from_m, to_m) = (points[0].d_m, points[points.len() - 1].d_m);
        let level_m = from_m + share * (to_m - from_m);
        let towards = (to_m - from_m).signum();
        let passed = points.windows(2).position(|pair| towards * (pair[1].d_m - level_m) >= 0.0);
        let Some(before) = passed else { return last as f64 };
        let step_m = points[before + 1].d_m - points[before].d_m;
        let within = if step_m == 0.0 { 0.0 } else { ((level_m - points[before].d_m) / step_m).clamp(0.0, 1.0) };
        (first + before) as f64 + within
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_width_share_of_a_quintic_path_matches_the_published_value() {
        assert!((quintic_width_share(0.5 * 1.85 / 3.75) - 0.71).abs() < 0.005);
    }
}
