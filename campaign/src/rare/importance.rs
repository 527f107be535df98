//! Importance sampling from a mixture that cross-entropy has found.
//!
//! ```text
//!  search 1 ─┐  levels: sample, keep the nearest to the event, fit a mixture to them …
//!  search 2 ─┴▶ pooled mixture ─▶ pilot ─▶ number of runs ─▶ fresh runs ─▶ weighted mean and interval
//! ```
//!
//! The searches follow the multilevel cross-entropy method (R. Y. Rubinstein and D. P. Kroese, *The
//! Cross-Entropy Method*, Springer 2004, chapter 3) with mixtures (N. Kurtz and J. Song,
//! *Cross-entropy-based adaptive importance sampling using Gaussian mixture*, Structural Safety 42
//! (2013) 35–44). Each of them starts from the distribution of the scenario, so that two of them
//! seldom miss the same region. Where they disagree, more of them follow.
//!
//! The final runs are independent of each other and of all runs before, given the mixture and their
//! number, which the pilot determines. Their weighted mean is therefore unbiased, and its interval
//! is the interval of a mean of independent values. The samples of the search enter no estimate.
//!
//! The defensive component keeps the share [`DEFENSIVE`] of the runs at the distribution of the
//! scenario (T. Hesterberg, Technometrics 37 (1995) 185–194). No weight exceeds its inverse, so a
//! region that every search missed cannot make the variance infinite. The component does not find
//! such a region: if p is a millionth, a thousand runs of the defensive component do not either.
//! Only another search finds a region that one search missed.

use serde::Serialize;

use closecall_traffic::maths::{exp_m1, ln, powf};

use super::estimate::Mean;
use super::mixture::{Component, Mixture, Weighted, effective};
use super::problem::{Point, Response, Seed, Simulator};

/// Share of the defensive component (-): an assumption; 0.05 to 0.2 are plausible.
pub const DEFENSIVE: f64 = 0.1;
/// Share of the runs of a level that are kept (-). Rubinstein and Kroese propose 0.01 to 0.1; more
/// points make the fit of many dimensions steadier.
const KEPT: f64 = 0.15;
/// Number of runs of a level of a search (-), and the number for each dimension if that is more:
/// assumptions; 200 to 2,000 and 20 to 200 are plausible.
const LEVEL_RUNS: usize = 400;
const LEVEL_RUNS_PER_DIMENSION: usize = 50;
/// Largest number of levels of a search (-): with [`KEPT`] they reach a probability of 1e-16.
const MOST_LEVELS: usize = 20;
/// Number of levels without progress after which a search gives up.
const PATIENCE: usize = 2;
/// Largest number of searches: the first search, and the searches beside regions that earlier
/// searches reached.
const MOST_SEARCHES: usize = 8;
/// Share of the probability of all known regions below which a further one ends the searches (-):
/// an assumption; 0.01 to 0.1 are plausible.
const SMALL_REGION: f64 = 0.03;
/// Number of searches that start anew after a first search that did not reach the event.
const FIRST_SEARCHES: usize = 2;
/// Smallest number of runs of a level that lie beside the known regions (-): an assumption. With
/// fewer, no room is left for another region.
const LEAST_BESIDE: usize = 20;
/// Number of events of a level that lead a search (-): an assumption; 3 to 10 are plausible.
const FEW_EVENTS: usize = 5;
/// Effective number of events of a level that a fit needs to lead to the region as well as it can
/// (-): an assumption; 10 to 40 are plausible.
const ENOUGH_EVENTS: f64 = 20.0;
/// Standard deviation of the distribution from which the last search starts (-), and largest number
/// of dimensions in which it does. With more of them, its points lie further out than any region
/// that matters.
const WIDE_SD: f64 = 3.0;
const MOST_WIDE: usize = 4;
/// Smallest number of final runs (-): below it the error of a weighted mean is not nearly normal.
const LEAST_FINAL: u64 = 600;
/// Smallest number of final runs with an event for which there is an interval, and smallest
/// effective number of them (-): assumptions. With fewer, the error is not nearly normal.
const LEAST_EVENTS: u64 = 30;
const LEAST_EFFECTIVE: f64 = 15.0;
/// Factor on the number of runs that the pilot's variance asks for (-): an assumption. That
/// variance is uncertain.
const MARGIN: f64 = 1.2;

/// When the sampling ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, serde::Deserialize)]
pub struct Goal {
    /// Width of the 95 % interval, relative to the estimate (-).
    pub relative_width: f64,
    /// Largest number of runs.
    pub budget: u64,
    /// Which of the values is estimated with that width: an index of [`Response::values`].
    pub value: usize,
}

