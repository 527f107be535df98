//! The stages of a run that are out of the ordinary.
//!
//! | stage | usual |
//! |---|---|
//! | points | the shipped rear LiDAR in clear weather |
//! | class | the shipped class confidence and the shipped rear camera |
//! | tracks | the shipped sensors and tracker, apart from their latency and class confidence |
//! | timing | the latencies of the shipped sensors |
//! | rear-reaction | no injected fault, and up to the 97.5 % quantile of the parameter that gives it; up to 2.5 s without one |
//!
//! Clusters, actuation and the braking of the lead vehicle have no usual values: they never count
//! as unusual.

use closecall_controllers::CheckedDriver;
use closecall_scenarios::parameters::Distribution;
use closecall_scenarios::{Actor, Scenario};
use closecall_sensors::{ObjectSensorConfig, SensorMode, SensorsConfig, TrackerConfig};
use closecall_traffic::{CONTROL_STEP, Check, Environment, ParameterName, Parameters, Range};

use super::Stage;
use crate::case::Case;

/// Longest usual reaction time of a driver without a sampled one (s): an assumption, the upper end
/// of the distribution of the library's scenarios.
const USUAL_REACTION_S: f64 = 2.5;
/// Quantile of a sampled reaction time up to which it is usual: the upper end of the middle 95 %.
const USUAL_QUANTILE: f64 = 0.975;

