//! The sensors and the controller of the ego in one run, with the interventions of the scenario.

use closecall_controllers::{EgoController, EgoSettings};
use closecall_sensors::{NoiseKey, Perception, SensorError};

use super::delayed_truth::DelayedTruth;
use super::suppressed::Suppressed;
use super::{Arm, RunKey};
use crate::perception::PerceptionProcess;
use closecall_scenarios::Scenario;

/// Returns the sensors of the arm in a run. The run needs the sensors that look back only if
/// `needs_rear`.
pub(super) fn perception(
    scenario: &Scenario,
    arm: &Arm,
    key: RunKey,
    needs_rear: bool,
) -> Result<Box<dyn Perception>, SensorError> {
    let sensors = match arm.sensors {
        Some(mode) => scenario.sensors.with_mode(mode),
        None => scenario.sensors,
    };
    if scenario.interventions.has_true_tracks {
        return Ok(Box::new(DelayedTruth::new(sensors.latency_steps())));
    }
    let sensors = if needs_rear { sensors } else { sensors.without_rear() };
    let program = sensors.running_program().map(|program| Box::new(PerceptionProcess::new(program)) as _);
    let key = NoiseKey {
        seed: key.seed,
        sample: key.sample,
        ego: scenario.ego_id().clone(),
        actors: scenario.actors.iter().map(|actor| actor.id.clone()).collect(),
    };
    sensors.build_with(&key, program)
}

/// Returns the controller of the arm in a run.
pub(super) fn controller(scenario: &Scenario, settings: &EgoSettings, arm: &Arm) -> Box<dyn EgoController> {
    let controller = arm.controller.build_with(settings, &scenario.variables);
    let off = &scenario.interventions.without_mis;
    if off.is_empty() || !arm.controller.has_mis(settings) {
        return controller;
    }
    Box::new(Suppressed::new(controller, arm.controller.settings(settings), off.clone()))
}
