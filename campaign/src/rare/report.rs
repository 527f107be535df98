//! The report on a rare event, for people and for programs.

use std::fmt;

use closecall_traffic::Parameters;
use closecall_traffic::words::counted;
use serde::Serialize;

use super::estimate::{COVERAGE, Mean};
use super::importance::{ImportanceResult, NoInterval};
use super::method::Method;
use super::plan::RarePlan;
use super::search::SearchResult;
use super::subset::{Level, SubsetResult};
use crate::gate::rounded_up;
use crate::record::SampleFailure;

/// Least effective number of runs for which the report does not warn that a few of them carry the
/// estimate (-), and largest share of one run: assumptions.
const FEW_EFFECTIVE: f64 = 50.0;
const LARGE_SHARE: f64 = 0.1;
/// Share of the estimate outside every component above which the report warns (-): an assumption;
/// 0.02 to 0.2 are plausible.
const LARGE_OUTSIDE: f64 = 0.1;

/// An estimate with its interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The event, or the difference of two.
    pub of: String,
    /// The estimate.
    pub value: f64,
    /// The 95 % interval; `None` of an event that never happened beside one that did, and of a
    /// difference that is the same in every run.
    pub interval_95: Option<[f64; 2]>,
    /// The mean from which both follow.
    #[serde(skip)]
    pub mean: Mean,
}

/// An event near the nominal case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Nearest {
    /// Distance to the nominal case in standard normal space (standard deviations).
    pub distance_sd: f64,
    /// The key of its random streams: the number of its sample.
    pub noise: u64,
    /// The events that happened.
    pub events: [bool; 2],
    /// The parameters.
    pub parameters: Parameters,
}

/// The result of one scenario.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RareReport {
    /// The scenario.
    pub scenario: String,
    /// The events.
    pub event: String,
    /// The method.
    pub method: Method,
    /// The width that was asked for, relative to the estimate.
    pub relative_width: f64,
    /// All runs.
    pub runs: u64,
    /// Runs that ended in an error. They count as runs without the event.
    pub errors: u64,
    /// The first error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_error: Option<SampleFailure>,
    /// The estimates: the event, and of a difference the second event and the difference.
    pub estimates: Vec<Estimate>,
    /// The reason for which there are no estimates.
    pub no_interval: Option<NoInterval>,
    /// Upper 95 % bound of the probability of the event, if no run had it and there is one.
    pub upper_bound_without_event: Option<f64>,
    /// The parameters that were moved. The random streams were drawn anew.
    pub parameters: Vec<String>,
    /// Details of importance sampling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub importance: Option<ImportanceDetails>,
    /// Details of subset simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subset: Option<SubsetDetails>,
    /// Details of a search for the first case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search: Option<SearchDetails>,
    /// The events nearest to the nominal case.
    pub nearest: Vec<Nearest>,
    /// The reasons for which a low probability says nothing about the system under test.
    pub not_judged: Vec<String>,
    /// What differed when the first run was run again at the end.
    #[serde(skip)]
    pub difference: Option<String>,
}

/// Details of a search for the first case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SearchDetails {
    /// How often the search began.
    pub starts: u64,
    /// Whether some run had the event.
    pub has_event: bool,
}

/// Details of importance sampling.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportanceDetails {
    /// The final runs, on which the estimate rests.
    pub final_runs: u64,
    /// Final runs with an event.
    pub events: u64,
    /// Effective number of final runs with an event.
    pub effective_events: f64,
    /// Largest share of the estimate that rests on one run.
    pub largest_share: f64,
    /// Share of the estimate that lies where no search has a component.
    pub outside: f64,
    /// Searches that came to the event.
    pub searches: usize,
    /// The largest weight that a run can have.
    #[serde(skip)]
    pub largest_weight: f64,
    /// Components of the mixture: each has a weight, and a mean and a standard deviation for each
    /// parameter.
    pub components: Vec<super::mixture::Component>,
}

