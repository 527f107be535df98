//! The rule by which a campaign stops before its last sample.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::ledger::ArmCounts;
use crate::probability::ProbabilityGate;

/// A request from outside to start no further samples. Clones share the request.
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<[AtomicBool; 2]>);

impl StopFlag {
    /// Requests the stop.
    pub fn set(&self) {
        self.0[0].store(true, Ordering::Relaxed);
    }

    /// Requests the stop, and that the running samples are not waited for: their results are lost.
    pub fn abandon(&self) {
        self.set();
        self.0[1].store(true, Ordering::Relaxed);
    }

    /// Returns true if the stop was requested.
    pub fn is_set(&self) -> bool {
        self.0[0].load(Ordering::Relaxed)
    }

    /// Returns true if the running samples are not to be waited for.
    pub fn is_abandoned(&self) -> bool {
        self.0[1].load(Ordering::Relaxed)
    }
}

/// When a campaign stops early.
#[derive(Clone, Copy, Debug)]
pub struct StopRule {
    /// A scenario ends as soon as the answer of this gate is certain.
    pub until_certain: Option<ProbabilityGate>,
    /// Wall time for all scenarios together.
    pub time_budget: Option<Duration>,
    /// Number of scenarios.
    pub scenarios: usize,
}

/// Applies a [`StopRule`] to a running campaign.
#[derive(Clone, Copy, Debug)]
pub struct StopMonitor {
    rule: StopRule,
    started: Instant,
    /// The index of the current scenario, and its deadline.
    current: Option<(usize, Instant)>,
}

impl StopMonitor {
    /// Returns a monitor whose time budget starts now.
    pub fn start(rule: StopRule) -> Self {
        Self { rule, started: Instant::now(), current: None }
    }

    /// Returns `Break` if the scenario with index `scenario` ends here. `counts` are the counts of
    /// its samples so far, in the arm under test.
    pub fn observe(&mut self, scenario: usize, counts: &ArmCounts) -> ControlFlow<End> {
        let is_certain = self.rule.until_certain.is_some_and(|gate| gate.is_settled(counts, self.rule.scenarios));
        if is_certain || self.is_late(scenario) { ControlFlow::Break(End::Scenario) } else { ControlFlow::Continue(()) }
    }

    /// Returns true if the scenario's time is over. When a scenario begins, the time left is
    /// divided evenly among the scenarios still to run.
    fn is_late(&mut self, scenario: usize) -> bool {
        let Some(budget) = self.rule.time_budget else { return false };
        let now = Instant::now();
        let deadline = match self.current {
            Some((current, deadline)) if current == scenario => deadline,
            previous => {
                let began = previous.map_or(self.started, |_| now);
                let left = budget.saturating_sub(began - self.started);
                let to_run = u32::try_from(self.rule.scenarios.saturating_sub(scenario)).unwrap_or(u32::MAX).max(1);
                let deadline = began + left / to_run;
                self.current = Some((scenario, deadline));
                deadline
            }
        };
        now >= deadline
    }
}

/// Parses a time above 0, in seconds, minutes or hours: `90s`, `15m`, `8h`.
///
/// # Errors
/// What is wrong with the text.
pub fn duration(text: &str) -> Result<Duration, String> {
    let units = [("s", 1.0), ("m", 60.0), ("h", 3_600.0)];
    let (number, unit_s) =
        units.iter().find_map(|(unit, s)| text.strip_suffix(unit).map(|number| (number, *s))).unwrap_or((text, 1.0));
    let time = number.parse().ok().filter(|value: &f64| *value > 0.0);
    // A time below half a nanosecond is none.
    time.and_then(|value| Duration::try_from_secs_f64(value * unit_s).ok().filter(|time| !time.is_zero()))
        .ok_or_else(|| format!("`{text}` is not a time above 0 such as 90s, 15m or 8h"))
}

/// What a caller of [`Campaign::run`](crate::execution::Campaign::run) ends after a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The scenario of the record. The next scenario begins.
    Scenario,
    /// The whole campaign.
    Campaign,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_certain_answer_or_the_time_budget_ends_a_scenario() {
        let gate = ProbabilityGate::new(0.01, 0.95).unwrap();
        let counts = |outcomes, collisions| ArmCounts { outcomes, collisions, ..ArmCounts::default() };
        let mut monitor = StopMonitor::start(StopRule { until_certain: Some(gate), time_budget: None, scenarios: 1 });
        assert!(monitor.observe(0, &counts(100, 0)).is_continue());
        assert_eq!(monitor.observe(0, &counts(10_000, 0)), ControlFlow::Break(End::Scenario));
        assert_eq!(monitor.observe(0, &counts(100, 50)), ControlFlow::Break(End::Scenario));
        let mut monitor =
            StopMonitor::start(StopRule { until_certain: None, time_budget: Some(Duration::ZERO), scenarios: 2 });
        assert!(monitor.observe(0, &counts(1, 0)).is_break());
        let hour = Duration::from_secs(3_600);
        let mut monitor = StopMonitor::start(StopRule { until_certain: None, time_budget: Some(hour), scenarios: 2 });
        assert!(monitor.observe(0, &counts(1, 0)).is_continue());
    }

    #[test]
    fn a_time_has_a_unit() {
        assert_eq!(duration("90"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("2h"), Ok(Duration::from_secs(7_200)));
        for text in ["", "0s", "-1m", "nan", "inf", "1d", "m", "1e300h", "1e-30s"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
