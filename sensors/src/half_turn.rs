//! A scene turned by half a turn: objects ahead of the ego are then behind it.
//!
//! ```text
//!   scene       ── ego ▶ ── lead ▶ ──▶ s          s' ◀── ◀ lead ── ◀ ego ──       the same vehicles
//!
//!   turned      ── lead ◀ ── ego ◁ ──▶ s'         the ego drives backward, and the lead vehicle is behind it
//! ```
//!
//! A LiDAR that looks ahead then needs no model of its own: the sensor at the rear of the turned
//! ego is the sensor at the front of the true ego. The turn is exact on a straight and on a curved
//! road. It changes no distance, no angle between two things, and no time.

use std::f64::consts::PI;

use closecall_traffic::{Environment, Road, Scene, SceneVehicle, Time, Track, VehicleState};

/// A scene turned by half a turn, with the memory of its vehicles.
#[derive(Clone, Debug)]
pub(crate) struct HalfTurn {
    time: Time,
    road: Road,
    environment: Environment,
    ego: SceneVehicle,
    others: Vec<SceneVehicle>,
}

impl HalfTurn {
    /// Returns the turned scene. `others` is memory for its vehicles, such as
    /// [`HalfTurn::into_memory`] returns it.
    pub(crate) fn of(scene: &Scene<'_>, mut others: Vec<SceneVehicle>) -> Self {
        let turned = |vehicle: &SceneVehicle| {
            let VehicleState { s_m, d_m, heading_rad, .. } = vehicle.state;
            let (s_m, d_m) = scene.road.reversed_position_m(s_m, d_m);
            SceneVehicle {
                state: VehicleState { s_m, d_m, heading_rad: heading_rad + PI, ..vehicle.state },
                ..*vehicle
            }
        };
        let ego = turned(&scene.ego);
        // The ego keeps looking along s'. It is its motion that turns round.
        let state = VehicleState {
            heading_rad: scene.ego.state.heading_rad,
            speed_mps: -scene.ego.state.speed_mps,
            acceleration_mps2: -scene.ego.state.acceleration_mps2,
            ..ego.state
        };
        others.clear();
        others.extend(scene.others.iter().map(turned));
        Self {
            time: scene.time,
            road: scene.road.reversed(),
            environment: *scene.environment,
            ego: SceneVehicle { state, pitch_rad: -scene.ego.pitch_rad, ..ego },
            others,
        }
    }

    /// Returns the memory of the vehicles, for another scene.
    pub(crate) fn into_memory(self) -> Vec<SceneVehicle> {
        self.others
    }

    /// Returns the turned scene as a scene.
    pub(crate) fn scene(&self) -> Scene<'_> {
        Scene { time: self.time, road: &self.road, environment: &self.environment, ego: self.ego, others: &self.others }
    }
}

/// Turns a track back into the frame of the ego.
pub(crate) fn turn_back(track: &mut Track) {
    track.state = -track.state;
    track.lane.reverse();
    // The direction of a box is the direction of its longer axis: the tracker assumes that a
    // vehicle points along the road.
    track.heading_rad -= (track.heading_rad / PI).round() * PI;
}

#[cfg(test)]
mod tests {
    use closecall_traffic::ego_frame::EgoFrame;
    use closecall_traffic::{Alignment, AlignmentPoint, VehicleClass};

    use super::*;
    use crate::testing::{scene_vehicle, with_speed};

    #[test]
    fn a_turned_vehicle_lies_on_the_opposite_side_of_the_ego_at_the_same_distance() {
        let points = [(0.0, 0.0), (500.0, 0.001), (540.0, 0.001), (600.0, -0.001)];
        let points = points.map(|(s_m, curvature_per_m)| AlignmentPoint { s_m, curvature_per_m });
        let bent = [0.0, 0.001, -0.001].map(|curvature_per_m| Road::straight(3).with_curvature(curvature_per_m));
        let course = Road::straight(3).with_alignment(Alignment::new(&points).unwrap());
        for road in bent.into_iter().chain([course]) {
            let road = road.with_guard_rails();
            let environment = Environment::CLEAR_DAY;
            let mut ego = with_speed(scene_vehicle(0, VehicleClass::Car, 500.0, -5.6), 30.0);
            ego.state.heading_rad = 0.02;
            let lead = with_speed(scene_vehicle(1, VehicleClass::Truck, 560.0, -1.9), 25.0);
            let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &[lead] };
            let turned = HalfTurn::of(&scene, Vec::new());
            let seen = turned.scene();
            let before = EgoFrame::new(&road, &ego.state).point(560.0, -1.9);
            let other = &seen.others[0].state;
            let after = EgoFrame::new(seen.road, &seen.ego.state).point(other.s_m, other.d_m);
            assert!((before.x_m + after.x_m).abs() < 1e-6, "{before:?} {after:?}");
            assert!((before.y_m + after.y_m).abs() < 1e-6, "{before:?} {after:?}");
            assert!((before.road_yaw_rad - after.road_yaw_rad).abs() < 1e-9);
            // The left rail of one scene is the right rail of the other.
            let [left_m, right_m] = road.guard_rail_offsets_m();
            assert_eq!(seen.road.guard_rail_offsets_m(), [right_m, left_m]);
            // Turned twice, everything is where it was.
            let again = HalfTurn::of(&seen, Vec::new());
            assert!((again.scene().ego.state.s_m - 500.0).abs() < 1e-6);
            let [curvature_per_m, expected_per_m] =
                [again.scene().road, &road].map(|road| road.curvature_at_per_m(520.0));
            assert!((curvature_per_m - expected_per_m).abs() < 1e-12);
        }
    }
}
