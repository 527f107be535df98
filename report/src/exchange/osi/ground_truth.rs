//! `GroundTruth`: the true states of all vehicles, the lanes, and the environment.

use std::f64::consts::{PI, TAU};

use closecall_recorded::osi::{
    self as messages, BaseMoving, BoundaryPoint, Dimension3d, EnvironmentalConditions, GroundTruth, Identifier,
    InterfaceVersion, LaneBoundary, LaneBoundaryClassification, LaneClassification, LightState, MovingObject,
    MovingObjectClassification, Orientation3d, TimeOfDay, Timestamp, Vector3d, VehicleAttributes,
    VehicleClassification,
};
use closecall_scenarios::Scenario;
use closecall_traffic::{Environment, Indicator, Lane, Light, Road, Time, Vehicle, VehicleClass, VehicleState, maths};

use super::recorder::{Moving, Step};

/// The version of the messages.
pub(super) const VERSION: [u32; 3] = [3, 8, 0];
/// Number of the first vehicle; the others follow.
const FIRST_VEHICLE: u64 = 1;
/// Number of the leftmost lane; the others follow.
const FIRST_LANE: u64 = 10_001;
/// Number of the left edge of the road; the lines between and beyond the lanes follow.
const FIRST_BOUNDARY: u64 = 20_001;
/// Distance between the points of a line (m). In the tightest curve, with a radius of 250 m, the
/// line deviates by 5 cm.
const POINT_SPACING_M: f64 = 10.0;
/// Wheel radius (m): an assumption; 0.3 to 0.5 are plausible. No run depends on it.
pub(super) const WHEEL_RADIUS_M: f64 = 0.325;
/// Width of a marking (m): the narrow line of RMS-1 (FGSV 1993).
const MARKING_WIDTH_M: f64 = 0.15;

pub(super) fn identifier(value: u64) -> Identifier {
    Identifier { value: Some(value) }
}

/// Returns the number of a vehicle, by its index among the actors.
pub(super) fn vehicle_id(index: usize) -> Identifier {
    identifier(FIRST_VEHICLE + index as u64)
}

pub(super) fn version() -> InterfaceVersion {
    let [version_major, version_minor, version_patch] = VERSION.map(Some);
    InterfaceVersion { version_major, version_minor, version_patch }
}

pub(super) fn timestamp(time: Time) -> Timestamp {
    const NS_PER_S: i64 = 1_000_000_000;
    let nanos = u32::try_from(time.ns().rem_euclid(NS_PER_S)).unwrap_or_default();
    Timestamp { seconds: Some(time.ns().div_euclid(NS_PER_S)), nanos: Some(nanos) }
}

pub(super) fn vector(x: f64, y: f64, z: f64) -> Vector3d {
    Vector3d { x: Some(x), y: Some(y), z: Some(z) }
}

pub(super) fn orientation(pitch: f64, yaw: f64) -> Orientation3d {
    Orientation3d { roll: Some(0.0), pitch: Some(pitch), yaw: Some(wrapped(yaw)) }
}

/// Returns the angle between −π and π (rad).
fn wrapped(angle_rad: f64) -> f64 {
    let turns = ((angle_rad + PI) / TAU).floor();
    (angle_rad - turns * TAU).clamp(-PI, PI)
}

/// Returns the message of a step. `range_m` is the part of the road that the lanes cover.
pub(super) fn ground_truth(scenario: &Scenario, step: &Step, range_m: Option<[f64; 2]>, map: &str) -> GroundTruth {
    let vehicles = scenario.actors.iter().map(|actor| &actor.vehicle);
    let moving = vehicles.zip(&step.vehicles).zip(0..);
    let (lane, lane_boundary) = range_m.map(|range_m| lanes(scenario, step, range_m)).unwrap_or_default();
    GroundTruth {
        version: Some(version()),
        timestamp: Some(timestamp(step.time)),
        host_vehicle_id: Some(vehicle_id(scenario.ego)),
        moving_object: moving
            .map(|((vehicle, moving), index)| moving_object(scenario, index, vehicle, moving))
            .collect(),
        lane_boundary,
        lane,
        environmental_conditions: Some(environment(&scenario.environment)),
        map_reference: Some(map.to_owned()),
    }
}

