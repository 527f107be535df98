//! The true state of the world at one instant: the input of the sensor models.

use crate::{Environment, Road, Time, Vehicle, VehicleState};

/// One vehicle of a scene.
#[derive(Clone, Copy, Debug)]
pub struct SceneVehicle {
    /// Index of the vehicle in the scenario's list of actors; truth labels refer to it.
    pub actor: usize,
    /// Class and dimensions.
    pub vehicle: Vehicle,
    /// Position and motion.
    pub state: VehicleState,
    /// Pitch of the body (rad); positive nose down, as under braking.
    pub pitch_rad: f64,
}

/// The true surroundings of the ego at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The instant.
    pub time: Time,
    /// The road.
    pub road: &'a Road,
    /// Light, weather and surface.
    pub environment: &'a Environment,
    /// The ego vehicle.
    pub ego: SceneVehicle,
    /// All other vehicles, in the order of their names.
    pub others: &'a [SceneVehicle],
}
