//! Tests of the coverage, the independence and the addressing of the designs.

use std::collections::BTreeSet;

use closecall_traffic::{ParameterName, Parameters, Value, maths};
use proptest::prelude::*;

use super::Design;
use crate::parameters::{ParameterSpace, ParametersConfig};

const SEEDS: [u64; 3] = [0, 1, u64::MAX];

fn space(text: &str) -> ParameterSpace {
    toml::from_str::<ParametersConfig>(text).unwrap().check().unwrap()
}

/// A space of `dimensions` parameters whose values are the numbers u of the design.
fn unit_cube(dimensions: usize) -> ParameterSpace {
    let line = |i| format!("u{i:03} = {{ uniform = {{ min = 0, max = 1 }} }}\n");
    space(&(0..dimensions).map(line).collect::<String>())
}

fn numbers(parameters: &Parameters) -> Vec<f64> {
    parameters
        .iter()
        .map(|(_, value)| match value {
            Value::Number(number) => *number,
            Value::Label(label) => panic!("the label {label}"),
        })
        .collect()
}

fn name(text: &str) -> ParameterName {
    ParameterName::new(text).unwrap()
}

#[test]
fn designs_are_named_as_in_files() {
    for design in Design::ALL {
        assert_eq!(design.name().parse(), Ok(design));
        assert_eq!(serde_json::to_string(&design).unwrap(), format!("\"{design}\""));
    }
    let error = "halton".parse::<Design>().unwrap_err().to_string();
    assert_eq!(error, "`halton` is not a sampling design: one of `random`, `sobol`, `grid`, `coverage` is needed");
}

/// Kolmogorov's test in each dimension at the significance level 10⁻⁶, with fixed seeds.
#[test]
fn random_numbers_are_uniform() {
    const N: usize = 2_000;
    let critical = (-0.5 * maths::ln(0.5e-6) / N as f64).sqrt();
    let cube = unit_cube(4);
    for seed in SEEDS {
        let samples: Vec<Vec<f64>> =
            (0..N as u64).map(|index| numbers(&cube.sample(Design::Random, seed, index, 0))).collect();
        for dimension in 0..4 {
            let mut column: Vec<f64> = samples.iter().map(|sample| sample[dimension]).collect();
            column.sort_by(f64::total_cmp);
            let deviation = |(rank, u): (usize, &f64)| {
                (u - rank as f64 / N as f64).abs().max((u - (rank + 1) as f64 / N as f64).abs())
            };
            let largest = column.iter().enumerate().map(deviation).fold(0.0, f64::max);
            assert!(largest < critical, "seed {seed}, dimension {dimension}: {largest} ≥ {critical}");
        }
    }
}

#[test]
fn random_parameters_are_uncorrelated() {
    const N: u64 = 4_000;
    let cube = unit_cube(3);
    let samples: Vec<Vec<f64>> = (0..N).map(|index| numbers(&cube.sample(Design::Random, 7, index, N))).collect();
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let covariance: f64 = samples.iter().map(|u| (u[a] - 0.5) * (u[b] - 0.5)).sum::<f64>() / N as f64;
        // The limit is five standard errors of a correlation of 0.
        assert!((covariance * 12.0).abs() < 5.0 / (N as f64).sqrt(), "{a} and {b}: {covariance}");
    }
}

#[test]
fn adding_a_parameter_does_not_change_the_others_in_the_random_design() {
    let small = space("b = { uniform = { min = 0, max = 1 } }\nd = { choice = { x = 1, y = 1 } }");
    let large = space(
        "a = { fixed = 1 }\nb = { uniform = { min = 0, max = 1 } }\nc = { uniform = { min = 0, max = 9 } }\n\
         d = { choice = { x = 1, y = 1 } }",
    );
    for index in 0..50 {
        let (before, after) = (small.sample(Design::Random, 3, index, 50), large.sample(Design::Random, 3, index, 50));
        for kept in ["b", "d"] {
            assert_eq!(before.get(&name(kept)), after.get(&name(kept)));
        }
    }
}

/// In each dimension, every one of 2^m equal intervals holds exactly one of the first 2^m points.
#[test]
fn sobol_is_stratified_in_every_dimension() {
    let cube = unit_cube(20);
    for seed in SEEDS {
        for bits in [1, 4, 8] {
            let n = 1_u64 << bits;
            let samples: Vec<Vec<f64>> =
                (0..n).map(|index| numbers(&cube.sample(Design::Sobol, seed, index, n))).collect();
            for dimension in 0..20 {
                let cells: BTreeSet<u64> = samples.iter().map(|u| (u[dimension] * n as f64) as u64).collect();
                assert_eq!(cells.len() as u64, n, "seed {seed}, {n} points, dimension {dimension}");
            }
        }
    }
}

/// The first two dimensions are a (0, 2)-sequence: each elementary rectangle of area 2^-m holds one
/// of 2^m points.
#[test]
fn sobol_is_stratified_in_the_plane() {
    const BITS: u32 = 6;
    let plane = unit_cube(2);
    let samples: Vec<Vec<f64>> =
        (0..1 << BITS).map(|index| numbers(&plane.sample(Design::Sobol, 5, index, 0))).collect();
    for bits_across in 0..=BITS {
        let (across, along) = (f64::from(1 << bits_across), f64::from(1 << (BITS - bits_across)));
        let cells: BTreeSet<(u64, u64)> =
            samples.iter().map(|u| ((u[0] * across) as u64, (u[1] * along) as u64)).collect();
        assert_eq!(cells.len(), 1 << BITS, "{across} × {along}");
    }
}

