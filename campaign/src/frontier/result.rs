//! The result of a frontier: what each combination of settings prevents, induces and costs, and
//! which combinations are Pareto-optimal.

use closecall_traffic::statistics::interval::{COVERAGE, clopper_pearson};
use closecall_traffic::statistics::sensitivity::jackknife::{Estimate, student};

use super::plan::FrontierPlan;
use crate::ledger::{Pairs, Tally};
use crate::sensitivity::RunErrors;

/// Difference of the speed lost below which two combinations count as equal (m/s): the last digit
/// of the reports.
const SPEED_LOST_STEP_MPS: f64 = 0.01;

/// The result of all combinations.
#[derive(Clone, Debug)]
pub struct Frontier {
    /// The scenario's name.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// Number of samples of each combination.
    pub samples: u64,
    /// The settings of the command line.
    pub settings: Vec<String>,
    /// The controllers, the one under test last.
    pub controllers: Vec<String>,
    /// The keys that are varied.
    pub keys: Vec<String>,
    /// The combinations.
    pub points: Vec<Point>,
    /// The runs without an outcome.
    pub errors: RunErrors,
}

/// The result of one combination of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The values, in the order of the keys.
    pub values: Vec<String>,
    /// Number of samples with an outcome in both arms.
    pub samples: u64,
    /// Collisions of the ego in the baseline.
    pub collisions_without: u64,
    /// Collisions of the ego in the arm under test.
    pub collisions: u64,
    /// Counts of the pairs: prevented, induced, both, neither.
    pub pairs: Pairs,
    /// Prevented collisions as a share of the baseline's collisions; `None` if the baseline has
    /// none.
    pub prevented: Option<Estimate>,
    /// Samples with an induced collision, as a share of all samples; `None` without samples.
    pub induced: Option<Estimate>,
    /// Mean over the samples of the largest speed deficit to the lead vehicle, less the deficit in
    /// the baseline (m/s); `None` for fewer than two samples.
    pub speed_lost_mps: Option<Estimate>,
    /// True if the combination is Pareto-optimal: no other combination is better in one of the
    /// three figures (prevented, induced, speed lost) and at least as good in the other two. The
    /// speed lost is rounded to 0.01 m/s, as in the reports.
    pub is_optimal: bool,
}

impl Point {
    pub(super) fn new(values: Vec<String>, baseline: &[Tally], tested: &[Tally]) -> Self {
        let (mut pairs, mut lost_mps) = (Pairs::default(), Vec::new());
        let (mut collisions_without, mut collisions) = (0, 0);
        for (baseline, tested) in baseline.iter().zip(tested) {
            let (Some(collides_without), Some(collides_with)) = (baseline.collided, tested.collided) else { continue };
            pairs.push(baseline, tested);
            lost_mps.push(tested.speed_deficit_mps - baseline.speed_deficit_mps);
            collisions_without += u64::from(collides_without);
            collisions += u64::from(collides_with);
        }
        let samples = lost_mps.len() as u64;
        let share = |hits: u64, trials: u64| {
            let interval_95 = clopper_pearson(hits, trials, COVERAGE);
            (trials > 0).then(|| Estimate { value: hits as f64 / trials as f64, interval_95 })
        };
        Self {
            values,
            samples,
            collisions_without,
            collisions,
            prevented: share(pairs.prevented, collisions_without),
            induced: share(pairs.induced, samples),
            speed_lost_mps: student(&lost_mps),
            pairs,
            is_optimal: false,
        }
    }

    /// Returns the three costs of a point, each better if it is smaller: minus the prevented share,
    /// the induced share, and the speed lost in whole steps. Returns `None` if one is unknown.
    fn costs(&self) -> Option<[f64; 3]> {
        let value = |estimate: Option<Estimate>| Some(estimate?.value);
        let lost_steps = (value(self.speed_lost_mps)? / SPEED_LOST_STEP_MPS).round();
        Some([-value(self.prevented)?, value(self.induced)?, lost_steps])
    }

    /// Returns the number of induced or both-arms pairs in which only vehicles other than the ego
    /// collide in the arm under test. [`collisions`](Self::collisions) leaves them out.
    pub fn collisions_of_others_only(&self) -> u64 {
        self.pairs.induced_of_others + self.pairs.both_of_others
    }
}

