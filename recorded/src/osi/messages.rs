//! The messages of `osi3.proto` as structs. Each number is the number of the field in the published
//! message.

use prost::Message;

/// `osi3.InterfaceVersion`
#[derive(Clone, PartialEq, Message)]
pub struct InterfaceVersion {
    #[prost(uint32, optional, tag = "1")]
    pub version_major: Option<u32>,
    #[prost(uint32, optional, tag = "2")]
    pub version_minor: Option<u32>,
    #[prost(uint32, optional, tag = "3")]
    pub version_patch: Option<u32>,
}

/// `osi3.Timestamp`
#[derive(Clone, PartialEq, Message)]
pub struct Timestamp {
    #[prost(int64, optional, tag = "1")]
    pub seconds: Option<i64>,
    #[prost(uint32, optional, tag = "2")]
    pub nanos: Option<u32>,
}

/// `osi3.Identifier`
#[derive(Clone, PartialEq, Message)]
pub struct Identifier {
    #[prost(uint64, optional, tag = "1")]
    pub value: Option<u64>,
}

/// `osi3.Vector3d`
#[derive(Clone, PartialEq, Message)]
pub struct Vector3d {
    #[prost(double, optional, tag = "1")]
    pub x: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub y: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub z: Option<f64>,
}

/// `osi3.Dimension3d`
#[derive(Clone, PartialEq, Message)]
pub struct Dimension3d {
    #[prost(double, optional, tag = "1")]
    pub length: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub width: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub height: Option<f64>,
}

/// `osi3.Orientation3d`
#[derive(Clone, PartialEq, Message)]
pub struct Orientation3d {
    #[prost(double, optional, tag = "1")]
    pub roll: Option<f64>,
    #[prost(double, optional, tag = "2")]
    pub pitch: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub yaw: Option<f64>,
}

/// `osi3.MountingPosition`
#[derive(Clone, PartialEq, Message)]
pub struct MountingPosition {
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3d>,
    #[prost(message, optional, tag = "2")]
    pub orientation: Option<Orientation3d>,
}

/// `osi3.BaseMoving`
#[derive(Clone, PartialEq, Message)]
pub struct BaseMoving {
    #[prost(message, optional, tag = "1")]
    pub dimension: Option<Dimension3d>,
    #[prost(message, optional, tag = "2")]
    pub position: Option<Vector3d>,
    #[prost(message, optional, tag = "3")]
    pub orientation: Option<Orientation3d>,
    #[prost(message, optional, tag = "4")]
    pub velocity: Option<Vector3d>,
    #[prost(message, optional, tag = "5")]
    pub acceleration: Option<Vector3d>,
    #[prost(message, optional, tag = "6")]
    pub orientation_rate: Option<Orientation3d>,
}

/// `osi3.MovingObject.VehicleAttributes`
#[derive(Clone, PartialEq, Message)]
pub struct VehicleAttributes {
    #[prost(double, optional, tag = "2")]
    pub radius_wheel: Option<f64>,
    #[prost(message, optional, tag = "4")]
    pub bbcenter_to_rear: Option<Vector3d>,
    #[prost(message, optional, tag = "5")]
    pub bbcenter_to_front: Option<Vector3d>,
}

/// `osi3.MovingObject.VehicleClassification.LightState`
#[derive(Clone, PartialEq, Message)]
pub struct LightState {
    #[prost(int32, optional, tag = "1")]
    pub indicator_state: Option<i32>,
    #[prost(int32, optional, tag = "4")]
    pub head_light: Option<i32>,
    #[prost(int32, optional, tag = "7")]
    pub brake_light_state: Option<i32>,
}

/// `osi3.MovingObject.VehicleClassification`
#[derive(Clone, PartialEq, Message)]
pub struct VehicleClassification {
    #[prost(int32, optional, tag = "1")]
    pub r#type: Option<i32>,
    #[prost(message, optional, tag = "2")]
    pub light_state: Option<LightState>,
    #[prost(bool, optional, tag = "3")]
    pub has_trailer: Option<bool>,
    #[prost(int32, optional, tag = "5")]
    pub role: Option<i32>,
}