/// Returns the settings that make a stage usual again, each as `key=value`. Empty if there are
/// none.
pub(super) fn usual_settings(stage: Stage, case: &Case) -> Vec<String> {
    match stage {
        Stage::Class if case.file.config().fault.class_background => vec!["fault.class-background=false".to_owned()],
        Stage::RearReaction if later_s(case) > 0.0 => vec!["fault.rear-reaction-s=0".to_owned()],
        Stage::Timing => {
            let Ok(shipped) = SensorsConfig::default().check(&Parameters::default()) else { return Vec::new() };
            let latency_s = |steps: usize| steps as f64 * CONTROL_STEP.s();
            let [front, surround, rear] = shipped.with_mode(SensorMode::Object).latency_steps().map(latency_s);
            let [_, _, tracker] = shipped.with_mode(SensorMode::Full).latency_steps().map(latency_s);
            let sensors = [("front-radar", front), ("surround", surround), ("rear-object", rear), ("tracker", tracker)];
            let latency = |(sensor, latency_s)| format!("sensors.{sensor}.latency-s={latency_s}");
            std::iter::once("fault.delay-s=0".to_owned()).chain(sensors.into_iter().map(latency)).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns the values of the case's parameters.
fn parameters(case: &Case) -> Parameters {
    case.sampled()
}

/// Returns by how much an injected fault delays the reaction of drivers behind the ego (s).
fn later_s(case: &Case) -> f64 {
    let later = case.file.config().fault.rear_reaction_s.as_ref();
    parameters(case).number_or(later, "rear-reaction-s", Range::closed(0.0, f64::MAX), 0.0).unwrap_or_default()
}

/// Returns the reaction time of a driver (s); `None` for the ego and for a driver without one.
fn reaction_s(actor: &Actor) -> Option<f64> {
    match &actor.driver {
        CheckedDriver::Human(human) => human.reaction_s(),
        CheckedDriver::Ego(_) => None,
    }
}

/// Returns the longest usual reaction time of an actor (s): the quantile of the parameter that
/// gives it, or else 2.5 s.
fn usual_reaction_s(case: &Case, index: usize, now_s: f64) -> f64 {
    let (space, parameters) = (case.file.space(), parameters(case));
    let with_quantile = |name: &ParameterName, distribution: &Distribution| {
        let mut changed = parameters.clone();
        changed.insert(name.clone(), distribution.quantile(USUAL_QUANTILE));
        reaction_s(case.file.concrete(&changed).ok()?.actors.get(index)?)
    };
    let mut quantiles = space.varying().filter_map(|(name, parameter)| with_quantile(name, &parameter.distribution));
    quantiles.find(|quantile_s| *quantile_s != now_s).unwrap_or(USUAL_REACTION_S)
}

/// Returns how the reaction of a driver behind the ego is out of the ordinary.
fn unusual_reaction(case: &Case, scenario: &Scenario) -> Option<String> {
    let later_s = later_s(case);
    if later_s > 0.0 {
        return Some(format!("drivers behind the ego react {later_s:.2} s later by an injected fault"));
    }
    let ego_m = scenario.actors[scenario.ego].start.s_m;
    let behind = scenario.actors.iter().enumerate().filter(|(_, actor)| actor.start.s_m < ego_m);
    let slow = behind.filter_map(|(index, actor)| {
        let now_s = reaction_s(actor)?;
        (now_s > usual_reaction_s(case, index, now_s)).then_some(now_s)
    });
    slow.reduce(f64::max).map(|slowest_s| format!("a driver behind the ego needs {slowest_s:.2} s to react"))
}

/// Returns how a stage of a run is out of the ordinary; `None` if it is not.
pub(super) fn unusual(stage: Stage, case: &Case, scenario: &Scenario) -> Option<String> {
    let config = &case.file.config().sensors;
    match stage {
        Stage::Points => {
            let is_other =
                config.rear_lidar != SensorsConfig::default().rear_lidar || !config.additional_rear_lidars.is_empty();
            let environment = &scenario.environment;
            let is_bad =
                environment.visibility_m < Environment::CLEAR_DAY.visibility_m || environment.rain_mm_per_h > 0.0;
            let reasons = [(is_other, "the rear LiDAR is not the shipped one"), (is_bad, "the weather is not clear")];
            first(&reasons)
        }
        Stage::Class => {
            let faults = &case.file.config().fault;
            let object = case.sensors() == SensorMode::Object;
            let has_other_camera = config.rear_camera != SensorsConfig::default().rear_camera
                || !config.additional_rear_cameras.is_empty();
            first(&[
                (faults.class_background, "every vehicle is classified as background"),
                (
                    object && config.rear_object.class_confidence.is_some(),
                    "the class confidence is not the shipped one",
                ),
                (!object && has_other_camera, "the rear camera is not the shipped one"),
            ])
        }
        Stage::Tracks => {
            let sensor = |sensor: &ObjectSensorConfig| {
                let rest = ObjectSensorConfig { latency_s: None, class_confidence: None, ..sensor.clone() };
                rest != ObjectSensorConfig::default()
            };
            let object = case.sensors() == SensorMode::Object;
            let tracker = TrackerConfig { latency_s: TrackerConfig::default().latency_s, ..config.tracker.clone() };
            let is_other = sensor(&config.front_radar)
                || sensor(&config.surround)
                || (object && sensor(&config.rear_object))
                || (!object && tracker != TrackerConfig::default());
            first(&[(is_other, "the sensors or the tracker are not the shipped ones")])
        }
        Stage::Timing => {
            let shipped = SensorsConfig::default().check(&Parameters::default()).ok()?;
            let [now, usual] =
                [scenario.sensors, shipped].map(|sensors| sensors.with_mode(case.sensors()).latency_steps());
            let later = now.iter().zip(usual).filter(|(now, usual)| **now > *usual);
            let worst = later.map(|(now, usual)| *now - usual).max()?;
            Some(format!("a sensor is {:.2} s later than the shipped one", worst as f64 * CONTROL_STEP.s()))
        }
        Stage::RearReaction => unusual_reaction(case, scenario),
        Stage::Clusters | Stage::Actuation | Stage::LeadBraking => None,
    }
}

/// Returns the first reason that holds.
fn first(reasons: &[(bool, &str)]) -> Option<String> {
    reasons.iter().find(|(holds, _)| *holds).map(|(_, reason)| (*reason).to_owned())
}
