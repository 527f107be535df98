//! What a radar would measure without errors: directly, and by way of a guard rail.
//!
//! ```text
//!        ▪ image      distance and angle of the image: along the path by way of the rail
//!   ═════╪═══════════ guard rail
//!        ▫ vehicle            ◁ radar
//! ```
//!
//! On a curve, the rail mirrors along the road: image and vehicle are equally far from the rail.

use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Road, maths};

use crate::surroundings::OtherVehicle;

/// Least range that a radar measures (m; assumption). Plausible: 0.2 to 1.
const MIN_RANGE_M: f64 = 0.3;

/// The mounting of a radar in the ego's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mount {
    /// Position ahead of and to the left of the ego's centre (m).
    pub(super) at_m: [f64; 2],
    /// Azimuth of the axis (rad): 0 is straight behind, positive to the ego's left.
    pub(super) axis_rad: f64,
    pub(super) half_field_rad: f64,
}

/// A point that reflects, in the ego's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reflector {
    /// Position (m).
    pub(super) at_m: [f64; 2],
    /// Velocity over ground, along the axes of the ego (m/s).
    pub(super) velocity_mps: [f64; 2],
}

/// What a radar measures of a point, without errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    /// Distance from the radar (m).
    pub(super) range_m: f64,
    /// Azimuth (rad): 0 is straight behind, positive to the ego's left.
    pub(super) azimuth_rad: f64,
    /// Rate of change of the range (m/s): negative if the point approaches.
    pub(super) radial_mps: f64,
}

impl Mount {
    /// Returns what the radar measures of a point while the ego drives at `ego_mps`. Returns `None`
    /// if the point is outside of the field of view, or not within `range_m` (m).
    pub(super) fn echo(&self, point: &Reflector, ego_mps: f64, range_m: f64) -> Option<Echo> {
        let [x_m, y_m] = [point.at_m[0] - self.at_m[0], point.at_m[1] - self.at_m[1]];
        let distance_m = maths::hypot(x_m, y_m);
        if !(distance_m >= MIN_RANGE_M && distance_m <= range_m) {
            return None;
        }
        let azimuth_rad = maths::atan2(y_m, -x_m);
        let off_axis_rad = (azimuth_rad - self.axis_rad).abs();
        let off_axis_rad = off_axis_rad.min(2.0 * std::f64::consts::PI - off_axis_rad);
        let [along_mps, left_mps] = point.velocity_mps;
        (off_axis_rad <= self.half_field_rad).then(|| Echo {
            range_m: distance_m,
            azimuth_rad,
            radial_mps: ((along_mps - ego_mps) * x_m + left_mps * y_m) / distance_m,
        })
    }

    /// Returns the point of a vehicle's outline that is nearest to the radar.
    pub(super) fn nearest_point(&self, other: &OtherVehicle) -> Reflector {
        let [x_m, y_m] = [self.at_m[0] - other.x_m, self.at_m[1] - other.y_m];
        let (half_length_m, half_width_m) = (0.5 * other.length_m, 0.5 * other.width_m);
        let along_m = (x_m * other.cos + y_m * other.sin).clamp(-half_length_m, half_length_m);
        let across_m = (y_m * other.cos - x_m * other.sin).clamp(-half_width_m, half_width_m);
        Reflector {
            at_m: [
                other.x_m + along_m * other.cos - across_m * other.sin,
                other.y_m + along_m * other.sin + across_m * other.cos,
            ],
            velocity_mps: [other.speed_mps * other.cos, other.speed_mps * other.sin],
        }
    }

    /// Returns whether a vehicle stands between the radar and a point.
    pub(super) fn is_hidden_by(&self, point: &Reflector, other: &OtherVehicle) -> bool {
        // The line of sight in the axes of the vehicle, from 0 at the radar to 1 at the point.
        let in_body = |[x_m, y_m]: [f64; 2]| {
            let (x_m, y_m) = (x_m - other.x_m, y_m - other.y_m);
            [x_m * other.cos + y_m * other.sin, y_m * other.cos - x_m * other.sin]
        };
        let (from_m, to_m) = (in_body(self.at_m), in_body(point.at_m));
        let half_m = [0.5 * other.length_m, 0.5 * other.width_m];
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for ((from_m, to_m), half_m) in from_m.into_iter().zip(to_m).zip(half_m) {
            let step_m = to_m - from_m;
            if step_m == 0.0 {
                if from_m.abs() > half_m {
                    return false;
                }
                continue;
            }
            let ends = [-half_m, half_m].map(|end_m| (end_m - from_m) / step_m);
            enters = enters.max(ends[0].min(ends[1]));
            leaves = leaves.min(ends[0].max(ends[1]));
        }
        enters < leaves
    }
}

/// Returns the lateral positions of the left and of the right guard rail (m).
pub(super) fn rails_m(road: &Road) -> [f64; 2] {
    let [left_m, right_m] = road.guard_rail_offsets_m();
    [left_m, road.right_edge_m() - right_m]
}