/// `osi3.MovingObject.MovingObjectClassification`
#[derive(Clone, PartialEq, Message)]
pub struct MovingObjectClassification {
    #[prost(message, repeated, tag = "1")]
    pub assigned_lane_id: Vec<Identifier>,
    #[prost(double, repeated, packed = "false", tag = "2")]
    pub assigned_lane_percentage: Vec<f64>,
}

/// `osi3.MovingObject`
#[derive(Clone, PartialEq, Message)]
pub struct MovingObject {
    #[prost(message, optional, tag = "1")]
    pub id: Option<Identifier>,
    #[prost(message, optional, tag = "2")]
    pub base: Option<BaseMoving>,
    #[prost(int32, optional, tag = "3")]
    pub r#type: Option<i32>,
    #[prost(message, repeated, tag = "4")]
    pub assigned_lane_id: Vec<Identifier>,
    #[prost(message, optional, tag = "5")]
    pub vehicle_attributes: Option<VehicleAttributes>,
    #[prost(message, optional, tag = "6")]
    pub vehicle_classification: Option<VehicleClassification>,
    #[prost(message, optional, tag = "9")]
    pub moving_object_classification: Option<MovingObjectClassification>,
}

/// `osi3.LaneBoundary.BoundaryPoint`
#[derive(Clone, PartialEq, Message)]
pub struct BoundaryPoint {
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3d>,
    #[prost(double, optional, tag = "2")]
    pub width: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub height: Option<f64>,
}

/// `osi3.LaneBoundary.Classification`
#[derive(Clone, PartialEq, Message)]
pub struct LaneBoundaryClassification {
    #[prost(int32, optional, tag = "1")]
    pub r#type: Option<i32>,
    #[prost(int32, optional, tag = "2")]
    pub color: Option<i32>,
}

/// `osi3.LaneBoundary`
#[derive(Clone, PartialEq, Message)]
pub struct LaneBoundary {
    #[prost(message, optional, tag = "1")]
    pub id: Option<Identifier>,
    #[prost(message, repeated, tag = "2")]
    pub boundary_line: Vec<BoundaryPoint>,
    #[prost(message, optional, tag = "3")]
    pub classification: Option<LaneBoundaryClassification>,
}

/// `osi3.Lane.Classification.LanePairing`
#[derive(Clone, PartialEq, Message)]
pub struct LanePairing {
    #[prost(message, optional, tag = "1")]
    pub antecessor_lane_id: Option<Identifier>,
    #[prost(message, optional, tag = "2")]
    pub successor_lane_id: Option<Identifier>,
}

/// `osi3.Lane.Classification`
#[derive(Clone, PartialEq, Message)]
pub struct LaneClassification {
    #[prost(int32, optional, tag = "1")]
    pub r#type: Option<i32>,
    #[prost(bool, optional, tag = "2")]
    pub is_host_vehicle_lane: Option<bool>,
    #[prost(message, repeated, tag = "3")]
    pub centerline: Vec<Vector3d>,
    #[prost(bool, optional, tag = "4")]
    pub centerline_is_driving_direction: Option<bool>,
    #[prost(message, repeated, tag = "5")]
    pub left_adjacent_lane_id: Vec<Identifier>,
    #[prost(message, repeated, tag = "6")]
    pub right_adjacent_lane_id: Vec<Identifier>,
    #[prost(message, repeated, tag = "7")]
    pub lane_pairing: Vec<LanePairing>,
    #[prost(message, repeated, tag = "8")]
    pub right_lane_boundary_id: Vec<Identifier>,
    #[prost(message, repeated, tag = "9")]
    pub left_lane_boundary_id: Vec<Identifier>,
}

/// `osi3.Lane`
#[derive(Clone, PartialEq, Message)]
pub struct Lane {
    #[prost(message, optional, tag = "1")]
    pub id: Option<Identifier>,
    #[prost(message, optional, tag = "2")]
    pub classification: Option<LaneClassification>,
}

