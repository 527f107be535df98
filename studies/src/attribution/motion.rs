//! The motion of all vehicles over a whole run, and how each of its collisions was avoidable.

use closecall_scenarios::Scenario;
use closecall_scenarios::outcome::Outcome;
use closecall_simulation::{Observer, RunEvent, RunKey, StepView};
use closecall_traffic::{Time, VehicleState};

use super::collision::{Avoidable, avoidable, careful_ego_avoids};

/// An observer that keeps the states of all vehicles.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// The states at each physics step, in the order of the scenario's actors.
    states: Vec<Vec<VehicleState>>,
    /// The number of steps before each collision.
    ends: Vec<usize>,
}

impl Motion {
    /// Returns how each collision of the run was avoidable, in the order of the outcome. `scenario`
    /// and `key` are of the run: with a collision, the scenario runs again with the careful driver
    /// in the place of the ego. An answer is `None` if this observer has not seen the collision.
    ///
    /// A later collision follows earlier ones: until the striking vehicle brakes otherwise, all
    /// vehicles move as they did.
    pub fn avoidable(&self, outcome: &Outcome, scenario: &Scenario, key: RunKey) -> Vec<Option<Avoidable>> {
        if outcome.collisions.is_empty() {
            return Vec::new();
        }
        let as_ego = careful_ego_avoids(scenario, key);
        let collisions = outcome.collisions.iter().enumerate();
        collisions
            .map(|(index, collision)| {
                let states = self.states.get(..*self.ends.get(index)?)?;
                avoidable(collision, scenario, key, states, as_ego)
            })
            .collect()
    }
}

impl Observer for Motion {
    fn wants_steps(&self) -> bool {
        false
    }

    fn step(&mut self, _: &StepView<'_>) {}

    fn event(&mut self, _: Time, event: &RunEvent) {
        if let RunEvent::Collision(_) = event {
            self.ends.push(self.states.len());
        }
    }

    fn moved(&mut self, _: Time, vehicles: &mut dyn Iterator<Item = VehicleState>) {
        self.states.push(vehicles.collect());
    }
}
