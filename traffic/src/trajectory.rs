//! Trajectories: the recorded movements of vehicles.

use crate::{Dimensions, Lane, Time, VehicleClass};

/// The state of a recorded vehicle at one instant, in the road frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// The time.
    pub time: Time,
    /// Position of the centre along the road (m).
    pub s_m: f64,
    /// Lateral position of the centre, positive to the left, 0 at the left edge of the leftmost
    /// lane (m).
    pub d_m: f64,
    /// Speed along the road (m/s).
    pub speed_mps: f64,
    /// Acceleration along the road (m/s²).
    pub acceleration_mps2: f64,
    /// Lateral speed, positive to the left (m/s).
    pub lateral_speed_mps: f64,
    /// Lateral acceleration, positive to the left (m/s²).
    pub lateral_acceleration_mps2: f64,
    /// The lane as given in the trajectory data.
    pub lane: Lane,
}

/// The recorded movement of one vehicle, without interruptions.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Number of this piece of a track, unique within a trajectory file.
    pub track_id: u64,
    /// Number of the vehicle in the trajectory file. The pieces of a track that was interrupted
    /// share it.
    pub vehicle_id: u64,
    /// Class of the vehicle.
    pub class: VehicleClass,
    /// Size of the vehicle; the height is typical of the class if it is not recorded.
    pub dimensions: Dimensions,
    /// The states, equally spaced in time.
    pub points: Vec<TrajectoryPoint>,
}

impl Trajectory {
    /// Returns the first and the last time, or `None` if there are no points.
    pub fn span(&self) -> Option<(Time, Time)> {
        Some((self.points.first()?.time, self.points.last()?.time))
    }

    /// Returns a trajectory of the same vehicle with other points.
    #[must_use]
    pub fn with_points(&self, points: Vec<TrajectoryPoint>) -> Self {
        let Self { track_id, vehicle_id, class, dimensions, .. } = *self;
        Self { track_id, vehicle_id, class, dimensions, points }
    }

    /// Returns the point nearest to `time`, or `None` if the trajectory does not cover it.
    ///
    /// The trajectory covers half of the point spacing beyond each end, so that every time between
    /// two frames rounds to a frame.
    pub fn at(&self, time: Time) -> Option<&TrajectoryPoint> {
        let (first, last) = self.span()?;
        let steps = self.points.len() as i64 - 1;
        if steps == 0 {
            return (time == first).then(|| &self.points[0]);
        }
        let spacing_ns = (last - first).ns() / steps;
        if spacing_ns <= 0 {
            return None;
        }
        let index = ((time - first).ns() + spacing_ns / 2).div_euclid(spacing_ns);
        self.points.get(usize::try_from(index).ok()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(frames: i64) -> Trajectory {
        let point = |frame| TrajectoryPoint {
            time: Time::from_ms(1_000 + 100 * frame),
            s_m: frame as f64,
            d_m: -1.8,
            speed_mps: 10.0,
            acceleration_mps2: 0.0,
            lateral_speed_mps: 0.0,
            lateral_acceleration_mps2: 0.0,
            lane: Lane(1),
        };
        let class = VehicleClass::Car;
        let dimensions = class.typical_dimensions();
        Trajectory { track_id: 1, vehicle_id: 1, class, dimensions, points: (0..frames).map(point).collect() }
    }

    #[test]
    fn the_nearest_point_is_found_inside_and_none_outside() {
        let track = track(5);
        let s_at = |ms| track.at(Time::from_ms(ms)).map(|point| point.s_m);
        assert_eq!(s_at(1_000), Some(0.0));
        assert_eq!(s_at(1_149), Some(1.0));
        assert_eq!(s_at(1_151), Some(2.0));
        assert_eq!(s_at(1_400), Some(4.0));
        assert_eq!(s_at(1_451), None);
        assert_eq!(s_at(940), None);
    }

    #[test]
    fn a_single_point_covers_its_own_instant_only() {
        assert!(track(1).at(Time::from_ms(1_000)).is_some());
        assert!(track(1).at(Time::from_ms(1_001)).is_none());
        assert!(track(0).at(Time::ZERO).is_none());
    }
}
