//! Compares the tracks of a run with the ground truth.

use closecall_sensors::{Scene, SceneVehicle, SensorError, TrackAudit};
use closecall_traffic::Time;

use super::{Observer, RunEvent, StepView};

/// An observer that audits the confirmed rear tracks of a run. It stops at the first collision,
/// since no motion model describes a wreck.
#[derive(Debug, Default)]
pub struct TrackAuditor {
    audit: TrackAudit,
    others: Vec<SceneVehicle>,
    error: Option<SensorError>,
    has_collided: bool,
}

impl TrackAuditor {
    /// Returns the audit of the run.
    ///
    /// # Errors
    /// [`SensorError::NotFinite`] if the ground truth was not finite in some step.
    pub fn into_audit(self) -> Result<TrackAudit, SensorError> {
        self.error.map_or(Ok(self.audit), Err)
    }
}

impl Observer for TrackAuditor {
    fn step(&mut self, view: &StepView<'_>) {
        if self.has_collided || self.error.is_some() {
            return;
        }
        let ego = view.scenario.ego;
        let others = view.vehicles.iter().enumerate().filter(|(actor, _)| *actor != ego);
        self.others.clear();
        self.others.extend(others.map(|(_, other)| *other));
        let scene = Scene {
            time: view.time,
            road: &view.scenario.road,
            environment: &view.scenario.environment,
            ego: view.vehicles[ego],
            others: &self.others,
        };
        self.error = self.audit.observe(view.tracks, &scene).err();
    }

    fn event(&mut self, _: Time, event: &RunEvent) {
        self.has_collided |= matches!(event, RunEvent::Collision(_));
    }
}
