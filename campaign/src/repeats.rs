//! Samples that are no new evidence: they repeat an earlier one.
//!
//! The bounds of probabilities hold for samples that are drawn independently. A sample that repeats
//! the parameters of an earlier one, or its outcome in every arm, shows the same encounter once
//! more. Three hundred such samples are one sample.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};

use closecall_scenarios::outcome::Outcome;
use closecall_scenarios::parameters::{ParameterSpace, SpaceEntry, Variation};
use closecall_traffic::{Measured, Parameters, Value};

use super::record::Record;

/// Smallest spread of a parameter that varies, as a share of its values (-): an assumption; 1e-4 to
/// 1e-2 are plausible. No measurement of traffic tells a thousandth apart.
const LEAST_SPREAD: f64 = 1e-3;
/// Smallest spread of a parameter that varies, in its unit: an assumption; 1e-7 to 1e-5 are
/// plausible. A curvature of 1e-6 1/m is a radius of 1,000 km, and no other unit of a scenario is
/// finer. Around zero, a share of the values is no scale.
const LEAST_AMOUNT: f64 = 1e-6;
/// The quantiles between which the spread of a parameter is taken.
const SPREAD: [f64; 2] = [0.05, 0.95];

/// Returns true if some parameter varies, and by more than [`LEAST_SPREAD`] and [`LEAST_AMOUNT`].
pub(crate) fn is_varied(space: &ParameterSpace) -> bool {
    space.varying().any(|(_, entry)| spreads(entry))
}

fn spreads(entry: &SpaceEntry) -> bool {
    match SPREAD.map(|u| entry.distribution.quantile(u)) {
        [Value::Number(low), Value::Number(high)] => {
            high - low > (LEAST_SPREAD * low.abs().max(high.abs())).max(LEAST_AMOUNT)
        }
        _ => true,
    }
}

/// The feature by which samples repeat each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Same {
    /// By their parameters, which have finitely many values.
    Parameters,
    /// By their outcomes in every arm.
    Outcome,
}

/// The samples so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Repeats {
    /// By what samples repeat each other; `None` if every one counts, because no parameter varies.
    by: Option<Same>,
    /// The keys of the samples.
    seen: HashSet<u64>,
    /// The keys of samples in which some vehicle collided in the arm under test.
    collided: HashSet<u64>,
}

impl Repeats {
    pub(crate) fn of(space: &ParameterSpace) -> Self {
        let by = match space.variation() {
            Variation::None => None,
            Variation::Discrete => Some(Same::Parameters),
            Variation::Continuous => Some(Same::Outcome),
        };
        Self { by, ..Self::default() }
    }

    /// Returns true if a sample counts: it is new, it ended in an error, or it is the first one of
    /// its kind in which vehicles collide. A collision is thus never left out.
    pub(crate) fn counts(&mut self, record: &Record) -> bool {
        let Some(by) = self.by else { return true };
        let outcomes: Option<Vec<&Outcome>> = record.arms.iter().map(|arm| arm.result.as_ref().ok()).collect();
        let Some((outcomes, tested)) = outcomes.and_then(|all| all.last().copied().map(|tested| (all, tested))) else {
            return true;
        };
        let collides = record.tallies().last().is_some_and(|tested| tested.collided == Some(true))
            || !tested.collisions.is_empty();
        let mut hasher = DefaultHasher::new();
        match by {
            Same::Parameters => key(&tested.parameters).hash(&mut hasher),
            Same::Outcome => outcomes.iter().for_each(|outcome| hash(outcome, &mut hasher)),
        }
        let key = hasher.finish();
        let is_new = self.seen.insert(key);
        let is_first_collision = collides && self.collided.insert(key);
        is_new || is_first_collision
    }
}

fn key(parameters: &Parameters) -> String {
    parameters.iter().map(|(name, value)| format!("{name}={value:?};")).collect()
}

/// Adds what happened in a run, and not why: neither its parameters nor its number.
fn hash(outcome: &Outcome, hasher: &mut DefaultHasher) {
    let measured = |value: Measured| value.map(rounded).map_err(|absent| absent.to_string());
    outcome.duration.hash(hasher);
    for collision in outcome.collisions.iter().chain(&outcome.touches) {
        (&collision.between[0], &collision.between[1]).hash(hasher);
        [collision.time.s(), collision.relative_speed_mps, collision.delta_v_mps[0]].map(rounded).hash(hasher);
    }
    for reached in &outcome.moments {
        (reached.moment, reached.time).hash(hasher);
    }
    let margins = &outcome.margins;
    for value in [
        margins.min_thw_front_s,
        margins.min_thw_rear_s,
        margins.min_gap_front_m,
        margins.min_gap_rear_m,
        margins.min_ttc_rear_s,
    ] {
        measured(value).hash(hasher);
    }
    [margins.max_deceleration_mps2, margins.max_jerk_mps3, margins.max_speed_deficit_mps].map(rounded).hash(hasher);
}

/// Returns a value in billionths of its unit. The same encounter 100 m further along the road
/// differs by 1e-11 at most, from rounding alone. A coarser comparison would leave out samples of a
/// scenario in which one parameter varies, and shift its shares.
fn rounded(value: f64) -> u64 {
    ((value * 1e9).round() + 0.0).to_bits()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_scenarios::{ScenarioFile, library};

    /// Returns whether the parameters of a scenario vary enough if the only one that is sampled
    /// lies between these bounds.
    fn is_varied_between(min: f64, max: f64) -> bool {
        let text = library::text("paper-figure").unwrap();
        let sampled = format!("[parameters]\nfilm = {{ uniform = {{ min = {min:?}, max = {max:?} }} }}\n\n[[actor]]");
        let text = text.replacen("[[actor]]", &sampled, 1);
        super::is_varied(ScenarioFile::parse(Path::new("a.toml"), &text, &[]).unwrap().space())
    }

    #[test]
    fn a_parameter_that_varies_by_less_than_a_thousandth_does_not_vary() {
        assert!(!is_varied_between(30.0, 30.000_001));
        assert!(!is_varied_between(30.0, 30.02));
        assert!(is_varied_between(30.0, 30.2));
        assert!(!is_varied_between(0.0, 1e-6), "around zero a share is no scale");
        assert!(!is_varied_between(-1e-7, 1e-7));
        assert!(is_varied_between(0.0, 1e-4), "a curvature in 1/m");
    }
}
