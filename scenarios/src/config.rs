//! The contents of a scenario file, before they are checked.

use std::collections::BTreeMap;

use crate::parameters::ParametersConfig;
use closecall_controllers::external::VariableTable;
use closecall_controllers::{DriverConfig, LaneKeepingConfig, SpeedKeepingConfig};
use closecall_sensors::SensorsConfig;
use closecall_traffic::{ActorId, EnvironmentConfig, Lane, Num, RoadConfig, VehicleConfig};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::events::EventConfig;
use super::intervention::{FaultConfig, IdealConfig};
use super::traffic::TrafficConfig;
use crate::coverage::CoverageConfig;
use crate::criteria::{Expression, FlagName, GateConfig};

/// The version of the scenario file format that this program reads.
pub const SCHEMA_VERSION: u32 = 1;

/// A scenario file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ScenarioConfig {
    /// Version of the file format: 1.
    pub schema_version: u32,
    /// Name: lower-case letters, digits and hyphens. A campaign over a driver ensemble names its
    /// entries SCENARIO@MEMBER.
    pub name: String,
    /// Description of the scenario, for readers.
    #[serde(default)]
    pub description: String,
    /// Tags by which scenarios are selected and grouped.
    #[serde(default)]
    pub tags: Vec<String>,
    /// Identifiers of the requirements that the scenario tests, such as `MIS-1`. Reports state
    /// which of them are met.
    #[serde(default)]
    pub requirements: Vec<String>,
    /// The function of the ego stack that the scenario judges. A campaign that names no controller
    /// runs it, and with a baseline the stack without it. Default: mis.
    #[serde(default, skip_serializing_if = "is_default")]
    pub function: Function,
    /// The criteria that check each requirement, by its mark: `MIS-2 = ["upper(induced) <= 0.02"]`.
    /// They are judged in every campaign, whatever its gates; a requirement without criteria is not
    /// checked.
    #[serde(default)]
    pub checks: BTreeMap<String, Vec<Expression>>,
    /// The gates of campaigns with this scenario.
    #[serde(default)]
    pub gate: GateConfig,
    /// What must happen in a run for it to count, such as `lead_braked`. A campaign in which it
    /// happens too seldom is invalid.
    #[serde(default)]
    pub expects: Vec<FlagName>,
    /// Least share of the samples in which everything that is expected must happen (-). Default:
    /// 0.95.
    #[serde(default = "default_expects_share")]
    pub expects_share: f64,
    /// What settings of the command line weakened: checks, requirements, expectations. `--set`
    /// writes it, and a campaign with such a scenario does not pass.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overridden: Vec<String>,
    /// What the samples should cover: bins of parameters, measures and attributes of the operational design domain, and crosses of
    /// them. Default: nothing.
    #[serde(default, skip_serializing_if = "CoverageConfig::is_empty")]
    pub coverage: CoverageConfig,
    /// Longest duration of a run (s).
    pub duration_s: Num,
    /// The road.
    pub road: RoadConfig,
    /// Light, weather and road surface. Default: a clear, dry day.
    #[serde(default)]
    pub environment: EnvironmentConfig,
    /// The parameters that are sampled. All other values are fixed.
    #[serde(default)]
    pub parameters: ParametersConfig,
    /// The vehicles. Exactly one of them has an ego stack as its driver.
    #[serde(default, rename = "actor")]
    pub actors: Vec<ActorConfig>,
    /// Surrounding traffic: vehicles that are drawn.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traffic: Vec<TrafficConfig>,
    /// The ego's sensors.
    #[serde(default)]
    pub sensors: SensorsConfig,
    /// The sample whose random numbers every run uses, instead of its own seed and number.
    /// For cases that were made from a sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub random_numbers: Option<RandomNumbersConfig>,
    /// What a controller from outside needs to know of the scenario. Default: nothing.
    #[serde(default, skip_serializing_if = "is_default")]
    pub controller: ControllerConfig,
    /// Stages of the chain that are replaced by the truth. Default: none.
    #[serde(default, skip_serializing_if = "is_default")]
    pub ideal: IdealConfig,
    /// Injected faults. Default: none.
    #[serde(default, skip_serializing_if = "is_default")]
    pub fault: FaultConfig,
}

