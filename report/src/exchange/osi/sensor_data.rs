//! `SensorData`: the tracks that the ego perceives, with the accuracy of each value.

use closecall_recorded::osi::{
    BaseMoving, CandidateMovingObject, DetectedItemHeader, DetectedMovingObject, Dimension3d, MountingPosition,
    SensorData, Vector3d,
};
use closecall_scenarios::Scenario;
use closecall_traffic::{Source, Track, TrackStatus, VehicleClass};

use super::ground_truth::{WHEEL_RADIUS_M, base, classification, identifier, orientation, timestamp, vector, version};
use super::recorder::Step;

/// Number of the virtual sensor whose frame the tracks have: the ego's vehicle frame.
const VIRTUAL_SENSOR: u64 = 30_000;

/// Returns the message of a step. The virtual sensor sits on the ground below the centre of the
/// ego's box.
pub(super) fn sensor_data(scenario: &Scenario, step: &Step) -> SensorData {
    let ego = &scenario.actors[scenario.ego].vehicle;
    let moving = step.vehicles.get(scenario.ego).copied().unwrap_or_default();
    let latest = step.tracks.iter().map(|track| track.time).max().unwrap_or(step.time);
    SensorData {
        version: Some(version()),
        timestamp: Some(timestamp(step.time)),
        host_vehicle_location: Some(base(&scenario.road, ego, &moving)),
        sensor_id: Some(identifier(VIRTUAL_SENSOR)),
        mounting_position: Some(MountingPosition {
            position: Some(vector(0.5 * ego.dimensions.wheelbase_m(), 0.0, -WHEEL_RADIUS_M)),
            orientation: Some(orientation(0.0, 0.0)),
        }),
        last_measurement_time: Some(timestamp(latest)),
        moving_object: step.tracks.iter().map(|track| detected(track, moving.state.speed_mps)).collect(),
    }
}

/// Returns a track. OSI asks for velocities relative to the ego, and has no place for the
/// covariances of two values.
fn detected(track: &Track, ego_mps: f64) -> DetectedMovingObject {
    let [x, y, vx, vy] = [0, 1, 2, 3].map(|index| track.state[index]);
    let deviation = |index: usize| Some(track.covariance[(index, index)].max(0.0).sqrt());
    let planar = |x, y| Vector3d { x, y, z: None };
    DetectedMovingObject {
        header: Some(DetectedItemHeader {
            tracking_id: Some(identifier(track.id.0.into())),
            existence_probability: Some(track.existence),
            measurement_state: Some(if track.status == TrackStatus::Coasting { 3 } else { 2 }),
            sensor_id: vec![identifier(VIRTUAL_SENSOR + 1 + source_number(track.source))],
        }),
        base: Some(BaseMoving {
            dimension: Some(Dimension3d { length: Some(track.length_m), width: Some(track.width_m), height: None }),
            position: Some(vector(x, y, 0.0)),
            orientation: Some(orientation(0.0, track.heading_rad)),
            velocity: Some(vector(vx - ego_mps, vy, 0.0)),
            ..BaseMoving::default()
        }),
        base_rmse: Some(BaseMoving {
            position: Some(planar(deviation(0), deviation(1))),
            velocity: Some(planar(deviation(2), deviation(3))),
            ..BaseMoving::default()
        }),
        candidate: VehicleClass::ALL.map(|class| candidate(track, class)).into(),
    }
}

fn source_number(source: Source) -> u64 {
    match source {
        Source::Front => 0,
        Source::Surround => 1,
        Source::Rear => 2,
    }
}

fn candidate(track: &Track, class: VehicleClass) -> CandidateMovingObject {
    const TYPE_VEHICLE: i32 = 2;
    CandidateMovingObject {
        probability: Some(track.class.0[class as usize]),
        r#type: Some(TYPE_VEHICLE),
        vehicle_classification: Some(classification(class, None)),
    }
}