#[test]
fn sobol_depends_on_the_seed_and_continues_after_a_block() {
    let cube = unit_cube(3);
    let at = |seed, index| numbers(&cube.sample(Design::Sobol, seed, index, 1));
    assert_ne!(at(0, 0), at(1, 0));
    assert_ne!(at(0, 0), at(0, 1 << 16), "the second block is scrambled differently");
    assert_ne!(at(0, (1 << 16) - 1), at(0, (2 << 16) - 1));
    // With more dimensions than the sequence has, the second group is not a copy of the first.
    let wide = numbers(&unit_cube(300).sample(Design::Sobol, 0, 3, 10));
    assert!(wide.iter().all(|u| (0.0..1.0).contains(u)));
    assert_ne!(wide[0..40], wide[256..296]);
}

#[test]
fn fixing_a_parameter_does_not_change_the_others_in_the_sobol_design() {
    let free = unit_cube(3);
    let pinned = space(
        "u000 = { uniform = { min = 0, max = 1 } }\nu001 = { fixed = 0.5 }\nu002 = { uniform = { min = 0, max = 1 } }",
    );
    for index in 0..20 {
        let (free, pinned) = (free.sample(Design::Sobol, 1, index, 0), pinned.sample(Design::Sobol, 1, index, 0));
        for kept in ["u000", "u002"] {
            assert_eq!(free.get(&name(kept)), pinned.get(&name(kept)));
        }
    }
}

#[test]
fn a_grid_contains_each_combination_once() {
    let space = space(
        "a = { uniform = { min = 0, max = 1 } }\nb = { choice = { car = 8, truck = 1, never = 0 } }\n\
         c = { fixed = 3 }\nd = { uniform = { min = 0, max = 1 } }",
    );
    // 2 labels; 4 × 2 × 1 × 3 = 24, as 4 × 2 × 1 × 4 = 32 is more than 30.
    assert_eq!(space.samples(Design::Grid, 30), 24);
    let points: Vec<String> = (0..24)
        .map(|index| {
            let point = space.sample(Design::Grid, 99, index, 30);
            point.iter().map(|(_, value)| format!("{value:.4}")).collect::<Vec<_>>().join(" ")
        })
        .collect();
    assert_eq!(points.iter().collect::<BTreeSet<_>>().len(), 24);
    assert_eq!(points[0], format!("0.125 car 3 {:.4}", Value::Number(1.0 / 6.0)));
    assert_eq!(points[3], format!("0.125 truck 3 {:.4}", Value::Number(1.0 / 6.0)));
    assert_eq!(
        space.sample(Design::Grid, 0, 24, 30),
        space.sample(Design::Grid, 0, 0, 30),
        "the grid starts again after its last point"
    );
}

#[test]
fn the_smallest_grid_is_the_nominal_point() {
    let space = space("a = { log-normal = { median = 2, sigma = 0.5 } }\nb = { choice = { x = 1, y = 3 } }");
    for n in [0, 1] {
        assert_eq!(space.samples(Design::Grid, n), 1);
        assert_eq!(space.sample(Design::Grid, 0, 0, n), space.nominal());
    }
    let empty = ParameterSpace::default();
    assert_eq!(empty.samples(Design::Grid, u64::MAX), 1);
    assert_eq!(space.samples(Design::Grid, u64::MAX - 1), (u64::MAX - 1) / 2 * 2, "the search is fast for huge grids");
}

proptest! {
    #[test]
    fn random_and_sobol_do_not_depend_on_the_number_of_samples(
        seed: u64, index in 0_u64..1 << 20, n: u64, m: u64, sobol: bool,
    ) {
        let design = if sobol { Design::Sobol } else { Design::Random };
        let cube = unit_cube(5);
        let sample = cube.sample(design, seed, index, n);
        prop_assert_eq!(&sample, &cube.sample(design, seed, index, m));
        for u in numbers(&sample) {
            prop_assert!((0.0..1.0).contains(&u));
            prop_assert!(!sobol || u > 0.0);
        }
    }

    #[test]
    fn a_grid_is_even_and_the_largest_within_n(n in 1_u64..600, numbers in 1_usize..6, labels in 1_usize..5) {
        let choice: Vec<String> = (0..labels).map(|i| format!("l{i} = 1")).collect();
        let uniform = |i| format!("u{i} = {{ uniform = {{ min = 0, max = 1 }} }}\n");
        let text: String = (0..numbers).map(uniform).collect();
        let space = space(&format!("{text}w = {{ choice = {{ {} }} }}", choice.join(", ")));
        let points = space.samples(Design::Grid, n);
        prop_assert!(1 <= points && points <= n);
        let distinct = |name: &ParameterName| {
            let points = (0..points).map(|index| space.sample(Design::Grid, 0, index, n));
            points.filter_map(|point| point.get(name).map(Value::to_string)).collect::<BTreeSet<_>>().len() as u64
        };
        let levels: Vec<u64> = space.iter().map(|(name, _)| distinct(name)).collect();
        prop_assert_eq!(levels.iter().product::<u64>(), points);
        let full = |index: usize| index == numbers && levels[index] == labels as u64;
        let fewest = (0..levels.len()).filter(|&index| !full(index)).map(|index| levels[index]).min().unwrap();
        for (index, &level) in levels.iter().enumerate() {
            let raised = level > fewest;
            prop_assert!(full(index) || raised || points / level * (level + 1) > n, "{levels:?} within {n}");
            prop_assert!(full(index) || level <= fewest + 1, "{levels:?}");
        }
    }
}
