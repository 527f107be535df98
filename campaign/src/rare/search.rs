//! A search for the first case of an event. It states no probability.
//!
//! ```text
//!  scenario ─▶ first runs ─▶ nearest runs so far ─▶ small and large moves beside them ─▶ event
//!                                  ▲──────────────────────────────┘
//! ```
//!
//! An evolution strategy (H.-G. Beyer and H.-P. Schwefel, *Evolution strategies: a comprehensive
//! introduction*, Natural Computing 1 (2002) 3–52) of the kind (μ + λ): the nearest μ runs stay,
//! and λ new ones are moved from them, as in subset simulation. Each move has a width of its own,
//! drawn at random, because a search does not know how narrow its region is. Some runs are drawn
//! from the scenario itself, and a search that comes no nearer starts again.
//!
//! The runs depend on the seed and on the responses only, and not on the number of threads: a
//! search always ends after a complete round.

use closecall_traffic::Stream;
use closecall_traffic::maths::{exp, ln};
use rand::RngExt;

use super::problem::{Point, Response, Seed, Simulator};
use super::subset::moved;

/// Number of runs with which a search begins (-): an assumption; 50 to 500 are plausible.
const FIRST: u64 = 200;
/// Number of nearest runs that are moved (-), and number of new runs of a round (-): assumptions;
/// 5 to 50 and 20 to 200 are plausible.
const NEAREST: usize = 20;
const ROUND: u64 = 50;
/// Share of the runs of a round that are drawn from the scenario (-): an assumption; 0.05 to 0.3
/// are plausible.
const FRESH: f64 = 0.1;
/// Smallest and largest width of a move (standard deviations): assumptions; a width of 1 is a new
/// draw.
const WIDTHS: [f64; 2] = [0.03, 0.9];
/// Number of rounds without a nearer run after which a search starts again (-): an assumption; 4 to
/// 20 are plausible.
const PATIENCE: usize = 8;

/// The result of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SearchResult {
    /// All runs.
    pub runs: u64,
    /// How often the search began.
    pub starts: u64,
    /// Whether some run had the event.
    pub has_event: bool,
}

type Run = (Point, Response);

struct Search<'a, S> {
    simulator: &'a mut S,
    dimensions: usize,
    runs: u64,
    budget: u64,
}

impl<S: Simulator> Search<'_, S> {
    /// Returns how many of the wanted runs the budget allows.
    fn affordable(&self, wanted: u64) -> u64 {
        wanted.min(self.budget - self.runs)
    }

    fn respond(&mut self, points: Vec<Point>) -> Result<Vec<Run>, S::Error> {
        let responses = self.simulator.run(&points)?;
        self.runs += points.len() as u64;
        Ok(points.into_iter().zip(responses).collect())
    }

    /// Searches from new runs of the scenario on. Returns whether some run has the event.
    fn climb(&mut self, rng: &mut Stream) -> Result<bool, S::Error> {
        let first = (0..self.affordable(FIRST)).map(|_| Point::draw(self.dimensions, rng)).collect();
        let mut nearest = kept(self.respond(first)?);
        let mut without_progress = 0;
        while without_progress < PATIENCE && !has_event(&nearest) && self.affordable(1) > 0 {
            let best = level(&nearest);
            let points = (0..self.affordable(ROUND)).map(|_| next(&nearest, self.dimensions, rng)).collect();
            nearest.extend(self.respond(points)?);
            nearest = kept(nearest);
            without_progress = if level(&nearest) > best { 0 } else { without_progress + 1 };
        }
        Ok(has_event(&nearest))
    }
}

/// Returns the nearest runs, the nearest first. Of equally near ones, the earlier stays.
fn kept(mut runs: Vec<Run>) -> Vec<Run> {
    runs.sort_by(|(_, a), (_, b)| b.level().total_cmp(&a.level()));
    runs.truncate(NEAREST);
    runs
}

fn level(nearest: &[Run]) -> f64 {
    nearest.first().map_or(f64::NEG_INFINITY, |(_, response)| response.level())
}

fn has_event(nearest: &[Run]) -> bool {
    nearest.first().is_some_and(|(_, response)| response.is_event())
}

