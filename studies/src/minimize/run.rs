//! Minimizes a failing sample.

use closecall_campaign::action::{Action, CommandFor};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::saved::SavedCampaign;
use closecall_simulation::controller::ControllerChoice;
use closecall_traffic::{ParameterName, Parameters, Value};
use serde::Serialize;

use super::nearest::NearestFailure;
use super::subset::fewest;
use super::trial::{Trial, WithoutOutcome};
use super::twin::{Candidate, Twin, twin};
use super::{grid, words};
use crate::attribution::{Attribution, attribute};
use crate::case::{Case, CausesError, check_repeats, fails};
use crate::failures::passes;

/// Number of steps of the grid beyond a failing value within which a passing one is sought.
const MOST_STEPS_TO_TWIN: i64 = 20;

/// A parameter of the smallest case that is off its nominal value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Offset {
    /// The parameter's name.
    pub name: String,
    /// The value in the smallest case, as text.
    pub value: String,
    /// The value in the sample.
    pub sampled: String,
    /// The nominal value.
    pub nominal: String,
    /// The value in words, with its unit.
    pub words: String,
    /// How far the value is from the nominal one, with sign (standard deviations); `None` of a
    /// value that the distribution never takes.
    pub distance_sd: Option<f64>,
    /// How far the value is from the nominal one, with sign, in the parameter's unit; `None` of a
    /// label.
    pub difference: Option<f64>,
    /// The difference in words, with its unit.
    #[serde(skip)]
    pub difference_words: Option<String>,
}

/// The smallest failing case near a sample, or the failing case nearest to the nominal one.
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
    /// The controller as the option `--controller` takes it.
    pub choice: String,
    /// The controller with which the case does not fail, if it was sought so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Depth of the sensor simulation.
    pub sensors: String,
    /// The parameters that are off their nominal values.
    pub off_nominal: Vec<Offset>,
    /// Distance of the smallest case to the nominal case in standard normal space (standard
    /// deviations); `None` if a parameter has a value that its distribution never takes.
    pub distance_sd: Option<f64>,
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
    /// The search for the case, if it is the one nearest to the nominal case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest: Option<NearestFailure>,
    /// Runs of the search that had no outcome: a smaller or nearer case may be among them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub without_outcome: Option<WithoutOutcome>,
}

impl Minimized {
    /// Returns whether a command drives with this controller if it names none.
    pub(super) fn is_default(&self) -> bool {
        self.choice == ControllerChoice::MIS.name()
    }

    /// Returns the command that runs a file of this case.
    pub(super) fn run_command(&self, file: &str, command_for: CommandFor) -> String {
        command_for(&Action::Run { file, controller: (!self.is_default()).then_some(&self.choice) })
    }
}

/// Minimizes a failing case. Returns `None` if no vehicle collides in it. If the case has a
/// reference, no vehicle collides with it in the smallest case either.
///
/// # Errors
/// [`CausesError`] if the sample has no outcome.
pub fn minimize(case: &Case) -> Result<Option<Minimized>, CausesError> {
    if !fails(&case.run(&[])?) {
        return Ok(None);
    }
    let trial = Trial::new(case);
    let subset = fewest(&trial);
    let (values, candidates) = shrunk(&trial, &subset.names);
    let minimized = described(&trial, &values, &subset.names, &candidates)?;
    let why_more_than_three = (minimized.off_nominal.len() > 3).then(|| {
        let more = if subset.is_smallest { "four are needed" } else { "of these, none can be left out" };
        format!("no set of three parameters fails with the others at their nominal values, and {more}")
    });
    Ok(Some(Minimized { why_more_than_three, ..minimized }))
}

/// Describes a case that fails with these values. The named ones are off nominal.
pub(super) fn described(
    trial: &Trial<'_>,
    values: &Parameters,
    names: &[ParameterName],
    candidates: &[Candidate],
) -> Result<Minimized, CausesError> {
    let case = trial.case;
    let settings = Trial::settings(values)?;
    let (_, collision) = attribute(case, &settings)?;
    let controller = case.arm.controller.name();
    let not_reduced = || CausesError::NotReduced { sample: case.sample, controller: controller.to_owned() };
    let collision = collision.ok_or_else(not_reduced)?;
    let off_nominal: Vec<Offset> = names.iter().filter_map(|name| offset(trial, values, name)).collect();
    let sentence = words::sentence(&collision, &off_nominal);
    Ok(Minimized {
        scenario: case.file.config().name.clone(),
        seed: case.sampling.seed,
        sample: case.sample,
        controller: controller.to_owned(),
        choice: controller.to_owned(),
        reference: case.reference.as_ref().map(|arm| arm.controller.name().to_owned()),
        sensors: case.sensors().name().to_owned(),
        off_nominal,
        distance_sd: case.file.space().distance_sd(values),
        sampled_off_nominal: trial.differing.len(),
        why_more_than_three: None,
        settings: settings.iter().map(ToString::to_string).collect(),
        twin: twin(trial, values, candidates)?,
        collision,
        sentence,
        nearest: None,
        // The twin is the last one that is searched.
        without_outcome: trial.without_outcome(),
    })
}

