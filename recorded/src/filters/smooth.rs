//! Smoothing of whole trajectory data sets on the common clock.

use closecall_traffic::{Time, Trajectory, TrajectoryPoint};

use super::butterworth::LowPass;
use super::resample::resample;
use super::stays::{Stay, period_of, stays_of};
use crate::lane_change::LaneReliability;
use crate::trajectory_data::{LaneMarkings, TrajectoryData};

/// Period of the common clock, which runs at 5 Hz.
pub const PERIOD: Time = Time::from_ms(200);

/// Corner frequency of the low-pass filter (Hz); see the module documentation.
pub const CORNER_HZ: f64 = 1.3;

/// Time by which reflection extends a signal beyond each end (s): 9 samples of the common clock.
const PADDING_S: f64 = 1.8;

/// The smoothed track of one vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothedTrack {
    /// The movement on the common clock.
    pub trajectory: Trajectory,
    /// The lane stays, from the recorded frames.
    pub stays: Vec<Stay>,
}

/// Trajectory data on the common clock, with smoothed positions and their derivatives.
#[derive(Clone, Debug)]
pub struct SmoothedTrajectoryData {
    /// Name of the trajectory data set.
    pub name: String,
    /// Lateral positions of the lane markings.
    pub markings: LaneMarkings,
    /// Whether lane changes are found by the recorded lanes.
    pub lanes: LaneReliability,
    /// The tracks in order of their track ids, without the tracks that cover no instant of the
    /// common clock.
    pub tracks: Vec<SmoothedTrack>,
    first_tick: i64,
    present: Vec<Vec<Presence>>,
}

/// One vehicle at one instant, as indices into [`SmoothedTrajectoryData::tracks`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Presence {
    /// Index of the track.
    pub track_index: usize,
    /// Index of the point within the track.
    pub point_index: usize,
}

/// Smooths every track and resamples it to the common clock.
pub fn smooth(data: &TrajectoryData) -> SmoothedTrajectoryData {
    let tracks: Vec<_> = data.trajectories.iter().filter_map(smooth_track).collect();
    SmoothedTrajectoryData::new(&data.name, data.markings.clone(), data.lanes, tracks)
}

/// Smooths one track and resamples it to the common clock.
///
/// Returns `None` if the track covers no instant of that clock.
pub fn smooth_track(track: &Trajectory) -> Option<SmoothedTrack> {
    let points = match period_of(track) {
        None => resample(&track.points, PERIOD),
        Some(period) if period <= PERIOD => {
            let mut points = track.points.clone();
            smooth_points(&mut points, period);
            resample(&points, PERIOD)
        }
        Some(_) => {
            let mut points = resample(&track.points, PERIOD);
            smooth_points(&mut points, PERIOD);
            points
        }
    };
    let trajectory = (!points.is_empty()).then(|| track.with_points(points))?;
    Some(SmoothedTrack { trajectory, stays: stays_of(track) })
}

impl SmoothedTrajectoryData {
    /// Creates the data of `tracks`, which are in order of their track ids.
    pub(super) fn new(name: &str, markings: LaneMarkings, lanes: LaneReliability, tracks: Vec<SmoothedTrack>) -> Self {
        let (first_tick, present) = presence_by_tick(&tracks);
        Self { name: name.to_owned(), markings, lanes, tracks, first_tick, present }
    }

    /// Returns all vehicles present at the clock instant nearest to `time`, in order of their track
    /// ids.
    pub fn present_at(&self, time: Time) -> &[Presence] {
        let tick = tick_of(time) - self.first_tick;
        usize::try_from(tick).ok().and_then(|tick| self.present.get(tick)).map_or(&[], Vec::as_slice)
    }

    /// Returns the trajectory and the point that `presence` refers to.
    pub fn look_up(&self, presence: Presence) -> (&Trajectory, &TrajectoryPoint) {
        let track = &self.tracks[presence.track_index].trajectory;
        (track, &track.points[presence.point_index])
    }

