//! Both methods on events of known probability.

use proptest::prelude::*;

use closecall_traffic::statistics::normal::TruncatedStandardNormal;

use super::importance::{Goal, NoInterval, importance};
use super::mixture::Mixture;
use super::problem::{Point, Response, Seed, Simulator};
use super::subset::subset;

/// A function in place of a simulation.
struct Function<F>(F);

impl<F: Fn(&Point) -> Response> Simulator for Function<F> {
    type Error = std::convert::Infallible;

    fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, Self::Error> {
        Ok(points.iter().map(&self.0).collect())
    }
}

/// Returns the number of standard deviations beyond which a probability lies.
fn beyond(probability: f64) -> f64 {
    -TruncatedStandardNormal::new(f64::NEG_INFINITY, f64::INFINITY).unwrap().quantile(probability)
}

/// An event in one direction that no axis has.
fn one_region(probability: f64) -> impl Fn(&Point) -> Response {
    let limit = beyond(probability);
    move |point| {
        let along = point.normals.iter().sum::<f64>() / (point.normals.len() as f64).sqrt();
        Response { score: along - limit, events: [along > limit, false] }
    }
}

/// Two regions on opposite sides. The first has `share` of the probability.
fn two_regions(probability: f64, share: f64) -> impl Fn(&Point) -> Response {
    let [up, down] = [share, 1.0 - share].map(|share| beyond(share * probability));
    move |point| {
        let z = point.normals[0];
        Response { score: (z - up).max(-z - down), events: [z > up || z < -down, false] }
    }
}

/// Two regions. The score of the second rises much faster, and the first attracts nearly every run:
/// at z = 1, the second seems nearer.
fn misleading(probability: f64) -> impl Fn(&Point) -> Response {
    let limit = beyond(0.5 * probability);
    move |point| {
        let z = point.normals[0];
        Response { score: (z - limit).max(0.4 * (-z - limit)), events: [z.abs() > limit, false] }
    }
}

const GOAL: Goal = Goal { relative_width: 0.5, budget: 200_000, value: 0 };
/// Runs that plain sampling needs for that width, times the probability: (2·1.96 / 0.5)².
const PLAIN: f64 = 61.47;

/// Number of repetitions of a test, and the least share of them that covers the truth: more than
/// four standard errors below 95 %.
const REPETITIONS: u64 = 40;
const LEAST_COVERED: f64 = 0.8;

/// Returns the share of repetitions whose interval contains the probability, and their mean number
/// of runs.
fn coverage(event: impl Fn(&Point) -> Response, dimensions: usize, probability: f64, by_subset: bool) -> (f64, f64) {
    let mut simulator = Function(event);
    let repetitions = if by_subset { REPETITIONS / 3 } else { REPETITIONS };
    let (mut covered, mut runs) = (0, 0);
    for seed in 0..repetitions {
        let (means, used) = if by_subset {
            let result = subset(&mut simulator, dimensions, Seed(seed), GOAL).unwrap();
            (result.means, result.runs)
        } else {
            let result = importance(&mut simulator, dimensions, Seed(seed), GOAL).unwrap();
            (result.means, result.runs)
        };
        let interval = means.and_then(|means| means[0].interval_of_probability(0.95));
        covered += u64::from(interval.is_some_and(|[low, high]| low <= probability && probability <= high));
        runs += used;
    }
    (covered as f64 / repetitions as f64, runs as f64 / repetitions as f64)
}

#[test]
fn importance_covers_with_few_runs() {
    for (probability, dimensions, saving) in [(1e-3, 3, 10.0), (1e-5, 2, 50.0), (1e-6, 8, 500.0)] {
        let (covered, runs) = coverage(one_region(probability), dimensions, probability, false);
        assert!(covered >= LEAST_COVERED, "{probability}: {covered}");
        assert!(runs * saving <= PLAIN / probability, "{probability}: {runs}");
    }
}

