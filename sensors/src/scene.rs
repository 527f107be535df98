//! The world as the sensor models see it: the truth that they measure with all their limits.

use closecall_traffic::{Environment, Road, Time, Vehicle, VehicleState};

/// One vehicle of a scene.
#[derive(Clone, Copy, Debug)]
pub struct SceneVehicle {
    /// Its place in the scenario's list of actors: truth labels name it by this.
    pub actor: usize,
    /// What it is.
    pub vehicle: Vehicle,
    /// Where it is and how it moves.
    pub state: VehicleState,
    /// Pitch of the body, positive nose down, as under braking [rad].
    pub pitch_rad: f64,
}

/// Everything a sensor of E could see at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The instant.
    pub time: Time,
    /// The road.
    pub road: &'a Road,
    /// Light, weather and surface.
    pub environment: &'a Environment,
    /// E itself.
    pub ego: SceneVehicle,
    /// All the others, in the order of their names.
    pub others: &'a [SceneVehicle],
}
