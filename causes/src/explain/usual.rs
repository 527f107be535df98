//! Which stages of a run are out of the ordinary.
//!
//! | stage | usual |
//! |---|---|
//! | points | the shipped rear LiDAR in clear weather |
//! | class | the shipped class confidence and the shipped rear camera |
//! | tracks | the shipped sensors and tracker, apart from their latency and class confidence |
//! | timing | the latencies of the shipped sensors |
//! | reaction of R | up to 1.5 s |
//!
//! Clusters, actuation and the braking of the lead vehicle have no usual values: they never count as unusual.

use closecall_controllers::CheckedDriver;
use closecall_sensors::{ObjectSensorConfig, SensorMode, SensorsConfig, TrackerConfig};
use closecall_simulation::scenario::Scenario;
use closecall_traffic::{CONTROL_STEP, Check, Environment, Parameters};

use super::Stage;
use crate::case::Case;

/// Longest usual reaction time (s): the mean for surprising events in Green, *How long does it take to stop?*, Transportation
/// Human Factors 2 (2000).
const USUAL_REACTION_S: f64 = 1.5;

/// Returns the settings that make a stage usual again, each as `key=value`. Empty if there are none.
pub(super) fn usual_settings(stage: Stage) -> Vec<String> {
    match stage {
        Stage::Class => vec!["fault.class-background=false".to_owned()],
        Stage::RearReaction => vec!["fault.rear-reaction-s=0".to_owned()],
        Stage::Timing => {
            let Ok(shipped) = SensorsConfig::default().check(&Parameters::default()) else { return Vec::new() };
            let latency_s = |steps: usize| steps as f64 * CONTROL_STEP.s();
            let [front, surround, rear] = shipped.with_mode(SensorMode::Object).latency_steps().map(latency_s);
            let [_, _, tracker] = shipped.with_mode(SensorMode::Full).latency_steps().map(latency_s);
            let sensors = [("front-radar", front), ("surround", surround), ("rear-object", rear), ("tracker", tracker)];
            let latency = |(sensor, latency_s)| format!("sensors.{sensor}.latency-s={latency_s}");
            std::iter::once("fault.delay-s=0".to_owned()).chain(sensors.into_iter().map(latency)).collect()
        }
        Stage::Points | Stage::Clusters | Stage::Tracks | Stage::Actuation | Stage::LeadBraking => Vec::new(),
    }
}

/// Returns how a stage of a run is out of the ordinary; `None` if it is not.
pub(super) fn unusual(stage: Stage, case: &Case, scenario: &Scenario) -> Option<String> {
    let config = &case.file.config().sensors;
    match stage {
        Stage::Points => {
            let is_other = config.rear_lidar != SensorsConfig::default().rear_lidar;
            let environment = &scenario.environment;
            let is_bad =
                environment.visibility_m < Environment::CLEAR_DAY.visibility_m || environment.rain_mm_per_h > 0.0;
            let reasons = [(is_other, "the rear LiDAR is not the shipped one"), (is_bad, "the weather is not clear")];
            first(&reasons)
        }
        Stage::Class => {
            let faults = &case.file.config().fault;
            let object = case.sensors() == SensorMode::Object;
            first(&[
                (faults.class_background, "every vehicle is classified as background"),
                (
                    object && config.rear_object.class_confidence.is_some(),
                    "the class confidence is not the shipped one",
                ),
                (
                    !object && config.rear_camera != SensorsConfig::default().rear_camera,
                    "the rear camera is not the shipped one",
                ),
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
        Stage::RearReaction => {
            let ego_m = scenario.actors[scenario.ego].start.s_m;
            let behind = scenario.actors.iter().filter(|actor| actor.start.s_m < ego_m);
            let slowest_s = behind
                .filter_map(|actor| match &actor.driver {
                    CheckedDriver::Human(human) => human.reaction_s(),
                    CheckedDriver::Ego(_) => None,
                })
                .fold(0.0, f64::max);
            (slowest_s > USUAL_REACTION_S).then(|| format!("a driver behind the ego needs {slowest_s:.2} s to react"))
        }
        Stage::Clusters | Stage::Actuation | Stage::LeadBraking => None,
    }
}

/// Returns the first reason that holds.
fn first(reasons: &[(bool, &str)]) -> Option<String> {
    reasons.iter().find(|(holds, _)| *holds).map(|(_, reason)| (*reason).to_owned())
}
