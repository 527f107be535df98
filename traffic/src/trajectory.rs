//! Recorded movements of one vehicle.

use crate::{Dimensions, Lane, Time, VehicleClass};

/// One instant of a recorded vehicle, in the road frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// When.
    pub time: Time,
    /// Position of the centre along the road [m].
    pub s_m: f64,
    /// Lateral position of the centre, positive to the left, 0 at the left edge of the leftmost lane [m].
    pub d_m: f64,
    /// Speed along the road [m/s].
    pub speed_mps: f64,
    /// Acceleration along the road [m/s²].
    pub acceleration_mps2: f64,
    /// Speed to the left [m/s].
    pub lateral_speed_mps: f64,
    /// Acceleration to the left [m/s²].
    pub lateral_acceleration_mps2: f64,
    /// The lane, as recorded.
    pub lane: Lane,
}

/// The recorded movement of one vehicle without gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// The recording's number for this piece of track; unique within a recording.
    pub track_id: u64,
    /// The recording's number for the vehicle; the pieces of a track that was lost for a while share it.
    pub vehicle_id: u64,
    /// Kind of the vehicle.
    pub class: VehicleClass,
    /// Size of the vehicle; its height is typical of the class where not recorded.
    pub dimensions: Dimensions,
    /// Its instants, equally spaced in time.
    pub points: Vec<TrajectoryPoint>,
}

impl Trajectory {
    /// The first and the last instant, or nothing where there are no points.
    pub fn span(&self) -> Option<(Time, Time)> {
        Some((self.points.first()?.time, self.points.last()?.time))
    }

    /// The same vehicle with other points.
    #[must_use]
    pub fn with_points(&self, points: Vec<TrajectoryPoint>) -> Self {
        let Self { track_id, vehicle_id, class, dimensions, .. } = *self;
        Self { track_id, vehicle_id, class, dimensions, points }
    }

    /// The point nearest to `time`, where the track covers it.
    ///
    /// Half of the spacing beyond each end still counts as covered, so that times between two frames round to a frame.
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
    fn the_nearest_point_is_found_and_none_outside() {
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
