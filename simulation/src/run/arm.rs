//! Identifies a run: its sample, and its arm (controller and sensors).

use std::sync::Arc;

use closecall_controllers::external::VariableTable;
use closecall_controllers::{CheckedDriver, EgoController, EgoSettings, MisSettings};
use closecall_scenarios::Scenario;
use closecall_sensors::SensorMode;

use crate::controller::isolated::Isolated;

/// Creates the controller under test, a new one for each run.
pub trait ControllerFactory: Send + Sync {
    /// Returns the name under which outcomes are reported.
    fn name(&self) -> &str;
    /// Returns the controller's settings, made from the settings of the scenario. If it keeps
    /// another gap to the lead vehicle, the ego starts further back by the difference.
    fn settings(&self, settings: &EgoSettings) -> EgoSettings {
        *settings
    }
    /// Returns whether the controller has a margin increase system whose actions the outcome
    /// summarises.
    fn has_mis(&self, settings: &EgoSettings) -> bool;
    /// Returns whether the controller is one of this program. Its reported states are then the
    /// states of its code. The reports of another controller about itself are never evidence.
    fn is_built_in(&self) -> bool {
        false
    }
    /// Returns whether the controller uses the sensors that look back. If it does not, their tracks
    /// do not reach it, and mode [`SensorMode::Full`] simulates them only for an observer of the
    /// steps.
    fn looks_back(&self, _: &EgoSettings) -> bool {
        true
    }
    /// Returns the controller that a worker process is to run, together with the whole sample;
    /// `None` for every controller that runs in this process, or brings its own process.
    fn isolated(&self) -> Option<Isolated> {
        None
    }
    /// Calls `run` once, which makes a run with a controller of this factory. A controller that
    /// needs something in its thread for a whole run prepares it before, and gives it back
    /// afterwards.
    fn in_thread(&self, run: &mut (dyn FnMut() + Send)) {
        run();
    }
    /// Creates a new controller with the settings of the scenario's ego stack.
    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController>;
    /// Creates a new controller as [`Self::build`] does, with the scenario's names of the variables
    /// of an FMU.
    fn build_with(&self, settings: &EgoSettings, _: &VariableTable) -> Box<dyn EgoController> {
        self.build(settings)
    }
}

/// One arm of a campaign: the ego's controller and its sensors.
#[derive(Clone)]
pub struct Arm {
    /// The controller under test.
    pub controller: Arc<dyn ControllerFactory>,
    /// The depth of the sensor simulation, or `None` for the scenario's own.
    pub sensors: Option<SensorMode>,
}

impl Arm {
    /// Returns the settings of the margin increase system in a scenario; `None` if the arm has no
    /// such system.
    pub fn mis(&self, scenario: &Scenario) -> Option<MisSettings> {
        match &scenario.actors[scenario.ego].driver {
            CheckedDriver::Ego(settings) if self.controller.has_mis(settings) => {
                self.controller.settings(settings).mis().copied()
            }
            _ => None,
        }
    }

    /// Returns the front time headway that the margin increase system is to gain (s); `None` if the
    /// arm has no such system.
    pub fn goal_s(&self, scenario: &Scenario) -> Option<f64> {
        self.mis(scenario).map(|mis| mis.thw_gain_s)
    }
}
