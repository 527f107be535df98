//! The ego stack: adaptive cruise control (ACC), automatic emergency braking (AEB), and the margin
//! increase system (MIS) above them.

mod acc;
mod aeb;
mod following_distance;
mod human;
mod interface;
mod mis;
mod r157_driver;
mod r157_fuzzy;
mod reason;
mod settings;
mod slower;
mod stack;
mod surroundings;

#[cfg(test)]
pub(crate) use acc::GapPolicy;
pub use acc::{Acc, AccConfig};
pub use aeb::{Aeb, AebConfig};
pub use human::EgoDriver;
pub use interface::{ControllerError, EgoCommand, EgoController, EgoInput, EgoState, Odometry, SensorAvailability};
pub use mis::{
    ACTUATOR_LAG_S, ArrivalPrediction, BRAKE_RELEASE_JERK_MPS3, BrakingResponse, Encounter, GOAL_TOLERANCE_S, Horizon,
    MisConfig, MisPlan, MisSettings, Solution,
};
pub use r157_driver::R157Driver;
pub use r157_fuzzy::R157Fuzzy;
pub use reason::Reason;
pub use settings::{EgoSettings, EgoStackConfig, StackPatch};
pub use slower::{Slower, Slowing};
pub use stack::EgoStack;
pub use surroundings::{Front, LeadVehicleSelector};
