//! The vehicle controllers: the ego stack (ACC, AEB, MIS), the human driver models, and external
//! controllers.
//!
//! ```text
//!  ground truth ─▶ driver/  perception (delayed, coarse) ─▶ Wiedemann 99 │ IDM │ overtaker │ prescribed profile
//!                                                          ─▶ acceleration, lane change
//!  tracks ───────▶ ego/     surroundings ─▶ ACC ─┐
//!                                           MIS ─┼─▶ arbitration (stack) ─▶ acceleration, state, reason
//!                                           AEB ─┘
//!  the ego may have a human driver in place of ACC and MIS: ground truth ─▶ driver/, tracks ─▶ AEB
//! ```
//!
//! The types keep the ground truth from the ego: an ego controller receives its own odometry and
//! tracks, never the ground truth. A human driver model receives the ground truth, and itself
//! models delayed perception.
//!
//! [`reference`](mod@reference) holds the performance models of UN Regulation 157. [`external`]
//! loads ego controllers that are shared libraries or functional mock-up units.
//!
//! The `driver` table of a scenario file is a [`DriverConfig`]. Checking it yields a
//! [`CheckedDriver`], from which each run builds a new driver.

mod braking;
mod config;
mod driver;
mod ego;
pub mod external;
pub mod reference;

pub use config::{CheckedDriver, DriverConfig, HumanDriver};
pub use driver::{
    DesiredSpeedNoise, Deviation, Driver, DriverAction, DriverError, DriverInput, DriverNote, ENTRY_STOP_MPS2,
    Evidence, EvidenceConfig, Follow, FollowConfig, Idm, IdmConfig, LaneChange, LaneKeeping, LaneKeepingConfig,
    LaneNeighbours, Lapse, LapseConfig, Lead, LogNormalConfig, Looks, Neighbour, Neighbours, Overtaker,
    OvertakerConfig, PerceptionConfig, PerceptionSettings, Prescribed, PrescribedConfig, PrescribedLaneChangeConfig,
    Reaction, ReactionChange, ReactionConfig, RecordedConfig, Regime, Return, ReturnConfig, SpeedKeeping,
    SpeedKeepingConfig, Thresholds, Weave, Wiedemann99, Wiedemann99Config, Wiedemann99Driver, Wiedemann99Model,
    entry_change_duration_s, entry_stop_distance_m,
};
pub use ego::{
    ACTUATOR_LAG_S, Acc, AccConfig, Aeb, AebConfig, ArrivalPrediction, BRAKE_RELEASE_JERK_MPS3, BrakingResponse,
    ControllerError, EgoCommand, EgoController, EgoDriver, EgoInput, EgoSettings, EgoStack, EgoStackConfig, EgoState,
    Encounter, Front, GOAL_TOLERANCE_S, Horizon, LeadVehicleSelector, MisConfig, MisPlan, MisSettings, Odometry,
    R157Driver, R157Fuzzy, Reason, SensorAvailability, Slower, Slowing, Solution, StackPatch,
};
