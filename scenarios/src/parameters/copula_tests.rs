//! Correlated parameters: their distributions stay, their ranks correlate, and wrong correlations
//! are refused.

use closecall_traffic::statistics::normal::TruncatedStandardNormal;
use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{ParameterName, Value};

use super::{NormalPoint, ParameterSpace, ParametersConfig, SpaceEntry};
use crate::sampling::{Design, unit_point};
use closecall_recorded::criticality::spearman;

const INDEPENDENT: &str = "
    a = { uniform = { min = 0.0, max = 1.0 } }
    b = { empirical = { quantiles = [1.0, 2.0, 8.0, 20.0] } }
    c = { log-normal = { median = 2.0, sigma = 0.5 } }
    d = { choice = { x = 1, y = 1 } }
    e = { fixed = 3.0 }";

fn parsed(text: &str) -> Result<ParameterSpace, String> {
    let config: ParametersConfig = toml::from_str(text).map_err(|error| error.to_string())?;
    config.check().map_err(|error| error.to_string())
}

/// Adds rank correlations to `b`.
fn coupled(correlations: &str) -> Result<ParameterSpace, String> {
    parsed(&INDEPENDENT.replace("20.0] } }", &format!("20.0] }}, spearman = {{ {correlations} }} }}")))
}

fn column(space: &ParameterSpace, design: Design, name: &str) -> Vec<f64> {
    let name = ParameterName::new(name).unwrap();
    let values = (0..4_000).map(|index| match space.sample(design, 7, index, 4_000).get(&name) {
        Some(Value::Number(value)) => *value,
        other => panic!("{other:?}"),
    });
    values.collect()
}

#[test]
fn ranks_correlate_as_stated_and_each_distribution_stays() {
    let (space, free) = (coupled("a = 0.6, c = -0.4").unwrap(), parsed(INDEPENDENT).unwrap());
    for design in [Design::Random, Design::Sobol] {
        let [a, b, c] = ["a", "b", "c"].map(|name| column(&space, design, name));
        for (correlation, wanted) in [(spearman(&a, &b), 0.6), (spearman(&b, &c), -0.4), (spearman(&a, &c), 0.0)] {
            assert!((correlation.unwrap() - wanted).abs() < 0.04, "{design}: {correlation:?} instead of {wanted}");
        }
        let (median_c, median_free) = (median(c), median(column(&free, design, "c")));
        assert!((median_c / median_free - 1.0).abs() < 0.1, "{design}: {median_c} {median_free}");
    }
}

#[test]
fn parameters_that_state_no_correlation_keep_their_bits() {
    let (space, free) = (coupled("c = 0.9").unwrap(), parsed(INDEPENDENT).unwrap());
    for design in [Design::Random, Design::Sobol, Design::Grid] {
        for index in 0..50 {
            let (correlated, independent) = (space.sample(design, 3, index, 50), free.sample(design, 3, index, 50));
            for name in ["a", "b", "d", "e"].map(|name| ParameterName::new(name).unwrap()) {
                assert_eq!(
                    correlated.get(&name),
                    independent.get(&name),
                    "{design}: the first of the coupled ones keeps its number"
                );
            }
            assert_eq!(
                correlated == independent,
                design == Design::Grid || correlated.get(&ParameterName::new("c").unwrap()).is_none()
            );
        }
    }
}

#[test]
fn wrong_correlations_are_refused_with_what_is_allowed() {
    for (correlations, words) in [
        ("a = 1.0", "from -0.99 to 0.99"),
        ("a = nan", "finite"),
        ("z = 0.5", "a, b, c, d, e"),
        ("b = 0.5", "with itself"),
        ("d = 0.5", "`d` does not"),
        ("e = 0.5", "`e` does not"),
    ] {
        let message = coupled(correlations).unwrap_err();
        assert!(message.contains(words), "{correlations}: {message}");
    }
    let impossible = "
        a = { uniform = { min = 0.0, max = 1.0 }, spearman = { b = 0.9, c = 0.9 } }
        b = { uniform = { min = 0.0, max = 1.0 }, spearman = { c = -0.9 } }
        c = { uniform = { min = 0.0, max = 1.0 } }";
    assert!(parsed(impossible).unwrap_err().contains("no joint distribution"));
    let twice = impossible.replace("c = -0.9", "c = 0.7, a = 0.8");
    assert!(parsed(&twice).unwrap_err().contains("different rank correlations"));
}

