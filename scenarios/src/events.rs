//! Events that act on a vehicle during a run: a trigger, and its effect.

use closecall_controllers::DriverConfig;
use closecall_traffic::metrics::bumper_gap_m;
use closecall_traffic::{
    ActorId, ConfigError, ENGAGEMENT_GAP_M, Lane, Num, Parameters, Problem, Range, Road, Side, Time, Vehicle,
    VehicleState,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::actor::find_actor;

/// An event of a scenario file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct EventConfig {
    /// Name, for logs and reports. It must be unique in the scenario.
    pub id: ActorId,
    /// When the event is triggered. An event is triggered at most once.
    pub when: TriggerConfig,
    /// The effect of the event.
    pub then: EffectConfig,
}

/// When an event is triggered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum TriggerConfig {
    /// At a time after the start (s).
    AtS(Num),
    /// At a time that depends on the start values only, so that it is the same whatever the ego
    /// does.
    NominalEncounter(NominalEncounterConfig),
    /// When the time headway of the actor `from` to the actor `to`, ahead of it in its lane, falls
    /// below a value.
    ThwBelow(ThwBelowConfig),
    /// When an actor starts to change lanes in order to overtake.
    CutOutStarted(CutOutStartedConfig),
}

/// A time relative to the nominal encounter of two actors, which would both keep their start
/// speeds. Phase 0 is the time at which `from` would arrive 100 m behind `to`, or the start of the
/// run if it starts closer. Phase 1 is 6 s after the time at which `from` would reach `to`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct NominalEncounterConfig {
    /// The actor that approaches from behind.
    pub from: ActorId,
    /// The actor that it approaches.
    pub to: ActorId,
    /// Phase between the two times, 0 to 1.
    pub phase: Num,
}

/// A threshold of the time headway between two actors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ThwBelowConfig {
    /// The actor behind.
    pub from: ActorId,
    /// The actor ahead.
    pub to: ActorId,
    /// Time headway below which the event is triggered (s).
    pub thw_s: Num,
}

/// The start of an actor's lane change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct CutOutStartedConfig {
    /// The actor that changes lanes.
    pub actor: ActorId,
    /// Delay after the start of the lane change (s). Default: 0.
    pub delay_s: Option<Num>,
}

/// The effect of an event on its actor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum EffectConfig {
    /// Braking at a constant deceleration to a final speed, which is then kept.
    Brake(BrakeConfig),
    /// A change to an adjacent lane, for a driver who does not change lanes by itself.
    LaneChange(LaneChangeConfig),
}

/// Braking at a constant deceleration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct BrakeConfig {
    /// Deceleration (m/s²).
    pub deceleration_mps2: Num,
    /// Final speed (m/s). Default: 0.
    pub to_speed_mps: Option<Num>,
}

/// A change to an adjacent lane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LaneChangeConfig {
    /// Side of the target lane.
    pub to: Side,
    /// Duration of the whole lane change at the speed at which it begins (s): 1.5 to 20.
    pub duration_s: Num,
}

/// A checked event.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The vehicle to which it happens.
    pub id: ActorId,
    /// When it happens.
    pub when: Trigger,
    /// What happens.
    pub then: Effect,
}

/// A checked effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// The vehicle brakes.
    Brake(Brake),
    /// The vehicle changes lanes.
    LaneChange {
        /// Side of the target lane.
        to: Side,
        /// Duration of the lane change at the speed at which it begins (s).
        duration_s: f64,
    },
}

/// A checked trigger. Actors are indices into the list of actors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// At a time of the run.
    At(Time),
    /// When a time headway falls below a value.
    ThwBelow {
        /// The vehicle behind.
        from: usize,
        /// The vehicle ahead.
        to: usize,
        /// The time headway (s).
        thw_s: f64,
    },
    /// Some time after a vehicle has started to change lanes.
    CutOutStarted {
        /// The vehicle that changes lanes.
        actor: usize,
        /// The time after the start.
        delay: Time,
    },
}

/// Checked braking at a constant deceleration to a final speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brake {
    /// The deceleration (m/s²).
    pub deceleration_mps2: f64,
    /// The final speed (m/s).
    pub to_speed_mps: f64,
}

/// Time from the nominal encounter to phase 1 (s).
const AFTER_ENCOUNTER_S: f64 = 6.0;
/// Closing speed above which there is a nominal encounter (m/s).
const SLOWEST_APPROACH_MPS: f64 = 0.1;

/// The actors at the start of a run, to which a trigger may refer. All slices are in the order of
/// the actors.
pub(super) struct Start<'a> {
    pub(super) ids: &'a [&'a ActorId],
    pub(super) vehicles: &'a [Vehicle],
    pub(super) states: &'a [VehicleState],
}

impl EventConfig {
    /// Checks the trigger and the effect.
    pub(super) fn check(&self, start: &Start<'_>, parameters: &Parameters) -> Result<Event, ConfigError> {
        Ok(Event {
            id: self.id.clone(),
            when: self.when.check(start, parameters).map_err(|error| error.within("when"))?,
            then: self.then.check(parameters).map_err(|error| error.within("then"))?,
        })
    }
}

