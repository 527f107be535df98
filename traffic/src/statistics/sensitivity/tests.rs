//! Validation on functions with known indices.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::functions::{event, event_indices, g_function, g_indices, ishigami, ishigami_indices};
use super::given_data::{CLASSES, ClassCounts};
use super::morris::Trajectories;
use super::saltelli::Design;

fn evaluated(design: &Design, function: fn(&[f64]) -> f64) -> Vec<Option<f64>> {
    (0..design.len()).map(|index| Some(function(&design.point(index)))).collect()
}

fn one_by_one(factors: usize) -> Vec<Vec<usize>> {
    (0..factors).map(|factor| vec![factor]).collect()
}

/// The share of repetitions in which the interval of each index contains the truth: first order,
/// and total.
fn coverage(
    function: fn(&[f64]) -> f64,
    truth: &[[f64; 2]],
    rows: usize,
    seeds: std::ops::Range<u64>,
) -> Vec<[f64; 2]> {
    let mut covered = vec![[0_u32; 2]; truth.len()];
    let repetitions = seeds.end - seeds.start;
    for seed in seeds {
        let design = Design::new(truth.len(), one_by_one(truth.len()), rows, &mut StdRng::seed_from_u64(seed));
        let indices = design.indices(&evaluated(&design, function));
        for ((covered, [first, total]), index) in covered.iter_mut().zip(truth).zip(indices) {
            covered[0] += u32::from(index.first.unwrap().covers(*first));
            covered[1] += u32::from(index.total.unwrap().covers(*total));
        }
    }
    covered.into_iter().map(|hits| hits.map(|hits| f64::from(hits) / repetitions as f64)).collect()
}

/// The range in which the coverage of a 95 % interval must lie.
const RANGE: std::ops::RangeInclusive<f64> = 0.93..=0.97;

#[test]
fn intervals_of_ishigami_s_function_contain_the_truth_as_often_as_they_say() {
    // Over 200 repetitions, the share of a single index scatters by 1.5 % around its expectation.
    // One of six indices is then likely to leave the range even if the intervals are exact. 200
    // repetitions are judged together for all indices, and each index by 2000 repetitions, which
    // scatter by 0.5 %.
    let of_200 = coverage(ishigami, &ishigami_indices(), 1_024, 10_000..10_200);
    println!("Ishigami's function, 200 repetitions, first order and total: {of_200:?}");
    let mean = of_200.iter().flatten().sum::<f64>() / 6.0;
    assert!(RANGE.contains(&mean), "{mean}: {of_200:?}");
    let of_2000 = coverage(ishigami, &ishigami_indices(), 1_024, 20_000..22_000);
    println!("2000 repetitions: {of_2000:?}");
    assert!(of_2000.iter().flatten().all(|share| RANGE.contains(share)), "{of_2000:?}");
}

#[test]
fn intervals_of_the_g_function_contain_the_truth_as_often_as_they_say() {
    let shares = coverage(g_function, &g_indices(), 512, 0..1_000);
    println!("g-function, 1000 repetitions, first order and total: {shares:?}");
    assert!(shares.iter().flatten().all(|share| RANGE.contains(share)), "{shares:?}");
}

#[test]
fn intervals_of_an_event_contain_the_truth_at_least_as_often_as_they_say() {
    let shares = coverage(event, &event_indices(), 1_024, 0..1_000);
    println!("event, 1000 repetitions, first order and total: {shares:?}");
    for share in shares.iter().flatten().chain(coverage(event, &event_indices(), 256, 0..1_000).iter().flatten()) {
        assert!(*share >= *RANGE.start(), "{shares:?}");
    }
    // The first factor, and the total indices that rest on enough changes, have intervals that are
    // not wider than needed.
    for share in [shares[0][0], shares[0][1], shares[1][1], shares[2][1]] {
        assert!(RANGE.contains(&share), "{shares:?}");
    }
}

fn design(function: fn(&[f64]) -> f64, factors: usize, groups: Vec<Vec<usize>>) -> (Design, Vec<Option<f64>>) {
    let design = Design::new(factors, groups, 4_096, &mut StdRng::seed_from_u64(1));
    let outputs = evaluated(&design, function);
    (design, outputs)
}