impl ImportanceDetails {
    /// Returns true if a few runs carry the estimate.
    fn is_carried_by_few(&self) -> bool {
        self.effective_events < FEW_EFFECTIVE || self.largest_share > LARGE_SHARE
    }
}

/// Details of subset simulation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubsetDetails {
    /// The levels before the event.
    pub levels: Vec<Level>,
    /// Independent repetitions.
    pub repetitions: usize,
    /// Repetitions whose particles did not come to the event.
    pub extinct: usize,
}

impl RareReport {
    fn new(plan: &RarePlan, runs: u64, means: Option<[Mean; 3]>, no_interval: Option<NoInterval>) -> Self {
        let expression = plan.nearness.expression();
        let names = match expression.second {
            None => vec![expression.first.to_string()],
            Some(second) => vec![expression.first.to_string(), second.to_string(), expression.to_string()],
        };
        let estimate = |(index, of): (usize, String), mean: Mean| Estimate {
            of,
            // The mean of weights may exceed 1, and no probability does.
            value: mean.value.min(1.0),
            interval_95: if index == 2 { mean.interval(COVERAGE) } else { mean.interval_of_probability(COVERAGE) },
            mean,
        };
        let estimates = means.map_or_else(Vec::new, |means| {
            names.into_iter().enumerate().zip(means).map(|(of, mean)| estimate(of, mean)).collect()
        });
        Self {
            scenario: String::new(),
            event: expression.to_string(),
            method: plan.method,
            relative_width: plan.goal.relative_width,
            runs,
            errors: 0,
            first_error: None,
            estimates,
            no_interval,
            upper_bound_without_event: None,
            parameters: Vec::new(),
            importance: None,
            subset: None,
            search: None,
            nearest: Vec::new(),
            not_judged: Vec::new(),
            difference: None,
        }
    }

    pub(super) fn of_importance(plan: &RarePlan, result: &ImportanceResult) -> Self {
        let details = ImportanceDetails {
            final_runs: result.final_runs,
            events: result.events,
            effective_events: result.effective,
            largest_share: result.largest_share,
            outside: result.outside,
            searches: result.searches,
            largest_weight: 1.0 / result.mixture.defensive,
            components: result.mixture.components.clone(),
        };
        Self {
            upper_bound_without_event: result.upper_bound_without_event,
            importance: Some(details),
            ..Self::new(plan, result.runs, result.means, result.no_interval)
        }
    }

    pub(super) fn of_subset(plan: &RarePlan, result: &SubsetResult) -> Self {
        let details =
            SubsetDetails { levels: result.levels.clone(), repetitions: result.repetitions, extinct: result.extinct };
        Self { subset: Some(details), ..Self::new(plan, result.runs, result.means, result.no_interval) }
    }

    pub(super) fn of_search(plan: &RarePlan, result: &SearchResult) -> Self {
        let details = SearchDetails { starts: result.starts, has_event: result.has_event };
        Self { search: Some(details), ..Self::new(plan, result.runs, None, None) }
    }

    /// Returns the estimate that the goal is about: the event, or the difference.
    pub fn main(&self) -> Option<&Estimate> {
        self.estimates.last()
    }

    /// Returns true if a few runs carry the estimate, or too much of it lies where no search led.
    /// The mean of the weights may then be far from normal, so that its interval is no evidence.
    pub fn is_doubtful(&self) -> bool {
        self.importance.as_ref().is_some_and(|details| details.is_carried_by_few() || details.outside > LARGE_OUTSIDE)
    }

    /// Returns the one-sided upper bound of the probability by which a gate is judged: of a
    /// doubtful estimate one that holds for any weights. `None` without an estimate or its bound.
    pub fn upper_bound(&self, confidence: f64) -> Option<f64> {
        let mean = &self.main()?.mean;
        let bound = mean.upper_bound(confidence)?;
        let largest_weight =
            self.importance.as_ref().filter(|_| self.is_doubtful()).map(|details| details.largest_weight);
        let of_any = largest_weight.map(|largest| mean.upper_bound_of_bounded(largest, confidence).min(1.0));
        Some(of_any.map_or(bound, |of_any| of_any.max(bound)))
    }

