//! The nearest case that passes.

use closecall_scenarios::{Setting, SettingError, StartConfig};
use closecall_traffic::{Num, ParameterName, Parameters, Value};
use rayon::prelude::*;
use serde::Serialize;

use super::trial::Trial;
use super::{grid, words};

/// Largest shift of the start of a rear vehicle that is tried (s), in steps of 0.1 s.
const MOST_SHIFT_TENTHS: i32 = 20;
/// Distances by which a parameter is moved, in widths of its distribution, until the case passes.
const MOVES: [f64; 7] = [0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0];

/// The nearest case that passes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Twin {
    /// The settings that make the passing case of the failing one, each as `key=value`.
    pub settings: Vec<String>,
    /// The difference in words, after "passes when".
    pub words: String,
}

/// A change of one parameter that makes the case pass.
pub(super) struct Candidate {
    pub(super) name: ParameterName,
    pub(super) value: Value,
    /// The size of the change, in widths of the distribution.
    pub(super) distance: f64,
}

/// Returns the nearest case that passes: with one parameter changed, or with the rear vehicle
/// starting earlier or later.
///
/// # Errors
/// [`SettingError`] if a value cannot be written as a setting.
pub(super) fn twin(
    trial: &Trial<'_>,
    values: &Parameters,
    candidates: &[Candidate],
) -> Result<Option<Twin>, SettingError> {
    // A case that fails at nominal values cannot move back to them: every parameter is moved in
    // both directions.
    let moved = if candidates.is_empty() { moved_parameters(trial, values) } else { Vec::new() };
    let all = candidates.iter().chain(&moved);
    let nearest = all.min_by(|a, b| a.distance.total_cmp(&b.distance));
    let by_parameter = nearest.map(|candidate| -> Result<_, SettingError> {
        let mut changed = values.clone();
        changed.insert(candidate.name.clone(), candidate.value.clone());
        let failing = values.get(&candidate.name).cloned().unwrap_or_else(|| candidate.value.clone());
        let twin = Twin {
            settings: Trial::settings(&changed)?.iter().map(ToString::to_string).collect(),
            words: words::change(candidate.name.as_str(), &failing, &candidate.value, trial.step(&candidate.name)),
        };
        Ok((candidate.distance, twin))
    });
    let by_start = shifted_start(trial, values, &Trial::settings(values)?);
    // The largest shift counts like a parameter that moves by the width of its distribution.
    Ok(match (by_parameter.transpose()?, by_start) {
        (Some((distance, twin)), Some((shift, other))) => Some(if distance <= shift { twin } else { other }),
        (by_parameter, by_start) => by_parameter.or(by_start).map(|(_, twin)| twin),
    })
}

/// Returns the smallest shift of the start of a rear vehicle with which the case passes, as a share
/// of the largest one.
fn shifted_start(trial: &Trial<'_>, values: &Parameters, settings: &[Setting]) -> Option<(f64, Twin)> {
    let scenario = trial.case.file.concrete(values).ok()?;
    let ego = &scenario.actors[scenario.ego];
    let (id, gap_m) = trial.case.file.config().actors.iter().find_map(|actor| match &actor.start {
        StartConfig::Behind(start) if start.of == ego.id => match start.gap_m {
            Some(Num::Fixed(gap_m)) => Some((&actor.id, gap_m)),
            _ => None,
        },
        _ => None,
    })?;
    let rear = scenario.actors.iter().find(|actor| actor.id == *id)?;
    let closing_mps = rear.start.speed_mps - ego.start.speed_mps;
    let shifts = (1..=MOST_SHIFT_TENTHS).flat_map(|tenths| [f64::from(tenths), -f64::from(tenths)]);
    shifts.map(|tenths| tenths / 10.0).find_map(|earlier_s| {
        let changed: Setting =
            format!("actor.{id}.start.behind.gap-m={:.2}", gap_m - earlier_s * closing_mps).parse().ok()?;
        let all = [settings, &[changed]].concat();
        let passes = trial.case.concrete(&all).is_ok_and(|scenario| trial.is_passed(&scenario));
        passes.then(|| {
            let when = if earlier_s > 0.0 { "earlier" } else { "later" };
            let twin = Twin {
                settings: all.iter().map(ToString::to_string).collect(),
                words: format!("{id} starts {:.1} s {when}", earlier_s.abs()),
            };
            (10.0 * earlier_s.abs() / f64::from(MOST_SHIFT_TENTHS), twin)
        })
    })
}

/// Returns for each varying parameter the nearest value on either side with which the case passes,
/// if there is one.
fn moved_parameters(trial: &Trial<'_>, values: &Parameters) -> Vec<Candidate> {
    let space = trial.case.file.space();
    let varying: Vec<(ParameterName, f64)> = space
        .varying()
        .filter_map(|(name, _)| Some((name.clone(), trial.span(name)?)))
        .flat_map(|(name, span)| [(name.clone(), span), (name, -span)])
        .collect();
    varying.par_iter().filter_map(|(name, span)| moved(trial, values, name, *span)).collect()
}

/// Returns the value nearest to the parameter's value, in the direction of `span`, with which the
/// case passes.
fn moved(trial: &Trial<'_>, values: &Parameters, name: &ParameterName, span: f64) -> Option<Candidate> {
    let Some(Value::Number(from)) = values.get(name) else { return None };
    let step = grid::step(span.abs());
    let at = |distance: f64| grid::at(grid::beyond(from + distance * span, *from, step), step);
    let passes = |value: f64| {
        let mut changed = values.clone();
        changed.insert(name.clone(), Value::Number(value));
        trial.passes(&changed)
    };
    let first = MOVES.iter().position(|distance| passes(at(*distance)))?;
    let mut low = first.checked_sub(1).map_or(0.0, |before| MOVES[before]);
    let mut high = MOVES[first];
    // To the step of the grid, which is at least a hundredth of the width.
    for _ in 0..6 {
        let middle = 0.5 * (low + high);
        if passes(at(middle)) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(Candidate { name: name.clone(), value: Value::Number(at(high)), distance: high })
}