impl Frontier {
    pub(super) fn new(plan: &FrontierPlan, mut points: Vec<Point>, errors: RunErrors) -> Self {
        mark_optimal(&mut points);
        Self {
            scenario: plan.file.config().name.clone(),
            seed: plan.sampling.seed,
            samples: plan.sampling.samples,
            settings: plan.file.settings().iter().map(ToString::to_string).collect(),
            controllers: plan.controllers.iter().map(|controller| controller.name().to_owned()).collect(),
            keys: plan.grid.iter().map(|grid| grid.key.clone()).collect(),
            points,
            errors,
        }
    }
}

/// Marks the points that no other point dominates. A point with an unknown cost is not marked.
fn mark_optimal(points: &mut [Point]) {
    let costs: Vec<Option<[f64; 3]>> = points.iter().map(Point::costs).collect();
    let dominates = |one: &[f64; 3], other: &[f64; 3]| {
        let pairs = || one.iter().zip(other);
        pairs().all(|(one, other)| one <= other) && pairs().any(|(one, other)| one < other)
    };
    for (point, cost) in points.iter_mut().zip(&costs) {
        point.is_optimal = cost.is_some_and(|cost| !costs.iter().flatten().any(|other| dominates(other, &cost)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tallies(collided: &[Option<bool>], deficit_mps: f64) -> Vec<Tally> {
        collided
            .iter()
            .map(|collided| Tally { collided: *collided, speed_deficit_mps: deficit_mps, ..Tally::default() })
            .collect()
    }

    #[test]
    fn a_point_counts_the_samples_that_have_both_outcomes() {
        let baseline = tallies(&[Some(true), Some(true), Some(false), Some(true), Some(false)], 0.5);
        let tested = tallies(&[Some(false), Some(true), Some(true), None, Some(false)], 2.5);
        let point = Point::new(vec!["1".to_owned()], &baseline, &tested);
        assert_eq!((point.samples, point.collisions_without, point.collisions), (4, 2, 2));
        assert_eq!((point.pairs.prevented, point.pairs.induced), (1, 1));
        assert_eq!(point.prevented.unwrap().value, 0.5);
        assert_eq!(point.induced.unwrap().value, 0.25);
        assert_eq!(point.speed_lost_mps.unwrap().value, 2.0);
    }

    #[test]
    fn a_point_is_optimal_unless_another_is_better() {
        let baseline = tallies(&[Some(true), Some(true), Some(false)], 0.0);
        let point =
            |tested: [bool; 3], lost_mps| Point::new(Vec::new(), &baseline, &tallies(&tested.map(Some), lost_mps));
        let mut points = [
            point([false, true, false], 1.0),  // prevents one of two
            point([false, true, false], 2.0),  // no more, and slower
            point([false, false, false], 2.0), // prevents both, slower
            point([false, false, true], 2.0),  // prevents both, induces one
            Point::new(Vec::new(), &[], &[]),
        ];
        mark_optimal(&mut points);
        assert_eq!(points.map(|point| point.is_optimal), [true, false, true, false, false]);
    }

    #[test]
    fn combinations_whose_figures_print_alike_are_marked_alike() {
        let baseline = tallies(&[Some(true), Some(true), Some(false)], 0.0);
        let point = |lost_mps| Point::new(Vec::new(), &baseline, &tallies(&[true, false, false].map(Some), lost_mps));
        let mut points = [point(1.000_03), point(1.0), point(1.02)];
        mark_optimal(&mut points);
        assert_eq!(points.map(|point| point.is_optimal), [true, true, false]);
    }

    #[test]
    fn a_point_counts_the_samples_in_which_only_other_vehicles_collide() {
        let baseline = tallies(&[Some(true), Some(false)], 0.0);
        let mut tested = tallies(&[Some(false), Some(false)], 0.0);
        tested[0].others_collided = true;
        let point = Point::new(Vec::new(), &baseline, &tested);
        assert_eq!((point.collisions_without, point.collisions, point.pairs.prevented), (1, 0, 0));
        assert_eq!(point.collisions_of_others_only(), 1);
    }
}