#[test]
fn importance_finds_both_of_two_regions() {
    for (probability, share) in [(1e-3, 0.5), (1e-5, 0.5), (1e-6, 0.7)] {
        let (covered, runs) = coverage(two_regions(probability, share), 2, probability, false);
        assert!(covered >= LEAST_COVERED, "{probability}: {covered}");
        assert!(runs * 10.0 <= PLAIN / probability, "{probability}: {runs}");
    }
}

#[test]
fn importance_finds_the_region_that_the_score_hides() {
    let (covered, _) = coverage(misleading(1e-5), 2, 1e-5, false);
    assert!(covered >= LEAST_COVERED, "{covered}");
}

#[test]
fn a_search_that_stops_at_the_first_region_would_be_caught() {
    // What one region alone would give: half of the probability, which no interval of the test
    // above may contain.
    let mut simulator = Function(two_regions(1e-5, 0.5));
    let result = importance(&mut simulator, 2, Seed(1), GOAL).unwrap();
    let [low, _] = result.means.unwrap()[0].interval_of_probability(0.95).unwrap();
    assert!(low > 0.5e-5, "{low}");
}

#[test]
fn subset_covers_with_few_runs() {
    for (probability, saving) in [(1e-5, 50.0), (1e-6, 400.0)] {
        let (covered, runs) = coverage(one_region(probability), 2, probability, true);
        assert!(covered >= 0.75, "{probability}: {covered}");
        assert!(runs * saving <= PLAIN / probability, "{probability}: {runs}");
    }
    let (covered, _) = coverage(two_regions(1e-5, 0.5), 2, 1e-5, true);
    assert!(covered >= 0.75, "{covered}");
}

#[test]
fn two_methods_agree_on_a_difference() {
    // Prevented with 2e-4, induced with 1e-4, in different directions.
    let [up, side] = [2e-4, 1e-4].map(beyond);
    let event = move |point: &Point| {
        let [z, y] = [point.normals[0], point.normals[1]];
        Response { score: (z - up).max(y - side), events: [z > up, y > side && z <= up] }
    };
    let goal = Goal { relative_width: 1.0, value: 2, ..GOAL };
    let by_importance = importance(&mut Function(event), 3, Seed(3), goal).unwrap().means.unwrap();
    let by_subset = subset(&mut Function(event), 3, Seed(3), goal).unwrap().means.unwrap();
    let truth = 2e-4 - 1e-4 * (1.0 - 2e-4);
    for means in [by_importance, by_subset] {
        let [low, high] = means[2].interval(0.99).unwrap();
        assert!(low <= truth && truth <= high, "{truth}: {low} to {high}");
        assert!((means[0].value - means[1].value - means[2].value).abs() < 1e-12);
    }
}

#[test]
fn an_event_of_the_random_streams_alone_is_estimated_although_they_are_not_moved() {
    // One key of sixteen has the event beyond 3 standard deviations.
    let event = |point: &Point| {
        let z = point.normals[0];
        Response { score: z, events: [z > 3.0 && point.noise.is_multiple_of(16), false] }
    };
    let truth = 1.349_898e-3 / 16.0;
    let means = importance(&mut Function(event), 2, Seed(5), GOAL).unwrap().means.unwrap();
    let [low, high] = means[0].interval_of_probability(0.99).unwrap();
    assert!(low <= truth && truth <= high, "{truth}: {low} to {high}");
    let means = subset(&mut Function(event), 2, Seed(5), GOAL).unwrap().means.unwrap();
    let [low, high] = means[0].interval_of_probability(0.99).unwrap();
    assert!(low <= truth && truth <= high, "{truth}: {low} to {high}");
}

