//! Whether the runs of a rare event say anything about the system under test.
//!
//! A scenario states what must happen in a run for it to count (`expects`), and an event that
//! cannot happen is rare. So a probability that is low enough is no pass if what the scenario is
//! about did not happen, if the system under test never acted, or if it slowed the ego before a
//! vehicle behind was near, which the scenario forbids.
//!
//! Later runs are moved towards the event. The first runs of every method are independent samples
//! of the scenario: only they count for the share in which something happens.

use closecall_scenarios::Function;
use closecall_scenarios::criteria::{Expression, FlagName};
use closecall_traffic::statistics::interval::lower_bound;
use closecall_traffic::words::counted;

use crate::attribution::{CONFIDENCE, MOST};
use crate::gate::{Course, ExpectationResult, checks_of_slowing, is_idle, least_action, missing_action};
use crate::record::Record;
use crate::runner::Work;

/// What the runs of a scenario are to show, and what they have shown.
#[derive(Clone, Debug)]
pub(super) struct Relevance {
    scenario: String,
    expects: Vec<FlagName>,
    least_share: f64,
    function: Function,
    /// The share of the runs in which the system acts, which it must exceed to be tested.
    least_action: Option<f64>,
    /// The checks that bound how often the ego is slowed before a vehicle behind is near.
    of_slowing: Vec<Expression>,
    /// Whether every sample has a baseline.
    is_paired: bool,
    /// Number of the first runs; `None` before them.
    first: Option<u64>,
    /// First runs with an outcome, and those in which everything happened.
    samples: u64,
    happened: u64,
    /// First runs that a check of slowing counts, and those in which the ego was slowed.
    counted: u64,
    slowed: u64,
    /// All runs with an outcome, and those in which the system acted.
    runs: u64,
    acted: u64,
}

impl Relevance {
    pub(super) fn of(work: &Work) -> Self {
        let config = work.file.config();
        let is_told = work.arms.len() > 1 || config.function == Function::Mis;
        Self {
            scenario: config.name.clone(),
            expects: config.expects.clone(),
            least_share: config.expects_share,
            function: config.function,
            least_action: least_action(config).filter(|_| is_told),
            of_slowing: checks_of_slowing(config),
            is_paired: work.arms.len() > 1,
            first: None,
            samples: 0,
            happened: 0,
            counted: 0,
            slowed: 0,
            runs: 0,
            acted: 0,
        }
    }

    /// Returns what a run shows; `None` if it has no outcome, or the scenario asks for nothing.
    pub(super) fn course(&self, record: &Record) -> Option<Course> {
        let asks = !self.expects.is_empty() || self.least_action.is_some() || !self.of_slowing.is_empty();
        asks.then(|| Course::of(record, &self.expects, self.function, &self.of_slowing)).flatten()
    }

    /// Says that so many runs follow. The first ones are samples of the scenario.
    pub(super) fn begin(&mut self, runs: u64) {
        self.first.get_or_insert(runs);
    }

    /// Counts a run by its number.
    pub(super) fn count(&mut self, run: u64, course: Option<Course>) {
        let Some(Course { happened, acted, slowed_unprompted }) = course else { return };
        self.runs += 1;
        self.acted += u64::from(acted);
        if self.first.is_some_and(|first| run < first) {
            self.samples += 1;
            self.happened += u64::from(happened);
            self.counted += u64::from(slowed_unprompted.is_some());
            self.slowed += u64::from(slowed_unprompted == Some(true));
        }
    }

    /// Returns the reasons for which a low probability says nothing.
    pub(super) fn not_judged(&self) -> Vec<String> {
        let expectation = ExpectationResult {
            scenario: self.scenario.clone(),
            expects: self.expects.clone(),
            happened: self.happened,
            samples: self.samples,
            least_share: self.least_share,
        };
        let is_missed = !self.expects.is_empty() && self.samples > 0 && !expectation.is_met();
        let missed = is_missed.then(|| format!("what the scenario is about did not happen: {expectation}"));
        let idle = is_idle(self.least_action, (self.acted, self.runs)).then(|| {
            let missing = missing_action(self.function, self.acted, &counted(self.runs, "run"));
            format!("the system under test {missing}, and they do not decide what it does")
        });
        let is_slower = lower_bound(self.slowed, self.counted, CONFIDENCE) > MOST;
        let slower = is_slower.then(|| {
            format!(
                "the system under test slowed the ego before a vehicle behind was near in {} of {}, and a slower ego needs no system",
                self.slowed,
                counted(self.counted, "sample")
            )
        });
        let open = self.unknown_slowing().map(|reason| {
            format!(
                "whether the system under test slows the ego before a vehicle behind is near is not known: {reason}"
            )
        });
        [missed, idle, slower, open].into_iter().flatten().collect()
    }

