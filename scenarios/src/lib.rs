//! Scenarios: from the text of a file to one concrete scenario.
//!
//! ```text
//!  file ─▶ ScenarioFile ─(parameters of one sample)─▶ Scenario ─▶ simulation
//!          text, checked keys                         numbers, checked ranges
//! ```
//!
//! A scenario file describes a *logical* scenario: fixed values, and parameters that are sampled.
//! The parameter values of one sample turn it into a *concrete* scenario, [`Scenario`], which is
//! valid by construction.
//!
//! * [`parameters`], [`sampling`]: the distributions of the parameters, and the designs that draw
//!   from them
//! * [`library`], [`member`]: the scenarios and the drivers that come with Closecall
//! * [`outcome`], [`harm`], [`causal`]: what a run leaves behind
//! * [`criteria`]: what a file asks of the outcomes
//! * [`coverage`]: what its samples should reach
//! * [`openscenario`]: scenarios of OpenSCENARIO XML, as scenario files

mod actor;
mod asked_mode;
mod base;
pub mod causal;
mod checked;
mod config;
pub mod coverage;
pub mod criteria;
mod edit;
mod events;
mod file;
mod fitted_file;
mod fleet;
mod grip;
pub mod harm;
mod inert_fault;
mod inert_object_fault;
mod intervention;
pub mod library;
mod lidar_file;
mod locate;
mod logical;
pub mod member;
pub mod openscenario;
pub mod outcome;
mod overridden;
pub mod parameters;
mod placement;
pub mod promise;
mod recorded;
mod recorded_values;
mod reenacted;
mod run_key;
mod sampled;
pub mod sampling;
mod schema;
pub mod source;
mod step_value;
mod traffic;
mod variation;

pub use actor::Actor;
pub use checked::Scenario;
pub use config::{
    AbsoluteStartConfig, ActorConfig, Function, RandomNumbersConfig, RelativeStartConfig, SCHEMA_VERSION,
    ScenarioConfig, StartConfig,
};
pub use edit::{Setting, SettingError};
pub use events::{
    Brake, BrakeConfig, CutOutStartedConfig, Effect, EffectConfig, Event, EventConfig, LaneChangeConfig,
    NominalEncounterConfig, ThwBelowConfig, Trigger, TriggerConfig,
};
pub use file::{ScenarioError, ScenarioFile};
pub use fitted_file::FittedFile;
pub use grip::lateral_grip_mps2;
pub use intervention::{FaultConfig, IdealConfig, Interventions, MisState};
pub use logical::{Spreads, logical};
pub use overridden::COVERAGE as WEAKENED_COVERAGE;
pub use reenacted::{RearDriver, actor_name, reenact};
pub use run_key::RunKey;
pub use sampled::{SampledEncounter, name_of_other, opp2_of, sampled};
pub use schema::strict_schema;
pub use step_value::{StepValue, Variation};
pub use traffic::{ClassWeightsConfig, TrafficConfig};