/// Returns the next point: beside one of the nearest runs, or drawn from the scenario.
fn next(nearest: &[Run], dimensions: usize, rng: &mut Stream) -> Point {
    let is_fresh = rng.random::<f64>() < FRESH;
    let parent = nearest.get(rng.random_range(0..nearest.len().max(1))).filter(|_| !is_fresh);
    let [low, high] = WIDTHS.map(ln);
    let width = exp(low + (high - low) * rng.random::<f64>());
    match parent {
        Some((point, _)) => moved(point, width, rng),
        None => Point::draw(dimensions, rng),
    }
}

/// Looks for the first run with an event.
///
/// # Errors
/// The error of the simulator.
pub fn search<S: Simulator>(
    simulator: &mut S,
    dimensions: usize,
    seed: Seed,
    budget: u64,
) -> Result<SearchResult, S::Error> {
    let mut search = Search { simulator, dimensions, runs: 0, budget };
    let (mut starts, mut has_event) = (0, false);
    while !has_event && search.affordable(1) > 0 {
        has_event = search.climb(&mut seed.stream("first-case", starts))?;
        starts += 1;
    }
    Ok(SearchResult { runs: search.runs, starts, has_event })
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    /// A region far from the nominal case that is narrow in two of eight dimensions: plain sampling
    /// finds it in 1 of 10^5 runs. `hides` leaves no score that leads there.
    struct Narrow {
        hides: bool,
    }

    impl Narrow {
        fn response(&self, point: &Point) -> Response {
            let (x, y) = (point.normals[0] - 3.2, point.normals[1] - 2.1);
            let away = (x.powi(2) + y.powi(2)).sqrt();
            Response { score: if self.hides { 0.0 } else { -away }, events: [away < 0.16, false] }
        }
    }

    impl Simulator for Narrow {
        type Error = Infallible;

        fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, Infallible> {
            Ok(points.iter().map(|point| self.response(point)).collect())
        }
    }

    const BUDGET: u64 = 2_000;
    const SEEDS: u64 = 40;

    fn successes(hides: bool) -> usize {
        let has_event = |seed: &u64| search(&mut Narrow { hides }, 8, Seed(*seed), BUDGET).unwrap().has_event;
        (0..SEEDS).filter(has_event).count()
    }

    #[test]
    fn a_region_that_plain_sampling_misses_is_found_in_a_tenth_of_the_runs() {
        let hits = successes(false);
        assert!(hits >= 38, "{hits} of {SEEDS}");
        let plain = |seed: &u64| {
            let mut rng = Seed(*seed).stream("plain", 0);
            (0..10 * BUDGET).any(|_| Narrow { hides: false }.response(&Point::draw(8, &mut rng)).is_event())
        };
        let by_chance = (0..SEEDS).filter(plain).count();
        assert!(by_chance <= 12, "{by_chance} of {SEEDS}: the region is not rare");
    }

    #[test]
    fn without_a_score_that_leads_there_a_search_is_no_better_than_chance() {
        let hits = successes(true);
        assert!(hits <= 4, "{hits} of {SEEDS}");
    }

    #[test]
    fn a_search_that_comes_no_nearer_starts_again_until_the_budget_is_spent() {
        let result = search(&mut Narrow { hides: true }, 8, Seed(1), BUDGET).unwrap();
        assert_eq!(result.runs, BUDGET);
        assert!(result.starts > 1, "{result:?}");
    }

    #[test]
    fn a_search_ends_with_the_round_of_the_first_event() {
        struct All;
        impl Simulator for All {
            type Error = Infallible;

            fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, Infallible> {
                Ok(points.iter().map(|_| Response { score: 0.0, events: [true, false] }).collect())
            }
        }
        assert_eq!(search(&mut All, 2, Seed(1), 1_000), Ok(SearchResult { runs: 200, starts: 1, has_event: true }));
        assert_eq!(search(&mut All, 2, Seed(1), 10), Ok(SearchResult { runs: 10, starts: 1, has_event: true }));
        assert_eq!(search(&mut All, 2, Seed(1), 0), Ok(SearchResult { runs: 0, starts: 0, has_event: false }));
    }
}
