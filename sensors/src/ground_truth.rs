//! Perception without errors, which separates faults of the controller from faults of the sensors.
//!
//! The tracks are exact, confirmed at once, and of certain class. Only their distance is limited: a
//! function that engages on a confirmed track behind the ego must not engage on a vehicle a
//! kilometre away.

use closecall_traffic::metrics::touching_distance_m;
use closecall_traffic::{ClassScores, Source, Track, TrackId, TrackStatus};
use nalgebra::{Matrix4, Vector4};

use crate::surroundings::{OtherVehicle, transform_scene};
use crate::{Perception, Scene, SensorError, SensorHealth};

/// Distance from centre to centre along the ego's axis up to which vehicles are reported (m).
///
/// It is the nominal range of the rear LiDAR and exceeds the range of the front radar.
const RANGE_M: f64 = 200.0;

/// Perception that reports a perfect track of every vehicle within 200 m ahead and behind.
///
/// A track's source follows from the vehicle's position: front if the vehicle is entirely ahead of
/// the ego, rear if it is entirely behind, surround if it is alongside. A track's id is the actor's
/// index in the scenario, and stays the same when the source changes.
#[derive(Clone, Debug, Default)]
pub struct GroundTruth {
    others: Vec<OtherVehicle>,
    tracks: Vec<Track>,
}

impl GroundTruth {
    /// Creates perfect perception.
    pub fn new() -> Self {
        Self::default()
    }
}

fn source(other: &OtherVehicle, ego_length_m: f64) -> Source {
    let alongside_m = touching_distance_m(ego_length_m, other.length_m);
    if other.x_m >= alongside_m {
        Source::Front
    } else if other.x_m <= -alongside_m {
        Source::Rear
    } else {
        Source::Surround
    }
}

impl Perception for GroundTruth {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let frame = transform_scene(scene, &mut self.others)?;
        self.tracks.clear();
        for other in self.others.iter().filter(|other| other.x_m.abs() <= RANGE_M) {
            #[expect(clippy::cast_possible_truncation, reason = "a scenario has far fewer than 2^32 actors")]
            let id = TrackId(other.actor as u32);
            self.tracks.push(Track {
                id,
                source: source(other, scene.ego.vehicle.dimensions.length_m),
                status: TrackStatus::Confirmed,
                time: scene.time,
                state: Vector4::new(other.x_m, other.y_m, other.speed_mps * other.cos, other.speed_mps * other.sin),
                covariance: Matrix4::zeros(),
                heading_rad: other.heading_rad,
                length_m: other.length_m,
                width_m: other.width_m,
                class: ClassScores::certain(other.class),
                existence: 1.0,
                lane: frame.lane_probabilities(other.road_m[0], other.road_m[1], 0.0),
            });
        }
        Ok(&self.tracks)
    }

    fn health(&self) -> SensorHealth {
        SensorHealth::default()
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;
    use closecall_traffic::{Environment, Road, Time, VehicleClass};

    use super::*;
    use crate::testing::{scene_vehicle, with_speed};

    #[test]
    fn source_follows_from_the_position() {
        let road = Road::straight(3);
        let ego = scene_vehicle(0, VehicleClass::Car, 500.0, -5.625);
        let others = [
            scene_vehicle(1, VehicleClass::Car, 530.0, -5.625),
            scene_vehicle(2, VehicleClass::Truck, 509.0, -1.875),
            scene_vehicle(3, VehicleClass::Motorcycle, 440.0, -5.0),
            scene_vehicle(4, VehicleClass::Car, 290.0, -5.0),
        ];
        let scene = Scene { time: Time::ZERO, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
        let mut perception = GroundTruth::new();
        let tracks = perception.step(&scene).unwrap();
        let seen: Vec<_> = tracks.iter().map(|track| (track.id.0, track.source, track.lane)).collect();
        let expected = [
            (1, Source::Front, [0.0, 1.0, 0.0]),
            (2, Source::Surround, [1.0, 0.0, 0.0]),
            (3, Source::Rear, [0.0, 1.0, 0.0]),
        ];
        assert_eq!(seen, expected);
        assert_eq!(tracks[2].class.best_vehicle_class(), VehicleClass::Motorcycle);
    }

    #[test]
    fn a_follower_in_a_bend_is_in_the_ego_lane() {
        let road = Road::straight(3).with_curvature(0.002);
        let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 500.0, -5.625), 30.0);
        let others = [with_speed(scene_vehicle(1, VehicleClass::Car, 400.0, -5.625), 36.0)];
        let scene = Scene { time: Time::ZERO, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
        let mut perception = GroundTruth::new();
        let track = &perception.step(&scene).unwrap()[0];
        // 100 m back on a circle with a radius of 500 m: 9.9 m to the left, turned by 0.2 rad
        // relative to the ego.
        assert!(track.y_m() > 9.0, "{}", track.y_m());
        assert!((track.heading_rad + 0.2).abs() < 1e-9);
        assert!((maths::hypot(track.vx_mps(), track.vy_mps()) - 36.0).abs() < 1e-9);
        assert_eq!(track.lane, [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_state_that_is_not_finite_is_an_error() {
        let road = Road::straight(3);
        let ego = scene_vehicle(0, VehicleClass::Car, 500.0, -5.625);
        let others = [with_speed(scene_vehicle(1, VehicleClass::Car, 400.0, -5.625), f64::NAN)];
        let scene = Scene { time: Time::ZERO, road: &road, environment: &Environment::CLEAR_DAY, ego, others: &others };
        assert!(matches!(GroundTruth::new().step(&scene), Err(SensorError::NotFinite { .. })));
    }
}
