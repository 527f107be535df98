//! The messages of `osi3.proto` as structs. Each number is the number of the field in the published
//! message.

use prost::Message;

/// `osi3.InterfaceVersion`
#[derive(Clone, PartialEq, Message)]
pub(super) struct InterfaceVersion {
    #[prost(uint32, optional, tag = "1")]
    pub(super) version_major: Option<u32>,
    #[prost(uint32, optional, tag = "2")]
    pub(super) version_minor: Option<u32>,
    #[prost(uint32, optional, tag = "3")]
    pub(super) version_patch: Option<u32>,
}

/// `osi3.Timestamp`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Timestamp {
    #[prost(int64, optional, tag = "1")]
    pub(super) seconds: Option<i64>,
    #[prost(uint32, optional, tag = "2")]
    pub(super) nanos: Option<u32>,
}

/// `osi3.Identifier`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Identifier {
    #[prost(uint64, optional, tag = "1")]
    pub(super) value: Option<u64>,
}

/// `osi3.Vector3d`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Vector3d {
    #[prost(double, optional, tag = "1")]
    pub(super) x: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub(super) y: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub(super) z: Option<f64>,
}

/// `osi3.Dimension3d`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Dimension3d {
    #[prost(double, optional, tag = "1")]
    pub(super) length: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub(super) width: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub(super) height: Option<f64>,
}

/// `osi3.Orientation3d`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Orientation3d {
    #[prost(double, optional, tag = "1")]
    pub(super) roll: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub(super) pitch: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub(super) yaw: Option<f64>,
}

/// `osi3.MountingPosition`
#[derive(Clone, PartialEq, Message)]
pub(super) struct MountingPosition {
    #[prost(message, optional, tag = "1")]
    pub(super) position: Option<Vector3d>,
    #[prost(message, optional, tag = "2")]
    pub(super) orientation: Option<Orientation3d>,
}

/// `osi3.BaseMoving`
#[derive(Clone, PartialEq, Message)]
pub(super) struct BaseMoving {
    #[prost(message, optional, tag = "1")]
    pub(super) dimension: Option<Dimension3d>,
    #[prost(message, optional, tag = "2")]
    pub(super) position: Option<Vector3d>,
    #[prost(message, optional, tag = "3")]
    pub(super) orientation: Option<Orientation3d>,
    #[prost(message, optional, tag = "4")]
    pub(super) velocity: Option<Vector3d>,
    #[prost(message, optional, tag = "5")]
    pub(super) acceleration: Option<Vector3d>,
    #[prost(message, optional, tag = "6")]
    pub(super) orientation_rate: Option<Orientation3d>,
}

/// `osi3.MovingObject.VehicleAttributes`
#[derive(Clone, PartialEq, Message)]
pub(super) struct VehicleAttributes {
    #[prost(double, optional, tag = "2")]
    pub(super) radius_wheel: Option<f64>,
    #[prost(message, optional, tag = "4")]
    pub(super) bbcenter_to_rear: Option<Vector3d>,
    #[prost(message, optional, tag = "5")]
    pub(super) bbcenter_to_front: Option<Vector3d>,
}

/// `osi3.MovingObject.VehicleClassification.LightState`
#[derive(Clone, PartialEq, Message)]
pub(super) struct LightState {
    #[prost(int32, optional, tag = "1")]
    pub(super) indicator_state: Option<i32>,
    #[prost(int32, optional, tag = "4")]
    pub(super) head_light: Option<i32>,
    #[prost(int32, optional, tag = "7")]
    pub(super) brake_light_state: Option<i32>,
}

/// `osi3.MovingObject.VehicleClassification`
#[derive(Clone, PartialEq, Message)]
pub(super) struct VehicleClassification {
    #[prost(int32, optional, tag = "1")]
    pub(super) r#type: Option<i32>,
    #[prost(message, optional, tag = "2")]
    pub(super) light_state: Option<LightState>,
    #[prost(bool, optional, tag = "3")]
    pub(super) has_trailer: Option<bool>,
    #[prost(int32, optional, tag = "5")]
    pub(super) role: Option<i32>,
}

