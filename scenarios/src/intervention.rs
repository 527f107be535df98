//! Interventions in a scenario: stages of the chain from sensors to drivers that are replaced by
//! the truth, and injected faults.
//!
//! ```text
//!  points ─▶ clusters ─▶ class ─▶ tracks ─▶ timing ─▶ (controller) ─▶ actuation ─▶ rear reaction ─▶ lead braking
//! ```
//!
//! A run in which one stage is ideal and all else is as before shows whether that stage has caused
//! a failure. An injected fault is the opposite: it causes failures of a known cause. Both are
//! values of the scenario, so that `--set ideal.class=true` repeats such a run. Neither changes the
//! sampled values or the random numbers of other stages.

use closecall_controllers::{CheckedDriver, EgoState, ReactionChange};
use closecall_sensors::Alterations;
use closecall_sensors::faults::{
    CameraFaultConfig, FaultEntries, LidarFaultConfig, ObjectFaultConfig, OdometryErrorConfig, RadarFaultConfig,
};
use closecall_traffic::{CONTROL_STEP, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Actor, Effect};

/// Longest additional latency and longest additional reaction time (s): those that the models have
/// memory for.
const MAX_LATENCY_S: f64 = 0.4;
const MAX_REACTION_S: f64 = 3.0;

/// A state in which the margin increase system changes the motion of the ego.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MisState {
    /// It brakes, in order to increase the margin.
    Increasing,
    /// It keeps the speed, and does not brake for the lead vehicle.
    Holding,
    /// It returns the margin.
    Releasing,
}

impl MisState {
    /// All states, in the order of an encounter.
    pub const ALL: [Self; 3] = [Self::Increasing, Self::Holding, Self::Releasing];

    /// Returns the name in scenario files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Increasing => "increasing",
            Self::Holding => "holding",
            Self::Releasing => "releasing",
        }
    }

    /// Returns whether the ego stack is in this state.
    pub fn is(self, state: EgoState) -> bool {
        match self {
            Self::Increasing => state == EgoState::Increasing,
            Self::Holding => state == EgoState::Holding,
            Self::Releasing => state == EgoState::Releasing,
        }
    }
}

/// Stages that are replaced by the truth. A stage that the sensors of the run do not have changes
/// nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct IdealConfig {
    /// The rear LiDAR measures every vehicle in its line of sight, without noise, losses or
    /// weather. Sensor mode `full`.
    pub points: bool,
    /// The points of each vehicle form one cluster, whose box is the vehicle's. Sensor mode
    /// `full`.
    pub clusters: bool,
    /// The class of every vehicle behind the ego is known.
    pub class: bool,
    /// The tracks are the true vehicles, as late as the tracks of the sensors.
    pub tracks: bool,
    /// Sensors and trackers need no time.
    pub timing: bool,
    /// The ego's actuators follow the command at once.
    pub actuation: bool,
    /// Drivers who start behind the ego react at once, without lapses of attention.
    pub rear_reaction: bool,
    /// Vehicles that start ahead of the ego do not brake by an event.
    pub lead_braking: bool,
    /// States in which the cruise control drives instead of the margin increase system.
    pub without_mis: Vec<MisState>,
}

