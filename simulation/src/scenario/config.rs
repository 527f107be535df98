//! A scenario as its file says it: text that is not checked yet.

use closecall_controllers::{DriverConfig, LaneKeepingConfig, SpeedKeepingConfig};
use closecall_scenarios::parameters::ParametersConfig;
use closecall_sensors::SensorsConfig;
use closecall_traffic::{ActorId, EnvironmentConfig, Lane, Num, RoadConfig, VehicleConfig};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::events::EventConfig;

/// The version of the scenario file's layout that this program reads.
pub const SCHEMA_VERSION: u32 = 1;

/// A scenario file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ScenarioConfig {
    /// Version of the layout: 1.
    pub schema_version: u32,
    /// Name: lower-case letters, digits and hyphens.
    pub name: String,
    /// What the scenario asks, for people.
    #[serde(default)]
    pub description: String,
    /// Words to select and group scenarios by.
    #[serde(default)]
    pub tags: Vec<String>,
    /// The requirements that the scenario is evidence for, such as `MIS-1`: reports say which of them are met.
    #[serde(default)]
    pub requirements: Vec<String>,
    /// Longest duration of a run (s).
    pub duration_s: Num,
    /// The road.
    pub road: RoadConfig,
    /// Light, weather and surface; a clear, dry day where absent.
    #[serde(default)]
    pub environment: EnvironmentConfig,
    /// The sampled values; everything else is fixed.
    #[serde(default)]
    pub parameters: ParametersConfig,
    /// The vehicles; exactly one has an ego stack for a driver.
    #[serde(default, rename = "actor")]
    pub actors: Vec<ActorConfig>,
    /// What E perceives with.
    #[serde(default)]
    pub sensors: SensorsConfig,
}

/// One vehicle with its driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ActorConfig {
    /// Name: lower-case letters, digits and hyphens.
    pub id: ActorId,
    /// What it is.
    pub vehicle: VehicleConfig,
    /// Where it starts.
    pub start: StartConfig,
    /// Who drives it.
    pub driver: DriverConfig,
    /// How a human driver weaves in its lane; not at all where absent.
    pub lane_keeping: Option<LaneKeepingConfig>,
    /// How the speed that a human driver wants wanders; not at all where absent.
    pub speed_keeping: Option<SpeedKeepingConfig>,
    /// What happens to it on the way.
    #[serde(default, rename = "event")]
    pub events: Vec<EventConfig>,
}

/// Where a vehicle starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum StartConfig {
    /// At a place on the road.
    Absolute(AbsoluteStartConfig),
    /// Ahead of another actor.
    Ahead(RelativeStartConfig),
    /// Behind another actor.
    Behind(RelativeStartConfig),
}

/// A place on the road.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct AbsoluteStartConfig {
    /// The lane, counted from 1 at the left.
    pub lane: Lane,
    /// Position of the centre along the road (m).
    pub s_m: Num,
    /// Speed (m/s).
    pub speed_mps: Num,
}

/// A place relative to another actor: one of `gap-m` and `thw-s`, one of `speed-mps` and `closing-mps`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RelativeStartConfig {
    /// The other actor.
    pub of: ActorId,
    /// Gap between the two, bumper to bumper (m); negative alongside, in another lane.
    pub gap_m: Option<Num>,
    /// Time headway between the two (s): of the other one where this starts ahead, of this one where it starts behind.
    pub thw_s: Option<Num>,
    /// Speed (m/s).
    pub speed_mps: Option<Num>,
    /// Speed at which the gap closes (m/s).
    pub closing_mps: Option<Num>,
    /// The lane, counted from 1 at the left; the other actor's where absent.
    pub lane: Option<Lane>,
}