    /// Returns what makes the estimate doubtful, in words.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Some(details) = self.importance.as_ref().filter(|_| !self.estimates.is_empty()) {
            if details.is_carried_by_few() {
                warnings.push(format!(
                    "{:.0} effective runs carry the estimate, and one of them {:.0} % of it: another seed may differ by more than the interval",
                    details.effective_events,
                    100.0 * details.largest_share
                ));
            }
            if details.outside > LARGE_OUTSIDE {
                warnings.push(format!(
                    "{:.0} % of the estimate lies where no search led: there may be another region of the event",
                    100.0 * details.outside
                ));
            }
        }
        let width = self.main().filter(|estimate| estimate.mean.relative_width() > 1.25 * self.relative_width);
        if let Some(estimate) = width {
            let width = estimate.mean.relative_width();
            // The width falls with the square root of the number of runs.
            let runs = if width.is_finite() {
                let needed = self.runs as f64 * (width / self.relative_width).powi(2);
                format!("some {} runs would give it", rounded_up(needed as u64))
            } else {
                "the budget is too small".to_owned()
            };
            warnings.push(format!(
                "the interval is {width:.2} wide, relative to the estimate; {} was asked for: {runs}",
                self.relative_width
            ));
        }
        warnings
    }
}

impl fmt::Display for RareReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} by {}, {}", self.scenario, self.event, self.method, counted(self.runs, "run"))?;
        for (index, Estimate { of, value, interval_95, .. }) in self.estimates.iter().enumerate() {
            match interval_95 {
                Some([low, high]) => writeln!(f, "  {of}: {value:.3e}, 95 % interval {low:.3e} to {high:.3e}")?,
                None if *value > 0.0 || index == 2 => {
                    writeln!(f, "  {of}: {value:.3e}; no interval, because the runs do not scatter")?
                }
                None => writeln!(f, "  {of}: in no run; no interval")?,
            }
        }
        match self.no_interval {
            None => {}
            Some(NoInterval::NotReached) => writeln!(f, "  no run came to the event: there is no estimate")?,
            Some(NoInterval::TooFewEvents) => writeln!(f, "  too few runs came to the event for an interval")?,
            Some(NoInterval::Budget) => {
                writeln!(f, "  the budget ended before the runs that an estimate rests on: it needs more runs")?
            }
        }
        if let Some(bound) = self.upper_bound_without_event {
            writeln!(f, "  its probability is at most {bound:.3e} with 95 % confidence")?;
        }
        if let Some(details) = &self.importance {
            let (runs, events, effective) = (details.final_runs, details.events, details.effective_events);
            writeln!(
                f,
                "  {runs} weighted runs, {events} with the event, which are worth {effective:.0} of equal weight"
            )?;
        }
        if let Some(SubsetDetails { levels, repetitions, extinct }) = &self.subset {
            let levels = levels.len();
            writeln!(
                f,
                "  {repetitions} independent repetitions with {levels} levels, {extinct} of them without the event"
            )?;
        }
        if let Some(SearchDetails { starts, has_event }) = self.search {
            let started = counted(starts, "start");
            match has_event {
                true => writeln!(f, "  found, after {started}; a search states no probability")?,
                false => writeln!(
                    f,
                    "  not found, after {started}: the event may be rarer, or nothing leads to it; a search bounds no probability"
                )?,
            }
        }
        writeln!(f, "  moved: {}; drawn anew: all random streams of drivers and sensors", self.parameters.join(", "))?;
        if let Some(error) = &self.first_error {
            writeln!(
                f,
                "  runs that ended in an error, and count as runs without the event: {}; the first: {}",
                self.errors, error.message
            )?;
        }
        for warning in self.warnings().iter().chain(&self.not_judged) {
            writeln!(f, "  warning: {warning}")?;
        }
        Ok(())
    }
}