/// Injected faults, whose effect shows whether a diagnosis finds them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct FaultConfig {
    /// Additional latency of all sensors (s): 0, or 0.04 to 0.4, rounded to the nearest control
    /// step of 0.04 s: 0.1 s is three steps, 0.12 s. No sensor is later than 0.4 s.
    pub delay_s: Option<Num>,
    /// Every vehicle behind the ego is classified as background.
    pub class_background: bool,
    /// Additional reaction time of drivers who start behind the ego (s). No driver needs more than
    /// 3 s.
    pub rear_reaction_s: Option<Num>,
    /// Faults of the rear LiDAR, at most four: sensor mode `full`.
    pub rear_lidar: Vec<LidarFaultConfig>,
    /// Faults of the LiDAR that looks ahead, at most four: sensor mode `full` with
    /// `sensors.front-lidar`.
    pub front_lidar: Vec<LidarFaultConfig>,
    /// Faults of the rear camera, at most four: sensor mode `full`.
    pub rear_camera: Vec<CameraFaultConfig>,
    /// Faults of the front radar, at most four.
    pub front_radar: Vec<ObjectFaultConfig>,
    /// Faults of the surround sensors, at most four.
    pub surround: Vec<ObjectFaultConfig>,
    /// Faults of the object-level sensor that replaces LiDAR and camera in mode `object`, at most
    /// four.
    pub rear_object: Vec<ObjectFaultConfig>,
    /// Faults of the rear radars, at most four: sensor mode `full` with `sensors.rear-radar`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rear_radar: Vec<RadarFaultConfig>,
    /// Errors of the ego's odometry and map. The ego does not know them. Default: none.
    pub odometry: Option<OdometryErrorConfig>,
}

/// Checked interventions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Interventions {
    /// The alterations of the sensors.
    pub(super) sensors: Alterations,
    /// Whether the tracks are the truth.
    pub has_true_tracks: bool,
    /// Whether the ego's actuators are ideal.
    pub has_ideal_actuation: bool,
    /// The change of the reaction of drivers behind the ego.
    reaction: Option<ReactionChange>,
    /// Whether vehicles ahead of the ego do not brake by an event.
    is_lead_steady: bool,
    /// States in which the margin increase system does not drive.
    pub without_mis: Vec<MisState>,
}

impl Interventions {
    /// Checks the two tables of a scenario file.
    pub(super) fn check(
        ideal: &IdealConfig,
        fault: &FaultConfig,
        parameters: &Parameters,
    ) -> Result<Self, ConfigError> {
        let number = |num: &Option<Num>, key, max| {
            let value = parameters.number_or(num.as_ref(), key, Range::closed(0.0, max), 0.0);
            value.map_err(|error| error.within("fault"))
        };
        let extra_latency_s = number(&fault.delay_s, "delay-s", MAX_LATENCY_S)?;
        if extra_latency_s > 0.0 && extra_latency_s < CONTROL_STEP.s() {
            // Half a step would become one or none.
            let allowed = Range::closed(CONTROL_STEP.s(), MAX_LATENCY_S);
            let problem = Problem::OutOfRange { value: extra_latency_s, allowed };
            return Err(ConfigError::new("delay-s", problem).within("fault"));
        }
        let entries = FaultEntries {
            rear_lidar: &fault.rear_lidar,
            front_lidar: &fault.front_lidar,
            rear_camera: &fault.rear_camera,
            object: [&fault.front_radar, &fault.surround, &fault.rear_object],
            rear_radar: &fault.rear_radar,
            odometry: fault.odometry.as_ref(),
        };
        let faults = entries.check(parameters).map_err(|error| error.within("fault"))?;
        let later_s = number(&fault.rear_reaction_s, "rear-reaction-s", MAX_REACTION_S)?;
        let later = (later_s > 0.0).then_some(ReactionChange::Later(later_s));
        Ok(Self {
            sensors: Alterations {
                has_true_points: ideal.points,
                has_true_clusters: ideal.clusters,
                has_true_class: ideal.class,
                has_no_latency: ideal.timing,
                extra_latency_s,
                is_class_background: fault.class_background,
                faults,
            },
            has_true_tracks: ideal.tracks,
            has_ideal_actuation: ideal.actuation,
            reaction: if ideal.rear_reaction { Some(ReactionChange::AtOnce) } else { later },
            is_lead_steady: ideal.lead_braking,
            without_mis: ideal.without_mis.clone(),
        })
    }

