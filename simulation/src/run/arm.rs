//! What a run is keyed by: which sample, and which controller and sensors.

use std::sync::Arc;

use closecall_controllers::{EgoController, EgoSettings};
use closecall_sensors::SensorMode;

/// Identifies one sample of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunKey {
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's number, from 0.
    pub sample: u64,
}

/// Builds the controller under test, one for each run.
pub trait ControllerFactory: Send + Sync {
    /// Returns the name under which outcomes are reported.
    fn name(&self) -> &str;
    /// Returns true if the controller has a margin increase system to report on.
    fn has_mis(&self, settings: &EgoSettings) -> bool;
    /// Builds a fresh controller with the scenario's settings.
    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController>;
}

/// One arm of a campaign: the ego's controller and its sensors.
#[derive(Clone)]
pub struct Arm {
    /// The controller under test.
    pub controller: Arc<dyn ControllerFactory>,
    /// The sensors; the scenario's own if `None`.
    pub sensors: Option<SensorMode>,
}