/// The reason for which there is no interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoInterval {
    /// No run came to the event.
    NotReached,
    /// Too few runs came to the event.
    TooFewEvents,
    /// The budget ended before the runs that the estimate rests on.
    Budget,
}

/// The result of importance sampling.
#[derive(Clone, Debug)]
pub struct ImportanceResult {
    /// The means of [`Response::values`].
    pub means: Option<[Mean; 3]>,
    /// The reason for which the means have no interval.
    pub no_interval: Option<NoInterval>,
    /// Upper 95 % bound of the probability that any event happens, if no final run had one: no
    /// weight exceeds the inverse of the defensive share.
    pub upper_bound_without_event: Option<f64>,
    /// All runs, with the runs of the searches and of the pilot.
    pub runs: u64,
    /// The final runs, on which the estimate rests.
    pub final_runs: u64,
    /// Final runs with an event.
    pub events: u64,
    /// Effective number of final runs with an event: (Σw)² / Σw².
    pub effective: f64,
    /// Largest share of the estimate that rests on one run.
    pub largest_share: f64,
    /// Number of searches.
    pub searches: usize,
    /// Share of the estimate that lies where no search has a component.
    pub outside: f64,
    /// The mixture from which the final runs were drawn.
    pub mixture: Mixture,
}

/// A region of the event to which a search has led.
struct Region {
    mixture: Mixture,
    /// A rough estimate of its probability, by the last level of the search. It decides whether the
    /// search goes on, and enters no result.
    probability: f64,
}

/// Runs points with a simulator.
type RunPoints<S> = fn(&mut S, &[Point]) -> Result<Vec<Response>, <S as Simulator>::Error>;

/// The runs so far.
struct Run<'a, S> {
    simulator: &'a mut S,
    dimensions: usize,
    seed: Seed,
    runs: u64,
    budget: u64,
    /// The part of the budget that searches may use. The rest has to carry the estimate.
    search_budget: u64,
}

/// Points with their responses and weights.
#[derive(Default)]
struct Drawn {
    points: Vec<Point>,
    responses: Vec<Response>,
    weights: Vec<f64>,
}

impl Drawn {
    /// Returns the points that `keep` keeps, with their weights.
    fn kept(&self, keep: &dyn Fn(&Response) -> bool) -> (Vec<&[f64]>, Vec<f64>) {
        let all = self.points.iter().zip(&self.responses).zip(&self.weights);
        all.filter(|((_, response), _)| keep(response)).map(|((point, _), w)| (point.normals.as_slice(), *w)).unzip()
    }

    /// Returns the points that lie on the other side of the nominal case than every known region.
    fn beside(self, regions: &[Component]) -> Self {
        let is_beside = |point: &Point| regions.iter().all(|component| !component.is_towards(&point.normals));
        let all = self.points.into_iter().zip(self.responses).zip(self.weights);
        let mut kept = Self::default();
        for ((point, response), weight) in all.filter(|((point, _), _)| is_beside(point)) {
            kept.points.push(point);
            kept.responses.push(response);
            kept.weights.push(weight);
        }
        kept
    }

    fn weight_of_events(&self) -> f64 {
        let all = self.responses.iter().zip(&self.weights);
        all.filter(|(response, _)| response.is_event()).map(|(_, weight)| weight).sum()
    }

    fn events(&self) -> usize {
        self.responses.iter().filter(|response| response.is_event()).count()
    }
}

