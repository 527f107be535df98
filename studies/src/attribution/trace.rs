//! The motion of all vehicles up to the first collision.

use closecall_controllers::EgoState;
use closecall_scenarios::outcome::Collision;
use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::{Time, VehicleState};

/// An observer that keeps the states of all vehicles up to the first collision.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Time of each physics step.
    pub(super) times: Vec<Time>,
    /// The states at each physics step, in the order of the scenario's actors.
    pub(super) states: Vec<Vec<VehicleState>>,
    /// The state of the ego stack at the latest control step before the collision.
    pub(super) ego_state: EgoState,
    collision: Option<Collision>,
}

impl Observer for Trace {
    fn step(&mut self, view: &StepView<'_>) {
        if self.collision.is_none() {
            self.ego_state = view.command.state;
        }
    }

    fn event(&mut self, _: Time, event: &RunEvent) {
        if let RunEvent::Collision(collision) = event {
            self.collision.get_or_insert_with(|| collision.clone());
        }
    }

    fn moved(&mut self, time: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        if self.collision.is_none() {
            self.times.push(time);
            self.states.push(vehicles.collect());
        }
    }
}