    /// Iterates over the trajectories in order of their track ids.
    pub fn trajectories(&self) -> impl Iterator<Item = &Trajectory> {
        self.tracks.iter().map(|track| &track.trajectory)
    }

    /// Returns the index of track `track_id` in [`Self::tracks`], or `None` if there is no such
    /// track.
    pub fn track_index(&self, track_id: u64) -> Option<usize> {
        self.tracks.binary_search_by_key(&track_id, |track| track.trajectory.track_id).ok()
    }
}

/// Returns the number of the clock instant nearest to `time`.
fn tick_of(time: Time) -> i64 {
    (time.ns() + PERIOD.ns() / 2).div_euclid(PERIOD.ns())
}

/// Returns the first clock instant of `tracks`, and the vehicles present at each instant from then
/// on.
fn presence_by_tick(tracks: &[SmoothedTrack]) -> (i64, Vec<Vec<Presence>>) {
    let spans = tracks.iter().filter_map(|track| track.trajectory.span());
    let Some((first, last)) = spans.reduce(|(a, b), (c, d)| (a.min(c), b.max(d))) else { return (0, Vec::new()) };
    let first_tick = tick_of(first);
    let ticks = usize::try_from(tick_of(last) - first_tick).map_or(0, |ticks| ticks + 1);
    let mut counts = vec![0_usize; ticks];
    for point in tracks.iter().flat_map(|track| &track.trajectory.points) {
        if let Some(count) =
            usize::try_from(tick_of(point.time) - first_tick).ok().and_then(|tick| counts.get_mut(tick))
        {
            *count += 1;
        }
    }
    let mut present: Vec<Vec<Presence>> = counts.into_iter().map(Vec::with_capacity).collect();
    for (track_index, track) in tracks.iter().enumerate() {
        for (point_index, point) in track.trajectory.points.iter().enumerate() {
            if let Ok(tick) = usize::try_from(tick_of(point.time) - first_tick) {
                present[tick].push(Presence { track_index, point_index });
            }
        }
    }
    (first_tick, present)
}

/// Smooths, in place, points that are `period` apart, and derives their speeds and accelerations.
fn smooth_points(points: &mut [TrajectoryPoint], period: Time) {
    let rate_hz = 1.0 / period.s();
    let (Some(filter), true) = (LowPass::new(CORNER_HZ, rate_hz), points.len() > 1) else { return };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and small")]
    let padding = (PADDING_S * rate_hz).round() as usize;
    let filtered = |points: &[TrajectoryPoint], value: fn(&TrajectoryPoint) -> f64| {
        low_pass(&points.iter().map(value).collect::<Vec<_>>(), filter, padding)
    };
    let along = filtered(points, |point| point.s_m);
    let across = filtered(points, |point| point.d_m);
    let speed = filtered(points, |point| point.speed_mps);
    let acceleration = derivative(&speed, period);
    let lateral_speed = derivative(&across, period);
    let lateral_acceleration = derivative(&lateral_speed, period);
    for (k, point) in points.iter_mut().enumerate() {
        point.s_m = along[k];
        point.d_m = across[k];
        point.speed_mps = speed[k];
        point.acceleration_mps2 = acceleration[k];
        point.lateral_speed_mps = lateral_speed[k];
        point.lateral_acceleration_mps2 = lateral_acceleration[k];
    }
}

/// Filters the deviation of `values` from the chord through both ends, so that steady movement
/// passes unchanged.
fn low_pass(values: &[f64], filter: LowPass, padding: usize) -> Vec<f64> {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Vec::new() };
    let slope = (last - first) / (values.len() - 1).max(1) as f64;
    let chord = |k: usize| first + slope * k as f64;
    let residual: Vec<f64> = values.iter().enumerate().map(|(k, value)| value - chord(k)).collect();
    let filtered = filter.forwards_and_backwards(&residual, padding).into_iter().enumerate();
    filtered.map(|(k, value)| value + chord(k)).collect()
}