/// Minimizes a failing sample of a campaign.
///
/// # Errors
/// [`CausesError`] if the sample does not fail, or has no outcome.
pub fn minimize_sample(saved: &SavedCampaign, case: &Case) -> Result<Minimized, CausesError> {
    let minimized = minimize(case)?.ok_or_else(|| passes(saved, case))?;
    check_repeats(saved, std::slice::from_ref(case))?;
    Ok(with_choice(saved.manifest(), minimized))
}

/// Names the controller of a case as the option `--controller` takes it.
pub fn with_choice(manifest: &Manifest, minimized: Minimized) -> Minimized {
    // A process has a name in reports, and a command on the command line.
    let mut arms = manifest.arms.iter().zip(manifest.arm_names());
    let choice = arms.find(|(_, name)| *name == minimized.controller).map(|(arm, _)| arm.to_string());
    Minimized { choice: choice.unwrap_or_else(|| minimized.controller.clone()), ..minimized }
}

fn offset(trial: &Trial<'_>, values: &Parameters, name: &ParameterName) -> Option<Offset> {
    let (value, nominal) = (values.get(name)?, trial.nominal.get(name)?);
    Some(Offset {
        name: name.to_string(),
        value: value.to_string(),
        sampled: trial.sampled.get(name)?.to_string(),
        nominal: nominal.to_string(),
        words: words::value(name.as_str(), value, nominal, trial.step(name)),
        distance_sd: trial.case.file.space().get(name)?.distribution.distance_sd(value),
        difference: match (value, nominal) {
            (Value::Number(value), Value::Number(nominal)) => Some(value - nominal),
            _ => None,
        },
        difference_words: words::difference(name.as_str(), value, nominal, trial.step(name)),
    })
}

/// Moves each named parameter towards its nominal value, until the case would pass. Returns the
/// values, and for each parameter the next value that passes.
fn shrunk(trial: &Trial<'_>, names: &[ParameterName]) -> (Parameters, Vec<Candidate>) {
    let mut values = trial.with(names);
    for name in names {
        if let Some((failing, _)) = boundary(trial, &values, name) {
            values.insert(name.clone(), failing);
        }
    }
    // The other parameters have moved since then: the boundary of each is sought again.
    let candidates = names.iter().filter_map(|name| {
        let (failing, next) = boundary(trial, &values, name)?;
        let passing = first_passing(trial, &values, name, &failing, next)?;
        let distance = match (&failing, &passing, trial.span(name)) {
            (Value::Number(failing), Value::Number(passing), Some(span)) => (failing - passing).abs() / span,
            _ => 1.0,
        };
        Some(Candidate { name: name.clone(), value: passing, distance })
    });
    let candidates = candidates.collect();
    (values, candidates)
}

/// Returns the first value of a parameter from `next` on, away from the failing one, with which the
/// case passes. A value that does not fail may fail at half the time step only, or make no valid
/// scenario.
fn first_passing(
    trial: &Trial<'_>,
    values: &Parameters,
    name: &ParameterName,
    failing: &Value,
    next: Value,
) -> Option<Value> {
    let steps = match (failing, &next, trial.span(name)) {
        (Value::Number(failing), Value::Number(next), Some(span)) => {
            let step = grid::step(span);
            let first = grid::beyond(*next, *failing, step);
            let sign = if next > failing { 1 } else { -1 };
            (0..MOST_STEPS_TO_TWIN).map(|count| Value::Number(grid::at(first + sign * count, step))).collect()
        }
        _ => Vec::new(),
    };
    std::iter::once(next).chain(steps).find(|value| {
        let mut changed = values.clone();
        changed.insert(name.clone(), value.clone());
        trial.passes(&changed)
    })
}

/// Returns the value of a parameter that is nearest to nominal and still fails, and the next one,
/// which passes. `None` if even the nominal value fails.
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
