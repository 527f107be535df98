//! Minimizes a failing sample.

use closecall_campaign::saved::SavedCampaign;
use closecall_simulation::scenario::{Setting, StartConfig};
use closecall_traffic::{Num, ParameterName, Parameters, Value};
use serde::Serialize;

use super::subset::fewest;
use super::trial::Trial;
use super::{grid, words};
use crate::attribution::{Attribution, attribute};
use crate::case::{Case, CausesError, fails};
use crate::failures::passes;

/// Largest shift of the start of a rear vehicle that is tried for a twin (s), in steps of 0.1 s.
const MOST_SHIFT_TENTHS: i32 = 20;

/// A parameter of the smallest case that is off its nominal value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Offset {
    /// The parameter's name.
    pub name: String,
    /// Its value in the smallest case, as text.
    pub value: String,
    /// Its value in the sample.
    pub sampled: String,
    /// Its nominal value.
    pub nominal: String,
    /// The value in words, in the units of a reader.
    pub words: String,
}

/// The nearest case that passes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Twin {
    /// The settings that make the passing case of the failing one, each as `key=value`.
    pub settings: Vec<String>,
    /// The difference in words, after "passes when".
    pub words: String,
}

/// The smallest failing case near a sample.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Minimized {
    /// The scenario's name.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// The sample's number.
    pub sample: u64,
    /// The controller.
    pub controller: String,
    /// Depth of the sensor simulation.
    pub sensors: String,
    /// The parameters that are off their nominal values.
    pub off_nominal: Vec<Offset>,
    /// Number of the sample's parameters that were off their nominal values.
    pub sampled_off_nominal: usize,
    /// Why there are more than three parameters; `None` if there are not.
    pub why_more_than_three: Option<String>,
    /// The settings that make the case of the scenario, each as `key=value`.
    pub settings: Vec<String>,
    /// The collision of the smallest case.
    pub collision: Attribution,
    /// The case in a sentence.
    pub sentence: String,
    /// The nearest case that passes; `None` if none was found.
    pub twin: Option<Twin>,
}

/// Minimizes a failing case. Returns `None` if no vehicle collides in it.
///
/// # Errors
/// [`CausesError`] if the sample has no outcome.
pub fn minimize(case: &Case) -> Result<Option<Minimized>, CausesError> {
    if !fails(&case.run(&[])?) {
        return Ok(None);
    }
    let trial = Trial::new(case);
    let found = fewest(&trial);
    let (values, candidates) = shrunk(&trial, &found.names);
    let settings = Trial::settings(&values);
    let (_, collision) = attribute(case, &settings)?;
    let Some(collision) = collision else { return Ok(None) };
    let off_nominal: Vec<Offset> = found.names.iter().filter_map(|name| offset(&trial, &values, name)).collect();
    let why_more_than_three = (off_nominal.len() > 3).then(|| {
        let more = if found.is_smallest { "four are needed" } else { "of these, none can be left out" };
        format!("no set of three parameters fails with the others at their nominal values, and {more}")
    });
    let sentence = words::sentence(&collision, &off_nominal);
    Ok(Some(Minimized {
        scenario: case.file.config().name.clone(),
        seed: case.sampling.seed,
        sample: case.sample,
        controller: case.arm.controller.name().to_owned(),
        sensors: case.sensors().name().to_owned(),
        off_nominal,
        sampled_off_nominal: trial.differing.len(),
        why_more_than_three,
        settings: settings.iter().map(ToString::to_string).collect(),
        twin: twin(&trial, &values, &candidates),
        collision,
        sentence,
    }))
}

/// Minimizes a failing sample of a campaign.
///
/// # Errors
/// [`CausesError`] if the sample does not fail, or has no outcome.
pub fn minimize_sample(saved: &SavedCampaign, case: &Case) -> Result<Minimized, CausesError> {
    minimize(case)?.ok_or_else(|| passes(saved, case))
}

fn offset(trial: &Trial<'_>, values: &Parameters, name: &ParameterName) -> Option<Offset> {
    let (value, nominal) = (values.get(name)?, trial.nominal.get(name)?);
    Some(Offset {
        name: name.to_string(),
        value: value.to_string(),
        sampled: trial.sampled.get(name)?.to_string(),
        nominal: nominal.to_string(),
        words: words::value(name.as_str(), value, nominal),
    })
}