/// Returns the derivative with respect to time: central differences over five samples, over three
/// next to the ends, one-sided at the ends.
fn derivative(values: &[f64], period: Time) -> Vec<f64> {
    let step_s = period.s();
    let last = values.len().saturating_sub(1);
    let over_five =
        |k: usize| (8.0 * (values[k + 1] - values[k - 1]) - (values[k + 2] - values[k - 2])) / (12.0 * step_s);
    let over_three = |k: usize| {
        let (left, right) = (k.saturating_sub(1), (k + 1).min(last));
        if left == right { 0.0 } else { (values[right] - values[left]) / ((right - left) as f64 * step_s) }
    };
    (0..values.len()).map(|k| if k >= 2 && k + 2 <= last { over_five(k) } else { over_three(k) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory_data::test_support::{straight_track, trajectory_data_of};
    use closecall_traffic::maths;

    #[test]
    fn constant_speed_passes_unchanged() {
        let smoothed = smooth(&trajectory_data_of(vec![straight_track(1, 0.0, 25.0, -1.75, 80)]));
        for point in &smoothed.tracks[0].trajectory.points {
            assert!((point.speed_mps - 25.0).abs() < 1e-9 && point.acceleration_mps2.abs() < 1e-6);
            assert!(point.lateral_speed_mps.abs() < 1e-9 && (point.s_m - 25.0 * point.time.s()).abs() < 1e-6);
        }
    }

    #[test]
    fn a_vehicle_is_present_exactly_while_it_is_recorded() {
        let mut late = straight_track(2, 0.0, 20.0, -5.0, 3);
        late.points.iter_mut().for_each(|point| point.time += Time::from_s(1.0));
        let smoothed = smooth(&trajectory_data_of(vec![straight_track(1, 0.0, 25.0, -1.75, 11), late]));
        let track_ids = |s| {
            let present = smoothed.present_at(Time::from_s(s)).iter();
            present.map(|&presence| smoothed.look_up(presence).0.track_id).collect::<Vec<_>>()
        };
        assert_eq!(track_ids(0.4), [1]);
        assert_eq!(track_ids(1.0), [1, 2]);
        assert_eq!(track_ids(1.2), [2]);
        assert!(track_ids(9.0).is_empty() && track_ids(-1.0).is_empty());
    }

    #[test]
    fn the_result_does_not_depend_on_the_recorded_rate() {
        let wave = |period_ms: i64| {
            let mut track = straight_track(1, 0.0, 25.0, -1.75, 20_000 / period_ms);
            for (k, point) in (0_i64..).zip(&mut track.points) {
                point.time = Time::from_ms(period_ms) * k;
                point.d_m = maths::sin(2.0 * std::f64::consts::PI * 0.2 * point.time.s());
            }
            smooth_track(&track).unwrap().trajectory.points
        };
        for period_ms in [10, 40, 100, 200] {
            for point in wave(period_ms).iter().filter(|point| (3.0..17.0).contains(&point.time.s())) {
                let angular = 2.0 * std::f64::consts::PI * 0.2;
                let expected_mps = angular * maths::cos(angular * point.time.s());
                assert!((point.lateral_speed_mps - expected_mps).abs() < 0.01, "{period_ms} ms at {}", point.time);
            }
        }
    }

    #[test]
    fn stays_are_as_long_as_their_recorded_frames() {
        let mut track = straight_track(1, 0.0, 25.0, -1.75, 11);
        track.points.iter_mut().skip(7).for_each(|point| point.lane = closecall_traffic::Lane(2));
        let smoothed = smooth_track(&track).unwrap();
        let stays: Vec<_> = smoothed.stays.iter().map(|stay| (stay.lane.0, stay.duration)).collect();
        assert_eq!(stays, [(1, Time::from_ms(700)), (2, Time::from_ms(400))]);
    }
}