/// `osi3.EnvironmentalConditions.TimeOfDay`
#[derive(Clone, PartialEq, Message)]
pub struct TimeOfDay {
    #[prost(uint32, optional, tag = "1")]
    pub seconds_since_midnight: Option<u32>,
}

/// `osi3.EnvironmentalConditions`
#[derive(Clone, PartialEq, Message)]
pub struct EnvironmentalConditions {
    #[prost(int32, optional, tag = "1")]
    pub ambient_illumination: Option<i32>,
    #[prost(message, optional, tag = "2")]
    pub time_of_day: Option<TimeOfDay>,
    #[prost(int32, optional, tag = "6")]
    pub precipitation: Option<i32>,
    #[prost(int32, optional, tag = "7")]
    pub fog: Option<i32>,
}

/// `osi3.GroundTruth`
#[derive(Clone, PartialEq, Message)]
pub struct GroundTruth {
    #[prost(message, optional, tag = "1")]
    pub version: Option<InterfaceVersion>,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub host_vehicle_id: Option<Identifier>,
    #[prost(message, repeated, tag = "5")]
    pub moving_object: Vec<MovingObject>,
    #[prost(message, repeated, tag = "9")]
    pub lane_boundary: Vec<LaneBoundary>,
    #[prost(message, repeated, tag = "10")]
    pub lane: Vec<Lane>,
    #[prost(message, optional, tag = "12")]
    pub environmental_conditions: Option<EnvironmentalConditions>,
    #[prost(string, optional, tag = "15")]
    pub map_reference: Option<String>,
}

/// `osi3.DetectedItemHeader`
#[derive(Clone, PartialEq, Message)]
pub struct DetectedItemHeader {
    #[prost(message, optional, tag = "1")]
    pub tracking_id: Option<Identifier>,
    #[prost(double, optional, tag = "3")]
    pub existence_probability: Option<f64>,
    #[prost(int32, optional, tag = "5")]
    pub measurement_state: Option<i32>,
    #[prost(message, repeated, tag = "6")]
    pub sensor_id: Vec<Identifier>,
}

/// `osi3.DetectedMovingObject.CandidateMovingObject`
#[derive(Clone, PartialEq, Message)]
pub struct CandidateMovingObject {
    #[prost(double, optional, tag = "1")]
    pub probability: Option<f64>,
    #[prost(int32, optional, tag = "2")]
    pub r#type: Option<i32>,
    #[prost(message, optional, tag = "3")]
    pub vehicle_classification: Option<VehicleClassification>,
}

/// `osi3.DetectedMovingObject`
#[derive(Clone, PartialEq, Message)]
pub struct DetectedMovingObject {
    #[prost(message, optional, tag = "1")]
    pub header: Option<DetectedItemHeader>,
    #[prost(message, optional, tag = "2")]
    pub base: Option<BaseMoving>,
    #[prost(message, optional, tag = "3")]
    pub base_rmse: Option<BaseMoving>,
    #[prost(message, repeated, tag = "8")]
    pub candidate: Vec<CandidateMovingObject>,
}

/// `osi3.SensorData`
#[derive(Clone, PartialEq, Message)]
pub struct SensorData {
    #[prost(message, optional, tag = "1")]
    pub version: Option<InterfaceVersion>,
    #[prost(message, optional, tag = "2")]
    pub timestamp: Option<Timestamp>,
    #[prost(message, optional, tag = "3")]
    pub host_vehicle_location: Option<BaseMoving>,
    #[prost(message, optional, tag = "5")]
    pub sensor_id: Option<Identifier>,
    #[prost(message, optional, tag = "6")]
    pub mounting_position: Option<MountingPosition>,
    #[prost(message, optional, tag = "9")]
    pub last_measurement_time: Option<Timestamp>,
    #[prost(message, repeated, tag = "13")]
    pub moving_object: Vec<DetectedMovingObject>,
}

/// `osi3.MapAsamOpenDrive`
#[derive(Clone, PartialEq, Message)]
pub struct MapAsamOpenDrive {
    #[prost(string, optional, tag = "1")]
    pub map_reference: Option<String>,
    #[prost(string, optional, tag = "2")]
    pub open_drive_xml_content: Option<String>,
}
