//! The names in the files. OpenLABEL and its ontology define some, and Closecall the others.

use closecall_traffic::{Side, VehicleClass};

/// The version of the schema.
pub(crate) const SCHEMA_VERSION: &str = "1.0.0";

/// The address of ASAM's ontology.
pub(crate) const ONTOLOGY: &str = "https://openlabel.asam.net/V1-0-0/ontologies/";

/// The coordinate system of the recorded road: x along the road, y to the left of the left edge of
/// lane 1, z up (m).
pub(crate) const ROAD: &str = "closecall-road";

/// The type of coordinate systems that do not move.
pub(crate) const SCENE: &str = "scene_cs";

/// The type of a lane in ASAM's ontology.
pub(crate) const LANE_TYPE: &str = "LaneTypeTraffic";

/// The cuboid of a vehicle.
pub(crate) const SHAPE: &str = "shape";

/// Numbers of a vehicle in a frame.
pub(crate) const SPEED: &str = "speed_mps";
pub(crate) const ACCELERATION: &str = "acceleration_mps2";
pub(crate) const LANE: &str = "lane";
/// Time of a vehicle's point (s), if it differs from the frame's.
pub(crate) const TIME: &str = "time_s";
/// Number of the vehicle, if it differs from the number of its track.
pub(crate) const VEHICLE: &str = "vehicle_id";
/// Lateral position of the right edge of a lane (m).
pub(crate) const RIGHT_EDGE: &str = "right_edge_m";

/// Returns the term of a vehicle class in ASAM's ontology.
pub(crate) const fn vehicle_type(class: VehicleClass) -> &'static str {
    match class {
        VehicleClass::Car => "VehicleCar",
        VehicleClass::Truck => "VehicleTruck",
        VehicleClass::Motorcycle => "VehicleMotorcycle",
    }
}

/// Returns the term of a lane change in ASAM's ontology.
pub(crate) const fn lane_change_type(side: Side) -> &'static str {
    match side {
        Side::Left => "MotionLaneChangeLeft",
        Side::Right => "MotionLaneChangeRight",
    }
}