/// Returns the mirror image of a point at a guard rail with the lateral position `rail_m` (m).
pub(super) fn mirrored(point: &Reflector, rail_m: f64, frame: &EgoFrame<'_>) -> Reflector {
    let [x_m, y_m] = point.at_m;
    let (s_m, d_m) = frame.road_position_m(x_m, y_m);
    let image = frame.point(s_m, 2.0 * rail_m - d_m);
    let (sin, cos) = maths::sin_cos(image.road_yaw_rad);
    let [vx_mps, vy_mps] = point.velocity_mps;
    // Along the road, the image moves as the vehicle does; across it, the other way.
    let (along_mps, across_mps) = (vx_mps * cos + vy_mps * sin, vx_mps * sin - vy_mps * cos);
    Reflector {
        at_m: [image.x_m, image.y_m],
        velocity_mps: [along_mps * cos - across_mps * sin, along_mps * sin + across_mps * cos],
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Environment, Time, VehicleClass};

    use super::*;
    use crate::surroundings::transform_scene;
    use crate::testing::{OWN_LANE_M, scene_vehicle, with_speed};
    use crate::{Scene, SceneVehicle};

    const MOUNT: Mount = Mount { at_m: [-2.0, 0.5], axis_rad: 0.5, half_field_rad: 1.3 };
    const EGO_MPS: f64 = 30.0;

    fn at(x_m: f64, y_m: f64, velocity_mps: [f64; 2]) -> Echo {
        MOUNT.echo(&Reflector { at_m: [x_m, y_m], velocity_mps }, EGO_MPS, 100.0).unwrap()
    }

    #[test]
    fn the_radial_speed_is_the_part_of_the_relative_velocity_along_the_line_of_sight() {
        // 40 m straight behind, 8 m/s faster: the range falls by 8 m/s.
        let straight = at(-42.0, 0.5, [38.0, 0.0]);
        assert_eq!((straight.range_m, straight.azimuth_rad, straight.radial_mps), (40.0, 0.0, -8.0));
        // 60° to the left, the same velocity: cos 60° of it.
        let (x_m, y_m) = (-2.0 - 20.0 * 0.5, 0.5 + 20.0 * 0.75_f64.sqrt());
        let aside = at(x_m, y_m, [38.0, 0.0]);
        assert!((aside.azimuth_rad.to_degrees() - 60.0).abs() < 1e-9 && (aside.range_m - 20.0).abs() < 1e-9);
        assert!((aside.radial_mps + 4.0).abs() < 1e-9, "{}", aside.radial_mps);
        // A vehicle that moves across the line of sight has no radial speed.
        let across = [EGO_MPS + 3.0 * 0.75_f64.sqrt(), 3.0 * 0.5];
        assert!(at(x_m, y_m, across).radial_mps.abs() < 1e-9);
        // The rate of change of the range, by a small step.
        let step_s = 1e-6;
        let later = at(x_m + step_s * (38.0 - EGO_MPS), y_m, [38.0, 0.0]);
        assert!(((later.range_m - aside.range_m) / step_s - aside.radial_mps).abs() < 1e-4);
    }

    #[test]
    fn what_is_too_far_too_near_or_too_far_aside_is_not_detected() {
        let sees = |at_m: [f64; 2]| MOUNT.echo(&Reflector { at_m, velocity_mps: [30.0, 0.0] }, EGO_MPS, 50.0).is_some();
        assert!(sees([-40.0, 0.0]) && sees([-2.5, 10.0]));
        assert!(!sees([-60.0, 0.0]) && !sees([-2.1, 0.5]));
        // The field reaches from 46° to the right to 103° to the left.
        assert!(!sees([-3.0, -10.0]) && !sees([8.0, 10.0]));
    }

    /// Calls `check` with the frame of the ego and the other vehicles.
    fn with(others: &[SceneVehicle], check: impl Fn(&EgoFrame<'_>, &[OtherVehicle])) {
        let road = Road::straight(3).with_guard_rails();
        let ego = with_speed(scene_vehicle(0, VehicleClass::Car, 1_000.0, OWN_LANE_M), EGO_MPS);
        let scene = Scene { time: Time::ZERO, road: &road, environment: &Environment::CLEAR_DAY, ego, others };
        let mut surroundings = Vec::new();
        let frame = transform_scene(&scene, &mut surroundings).unwrap();
        check(&frame, &surroundings);
    }

    #[test]
    fn a_vehicle_reflects_at_its_nearest_point_and_hides_what_is_behind_it() {
        let near = with_speed(scene_vehicle(1, VehicleClass::Car, 980.0, OWN_LANE_M), EGO_MPS);
        let far = with_speed(scene_vehicle(2, VehicleClass::Car, 950.0, OWN_LANE_M), EGO_MPS);
        with(&[near, far], |_, others| {
            let point = MOUNT.nearest_point(&others[0]);
            let front_m = -20.0 + 0.5 * near.vehicle.dimensions.length_m;
            assert!((point.at_m[0] - front_m).abs() < 1e-9 && (point.at_m[1] - 0.5).abs() < 1e-9, "{point:?}");
            assert!(MOUNT.is_hidden_by(&MOUNT.nearest_point(&others[1]), &others[0]));
            assert!(!MOUNT.is_hidden_by(&point, &others[1]));
        });
    }

    #[test]
    fn the_mirror_image_lies_beyond_the_rail_as_far_as_the_vehicle_lies_before_it() {
        let mut other = with_speed(scene_vehicle(1, VehicleClass::Car, 970.0, OWN_LANE_M), 35.0);
        other.state.heading_rad = 0.02;
        with(&[other], |frame, others| {
            let road = Road::straight(3).with_guard_rails();
            let point = MOUNT.nearest_point(&others[0]);
            let (_, d_m) = frame.road_position_m(point.at_m[0], point.at_m[1]);
            let [left_m, right_m] = rails_m(&road);
            assert!(left_m > 0.0 && right_m < road.right_edge_m());
            for rail_m in [left_m, right_m] {
                let image = mirrored(&point, rail_m, frame);
                let (_, image_d_m) = frame.road_position_m(image.at_m[0], image.at_m[1]);
                assert!(((image_d_m - rail_m) - (rail_m - d_m)).abs() < 1e-9, "{image_d_m}");
                assert!((image.at_m[0] - point.at_m[0]).abs() < 1e-9);
                assert_eq!(image.velocity_mps[0], point.velocity_mps[0]);
                assert!((image.velocity_mps[1] + point.velocity_mps[1]).abs() < 1e-9);
            }
        });
    }
}
