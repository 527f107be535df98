//! A whole recording, resampled and smoothed.

use closecall_traffic::{Time, Trajectory, TrajectoryPoint};

use super::butterworth::LowPass;
use super::resample::resample;
use crate::recordings::{LaneMarkings, Recording};

/// The common clock: 10 Hz, the rate of the NGSIM recordings.
pub const PERIOD: Time = Time::from_ms(100);

/// The filter's corner [Hz]; see the module's documentation.
pub const CORNER_HZ: f64 = 1.3;

/// A recording on the common clock, with smooth positions and their derivatives.
#[derive(Clone, Debug)]
pub struct SmoothedRecording {
    /// The recording's name.
    pub name: String,
    /// Where the lane markings are.
    pub markings: LaneMarkings,
    /// The tracks in the order of their numbers; those that cover no instant of the clock are not there.
    pub trajectories: Vec<Trajectory>,
    first_tick: i64,
    present: Vec<Vec<Presence>>,
}

/// One vehicle at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Presence {
    /// Which of the recording's trajectories.
    pub trajectory: usize,
    /// Which of its points.
    pub point: usize,
}

/// Resamples every track to the common clock and smooths it.
pub fn smooth(recording: &Recording) -> SmoothedRecording {
    let filter = LowPass::new(CORNER_HZ, 1.0 / PERIOD.s());
    let smoothed = recording.trajectories.iter();
    let smoothed = smoothed.map(|track| track.with_points(smooth_points(resample(&track.points, PERIOD), filter)));
    let trajectories: Vec<_> = smoothed.filter(|track| !track.points.is_empty()).collect();
    let (first_tick, present) = presence(&trajectories);
    SmoothedRecording {
        name: recording.name.clone(),
        markings: recording.markings.clone(),
        trajectories,
        first_tick,
        present,
    }
}

impl SmoothedRecording {
    /// Every vehicle that is there at the instant of the clock nearest to `time`, in the order of the track numbers.
    pub fn present_at(&self, time: Time) -> &[Presence] {
        let tick = tick_of(time) - self.first_tick;
        usize::try_from(tick).ok().and_then(|tick| self.present.get(tick)).map_or(&[], Vec::as_slice)
    }

    /// A track and its point.
    pub fn look_up(&self, presence: Presence) -> (&Trajectory, &TrajectoryPoint) {
        let track = &self.trajectories[presence.trajectory];
        (track, &track.points[presence.point])
    }
}

fn tick_of(time: Time) -> i64 {
    (time.ns() + PERIOD.ns() / 2).div_euclid(PERIOD.ns())
}

fn presence(trajectories: &[Trajectory]) -> (i64, Vec<Vec<Presence>>) {
    let starts = trajectories.iter().filter_map(Trajectory::span);
    let Some((first, last)) = starts.reduce(|(a, b), (c, d)| (a.min(c), b.max(d))) else { return (0, Vec::new()) };
    let first_tick = tick_of(first);
    let ticks = usize::try_from(tick_of(last) - first_tick).map_or(0, |ticks| ticks + 1);
    let mut present = vec![Vec::new(); ticks];
    for (trajectory, track) in trajectories.iter().enumerate() {
        for (point, instant) in track.points.iter().enumerate() {
            if let Ok(tick) = usize::try_from(tick_of(instant.time) - first_tick) {
                present[tick].push(Presence { trajectory, point });
            }
        }
    }
    (first_tick, present)
}

fn smooth_points(mut points: Vec<TrajectoryPoint>, filter: Option<LowPass>) -> Vec<TrajectoryPoint> {
    let (Some(filter), true) = (filter, points.len() > 1) else { return points };
    let filtered = |value: fn(&TrajectoryPoint) -> f64| low_pass(&points.iter().map(value).collect::<Vec<_>>(), filter);
    let along = filtered(|point| point.s_m);
    let across = filtered(|point| point.d_m);
    let speed = filtered(|point| point.speed_mps);
    let acceleration = difference(&speed);
    let lateral_speed = difference(&across);
    let lateral_acceleration = difference(&lateral_speed);
    for (k, point) in points.iter_mut().enumerate() {
        point.s_m = along[k];
        point.d_m = across[k];
        point.speed_mps = speed[k];
        point.acceleration_mps2 = acceleration[k];
        point.lateral_speed_mps = lateral_speed[k];
        point.lateral_acceleration_mps2 = lateral_acceleration[k];
    }
    points
}

/// `values` filtered about the chord through both ends, so that steady movement passes unchanged up to the ends.
fn low_pass(values: &[f64], filter: LowPass) -> Vec<f64> {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Vec::new() };
    let slope = (last - first) / (values.len() - 1).max(1) as f64;
    let chord = |k: usize| first + slope * k as f64;
    let residual: Vec<f64> = values.iter().enumerate().map(|(k, value)| value - chord(k)).collect();
    let filtered = filter.forwards_and_backwards(&residual).into_iter().enumerate();
    filtered.map(|(k, value)| value + chord(k)).collect()
}

/// The derivative with respect to time: central differences, one-sided at both ends.
fn difference(values: &[f64]) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let slope = |k: usize| {
        let (left, right) = (k.saturating_sub(1), (k + 1).min(last));
        if left == right { 0.0 } else { (values[right] - values[left]) / ((right - left) as f64 * PERIOD.s()) }
    };
    (0..values.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings::test_support::{recording_of, straight_track};

    #[test]
    fn a_steady_drive_stays_a_steady_drive() {
        let smoothed = smooth(&recording_of(vec![straight_track(1, 0.0, 25.0, -1.75, 80)]));
        for point in &smoothed.trajectories[0].points {
            assert!((point.speed_mps - 25.0).abs() < 1e-9 && point.acceleration_mps2.abs() < 1e-6);
            assert!(point.lateral_speed_mps.abs() < 1e-9 && (point.s_m - 25.0 * point.time.s()).abs() < 1e-6);
        }
    }

    #[test]
    fn every_vehicle_is_found_at_its_instants() {
        let mut late = straight_track(2, 0.0, 20.0, -5.0, 3);
        late.points.iter_mut().for_each(|point| point.time += Time::from_s(1.0));
        let smoothed = smooth(&recording_of(vec![straight_track(1, 0.0, 25.0, -1.75, 11), late]));
        let numbers = |s| {
            let present = smoothed.present_at(Time::from_s(s)).iter();
            present.map(|&presence| smoothed.look_up(presence).0.track_id).collect::<Vec<_>>()
        };
        assert_eq!(numbers(0.5), [1]);
        assert_eq!(numbers(1.0), [1, 2]);
        assert_eq!(numbers(1.2), [2]);
        assert!(numbers(9.0).is_empty() && numbers(-1.0).is_empty());
    }
}