impl<S: Simulator> Run<'_, S> {
    fn left(&self) -> u64 {
        self.budget - self.runs
    }

    fn level_runs(&self) -> usize {
        LEVEL_RUNS.max(LEVEL_RUNS_PER_DIMENSION * self.dimensions)
    }

    /// Draws and runs points of a mixture.
    fn draw(&mut self, mixture: &Mixture, count: usize, stream: (&str, u64)) -> Result<Drawn, S::Error> {
        self.draw_by(S::run, mixture, count, stream)
    }

    fn draw_by(
        &mut self,
        run: RunPoints<S>,
        mixture: &Mixture,
        count: usize,
        (part, index): (&str, u64),
    ) -> Result<Drawn, S::Error> {
        let mut rng = self.seed.stream(part, index);
        let points: Vec<Point> = (0..count).map(|_| mixture.draw(self.dimensions, &mut rng)).collect();
        let responses = run(self.simulator, &points)?;
        self.runs += count as u64;
        let weights = points.iter().map(|point| 1.0 / mixture.ratio(&point.normals)).collect();
        Ok(Drawn { points, responses, weights })
    }

    /// Searches the event from the distribution of the scenario on, beside the regions that are
    /// known. `None` if it does not come nearer, or the budget ends.
    fn search(&mut self, number: usize, regions: &[Component], start: Mixture) -> Result<Option<Region>, S::Error> {
        let mut mixture = start;
        let (mut nearest, mut without_progress) = (f64::NEG_INFINITY, 0);
        let mut best: Option<(f64, Region)> = None;
        for level in 0..MOST_LEVELS {
            let runs = self.level_runs();
            if self.runs + runs as u64 > self.search_budget {
                break;
            }
            let index = (number * MOST_LEVELS + level) as u64;
            let drawn = self.draw(&mixture, runs, ("search", index))?.beside(regions);
            let Some(threshold) = threshold(&drawn.responses) else { break };
            let events = drawn.events();
            let worth = effective(&drawn.kept(&Response::is_event).1);
            let fit = |part: &str, keep: &dyn Fn(&Response) -> bool| {
                let (points, weights) = drawn.kept(keep);
                Weighted { points: &points, weights: &weights }.fit(DEFENSIVE, &mut self.seed.stream(part, index))
            };
            // The event may never be likely, as when the random streams decide it: then the level
            // whose events are worth most leads to it.
            let is_best = best.as_ref().is_none_or(|(most, _)| worth > *most);
            if threshold == f64::INFINITY || events >= FEW_EVENTS && is_best {
                let probability = drawn.weight_of_events() / runs as f64;
                best = fit("events", &Response::is_event).map(|mixture| (worth, Region { mixture, probability }));
            }
            let has_passed =
                best.as_ref().is_some_and(|(most, _)| 2.0 * worth < *most || worth < *most && *most >= ENOUGH_EVENTS);
            if threshold == f64::INFINITY || has_passed {
                break;
            }
            // A region beside the known ones may begin abruptly: a few events lead there better
            // than many runs that are merely near.
            let has_few = !regions.is_empty() && events >= FEW_EVENTS;
            let Some(fitted) = fit("fit", &|point| if has_few { point.is_event() } else { point.level() >= threshold })
            else {
                break;
            };
            mixture = fitted;
            without_progress = if threshold > nearest { 0 } else { without_progress + 1 };
            nearest = nearest.max(threshold);
            if without_progress == PATIENCE {
                break;
            }
        }
        Ok(best.map(|(_, region)| region))
    }
}

/// Returns the level that the nearest runs reach: infinite if enough of them have the event. `None`
/// of too few runs.
fn threshold(responses: &[Response]) -> Option<f64> {
    if responses.len() < LEAST_BESIDE {
        return None;
    }
    let mut levels: Vec<f64> = responses.iter().map(Response::level).collect();
    levels.sort_by(|a, b| b.total_cmp(a));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
    let kept = (KEPT * levels.len() as f64).ceil() as usize;
    levels.get(kept.max(1) - 1).copied()
}

/// Estimates the probabilities of the events.
///
/// # Errors
/// The error of the simulator.
pub fn importance<S: Simulator>(
    simulator: &mut S,
    dimensions: usize,
    seed: Seed,
    goal: Goal,
) -> Result<ImportanceResult, S::Error> {
    let mut run = Run { simulator, dimensions, seed, runs: 0, budget: goal.budget, search_budget: goal.budget / 2 };
    let mut searches: Vec<Mixture> = Vec::new();
    let mut total = 0.0;
    for number in 0..MOST_SEARCHES {
        let regions: Vec<Component> = searches.iter().flat_map(|mixture| mixture.components.clone()).collect();
        let is_wide = !regions.is_empty() && dimensions <= MOST_WIDE;
        let start = if is_wide { Mixture::wide(dimensions, WIDE_SD) } else { Mixture::standard() };
        match run.search(number, &regions, start)? {
            Some(Region { mixture, probability }) => {
                searches.push(mixture);
                total += probability;
                // What is left beside such a region matters less still.
                if probability < SMALL_REGION * total {
                    break;
                }
            }
            None if searches.is_empty() && number < FIRST_SEARCHES => {}
            None => break,
        }
    }
    let pilot_runs = 2 * run.level_runs();
    if searches.is_empty() || run.left() < pilot_runs as u64 + LEAST_FINAL {
        // Nothing leads to the event: the rest of the budget shows how rare it is at most.
        return without_search(&mut run, &searches, goal);
    }
    let pooled = Mixture::pooled(&searches, DEFENSIVE);
    let drawn = run.draw(&pooled, pilot_runs, ("pilot", 0))?;
    let mixture = refined(&pooled, &drawn, &mut seed.stream("refine", 0));
    let planned = planned(&drawn, &mixture, goal).min(run.left());
    finish(&mut run, &searches, mixture, planned)
}

