//! When a campaign stops before its last sample.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::execution::End;
use crate::ledger::ArmCounts;
use crate::probability::ProbabilityGate;

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// The gate whose answer ends a scenario.
    pub certain: Option<ProbabilityGate>,
    /// The time for all scenarios together.
    pub budget: Option<Duration>,
    /// How many scenarios there are.
    pub scenarios: usize,
}

/// A watch over when to stop, from the start of the campaign on.
#[derive(Clone, Copy, Debug)]
pub struct StopWatch {
    stop: Stop,
    started: Instant,
    /// The scenario that is run, and when its time is over.
    running: Option<(usize, Instant)>,
}

impl StopWatch {
    /// Starts the watch now.
    pub fn start(stop: Stop) -> Self {
        Self { stop, started: Instant::now(), running: None }
    }

    /// Returns whether scenario number `scenario` goes on after samples that came to `counts` in the arm under test.
    pub fn observe(&mut self, scenario: usize, counts: &ArmCounts) -> ControlFlow<End> {
        let is_certain = self.stop.certain.is_some_and(|gate| gate.is_settled(counts, self.stop.scenarios));
        if is_certain || self.is_late(scenario) { ControlFlow::Break(End::Scenario) } else { ControlFlow::Continue(()) }
    }

    /// True where the scenario's time is over: an even share of what the scenarios before it have left.
    fn is_late(&mut self, scenario: usize) -> bool {
        let Some(budget) = self.stop.budget else { return false };
        let now = Instant::now();
        let deadline = match self.running {
            Some((running, deadline)) if running == scenario => deadline,
            before => {
                let began = before.map_or(self.started, |_| now);
                let left = budget.saturating_sub(began - self.started);
                let to_come = u32::try_from(self.stop.scenarios.saturating_sub(scenario)).unwrap_or(u32::MAX).max(1);
                let deadline = began + left / to_come;
                self.running = Some((scenario, deadline));
                deadline
            }
        };
        now >= deadline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn certainty_ends_a_scenario_and_time_does() {
        let gate = ProbabilityGate::new(0.01, 0.95).unwrap();
        let counts = |outcomes, collisions| ArmCounts { outcomes, collisions, ..ArmCounts::default() };
        let mut watch = StopWatch::start(Stop { certain: Some(gate), budget: None, scenarios: 1 });
        assert!(watch.observe(0, &counts(100, 0)).is_continue());
        assert_eq!(watch.observe(0, &counts(10_000, 0)), ControlFlow::Break(End::Scenario));
        assert_eq!(watch.observe(0, &counts(100, 50)), ControlFlow::Break(End::Scenario));
        let mut watch = StopWatch::start(Stop { certain: None, budget: Some(Duration::ZERO), scenarios: 2 });
        assert!(watch.observe(0, &counts(1, 0)).is_break());
        let hour = Duration::from_secs(3_600);
        let mut watch = StopWatch::start(Stop { certain: None, budget: Some(hour), scenarios: 2 });
        assert!(watch.observe(0, &counts(1, 0)).is_continue());
    }
}
