//! Peaks of the lateral speed as manoeuvres.

use closecall_traffic::{Side, Time, Trajectory, TrajectoryPoint};

use super::peaks::{find_peaks, peak_at, peak_width};
use crate::filters::PERIOD;

/// A peak of lateral speed needs this prominence [m/s]; see the module's documentation.
pub const MIN_PROMINENCE_MPS: f64 = 0.15;

/// A complete lane change shifts the vehicle by at least this [m]: most of a lane, but a vehicle need not end in its middle.
pub const MIN_SHIFT_M: f64 = 2.5;

/// A peak of lateral speed, in fractional samples of its track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Manoeuvre {
    pub(super) direction: Side,
    pub(super) peak_mps: f64,
    pub(super) width: f64,
    pub(super) start: f64,
    pub(super) end: f64,
}

/// Share of a quintic lane change's duration that its peak of lateral speed is wide, measured at the share
/// `height_share` of the peak: √(1 − √h).
pub fn quintic_width_share(height_share: f64) -> f64 {
    (1.0 - height_share.sqrt()).sqrt()
}

/// h = (w_vehicle / w_lane) / 2, the height at which widths are measured as a share of the peak.
pub(super) fn height_share(track: &Trajectory, lane_width_m: f64) -> f64 {
    0.5 * (track.dimensions.width_m / lane_width_m).min(1.0)
}

/// The manoeuvres of a track, those to the left first.
pub(super) fn manoeuvres(track: &Trajectory, lane_width_m: f64) -> Vec<Manoeuvre> {
    let height_share = height_share(track, lane_width_m);
    let mut found = manoeuvres_to(track, Side::Left, height_share);
    found.extend(manoeuvres_to(track, Side::Right, height_share));
    found
}

fn manoeuvres_to(track: &Trajectory, direction: Side, height_share: f64) -> Vec<Manoeuvre> {
    let sign = sign(direction);
    // Rest before and after the track makes peaks of manoeuvres that the recording cuts at their fastest.
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

/// +1 to the left, where lateral positions grow.
pub(super) const fn sign(direction: Side) -> f64 {
    match direction {
        Side::Left => 1.0,
        Side::Right => -1.0,
    }
}

/// A track on the common clock, looked at by fractional samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampled<'a> {
    pub(super) track: &'a Trajectory,
}

impl<'a> Sampled<'a> {
    /// Nothing for a track without points.
    pub(super) fn new(track: &'a Trajectory) -> Option<Self> {
        (!track.points.is_empty()).then_some(Self { track })
    }

    pub(super) fn last(&self) -> f64 {
        (self.track.points.len() - 1) as f64
    }

    pub(super) fn time_s(&self, sample: f64) -> f64 {
        self.track.points[0].time.s() + sample * PERIOD.s()
    }

    pub(super) fn sample(&self, time: Time) -> f64 {
        (time - self.track.points[0].time).s() / PERIOD.s()
    }

    /// The whole sample at or below `sample`, within the track.
    pub(super) fn place(&self, sample: f64) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the track's samples")]
        let place = sample.clamp(0.0, self.last()) as usize;
        place
    }

    pub(super) fn point(&self, sample: f64) -> &'a TrajectoryPoint {
        &self.track.points[self.place(sample)]
    }

    /// Shift towards `direction` between two samples, as far as recorded [m].
    pub(super) fn shift_m(&self, direction: Side, [start, end]: [f64; 2]) -> f64 {
        sign(direction) * (self.point(end.ceil()).d_m - self.point(start.floor()).d_m)
    }

    /// The first sample at which the share `share` of the shift between two samples is done.
    pub(super) fn sample_of_share(&self, share: f64, [start, end]: [f64; 2]) -> f64 {
        let (first, last) = (self.place(start.floor()), self.place(end.ceil()));
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
    fn the_published_share_of_a_quintic_path() {
        assert!((quintic_width_share(0.5 * 1.85 / 3.75) - 0.71).abs() < 0.005);
    }
}