/// Returns position and motion of a vehicle in the plane.
pub(super) fn base(road: &Road, vehicle: &Vehicle, moving: &Moving) -> BaseMoving {
    let Moving { state, pitch_rad, acceleration_mps2: [along_mps2, left_mps2] } = *moving;
    let pose = road.plane_pose(state.s_m, state.d_m, state.heading_rad);
    let (sin, cos) = maths::sin_cos(pose.yaw_rad);
    let size = vehicle.dimensions;
    BaseMoving {
        dimension: Some(Dimension3d {
            length: Some(size.length_m),
            width: Some(size.width_m),
            height: Some(size.height_m),
        }),
        position: Some(vector(pose.x_m, pose.y_m, 0.5 * size.height_m)),
        orientation: Some(orientation(pitch_rad, pose.yaw_rad)),
        velocity: Some(vector(state.speed_mps * cos, state.speed_mps * sin, 0.0)),
        acceleration: Some(vector(along_mps2 * cos - left_mps2 * sin, along_mps2 * sin + left_mps2 * cos, 0.0)),
        orientation_rate: Some(Orientation3d { roll: Some(0.0), pitch: Some(0.0), yaw: Some(state.yaw_rate_radps) }),
    }
}

fn moving_object(scenario: &Scenario, index: usize, vehicle: &Vehicle, moving: &Moving) -> MovingObject {
    const TYPE_VEHICLE: i32 = 2;
    let lane = lane_id(scenario.road.lane_of(&moving.state));
    let half_m = 0.5 * vehicle.dimensions.wheelbase_m();
    let down_m = WHEEL_RADIUS_M - 0.5 * vehicle.dimensions.height_m;
    MovingObject {
        id: Some(vehicle_id(index)),
        base: Some(base(&scenario.road, vehicle, moving)),
        r#type: Some(TYPE_VEHICLE),
        assigned_lane_id: vec![lane.clone()],
        vehicle_attributes: Some(VehicleAttributes {
            radius_wheel: Some(WHEEL_RADIUS_M),
            bbcenter_to_rear: Some(vector(-half_m, 0.0, down_m)),
            bbcenter_to_front: Some(vector(half_m, 0.0, down_m)),
        }),
        vehicle_classification: Some(classification(vehicle.class, Some(lights(scenario, &moving.state)))),
        moving_object_classification: Some(MovingObjectClassification {
            assigned_lane_id: vec![lane],
            assigned_lane_percentage: vec![1.0],
        }),
    }
}

/// Returns the classification of a vehicle of this class.
pub(super) fn classification(class: VehicleClass, light_state: Option<LightState>) -> VehicleClassification {
    const ROLE_CIVIL: i32 = 2;
    let r#type = match class {
        VehicleClass::Car => 4,
        VehicleClass::Truck => 7,
        VehicleClass::Motorcycle => 10,
    };
    // A truck is a box of tractor and trailer: there is no other object that is its trailer.
    VehicleClassification { r#type: Some(r#type), light_state, has_trailer: Some(false), role: Some(ROLE_CIVIL) }
}

fn lights(scenario: &Scenario, state: &VehicleState) -> LightState {
    const OFF: i32 = 2;
    const ON: i32 = 3;
    let indicator = match state.indicator {
        Indicator::Off => OFF,
        Indicator::Left => 3,
        Indicator::Right => 4,
    };
    LightState {
        indicator_state: Some(indicator),
        head_light: Some(if scenario.environment.light == Light::Day { OFF } else { ON }),
        brake_light_state: Some(if state.brake_light { ON } else { OFF }),
    }
}

fn lane_id(lane: Lane) -> Identifier {
    identifier(FIRST_LANE + u64::from(lane.0) - 1)
}