/// `osi3.MovingObject.MovingObjectClassification`
#[derive(Clone, PartialEq, Message)]
pub(super) struct MovingObjectClassification {
    #[prost(message, repeated, tag = "1")]
    pub(super) assigned_lane_id: Vec<Identifier>,
    #[prost(double, repeated, packed = "false", tag = "2")]
    pub(super) assigned_lane_percentage: Vec<f64>,
}

/// `osi3.MovingObject`
#[derive(Clone, PartialEq, Message)]
pub(super) struct MovingObject {
    #[prost(message, optional, tag = "1")]
    pub(super) id: Option<Identifier>,
    #[prost(message, optional, tag = "2")]
    pub(super) base: Option<BaseMoving>,
    #[prost(int32, optional, tag = "3")]
    pub(super) r#type: Option<i32>,
    #[prost(message, repeated, tag = "4")]
    pub(super) assigned_lane_id: Vec<Identifier>,
    #[prost(message, optional, tag = "5")]
    pub(super) vehicle_attributes: Option<VehicleAttributes>,
    #[prost(message, optional, tag = "6")]
    pub(super) vehicle_classification: Option<VehicleClassification>,
    #[prost(message, optional, tag = "9")]
    pub(super) moving_object_classification: Option<MovingObjectClassification>,
}

/// `osi3.LaneBoundary.BoundaryPoint`
#[derive(Clone, PartialEq, Message)]
pub(super) struct BoundaryPoint {
    #[prost(message, optional, tag = "1")]
    pub(super) position: Option<Vector3d>,
    #[prost(double, optional, tag = "2")]
    pub(super) width: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub(super) height: Option<f64>,
}

/// `osi3.LaneBoundary.Classification`
#[derive(Clone, PartialEq, Message)]
pub(super) struct LaneBoundaryClassification {
    #[prost(int32, optional, tag = "1")]
    pub(super) r#type: Option<i32>,
    #[prost(int32, optional, tag = "2")]
    pub(super) color: Option<i32>,
}

/// `osi3.LaneBoundary`
#[derive(Clone, PartialEq, Message)]
pub(super) struct LaneBoundary {
    #[prost(message, optional, tag = "1")]
    pub(super) id: Option<Identifier>,
    #[prost(message, repeated, tag = "2")]
    pub(super) boundary_line: Vec<BoundaryPoint>,
    #[prost(message, optional, tag = "3")]
    pub(super) classification: Option<LaneBoundaryClassification>,
}

/// `osi3.Lane.Classification`
#[derive(Clone, PartialEq, Message)]
pub(super) struct LaneClassification {
    #[prost(int32, optional, tag = "1")]
    pub(super) r#type: Option<i32>,
    #[prost(bool, optional, tag = "2")]
    pub(super) is_host_vehicle_lane: Option<bool>,
    #[prost(message, repeated, tag = "3")]
    pub(super) centerline: Vec<Vector3d>,
    #[prost(bool, optional, tag = "4")]
    pub(super) centerline_is_driving_direction: Option<bool>,
    #[prost(message, repeated, tag = "5")]
    pub(super) left_adjacent_lane_id: Vec<Identifier>,
    #[prost(message, repeated, tag = "6")]
    pub(super) right_adjacent_lane_id: Vec<Identifier>,
    #[prost(message, repeated, tag = "8")]
    pub(super) right_lane_boundary_id: Vec<Identifier>,
    #[prost(message, repeated, tag = "9")]
    pub(super) left_lane_boundary_id: Vec<Identifier>,
}

/// `osi3.Lane`
#[derive(Clone, PartialEq, Message)]
pub(super) struct Lane {
    #[prost(message, optional, tag = "1")]
    pub(super) id: Option<Identifier>,
    #[prost(message, optional, tag = "2")]
    pub(super) classification: Option<LaneClassification>,
}

/// `osi3.EnvironmentalConditions.TimeOfDay`
#[derive(Clone, PartialEq, Message)]
pub(super) struct TimeOfDay {
    #[prost(uint32, optional, tag = "1")]
    pub(super) seconds_since_midnight: Option<u32>,
}

