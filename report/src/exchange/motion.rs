//! The motion of all vehicles of a run, at each control step.

use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::{Time, VehicleState};

/// The states of all vehicles of a run, in the order of the scenario's actors.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Each control step with the states.
    pub steps: Vec<(Time, Vec<VehicleState>)>,
}

impl Observer for Motion {
    fn step(&mut self, view: &StepView<'_>) {
        self.steps.push((view.time, view.vehicles.iter().map(|vehicle| vehicle.state).collect()));
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}