    /// Changes the drivers and events of the actors.
    pub(super) fn apply(&self, actors: &mut [Actor], ego: usize) {
        let ego_m = actors[ego].start.s_m;
        for actor in actors.iter_mut() {
            if let (CheckedDriver::Human(human), Some(change)) = (&mut actor.driver, self.reaction)
                && actor.start.s_m < ego_m
            {
                *human = human.reacting(change);
            }
            if self.is_lead_steady && actor.start.s_m > ego_m {
                actor.events.retain(|event| !matches!(event.then, Effect::Brake(_)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_controllers::HumanDriver;

    use super::*;
    use crate::{Scenario, ScenarioFile, source};

    fn with(settings: &[&str]) -> Scenario {
        let object = ["sensors.mode=\"object\""];
        let settings: Vec<_> = object.iter().chain(settings).map(|text| text.parse().unwrap()).collect();
        let file: ScenarioFile = source::load(Path::new("low-thw-overtake"), &settings).unwrap();
        file.check().unwrap();
        file.concrete(&file.space().nominal()).unwrap()
    }

    fn reaction_s(scenario: &Scenario) -> f64 {
        let rear = scenario.actors.iter().find(|actor| actor.id.as_str() == "rear").unwrap();
        let CheckedDriver::Human(human @ HumanDriver::Overtaker(_)) = &rear.driver else { panic!("an overtaker") };
        human.reaction_s().unwrap()
    }

    #[test]
    fn each_stage_changes_what_it_names_and_nothing_else() {
        let usual = with(&[]);
        assert!((reaction_s(&usual) - 1.245).abs() < 0.01, "{}", reaction_s(&usual));
        assert_eq!(reaction_s(&with(&["ideal.rear-reaction=true"])), 0.0);
        assert_eq!(reaction_s(&with(&["fault.rear-reaction-s=1"])), reaction_s(&usual) + 1.0);
        assert_eq!(reaction_s(&with(&["fault.rear-reaction-s=3"])), 3.0, "no driver needs more");
        assert_eq!(reaction_s(&with(&["fault.rear-reaction-s=1", "ideal.rear-reaction=true"])), 0.0);
        let events = |scenario: &Scenario| scenario.actors.iter().map(|actor| actor.events.len()).sum::<usize>();
        assert_eq!((events(&usual), events(&with(&["ideal.lead-braking=true"]))), (1, 0));
        assert_eq!(usual.sensors.latency_steps(), [2, 1, 2]);
        assert_eq!(with(&["fault.delay-s=0.1"]).sensors.latency_steps(), [5, 4, 5]);
        assert_eq!(with(&["fault.delay-s=0.04"]).sensors.latency_steps(), [3, 2, 3]);
        assert_eq!(with(&["fault.delay-s=0"]).sensors.latency_steps(), [2, 1, 2]);
        assert_eq!(with(&["fault.delay-s=0.4"]).sensors.latency_steps(), [10, 10, 10], "no sensor is later");
        assert_eq!(with(&["fault.delay-s=0.1", "ideal.timing=true"]).sensors.latency_steps(), [0, 0, 0]);
        assert_eq!(with(&["ideal.class=true"]).sensors.latency_steps(), [2, 1, 2]);
        assert_eq!(with(&["ideal.without-mis=[\"holding\"]"]).interventions.without_mis, [MisState::Holding]);
    }

    #[test]
    fn a_fault_out_of_range_or_a_misspelt_stage_is_refused_by_its_key() {
        let refused = |text: &str| {
            let loaded = source::load(Path::new("low-thw-overtake"), &[text.parse().unwrap()]);
            loaded.and_then(|file| file.check()).unwrap_err().to_string()
        };
        assert!(refused("fault.delay-s=0.5").contains("`fault.delay-s` is 0.5"), "{}", refused("fault.delay-s=0.5"));
        let too_short = refused("fault.delay-s=0.01");
        assert!(too_short.contains("`fault.delay-s` is 0.01") && too_short.contains("0.04"), "{too_short}");
        assert!(refused("ideal.clas=true").contains("did you mean `class`?"), "{}", refused("ideal.clas=true"));
        assert!(refused("ideals.class=true").contains("leads nowhere"), "{}", refused("ideals.class=true"));
    }
}