/// Returns the lanes and their boundaries over a part of the road.
fn lanes(scenario: &Scenario, step: &Step, [start_m, end_m]: [f64; 2]) -> (Vec<messages::Lane>, Vec<LaneBoundary>) {
    const TYPE_DRIVING: i32 = 2;
    let road = &scenario.road;
    let count = ((end_m - start_m) / POINT_SPACING_M).ceil().max(1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a road has some thousand points")]
    let evenly_m = (0..=count as u32).map(|index| start_m + (end_m - start_m) * f64::from(index) / count);
    // Lanes whose widths change have kinks.
    let kinks_m = road.cross_sections_m().filter(|s_m| start_m < *s_m && *s_m < end_m);
    let mut places_m: Vec<f64> = evenly_m.chain(kinks_m).collect();
    places_m.sort_by(f64::total_cmp);
    places_m.dedup();
    let line = |d_m: &dyn Fn(f64) -> f64| -> Vec<Vector3d> {
        let points = places_m.iter().map(|s_m| {
            let pose = road.plane_pose(*s_m, d_m(*s_m), 0.0);
            vector(pose.x_m, pose.y_m, 0.0)
        });
        points.collect()
    };
    let host = step.vehicles.get(scenario.ego).map(|moving| road.lane_of(&moving.state));
    let boundary_id = |number: u8| identifier(FIRST_BOUNDARY + u64::from(number));
    let lanes = (1..=road.lanes()).map(|number| {
        let lane = Lane(number);
        let beside = |side| road.beside(lane, side).map(lane_id).into_iter().collect();
        messages::Lane {
            id: Some(lane_id(lane)),
            classification: Some(LaneClassification {
                r#type: Some(TYPE_DRIVING),
                is_host_vehicle_lane: Some(host == Some(lane)),
                centerline: line(&|s_m| road.lane_centre_m(lane, s_m)),
                centerline_is_driving_direction: Some(true),
                left_adjacent_lane_id: beside(closecall_traffic::Side::Left),
                right_adjacent_lane_id: beside(closecall_traffic::Side::Right),
                right_lane_boundary_id: vec![boundary_id(number)],
                left_lane_boundary_id: vec![boundary_id(number - 1)],
                lane_pairing: Vec::new(),
            }),
        }
    });
    let boundaries = (0..=road.lanes()).map(|number| {
        let is_edge = number == 0 || number == road.lanes();
        let points = line(&|s_m| road.boundary_at_m(number, s_m)).into_iter().map(|position| BoundaryPoint {
            position: Some(position),
            width: Some(MARKING_WIDTH_M),
            height: Some(0.0),
        });
        LaneBoundary {
            id: Some(boundary_id(number)),
            boundary_line: points.collect(),
            classification: Some(LaneBoundaryClassification {
                r#type: Some(if is_edge { 3 } else { 4 }),
                color: Some(3),
            }),
        }
    });
    (lanes.collect(), boundaries.collect())
}

/// Returns light, rain and visibility in the levels of OSI.
fn environment(environment: &Environment) -> EnvironmentalConditions {
    const NOON_S: u32 = 43_200;
    let (light, seconds) = match environment.light {
        Light::Day => (9, NOON_S),
        Light::Dusk => (4, 77_400),
        Light::Night => (3, 0),
    };
    // Upper ends of the levels from "none" on, in mm/h, and lower ends of the levels from
    // "excellent" on, in m.
    let rain = [0.1, 0.5, 1.9, 8.1, 34.0, 149.0].partition_point(|end| *end <= environment.rain_mm_per_h);
    let visible = [40_000.0, 10_000.0, 4_000.0, 2_000.0, 1_000.0, 200.0, 50.0]
        .partition_point(|end| *end > environment.visibility_m);
    let level = |steps: usize| i32::try_from(steps).ok().map(|steps| 2 + steps);
    EnvironmentalConditions {
        ambient_illumination: Some(light),
        time_of_day: Some(TimeOfDay { seconds_since_midnight: Some(seconds) }),
        precipitation: level(rain),
        fog: level(visible),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weather_has_the_levels_of_the_standard() {
        let levels = |visibility_m, rain_mm_per_h| {
            let levels = environment(&Environment { visibility_m, rain_mm_per_h, ..Environment::CLEAR_DAY });
            (levels.fog.unwrap(), levels.precipitation.unwrap())
        };
        assert_eq!(levels(10_000.0, 0.0), (3, 2));
        assert_eq!(levels(150.0, 5.0), (8, 5));
        assert_eq!(levels(20.0, 200.0), (9, 8));
    }

    #[test]
    fn an_angle_is_brought_between_minus_and_plus_half_a_turn() {
        for angle_rad in [0.0, 3.0, -3.0] {
            assert!((wrapped(angle_rad) - angle_rad).abs() < 1e-12);
            assert!((wrapped(angle_rad + 2.0 * TAU) - angle_rad).abs() < 1e-12);
        }
    }
}
