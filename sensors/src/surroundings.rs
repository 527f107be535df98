//! The scene turned into E's frame once for each step, for all object-level models to share.

use closecall_traffic::VehicleClass;

use crate::ego_frame::EgoFrame;
use crate::{Scene, SceneVehicle, SensorError};

/// Another vehicle as it truly is, in road coordinates and in E's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Other {
    /// Its place in the scenario's list of actors.
    pub(crate) actor: usize,
    pub(crate) class: VehicleClass,
    pub(crate) length_m: f64,
    pub(crate) width_m: f64,
    /// Position along the road and to the left [m].
    pub(crate) road_m: [f64; 2],
    /// Rate of change of `road_m` [m/s].
    pub(crate) road_mps: [f64; 2],
    /// Position of the box's centre in E's frame [m].
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    /// Heading relative to E's [rad], with its sine and cosine.
    pub(crate) heading_rad: f64,
    pub(crate) sin: f64,
    pub(crate) cos: f64,
    /// Speed over ground along its heading [m/s].
    pub(crate) speed_mps: f64,
}

/// Refuses a vehicle whose state is not finite, which no sensor could turn into a safe-looking measurement.
fn check_finite(vehicle: &SceneVehicle, scene: &Scene<'_>) -> Result<(), SensorError> {
    let state = &vehicle.state;
    let sum = state.s_m + state.d_m + state.heading_rad + state.speed_mps;
    if sum.is_finite() { Ok(()) } else { Err(SensorError::NotFinite { what: "a vehicle's state", time: scene.time }) }
}

/// Writes all other vehicles of the scene into `others`, whose memory is used again.
pub(crate) fn survey<'a>(scene: &Scene<'a>, others: &mut Vec<Other>) -> Result<EgoFrame<'a>, SensorError> {
    check_finite(&scene.ego, scene)?;
    let frame = EgoFrame::new(scene.road, &scene.ego.state);
    let curvature_per_m = scene.road.curvature_per_m();
    others.clear();
    for vehicle in scene.others {
        check_finite(vehicle, scene)?;
        let state = &vehicle.state;
        let point = frame.point(state.s_m, state.d_m);
        let heading_rad = point.road_yaw_rad + state.heading_rad;
        let (sin, cos) = heading_rad.sin_cos();
        let (road_sin, road_cos) = state.heading_rad.sin_cos();
        // A vehicle on the inside of a bend covers more of the reference line than of its own path.
        let stretch = 1.0 - curvature_per_m * state.d_m;
        others.push(Other {
            actor: vehicle.actor,
            class: vehicle.vehicle.class,
            length_m: vehicle.vehicle.dimensions.length_m,
            width_m: vehicle.vehicle.dimensions.width_m,
            road_m: [state.s_m, state.d_m],
            road_mps: [state.speed_mps * road_cos / stretch, state.speed_mps * road_sin],
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