/// Adds a fit of the pilot's events to the pooled mixture.
fn refined(pooled: &Mixture, drawn: &Drawn, rng: &mut closecall_traffic::Stream) -> Mixture {
    let (points, weights) = drawn.kept(&Response::is_event);
    let fit = Weighted { points: &points, weights: &weights }.fit(DEFENSIVE, rng);
    match fit {
        Some(fit) => Mixture::pooled(&[pooled.clone(), fit], DEFENSIVE),
        None => pooled.clone(),
    }
}

/// Returns the number of final runs that the goal needs, by the variance that the pilot shows for
/// the mixture.
fn planned(drawn: &Drawn, mixture: &Mixture, goal: Goal) -> u64 {
    let count = drawn.points.len() as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for ((point, response), weight) in drawn.points.iter().zip(&drawn.responses).zip(&drawn.weights) {
        let value = response.values()[goal.value];
        sum += weight * value;
        squares += weight * value * value / mixture.ratio(&point.normals);
    }
    let (mean, square) = (sum / count, squares / count);
    let needed = MARGIN * (square / (mean * mean) - 1.0) * powf(2.0 * 1.96 / goal.relative_width, 2.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of runs; a cast saturates")]
    let needed = if needed.is_finite() { needed.ceil() as u64 } else { u64::MAX };
    needed.max(LEAST_FINAL)
}

/// Returns the share of the estimate that lies where no search has a component.
fn outside(drawn: &Drawn, searches: &[Mixture]) -> f64 {
    let (mut all, mut outside) = (0.0, 0.0);
    for ((point, response), weight) in drawn.points.iter().zip(&drawn.responses).zip(&drawn.weights) {
        if response.is_event() {
            all += weight;
            // Less dense than the distribution of the scenario itself: the search does not lead
            // there.
            if searches.iter().all(|search| search.ratio_of_components(&point.normals) < 1.0) {
                outside += weight;
            }
        }
    }
    if all > 0.0 { outside / all } else { 1.0 }
}

/// Draws the final runs, and estimates.
fn finish<S: Simulator>(
    run: &mut Run<'_, S>,
    searches: &[Mixture],
    mixture: Mixture,
    count: u64,
) -> Result<ImportanceResult, S::Error> {
    let drawn = run.draw_by(S::run_last, &mixture, usize::try_from(count).unwrap_or(usize::MAX), ("final", 0))?;
    let all = || drawn.responses.iter().zip(&drawn.weights);
    let column = |value: usize| Mean::of(&all().map(|(r, w)| r.values()[value] * w).collect::<Vec<_>>());
    let of_events: Vec<f64> = all().filter(|(response, _)| response.is_event()).map(|(_, w)| *w).collect();
    let (events, sum) = (of_events.len() as u64, of_events.iter().sum::<f64>());
    let effective = effective(&of_events);
    let no_interval = match events {
        _ if count < LEAST_FINAL => Some(NoInterval::Budget),
        0 => Some(NoInterval::NotReached),
        _ if events < LEAST_EVENTS || effective < LEAST_EFFECTIVE => Some(NoInterval::TooFewEvents),
        _ => None,
    };
    // Q(event) is at most 1 − 0.05^(1/n), and p = E[w; event] is at most Q(event) / α.
    let bound = || -exp_m1(ln(0.05) / count as f64) / mixture.defensive;
    let means = match [column(0), column(1), column(2)] {
        [Some(first), Some(second), Some(difference)] if no_interval.is_none() => Some([first, second, difference]),
        _ => None,
    };
    Ok(ImportanceResult {
        means,
        no_interval,
        upper_bound_without_event: (events == 0 && count > 0).then(|| bound().min(1.0)),
        runs: run.runs,
        final_runs: count,
        events,
        effective,
        largest_share: if sum > 0.0 { of_events.iter().copied().fold(0.0, f64::max) / sum } else { 0.0 },
        searches: searches.len(),
        outside: outside(&drawn, searches),
        mixture,
    })
}

/// Spends the rest of the budget on the distribution of the scenario: plain sampling, whose bound
/// holds without any search.
fn without_search<S: Simulator>(
    run: &mut Run<'_, S>,
    searches: &[Mixture],
    goal: Goal,
) -> Result<ImportanceResult, S::Error> {
    let count = run.left().min(goal.budget / 2);
    finish(run, searches, Mixture::standard(), count)
}