#[test]
fn an_impossible_event_has_a_bound_and_no_interval() {
    let event = |point: &Point| Response { score: point.normals[0], events: [false, false] };
    let goal = Goal { budget: 5_000, ..GOAL };
    let result = importance(&mut Function(event), 2, Seed(0), goal).unwrap();
    assert_eq!((result.means, result.no_interval), (None, Some(NoInterval::NotReached)));
    // A bound by plain sampling: three over the number of final runs.
    let bound = result.upper_bound_without_event.unwrap();
    assert!((bound * result.final_runs as f64 - 3.0).abs() < 0.01, "{bound}");
    assert!(result.runs <= goal.budget);
    // The levels come nearer to the event until the budget ends.
    let result = subset(&mut Function(event), 2, Seed(0), goal).unwrap();
    assert!(result.means.is_none() && result.runs <= goal.budget);
    assert_eq!(result.no_interval, Some(NoInterval::Budget));
}

#[test]
fn a_score_without_any_information_is_no_estimate_that_looks_safe() {
    // Every run has the same score: nothing leads to the event.
    let event = |point: &Point| Response { score: 0.0, events: [point.normals[0] > 6.0, false] };
    let goal = Goal { budget: 20_000, ..GOAL };
    let result = importance(&mut Function(event), 6, Seed(0), goal).unwrap();
    assert!(result.means.is_none() && result.no_interval.is_some());
    let result = subset(&mut Function(event), 6, Seed(0), goal).unwrap();
    assert_eq!((result.means, result.no_interval), (None, Some(NoInterval::NotReached)));
}

#[test]
fn a_score_that_is_not_a_number_is_the_farthest() {
    let response = |score, happened| Response { score, events: [happened, false] };
    assert_eq!(response(f64::NAN, false).level(), f64::NEG_INFINITY);
    assert_eq!(response(f64::NAN, true).level(), f64::INFINITY);
    assert!(response(f64::INFINITY, false).level() < f64::INFINITY, "only an event is the event");
}

#[test]
fn a_frequent_event_needs_no_search() {
    let (covered, runs) = coverage(one_region(0.2), 2, 0.2, false);
    assert!(covered >= LEAST_COVERED && runs < 10_000.0, "{covered} {runs}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_runs_follow_from_the_seed_and_stay_within_the_budget(
        seed: u64, budget in 1_u64..6_000, dimensions in 1_usize..6, by_subset: bool,
    ) {
        let goal = Goal { budget, ..GOAL };
        let once = || {
            let mut points = Vec::new();
            let event = one_region(1e-2);
            let mut simulator = Recording(|point: &Point| { points.push(point.clone()); event(point) });
            let (means, runs) = if by_subset {
                let result = subset(&mut simulator, dimensions, Seed(seed), goal).unwrap();
                (result.means, result.runs)
            } else {
                let result = importance(&mut simulator, dimensions, Seed(seed), goal).unwrap();
                (result.means, result.runs)
            };
            (points, means, runs)
        };
        let (points, means, runs) = once();
        prop_assert_eq!(points.len() as u64, runs);
        prop_assert!(runs <= budget);
        prop_assert_eq!((points, means, runs), once());
    }

    #[test]
    fn weights_are_bounded_and_the_density_is_one_on_average(seed: u64, dimensions in 1_usize..5) {
        let mut rng = Seed(seed).stream("test", 0);
        let mut mixture = Mixture::wide(dimensions, 2.0);
        mixture.defensive = 0.1;
        let weights: Vec<f64> =
            (0..4_000).map(|_| 1.0 / mixture.ratio(&mixture.draw(dimensions, &mut rng).normals)).collect();
        prop_assert!(weights.iter().all(|weight| (0.0..=10.0 + 1e-9).contains(weight)));
        // The mean of the weights is 1. Their variance is below 9; six standard errors.
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        prop_assert!((mean - 1.0).abs() < 6.0 * 3.0 / (weights.len() as f64).sqrt(), "{}", mean);
    }
}

/// A function that changes a value outside.
struct Recording<F>(F);

impl<F: FnMut(&Point) -> Response> Simulator for Recording<F> {
    type Error = std::convert::Infallible;

    fn run(&mut self, points: &[Point]) -> Result<Vec<Response>, Self::Error> {
        Ok(points.iter().map(&mut self.0).collect())
    }
}
