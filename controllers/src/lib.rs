//! Who drives: the ego stack (ACC, AEB, MIS) and the human drivers.
//!
//! ```text
//!  truth ─▶ driver/  perception (late, coarse) ─▶ Wiedemann 99 │ IDM │ overtaker │ prescribed profile ─▶ acceleration, lane change
//!  tracks ─▶ ego/    surroundings ─▶ ACC ─┐
//!                                  MIS ─┼─▶ arbitration (stack) ─▶ acceleration, state, reason
//!                                  AEB ─┘
//! ```
//!
//! The type system forbids cheating: an ego controller is given its own odometry and tracks, never the truth; a human
//! driver is given the truth, and its own part is to perceive it late.
//!
//! A scenario's `driver` table is a [`DriverConfig`]; checked, it is a [`CheckedDriver`], from which a fresh driver is
//! built for each run.

mod braking;
mod config;
mod driver;
mod ego;

pub use config::{CheckedDriver, DriverConfig, HumanDriver};
pub use driver::{
    Deviation, Driver, DriverAction, DriverError, DriverInput, DriverNote, FollowConfig, Idm, IdmConfig, LaneChange,
    LaneKeeping, LaneKeepingConfig, LaneNeighbours, Lapse, LapseConfig, Lead, LogNormalConfig, Neighbour, Neighbours,
    Overtaker, OvertakerConfig, Prescribed, PrescribedConfig, PrescribedLaneChangeConfig, Reaction, ReactionConfig,
    RecordedConfig, Regime, Return, ReturnConfig, SpeedKeeping, SpeedKeepingConfig, Thresholds, Wander, Weave,
    Wiedemann99, Wiedemann99Config, Wiedemann99Driver, Wiedemann99Model,
};
pub use ego::{
    Acc, AccConfig, Aeb, AebConfig, ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack,
    EgoStackConfig, EgoState, Encounter, Foresight, Front, FrontFollower, MisConfig, MisPlan, MisSettings, Odometry,
    Reason, Response, SensorAvailability, Solution,
};
