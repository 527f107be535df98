//! The ego stack: adaptive cruise control, emergency braking, and the margin increase system above them.

mod acc;
mod aeb;
mod interface;
mod mis;
mod reason;
mod settings;
mod stack;
mod surroundings;

pub use acc::{Acc, AccConfig};
pub use aeb::{Aeb, AebConfig};
pub use interface::{ControllerError, EgoCommand, EgoController, EgoInput, EgoState, Odometry, SensorAvailability};
pub use mis::{Encounter, Foresight, MisConfig, MisPlan, MisSettings, Response, Solution};
pub use reason::Reason;
pub use settings::{EgoSettings, EgoStackConfig};
pub use stack::EgoStack;
pub use surroundings::{Front, FrontFollower};