#[test]
fn independent_standard_normal_numbers_give_the_distribution_of_independent_samples() {
    let (space, free) = (coupled("a = 0.6, c = -0.4").unwrap(), parsed(INDEPENDENT).unwrap());
    let normal = TruncatedStandardNormal::new(f64::NEG_INFINITY, f64::INFINITY).unwrap();
    for index in 0..200 {
        // The numbers u of the uniform parameter and of the others, by name: e does not vary.
        let numbers = unit_point(index, 5);
        let normals: Vec<f64> = numbers[..4].iter().map(|u| normal.quantile(*u)).collect();
        for space in [&space, &free] {
            let (ours, expected) = (space.at_normals(&normals), space.values(numbers.clone()));
            for name in ["a", "b", "c", "d", "e"].map(|name| ParameterName::new(name).unwrap()) {
                match (ours.get(&name).unwrap(), expected.get(&name).unwrap()) {
                    (Value::Number(first), Value::Number(second)) => assert!((first - second).abs() < 1e-6, "{name}"),
                    (first, second) => assert_eq!(first, second, "{name}"),
                }
            }
        }
    }
}

#[test]
fn the_distance_to_the_nominal_values_is_the_length_of_the_point_in_normal_space() {
    let spaces = [coupled("a = 0.6, c = -0.4").unwrap(), parsed(INDEPENDENT).unwrap()];
    for space in &spaces {
        assert!(space.distance_sd(&space.nominal()).unwrap() < 1e-9);
        let numbers: Vec<&SpaceEntry> = space.varying().map(|(_, entry)| entry).collect();
        // A label has no place of its own in normal space: it stays at its nominal value.
        let is_number = |entry: &SpaceEntry| entry.distribution.labels().is_empty();
        for point in [[0.5, -1.0, 2.0, 0.25], [-2.5, 0.0, 0.1, 3.0]] {
            let normals: Vec<f64> =
                numbers.iter().zip(point).map(|(entry, z)| if is_number(entry) { z } else { 0.0 }).collect();
            let mut values = space.at_normals(&normals);
            for (name, entry) in space.varying().filter(|(_, entry)| !is_number(entry)) {
                values.insert(name.clone(), entry.distribution.nominal());
            }
            let (ours, expected) = (space.distance_sd(&values).unwrap(), normals.iter().map(|z| z * z).sum::<f64>());
            assert!((ours - expected.sqrt()).abs() < 1e-4, "{ours} instead of {}", expected.sqrt());
        }
    }
}

#[test]
fn a_sample_has_a_point_in_normal_space_that_gives_it_back() {
    let label = ParameterName::new("d").unwrap();
    for space in [coupled("a = 0.6, c = -0.4").unwrap(), parsed(INDEPENDENT).unwrap()] {
        let origin = space.normal_point(&space.nominal()).unwrap();
        assert!(space.length_sd(&origin) < 1e-9 && origin.normals.len() == 3 && origin.labels.len() == 1);
        let zero = NormalPoint { normals: vec![0.0; 3], ..NormalPoint::default() };
        // To the bit: a parameter that is not moved is not listed as moved.
        assert_eq!(space.at_normal_point(&zero), space.nominal());
        for index in 0..50 {
            let sample = space.sample(Design::Random, 7, index, 50);
            let point = space.normal_point(&sample).unwrap();
            assert!((space.length_sd(&point) - space.distance_sd(&sample).unwrap()).abs() < 1e-9);
            let again = space.at_normal_point(&point);
            assert_eq!(again.get(&label), sample.get(&label));
            for (name, value) in sample.iter() {
                if let (Value::Number(value), Some(Value::Number(again))) = (value, again.get(name)) {
                    assert!((value - again).abs() < 1e-6, "{name}: {again} instead of {value}");
                }
            }
        }
        // A label that is as probable as the nominal one is no further away.
        let mut other = origin.clone();
        other.labels.insert(label.clone(), "y".to_owned());
        assert!(space.at_normal_point(&other) != space.nominal() && space.length_sd(&other) < 1e-9);
    }
}

#[test]
fn a_value_outside_a_distribution_has_no_distance() {
    let space = parsed(INDEPENDENT).unwrap();
    let mut values = space.nominal();
    let (name, entry) = space.varying().find(|(_, entry)| entry.distribution.bounds().is_some()).unwrap();
    let [low, high] = entry.distribution.bounds().unwrap();
    values.insert(name.clone(), Value::Number(high + (high - low)));
    assert_eq!(space.distance_sd(&values), None);
}

#[test]
fn no_point_of_normal_space_leaves_the_bounds() {
    let space = coupled("a = 0.6, c = -0.4").unwrap();
    for z in [-1e300, -40.0, -9.0, 9.0, 40.0, 1e300] {
        let values = space.at_normals(&[z, -z, z, z]);
        for (name, entry) in space.iter() {
            let Some([low, high]) = entry.distribution.bounds() else { continue };
            let Some(Value::Number(value)) = values.get(name) else { panic!("{name}") };
            // An unbounded distribution is cut at a probability of 1e-16 for its bounds.
            let is_inside = (low..=high).contains(value) || name.as_str() == "c" && *value > 0.0 && value.is_finite();
            assert!(is_inside, "{name} at {z}: {value}");
        }
    }
}
