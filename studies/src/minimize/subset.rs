//! The fewest parameters that must be off their nominal values for a case to fail.

use closecall_sensors::SensorMode;
use closecall_simulation::Arm;
use closecall_traffic::ParameterName;
use rayon::prelude::*;

use super::trial::Trial;
use crate::case::Case;

/// Largest number of parameters for which every subset is tried.
const TRIED: usize = 3;

/// The parameters that a failing case needs.
pub(super) struct Found {
    pub(super) names: Vec<ParameterName>,
    /// Whether every smaller set was tried.
    pub(super) is_smallest: bool,
}

/// Returns the fewest parameters with which the case fails, the others being at their nominal
/// values. Of several sets of the same size, the one that is nearest to nominal is returned.
pub(super) fn fewest(trial: &Trial<'_>) -> Found {
    for size in 0..=TRIED.min(trial.differing.len()) {
        if let Some(names) = failing_set(trial, size) {
            return Found { names, is_smallest: true };
        }
    }
    let names = delta_debugged(trial);
    let is_smallest = names.len() == TRIED + 1;
    Found { names, is_smallest }
}

/// Returns the failing set of `size` parameters that is nearest to nominal; `None` if no such set
/// fails.
fn failing_set(trial: &Trial<'_>, size: usize) -> Option<Vec<ParameterName>> {
    let mut sets = sets(&trial.differing, size);
    sets.sort_by(|a, b| distance(trial, a).total_cmp(&distance(trial, b)));
    let fails = |set: &&Vec<ParameterName>| trial.fails(&trial.with(set));
    if trial.case.sensors() != SensorMode::Full {
        return sets.par_iter().find_first(fails).cloned();
    }
    // Full sensors are slow. A set that fails with object-level sensors is likely to fail with full
    // sensors, and is tried first.
    let quick = Case { arm: Arm { sensors: Some(SensorMode::Object), ..trial.case.arm.clone() }, ..trial.case.clone() };
    let quick = Trial::new(&quick);
    let likely: Vec<bool> = sets.par_iter().map(|set| quick.fails(&quick.with(set))).collect();
    let ranked = |is_likely: bool| sets.iter().zip(&likely).filter(move |(_, likely)| **likely == is_likely);
    let ranked: Vec<&Vec<ParameterName>> = ranked(true).chain(ranked(false)).map(|(set, _)| set).collect();
    ranked.par_iter().find_first(|set| fails(set)).map(|set| (*set).clone())
}

/// Returns all sets of `size` names.
fn sets(names: &[ParameterName], size: usize) -> Vec<Vec<ParameterName>> {
    if size == 0 {
        return vec![Vec::new()];
    }
    let mut subsets = Vec::new();
    for (index, name) in names.iter().enumerate() {
        for rest in sets(&names[index + 1..], size - 1) {
            subsets.push([vec![name.clone()], rest].concat());
        }
    }
    subsets
}

/// Returns how far the parameters of the sample are from nominal, in widths of their distributions.
/// A label is one width away.
fn distance(trial: &Trial<'_>, names: &[ParameterName]) -> f64 {
    names.iter().map(|name| offset_in_spans(trial, name)).sum()
}

/// Returns how far a parameter of the sample is from nominal, in widths of its distribution.
fn offset_in_spans(trial: &Trial<'_>, name: &ParameterName) -> f64 {
    use closecall_traffic::Value::Number;
    match (trial.sampled.get(name), trial.nominal.get(name), trial.span(name)) {
        (Some(Number(sampled)), Some(Number(nominal)), Some(span)) => (sampled - nominal).abs() / span,
        _ => 1.0,
    }
}

/// Removes parameters from the sample until no single one can be removed: delta debugging for a
/// minimal failing set.
fn delta_debugged(trial: &Trial<'_>) -> Vec<ParameterName> {
    let mut names = trial.differing.clone();
    let mut parts = 2;
    while names.len() >= 2 {
        let length = names.len().div_ceil(parts);
        let chunks: Vec<Vec<ParameterName>> = names.chunks(length).map(<[_]>::to_vec).collect();
        let complement = |index: usize| {
            let rest = chunks.iter().enumerate().filter(|(other, _)| *other != index);
            rest.flat_map(|(_, chunk)| chunk.clone()).collect::<Vec<_>>()
        };
        let smaller = (0..chunks.len()).map(complement).find(|rest| trial.fails(&trial.with(rest)));
        match smaller {
            Some(rest) => {
                names = rest;
                parts = (parts - 1).max(2);
            }
            None if length == 1 => break,
            None => parts = (2 * parts).min(names.len()),
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_of_a_size_is_listed_once() {
        let names: Vec<ParameterName> = ["a", "b", "c", "d"].map(|name| ParameterName::new(name).unwrap()).to_vec();
        assert_eq!([0, 1, 2, 3, 4].map(|size| sets(&names, size).len()), [1, 4, 6, 4, 1]);
    }
}