impl TriggerConfig {
    fn check(&self, start: &Start<'_>, parameters: &Parameters) -> Result<Trigger, ConfigError> {
        match self {
            Self::AtS(time) => {
                Ok(Trigger::At(Time::from_s(parameters.number(time, "at-s", Range::closed(0.0, 3_600.0))?)))
            }
            Self::NominalEncounter(config) => {
                nominal_time(config, start, parameters).map_err(|error| error.within("nominal-encounter"))
            }
            Self::ThwBelow(config) => thw_below(config, start, parameters).map_err(|error| error.within("thw-below")),
            Self::CutOutStarted(config) => {
                cut_out(config, start, parameters).map_err(|error| error.within("cut-out-started"))
            }
        }
    }
}

fn thw_below(config: &ThwBelowConfig, start: &Start<'_>, parameters: &Parameters) -> Result<Trigger, ConfigError> {
    Ok(Trigger::ThwBelow {
        from: find_actor(start.ids, &config.from, "from")?,
        to: find_actor(start.ids, &config.to, "to")?,
        thw_s: parameters.number(&config.thw_s, "thw-s", Range::above(0.0, 60.0))?,
    })
}

fn cut_out(config: &CutOutStartedConfig, start: &Start<'_>, parameters: &Parameters) -> Result<Trigger, ConfigError> {
    let delay_s = match &config.delay_s {
        Some(delay) => parameters.number(delay, "delay-s", Range::closed(0.0, 60.0))?,
        None => 0.0,
    };
    let actor = find_actor(start.ids, &config.actor, "actor")?;
    Ok(Trigger::CutOutStarted { actor, delay: Time::from_s(delay_s) })
}

fn nominal_time(
    config: &NominalEncounterConfig,
    start: &Start<'_>,
    parameters: &Parameters,
) -> Result<Trigger, ConfigError> {
    let from = find_actor(start.ids, &config.from, "from")?;
    let to = find_actor(start.ids, &config.to, "to")?;
    let phase = parameters.number(&config.phase, "phase", Range::UNIT)?;
    let closing_mps = start.states[from].speed_mps - start.states[to].speed_mps;
    // A vehicle that does not approach has no nominal encounter.
    Range::above(SLOWEST_APPROACH_MPS, 100.0).check(closing_mps, "from")?;
    let lengths_m = [from, to].map(|index| start.vehicles[index].dimensions.length_m);
    let gap_m = bumper_gap_m(start.states[to].s_m - start.states[from].s_m, lengths_m[0], lengths_m[1]);
    let begins_s = ((gap_m - ENGAGEMENT_GAP_M) / closing_mps).max(0.0);
    let ends_s = (gap_m / closing_mps).max(begins_s) + AFTER_ENCOUNTER_S;
    Ok(Trigger::At(Time::from_s(begins_s + phase * (ends_s - begins_s))))
}

impl EffectConfig {
    fn check(&self, parameters: &Parameters) -> Result<Effect, ConfigError> {
        match self {
            Self::Brake(config) => config.check(parameters).map_err(|error| error.within("brake")),
            Self::LaneChange(config) => {
                let duration_s = parameters.number(&config.duration_s, "duration-s", Range::closed(1.5, 20.0));
                let duration_s = duration_s.map_err(|error| error.within("lane-change"))?;
                Ok(Effect::LaneChange { to: config.to, duration_s })
            }
        }
    }
}

impl BrakeConfig {
    fn check(&self, parameters: &Parameters) -> Result<Effect, ConfigError> {
        let deceleration_mps2 =
            parameters.number(&self.deceleration_mps2, "deceleration-mps2", Range::above(0.0, 12.0))?;
        let to_speed_mps =
            parameters.number_or(self.to_speed_mps.as_ref(), "to-speed-mps", Range::closed(0.0, 80.0), 0.0)?;
        Ok(Effect::Brake(Brake { deceleration_mps2, to_speed_mps }))
    }
}

impl Effect {
    /// Returns the same effect with left and right exchanged.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Brake(_) => self,
            Self::LaneChange { to, duration_s } => Self::LaneChange { to: to.opposite(), duration_s },
        }
    }

    /// Checks that an actor with this driver, which starts in lane `start` of `road`, can change
    /// lanes.
    pub(super) fn check_lane_change(self, driver: &DriverConfig, start: Lane, road: &Road) -> Result<(), ConfigError> {
        let Self::LaneChange { to, .. } = self else { return Ok(()) };
        let refuse = |other, rule: String| Err(ConfigError::new("lane-change", Problem::Contradiction { other, rule }));
        if !matches!(driver, DriverConfig::Wiedemann99(_) | DriverConfig::Idm(_)) {
            return refuse(
                "driver",
                "only a driver that follows and stays in its lane, `wiedemann99` or `idm`, changes lanes by an event"
                    .to_owned(),
            );
        }
        road.lane_to_enter(start, to).map(|_| ()).or_else(|reason| refuse("start", reason.to_string()))
    }
}