#[test]
fn the_total_index_of_a_group_covers_all_its_factors() {
    let (design, outputs) = design(ishigami, 3, vec![vec![0, 2], vec![1]]);
    let indices = design.indices(&outputs);
    let of_second = ishigami_indices()[1][0];
    // The second factor does not interact with the others.
    assert!((indices[0].total.unwrap().value - (1.0 - of_second)).abs() < 0.02);
    assert!((indices[0].first.unwrap().value - (1.0 - of_second)).abs() < 0.02);
}

#[test]
fn a_factor_without_influence_on_an_event_has_an_index_bounded_by_its_rows() {
    let (design, outputs) = design(event, 4, one_by_one(4));
    let idle = &design.indices(&outputs)[3];
    assert_eq!((idle.changes, idle.rows), (0, 4_096));
    let [low, high] = idle.total.unwrap().interval_95;
    assert!(low == 0.0 && high > 0.0 && high < 0.02, "{high}");
    assert_eq!(idle.first.unwrap().interval_95, [0.0, high]);
}

#[test]
fn a_missing_output_leaves_out_its_row_and_a_constant_output_has_no_index() {
    let (design, mut outputs) = design(ishigami, 3, one_by_one(3));
    // Row 0: the mixed point of the first factor. Row 1: point A, which all need.
    outputs[2] = None;
    outputs[5] = None;
    let rows: Vec<u64> = design.indices(&outputs).iter().map(|index| index.rows).collect();
    assert_eq!(rows, [4_094, 4_095, 4_095]);
    let constant = vec![Some(1.0); outputs.len()];
    assert!(design.indices(&constant).iter().all(|index| index.first.is_none() && index.total.is_none()));
    let none = vec![None; outputs.len()];
    assert!(design.indices(&none).iter().all(|index| index.rows == 0 && index.total.is_none()));
}

#[test]
fn outputs_that_differ_by_rounding_alone_have_no_index() {
    // The mixed points alone have the event: A and B have no variance, and their squares less the
    // squared mean are about 1e-20.
    let (design, outputs) = design(event, 4, one_by_one(4));
    let mixed_alone: Vec<_> = (0..outputs.len()).map(|index| Some(f64::from(u8::from(index % 6 > 1)))).collect();
    let seldom: Vec<_> = (0..outputs.len()).map(|index| Some(f64::from(u8::from(index % 600 == 3)))).collect();
    for outputs in [mixed_alone, seldom] {
        let indices = design.indices(&outputs);
        assert!(indices.iter().all(|index| index.first.is_none() && index.total.is_none()), "{indices:?}");
    }
    // The sum of equal outputs is rounded.
    for output in [0.1, 0.3, 36.7, 1e9 / 3.0] {
        let constant = vec![Some(output); outputs.len()];
        assert_eq!(design.main_effect(0, &constant), None, "{output}");
        let indices = design.indices(&constant);
        assert!(indices.iter().all(|index| index.first.is_none() && index.total.is_none()), "{output}: {indices:?}");
    }
    // Two events in the points A and B of two replicates are a variance, however seldom they are.
    let mut two = vec![Some(0.0); outputs.len()];
    (two[0], two[outputs.len() / 2 + 1]) = (Some(1.0), Some(1.0));
    assert!(design.indices(&two)[0].total.is_some_and(|total| total.value <= 1.0 + 1e-9));
}

