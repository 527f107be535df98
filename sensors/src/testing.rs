//! Vehicles for the scenes of the unit tests.

use closecall_traffic::{Vehicle, VehicleClass, VehicleState};

use crate::SceneVehicle;

/// Lateral position of the centre of the middle one of three lanes of 3.75 m (m).
pub(crate) const OWN_LANE_M: f64 = -5.625;

/// Returns a typical vehicle of `class` at rest.
pub(crate) fn scene_vehicle(actor: usize, class: VehicleClass, s_m: f64, d_m: f64) -> SceneVehicle {
    let state = VehicleState { s_m, d_m, ..VehicleState::default() };
    SceneVehicle { actor, vehicle: Vehicle::typical(class), state, pitch_rad: 0.0 }
}

/// Returns the same vehicle with another speed.
pub(crate) fn with_speed(mut vehicle: SceneVehicle, speed_mps: f64) -> SceneVehicle {
    vehicle.state.speed_mps = speed_mps;
    vehicle
}
