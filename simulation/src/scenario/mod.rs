//! Scenarios: from the text of a file to one concrete scenario.
//!
//! ```text
//!  file ─▶ ScenarioFile ─(parameters of one sample)─▶ Scenario ─▶ simulation
//!          text, checked keys                         numbers, checked ranges
//! ```
//!
//! A scenario file describes a *logical* scenario: fixed values, and parameters that are sampled. The parameter values of
//! one sample turn it into a *concrete* scenario, [`Scenario`], which is valid by construction.

mod base;
mod checked;
mod config;
mod edit;
mod events;
mod file;
mod fleet;
mod inert_fault;
mod inert_object_fault;
mod intervention;
pub mod library;
mod lidar_file;
mod locate;
pub mod member;
mod overridden;
mod placement;
mod recorded;
mod recorded_values;
mod reenacted;
mod sampled;
mod schema;
pub mod source;
mod step_value;
mod traffic;
mod variation;

pub use checked::{Actor, Scenario};
pub use config::{
    AbsoluteStartConfig, ActorConfig, RandomNumbersConfig, RelativeStartConfig, SCHEMA_VERSION, ScenarioConfig,
    StartConfig,
};
pub use edit::{Setting, SettingError};
pub(crate) use events::{Brake, Effect, Event, Trigger};
pub use events::{
    BrakeConfig, CutOutStartedConfig, EffectConfig, EventConfig, LaneChangeConfig, NominalEncounterConfig,
    ThwBelowConfig, TriggerConfig,
};
pub use file::{ScenarioError, ScenarioFile};
pub use intervention::{FaultConfig, IdealConfig, MisState};
pub use reenacted::{RearDriver, actor_name, reenact};
pub use sampled::{SampledEncounter, opp2_of, sampled};
pub use schema::strict_schema;
pub use step_value::{StepValue, Variation};
pub use traffic::{ClassWeightsConfig, TrafficConfig};
