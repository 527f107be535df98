//! The other vehicles in the ego's frame, computed once per step and shared by all object-level
//! models.

use closecall_traffic::{Appearance, VehicleClass, maths};

use crate::{Scene, SceneVehicle, SensorError};
use closecall_traffic::ego_frame::EgoFrame;

/// The true state of another vehicle, in road coordinates and in the ego's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OtherVehicle {
    /// Index in the scenario's list of actors.
    pub(crate) actor: usize,
    pub(crate) class: VehicleClass,
    pub(crate) appearance: Appearance,
    pub(crate) length_m: f64,
    pub(crate) width_m: f64,
    /// Road coordinates (s, d) of the box's centre (m).
    pub(crate) road_m: [f64; 2],
    /// Rate of change of `road_m` (m/s).
    pub(crate) road_mps: [f64; 2],
    /// Position of the box's centre ahead of the ego (m).
    pub(crate) x_m: f64,
    /// Position of the box's centre to the left of the ego (m).
    pub(crate) y_m: f64,
    /// Heading relative to the ego's (rad).
    pub(crate) heading_rad: f64,
    /// Sine of `heading_rad`.
    pub(crate) sin: f64,
    /// Cosine of `heading_rad`.
    pub(crate) cos: f64,
    /// Speed over ground along the vehicle's heading (m/s).
    pub(crate) speed_mps: f64,
}

/// Returns an error if a vehicle's state is not finite, so that no sensor turns it into a
/// measurement that looks safe.
fn check_finite(vehicle: &SceneVehicle, scene: &Scene<'_>) -> Result<(), SensorError> {
    let state = &vehicle.state;
    let sum = state.s_m + state.d_m + state.heading_rad + state.speed_mps;
    if sum.is_finite() {
        Ok(())
    } else {
        Err(SensorError::NotFinite { quantity: "a vehicle's state", time: scene.time })
    }
}

/// Replaces the contents of `others` with the scene's other vehicles, and returns the ego's frame.
pub(crate) fn transform_scene<'a>(
    scene: &Scene<'a>,
    others: &mut Vec<OtherVehicle>,
) -> Result<EgoFrame<'a>, SensorError> {
    check_finite(&scene.ego, scene)?;
    let frame = EgoFrame::new(scene.road, &scene.ego.state);
    others.clear();
    for vehicle in scene.others {
        check_finite(vehicle, scene)?;
        let state = &vehicle.state;
        let point = frame.point(state.s_m, state.d_m);
        let heading_rad = point.road_yaw_rad + state.heading_rad;
        let (sin, cos) = maths::sin_cos(heading_rad);
        let (road_sin, road_cos) = maths::sin_cos(state.heading_rad);
        // On the inside of a bend, a vehicle passes more metres of the reference line than it
        // drives.
        let path_scale = scene.road.path_scale(state.s_m, state.d_m);
        others.push(OtherVehicle {
            actor: vehicle.actor,
            class: vehicle.vehicle.class,
            appearance: vehicle.vehicle.appearance,
            length_m: vehicle.vehicle.dimensions.length_m,
            width_m: vehicle.vehicle.dimensions.width_m,
            road_m: [state.s_m, state.d_m],
            road_mps: [state.speed_mps * road_cos / path_scale, state.speed_mps * road_sin],
            x_m: point.x_m,
            y_m: point.y_m,
            heading_rad,
            sin,
            cos,
            speed_mps: state.speed_mps,
        });
    }
    Ok(frame)
}