#[test]
fn the_main_effect_of_a_factor_equals_the_true_effect() {
    // The event needs the first factor below 0.3, the others below 0.6 and 0.9.
    let truth = [0.54, 0.2 * 0.54, 0.0, 0.0];
    let p = 0.3 * 0.54;
    let index = truth.iter().map(|mean| 0.25 * (mean - p) * (mean - p)).sum::<f64>() / (p * (1.0 - p));
    let (mut of_index, mut of_idle, mut of_means) = (0, 0, [0; 4]);
    for seed in 0..1_000 {
        let design = Design::new(4, one_by_one(4), 256, &mut StdRng::seed_from_u64(seed));
        let outputs = evaluated(&design, event);
        let effect = design.main_effect(0, &outputs).unwrap();
        of_index += u32::from(effect.index.covers(index));
        for ((covered, mean), truth) in of_means.iter_mut().zip(effect.means).zip(truth) {
            *covered += u32::from(mean.covers(truth));
        }
        of_idle += u32::from(design.main_effect(3, &outputs).unwrap().index.covers(0.0));
    }
    println!("main effect, 1000 repetitions: index {of_index}, means {of_means:?}, idle factor {of_idle}");
    assert!((930..=975).contains(&of_index), "{of_index}");
    assert!(of_means[..2].iter().all(|covered| (930..=975).contains(covered)), "{of_means:?}");
    assert!(of_idle >= 930, "{of_idle}");
    let (design, outputs) = design(event, 4, one_by_one(4));
    let [low, high] = design.main_effect(0, &outputs).unwrap().ends();
    assert!(low.value == 0.0 && (high.value - 0.54).abs() < 0.01);
    assert_eq!(design.main_effect(0, &vec![Some(1.0); outputs.len()]), None);
}

#[test]
fn a_seed_determines_every_point() {
    let points = |seed| {
        let design = Design::new(3, one_by_one(3), 64, &mut StdRng::seed_from_u64(seed));
        (0..design.len()).map(|index| design.point(index)).collect::<Vec<_>>()
    };
    assert_eq!(points(1), points(1));
    assert_ne!(points(1), points(2));
    assert!(points(1).iter().flatten().all(|u| 0.0 < *u && *u < 1.0));
}

fn linear(u: &[f64]) -> f64 {
    3.0 * u[0] - 2.0 * u[1] + 0.0 * u[2]
}

#[test]
fn the_effects_of_a_linear_function_are_its_coefficients() {
    let design = Trajectories::new(3, 10, &mut StdRng::seed_from_u64(3));
    let outputs: Vec<Option<f64>> = (0..design.len()).map(|index| Some(linear(&design.point(index)))).collect();
    for (effects, coefficient) in design.effects(&outputs).iter().zip([3.0, -2.0, 0.0]) {
        assert!((effects.mu.unwrap() - coefficient).abs() < 1e-9);
        assert!((effects.mu_star.unwrap().value - f64::abs(coefficient)).abs() < 1e-9);
        assert!(effects.sigma.unwrap() < 1e-9);
        assert_eq!((effects.effects, effects.missing), (10, 0));
    }
}

#[test]
fn the_interval_of_an_effect_that_is_seldom_seen_does_not_begin_below_0() {
    let design = Trajectories::new(3, 10, &mut StdRng::seed_from_u64(6));
    let outputs: Vec<Option<f64>> =
        (0..design.len()).map(|index| Some(f64::from(u8::from(design.point(index)[0] > 0.93)))).collect();
    let mu_star = design.effects(&outputs)[0].mu_star.unwrap();
    assert!(mu_star.value > 0.0, "the effect is seen");
    assert!(mu_star.interval_95[0] > 0.0 && mu_star.covers(mu_star.value), "{mu_star:?}");
}

#[test]
fn screening_finds_the_factors_of_the_g_function_in_their_order() {
    let design = Trajectories::new(5, 100, &mut StdRng::seed_from_u64(4));
    let outputs: Vec<Option<f64>> = (0..design.len()).map(|index| Some(g_function(&design.point(index)))).collect();
    let mu_stars: Vec<f64> = design.effects(&outputs).iter().map(|effects| effects.mu_star.unwrap().value).collect();
    assert!(mu_stars.windows(2).all(|pair| pair[0] > pair[1]), "{mu_stars:?}");
    // Every factor interacts with the others: σ is of the size of μ*.
    assert!(design.effects(&outputs)[0].sigma.unwrap() > 0.5 * mu_stars[0]);
}