/// A function of the ego stack.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Function {
    /// The margin increase system: `acc` and `mis`.
    #[default]
    Mis,
    /// Emergency braking: `acc-aeb` and `acc+aeb`.
    Aeb,
    /// Adaptive cruise control: `cruise+aeb` and `acc+aeb`.
    Acc,
    /// Emergency braking beside a human driver of the ego: `human-aeb` and `human+aeb`.
    AebWithHuman,
}

impl Function {
    /// Returns the name in scenario files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mis => "mis",
            Self::Aeb => "aeb",
            Self::Acc => "acc",
            Self::AebWithHuman => "aeb-with-human",
        }
    }
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Share of the samples in which what is expected must happen unless the file says otherwise (-).
pub(super) const EXPECTS_SHARE: f64 = 0.95;

const fn default_expects_share() -> f64 {
    EXPECTS_SHARE
}

/// What a controller from outside needs to know of the scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ControllerConfig {
    /// The names of the variables of an FMU, if they differ from the names of the quantities.
    #[serde(default)]
    pub fmu: VariableTable,
    /// Time for which a controller computes in a control step (s): its command takes effect that
    /// much later than its input, rounded up to whole steps of 10 ms. One from outside that
    /// computes for longer is an error. Default: the command takes effect at once, and a controller
    /// from outside may compute for 0.04 s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub computing_s: Option<Num>,
}

/// A sample whose random numbers are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RandomNumbersConfig {
    /// The seed.
    pub seed: u64,
    /// The sample's number.
    pub sample: u64,
}

/// One vehicle with its driver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ActorConfig {
    /// Name: letters, digits, hyphens and underscores, starting with a letter or an underscore. `Ego`
    /// and `ego` are two names.
    pub id: ActorId,
    /// Class, size and appearance.
    pub vehicle: VehicleConfig,
    /// Position and speed at the start.
    pub start: StartConfig,
    /// The driver: a human driver model, or the ego stack.
    pub driver: DriverConfig,
    /// The lateral path of a human driver, in place of the centre of the lane: pairs of the distance
    /// along the road since the start (m) and the lateral position of the vehicle's centre, positive
    /// to the left of the road's left edge (m). The distances increase from 0, and the first position
    /// is in the lane of the start. At its end the vehicle drives straight on. A lane change by the
    /// driver or by an event ends it. Default: the vehicle keeps the centre of its lane.
    pub path: Option<Vec<[Num; 2]>>,
    /// How a human driver weaves in the lane. Default: it does not.
    pub lane_keeping: Option<LaneKeepingConfig>,
    /// How the desired speed of a human driver varies. Default: it is constant.
    pub speed_keeping: Option<SpeedKeepingConfig>,
    /// Events that act on this vehicle during the run.
    #[serde(default, rename = "event")]
    pub events: Vec<EventConfig>,
}

/// Position and speed of a vehicle at the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum StartConfig {
    /// At a position on the road.
    Absolute(AbsoluteStartConfig),
    /// Ahead of another actor.
    Ahead(RelativeStartConfig),
    /// Behind another actor.
    Behind(RelativeStartConfig),
}

/// A position on the road, and a speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct AbsoluteStartConfig {
    /// The lane, counted from 1 for the leftmost lane.
    pub lane: Lane,
    /// Position of the vehicle's centre along the road (m).
    pub s_m: Num,
    /// Speed (m/s).
    pub speed_mps: Num,
    /// Acceleration (m/s²). Default: 0.
    pub acceleration_mps2: Option<Num>,
}

/// A position and a speed relative to another actor. Give exactly one of `gap-m`, `thw-s` and
/// `settled`, and exactly one of `speed-mps` and `closing-mps`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RelativeStartConfig {
    /// The other actor.
    pub of: ActorId,
    /// Gap between the two vehicles, bumper to bumper (m). It is negative if they overlap
    /// lengthwise in different lanes.
    pub gap_m: Option<Num>,
    /// Time headway between the two vehicles (s), with the speed of the vehicle that is behind.
    pub thw_s: Option<Num>,
    /// `true`: the gap at which the driver of this actor follows in equilibrium, cc0 + cc1·v +
    /// cc2/2 or s₀ + T·v. The actor is behind, and its driver follows by Wiedemann 99 or the
    /// Intelligent Driver Model.
    pub settled: Option<bool>,
    /// Speed (m/s).
    pub speed_mps: Option<Num>,
    /// Speed at which the gap closes (m/s).
    pub closing_mps: Option<Num>,
    /// The lane, counted from 1 for the leftmost lane. Default: the lane of the other actor.
    pub lane: Option<Lane>,
}