/// `osi3.EnvironmentalConditions`
#[derive(Clone, PartialEq, Message)]
pub(super) struct EnvironmentalConditions {
    #[prost(int32, optional, tag = "1")]
    pub(super) ambient_illumination: Option<i32>,
    #[prost(message, optional, tag = "2")]
    pub(super) time_of_day: Option<TimeOfDay>,
    #[prost(int32, optional, tag = "6")]
    pub(super) precipitation: Option<i32>,
    #[prost(int32, optional, tag = "7")]
    pub(super) fog: Option<i32>,
}

/// `osi3.GroundTruth`
#[derive(Clone, PartialEq, Message)]
pub(super) struct GroundTruth {
    #[prost(message, optional, tag = "1")]
    pub(super) version: Option<InterfaceVersion>,
    #[prost(message, optional, tag = "2")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub(super) host_vehicle_id: Option<Identifier>,
    #[prost(message, repeated, tag = "5")]
    pub(super) moving_object: Vec<MovingObject>,
    #[prost(message, repeated, tag = "9")]
    pub(super) lane_boundary: Vec<LaneBoundary>,
    #[prost(message, repeated, tag = "10")]
    pub(super) lane: Vec<Lane>,
    #[prost(message, optional, tag = "12")]
    pub(super) environmental_conditions: Option<EnvironmentalConditions>,
    #[prost(string, optional, tag = "15")]
    pub(super) map_reference: Option<String>,
}

/// `osi3.DetectedItemHeader`
#[derive(Clone, PartialEq, Message)]
pub(super) struct DetectedItemHeader {
    #[prost(message, optional, tag = "1")]
    pub(super) tracking_id: Option<Identifier>,
    #[prost(double, optional, tag = "3")]
    pub(super) existence_probability: Option<f64>,
    #[prost(int32, optional, tag = "5")]
    pub(super) measurement_state: Option<i32>,
    #[prost(message, repeated, tag = "6")]
    pub(super) sensor_id: Vec<Identifier>,
}

/// `osi3.DetectedMovingObject.CandidateMovingObject`
#[derive(Clone, PartialEq, Message)]
pub(super) struct CandidateMovingObject {
    #[prost(double, optional, tag = "1")]
    pub(super) probability: Option<f64>,
    #[prost(int32, optional, tag = "2")]
    pub(super) r#type: Option<i32>,
    #[prost(message, optional, tag = "3")]
    pub(super) vehicle_classification: Option<VehicleClassification>,
}

/// `osi3.DetectedMovingObject`
#[derive(Clone, PartialEq, Message)]
pub(super) struct DetectedMovingObject {
    #[prost(message, optional, tag = "1")]
    pub(super) header: Option<DetectedItemHeader>,
    #[prost(message, optional, tag = "2")]
    pub(super) base: Option<BaseMoving>,
    #[prost(message, optional, tag = "3")]
    pub(super) base_rmse: Option<BaseMoving>,
    #[prost(message, repeated, tag = "8")]
    pub(super) candidate: Vec<CandidateMovingObject>,
}

/// `osi3.SensorData`
#[derive(Clone, PartialEq, Message)]
pub(super) struct SensorData {
    #[prost(message, optional, tag = "1")]
    pub(super) version: Option<InterfaceVersion>,
    #[prost(message, optional, tag = "2")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub(super) host_vehicle_location: Option<BaseMoving>,
    #[prost(message, optional, tag = "5")]
    pub(super) sensor_id: Option<Identifier>,
    #[prost(message, optional, tag = "6")]
    pub(super) mounting_position: Option<MountingPosition>,
    #[prost(message, optional, tag = "9")]
    pub(super) last_measurement_time: Option<Timestamp>,
    #[prost(message, repeated, tag = "13")]
    pub(super) moving_object: Vec<DetectedMovingObject>,
}

/// `osi3.MapAsamOpenDrive`
#[derive(Clone, PartialEq, Message)]
pub(super) struct MapAsamOpenDrive {
    #[prost(string, optional, tag = "1")]
    pub(super) map_reference: Option<String>,
    #[prost(string, optional, tag = "2")]
    pub(super) open_drive_xml_content: Option<String>,
}