#[test]
fn each_step_moves_one_factor_by_half_of_its_range_and_a_rare_label_is_met() {
    let design = Trajectories::new(4, 50, &mut StdRng::seed_from_u64(5));
    let mut is_met = false;
    for index in 1..design.len() {
        let (before, after) = (design.point(index - 1), design.point(index));
        assert!(after.iter().all(|u| (0.0..1.0).contains(u)));
        is_met |= after[0] > 0.9;
        if index % 5 != 0 {
            let moved: Vec<f64> = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).filter(|d| *d > 0.0).collect();
            assert!(moved.len() == 1 && (moved[0] - 0.5).abs() < 1e-12, "{moved:?}");
        }
    }
    assert!(is_met);
}

#[test]
fn a_missing_output_leaves_out_the_effects_at_its_ends() {
    let design = Trajectories::new(3, 4, &mut StdRng::seed_from_u64(6));
    let mut outputs: Vec<Option<f64>> = (0..design.len()).map(|index| Some(linear(&design.point(index)))).collect();
    outputs[1] = None;
    let effects = design.effects(&outputs);
    assert_eq!(effects.iter().map(|effects| effects.missing).sum::<usize>(), 2);
    assert_eq!(effects.iter().map(|effects| effects.effects).sum::<usize>(), 10);
}

/// Counts of an event with a probability that depends on one of two independent parameters.
fn given(samples: u64, seed: u64, probability: fn(f64) -> f64) -> [ClassCounts; 2] {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut counts = [ClassCounts::continuous(), ClassCounts::continuous()];
    for number in 0..samples {
        let u: [f64; 2] = [rng.random(), rng.random()];
        let is_event = rng.random::<f64>() < probability(u[0]);
        for (counts, u) in counts.iter_mut().zip(u) {
            counts.push((u * CLASSES as f64) as usize, number, is_event);
        }
    }
    counts
}

#[test]
fn the_index_from_given_data_is_unbiased_and_its_interval_is_honest() {
    // Two levels of probability, one per half of the range: the index is exact for any number of
    // even classes.
    let probability = |u: f64| if u < 0.5 { 0.1 } else { 0.3 };
    let truth = [0.01 / (0.2 * 0.8), 0.0];
    let (mut covered, mut sum) = ([0_u32; 2], [0.0; 2]);
    for seed in 0..2_000 {
        for (index, counts) in given(1_000, seed, probability).iter().enumerate() {
            let estimate = counts.influence().unwrap().index;
            covered[index] += u32::from(estimate.covers(truth[index]));
            sum[index] += estimate.value;
        }
    }
    let shares = covered.map(|hits| f64::from(hits) / 2_000.0);
    println!("given data, 2000 repetitions: coverage {shares:?}, means {:?}", sum.map(|sum| sum / 2_000.0));
    assert!(shares.iter().all(|share| (0.93..=0.985).contains(share)), "{shares:?}");
    for (sum, truth) in sum.iter().zip(truth) {
        assert!((sum / 2_000.0 - truth).abs() < 0.001, "{sum:?} for {truth}");
    }
}

#[test]
fn with_few_events_there_is_no_influence() {
    let [few, _] = given(1_000, 1, |_| 0.005);
    assert_eq!(few.influence(), None);
    let [some, _] = given(1_000, 1, |_| 0.03);
    let influence = some.influence().unwrap();
    assert_eq!(influence.rates.len(), 4, "with few events there are four classes");
    let [many, _] = given(1_000, 1, |_| 0.2);
    assert_eq!(many.influence().unwrap().rates.len(), CLASSES);
    let [nearly_all, _] = given(1_000, 1, |_| 0.995);
    assert_eq!(nearly_all.influence(), None, "few samples without the event say as little");
}

#[test]
fn labels_are_classes_of_their_own() {
    let mut counts = ClassCounts::labels(3);
    for number in 0..900 {
        counts.push((number % 3) as usize, number / 3, number % 3 == 0);
    }
    counts.push(7, 0, true);
    let influence = counts.influence().unwrap();
    assert_eq!(counts.total(), [900, 300]);
    assert!((influence.index.value - 1.0).abs() < 1e-9);
    assert_eq!(influence.rates.iter().map(|rate| rate.value).collect::<Vec<_>>(), [1.0, 0.0, 0.0]);
}