/// A change of one parameter that makes the case pass.
struct Candidate {
    name: ParameterName,
    value: Value,
    /// The size of the change, in widths of the distribution.
    distance: f64,
}

/// Moves each named parameter towards its nominal value as far as the case still fails. Returns the values, and for each
/// parameter the next value that passes.
fn shrunk(trial: &Trial<'_>, names: &[ParameterName]) -> (Parameters, Vec<Candidate>) {
    let mut values = trial.with(names);
    for name in names {
        if let Some((failing, _)) = boundary(trial, &values, name) {
            values.insert(name.clone(), failing);
        }
    }
    // The other parameters have moved since: the boundary of each is looked for again.
    let candidates = names.iter().filter_map(|name| {
        let (failing, passing) = boundary(trial, &values, name)?;
        let distance = match (&failing, &passing, trial.span(name)) {
            (Value::Number(failing), Value::Number(passing), Some(span)) => (failing - passing).abs() / span,
            _ => 1.0,
        };
        Some(Candidate { name: name.clone(), value: passing, distance })
    });
    let candidates = candidates.collect();
    (values, candidates)
}

/// Returns the value of a parameter that is nearest to nominal and still fails, and the next one, which passes. `None` if even
/// the nominal value fails.
fn boundary(trial: &Trial<'_>, values: &Parameters, name: &ParameterName) -> Option<(Value, Value)> {
    let at = |value: Value| {
        let mut changed = values.clone();
        changed.insert(name.clone(), value);
        changed
    };
    let (present, nominal) = (values.get(name)?.clone(), trial.nominal.get(name)?.clone());
    if trial.fails(&at(nominal.clone())) {
        return None;
    }
    let (Value::Number(present_value), Value::Number(nominal_value), Some(span)) =
        (&present, &nominal, trial.span(name))
    else {
        return Some((present, nominal));
    };
    let step = grid::step(span);
    let number = |index: i64| Value::Number(grid::at(index, step));
    let mut failing = grid::beyond(*present_value, *nominal_value, step);
    let inner = grid::beyond(*nominal_value, *present_value, step);
    if !trial.fails(&at(number(failing))) {
        // The readable value next to the sample's passes: the sample's own value stays.
        return Some((present, number(failing)));
    }
    let mut passing = inner;
    if trial.fails(&at(number(passing))) {
        return Some((number(passing), nominal));
    }
    while (failing - passing).abs() > 1 {
        let middle = i64::midpoint(failing, passing);
        if trial.fails(&at(number(middle))) {
            failing = middle;
        } else {
            passing = middle;
        }
    }
    Some((number(failing), number(passing)))
}

/// Returns the nearest case that passes: with one parameter changed, or with the rear vehicle starting earlier or later.
fn twin(trial: &Trial<'_>, values: &Parameters, candidates: &[Candidate]) -> Option<Twin> {
    let nearest = candidates.iter().min_by(|one, other| one.distance.total_cmp(&other.distance));
    let by_parameter = nearest.map(|candidate| {
        let mut changed = values.clone();
        changed.insert(candidate.name.clone(), candidate.value.clone());
        let failing = values.get(&candidate.name).cloned().unwrap_or_else(|| candidate.value.clone());
        let twin = Twin {
            settings: Trial::settings(&changed).iter().map(ToString::to_string).collect(),
            words: words::change(candidate.name.as_str(), &failing, &candidate.value),
        };
        (candidate.distance, twin)
    });
    let by_start = shifted_start(trial, values);
    // A shift by the largest one counts like a parameter that moves by the width of its distribution.
    match (by_parameter, by_start) {
        (Some((distance, twin)), Some((shift, other))) => Some(if distance <= shift { twin } else { other }),
        (one, other) => one.or(other).map(|(_, twin)| twin),
    }
}

/// Returns the smallest shift of the start of a rear vehicle with which the case passes, as a share of the largest one.
fn shifted_start(trial: &Trial<'_>, values: &Parameters) -> Option<(f64, Twin)> {
    let settings = Trial::settings(values);
    let scenario = trial.case.concrete(&settings).ok()?;
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
        let all = [settings.clone(), vec![changed]].concat();
        let passes = trial.case.run(&all).is_ok_and(|outcome| !fails(&outcome));
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