    /// Returns why the checks of slowing have no answer, if they have none.
    fn unknown_slowing(&self) -> Option<String> {
        if let Some(check) = self.of_slowing.iter().find(|check| check.needs_pairs() && !self.is_paired) {
            return Some(format!("`{check}` compares with a baseline, and there is none"));
        }
        let check = self.of_slowing.first().filter(|_| self.samples > 0 && self.counted == 0)?;
        Some(format!("no sample meets the condition of `{check}`"))
    }
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::criteria::EGO_COLLIDED;

    use super::*;

    const ACTED: Course = Course { happened: true, acted: true, slowed_unprompted: Some(false) };

    fn relevance() -> Relevance {
        Relevance {
            scenario: "one".to_owned(),
            expects: vec![EGO_COLLIDED.parse().unwrap()],
            least_share: 0.5,
            function: Function::Mis,
            least_action: Some(0.0),
            of_slowing: vec!["upper(slowed_unprompted) <= 0.05".parse().unwrap()],
            is_paired: false,
            first: None,
            samples: 0,
            happened: 0,
            counted: 0,
            slowed: 0,
            runs: 0,
            acted: 0,
        }
    }

    #[test]
    fn only_the_first_runs_show_how_often_something_happens() {
        let mut relevance = relevance();
        relevance.begin(4);
        relevance.begin(100);
        for run in 0..50 {
            // Everything happens in the runs that were moved towards the event.
            relevance.count(run, Some(Course { happened: run >= 3, ..ACTED }));
        }
        let reasons = relevance.not_judged();
        assert!(
            reasons.len() == 1 && reasons[0].contains("1 of 4 samples (25.0 %, at least 50.0 % expected)"),
            "{reasons:?}"
        );
    }

    #[test]
    fn a_system_that_acts_in_any_run_was_there_to_be_tested() {
        let mut relevance = relevance();
        relevance.begin(2);
        relevance.count(0, Some(Course { acted: false, ..ACTED }));
        relevance.count(1, None);
        assert!(relevance.not_judged()[0].starts_with("the system under test never slowed the ego"));
        relevance.count(2, Some(ACTED));
        assert_eq!(relevance.not_judged(), Vec::<String>::new());
    }

    #[test]
    fn an_ego_that_is_slower_where_the_scenario_forbids_it_is_not_judged() {
        let reasons = |slowed: u64, of_check: u64| {
            let mut relevance = relevance();
            relevance.begin(100);
            for run in 0..200 {
                // The runs that were moved towards the event say nothing about it.
                let slowed_unprompted = (run < of_check || run >= 100).then_some(run < slowed || run >= 100);
                relevance.count(run, Some(Course { slowed_unprompted, ..ACTED }));
            }
            relevance.not_judged()
        };
        let expected = "the system under test slowed the ego before a vehicle behind was near in 12 of 100 samples";
        assert!(reasons(12, 100)[0].starts_with(expected), "{:?}", reasons(12, 100));
        assert_eq!(reasons(4, 100), Vec::<String>::new());
        assert!(reasons(4, 20)[0].contains("in 4 of 20 samples"), "{:?}", reasons(4, 20));
        assert!(reasons(0, 0)[0].contains("no sample meets the condition"), "{:?}", reasons(0, 0));
    }

    #[test]
    fn a_bound_that_compares_with_a_baseline_is_not_judged_without_one() {
        let check = "upper(unprompted_deficit_mps > 0.5 | baseline.unprompted_deficit_mps < 0.5) <= 0.05";
        let of_slowing = vec![check.parse().unwrap()];
        let paired = Relevance { of_slowing, is_paired: true, ..relevance() };
        assert_eq!(paired.not_judged(), Vec::<String>::new());
        let alone = Relevance { is_paired: false, ..paired };
        let reasons = alone.not_judged();
        assert!(
            reasons.len() == 1 && reasons[0].contains(check) && reasons[0].ends_with("and there is none"),
            "{reasons:?}"
        );
    }

    #[test]
    fn without_runs_nothing_is_said() {
        assert_eq!(relevance().not_judged(), Vec::<String>::new());
    }
}
