//! Which criteria a campaign is judged by, and where each of them comes from.
//!
//! ```text
//!  command line ─┐ replaces, for the same left-hand side,
//!  preset        ├─▶ GateSet ─▶ one gate per criterion and scenario
//!  closecall.toml│ replaces
//!  scenario file ┘                      requirement checks of the scenario file: always
//! ```
//!
//! If a gate demands less than the gate of a file that it replaces, the verdict is at best
//! OVERRIDDEN. A preset replaces no gate that demands more.

use std::fmt;
use std::path::PathBuf;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::criteria::{Expression, GateConfig};

use crate::probability::ProbabilityGate;

/// The origin of a gate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GateSource {
    /// The command line.
    CommandLine,
    /// A preset of the command line.
    Preset(&'static str),
    /// A project file, `closecall.toml`.
    ProjectFile(PathBuf),
    /// The table `[gate]` of the scenario file.
    Scenario,
    /// The check of a requirement in the scenario file.
    Requirement(String),
}

impl fmt::Display for GateSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CommandLine => f.write_str("command line"),
            Self::Preset(name) => write!(f, "preset {name}"),
            Self::ProjectFile(path) => write!(f, "{}", path.display()),
            Self::Scenario => f.write_str("scenario file"),
            Self::Requirement(mark) => write!(f, "requirement {mark}"),
        }
    }
}

/// One criterion with its origin. It is judged on the samples of each scenario, one scenario at a
/// time.
#[derive(Clone, Debug, PartialEq)]
pub struct GateSpec {
    /// The criterion.
    pub expression: Expression,
    /// The origin of the criterion.
    pub source: GateSource,
}

impl GateSpec {
    /// Returns true if the gate bounds the same value as `expression` on the same side, and demands
    /// less.
    fn is_weaker_than(&self, expression: &Expression) -> bool {
        self.expression.bounds_as(expression) && !self.expression.is_as_strict_as(expression)
    }

    const fn is_of_preset(&self) -> bool {
        matches!(self.source, GateSource::Preset(_))
    }
}

/// A gate on the probability of a collision, with its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbabilitySpec {
    /// The gate.
    pub gate: ProbabilityGate,
    /// The origin of the gate.
    pub source: GateSource,
}

/// The gates that hold for every scenario of a campaign. The gates of the scenario files come on
/// top.
#[derive(Clone, Debug, PartialEq)]
pub struct GateSet {
    /// The criteria. The first ones win.
    pub specs: Vec<GateSpec>,
    /// The gate on the probability of a collision.
    pub probability: Option<ProbabilitySpec>,
    /// True if nothing is to be judged: the campaign is a measurement.
    pub is_measurement: bool,
    /// Share of the checked verdicts that may flip at half the time step.
    pub max_flip_rate: f64,
    /// Most flaky samples; any number if `None`.
    pub max_flaky: Option<u64>,
    /// Remarks on the origin of the gates, for the reader.
    pub notes: Vec<String>,
    /// What the project file demands more than the gates that replace its gates, in words.
    pub weakened: Vec<String>,
}

impl Default for GateSet {
    fn default() -> Self {
        Self {
            specs: Vec::new(),
            probability: None,
            is_measurement: false,
            max_flip_rate: MAX_FLIP_RATE,
            max_flaky: None,
            notes: Vec::new(),
            weakened: Vec::new(),
        }
    }
}

impl GateSet {
    /// Returns a set of criteria from the command line, each judged on every scenario.
    pub fn of(expressions: impl IntoIterator<Item = Expression>) -> Self {
        let mut set = Self::default();
        for expression in expressions {
            set.push(GateSpec { expression, source: GateSource::CommandLine });
        }
        set
    }

    /// Adds a criterion, unless the set has one with the same left-hand side: the first one wins.
    pub fn push(&mut self, spec: GateSpec) {
        if self.specs.iter().all(|gate| !gate.expression.bounds_as(&spec.expression)) {
            self.specs.push(spec);
        }
    }

    /// Returns the gate of the set that replaces a gate of a file and demands less, in words.
    pub(super) fn weaker_than(&self, expression: &Expression) -> Option<String> {
        let is_weaker = |gate: &&GateSpec| gate.is_weaker_than(expression) && !gate.is_of_preset();
        let weaker = self.specs.iter().find(is_weaker)?;
        Some(format!("gate {expression}, replaced by {} ({})", weaker.expression, weaker.source))
    }

    /// Removes the gate of a preset that bounds the same value on the same side, and demands less.
    pub(super) fn drop_weaker_preset(&mut self, expression: &Expression) {
        self.specs.retain(|gate| !(gate.is_of_preset() && gate.is_weaker_than(expression)));
    }

    /// Returns the gate on the probability of a collision that replaces a gate of a file and
    /// demands less, in words.
    pub(super) fn weaker_than_probability(&self, gate: &ProbabilityGate) -> Option<String> {
        let spec = self.probability.as_ref()?;
        let is_kept = spec.gate.max() <= gate.max() && spec.gate.confidence() >= gate.confidence();
        let words = |of: &ProbabilityGate| {
            if spec.gate.confidence() < gate.confidence() {
                format!("{} with confidence {}", of.max(), of.confidence())
            } else {
                of.max().to_string()
            }
        };
        (!is_kept).then(|| {
            format!("gate max-probability {}, replaced by {} ({})", words(gate), words(&spec.gate), spec.source)
        })
    }

    /// Returns what the gates of the set demand less than the gates that they replace: the gates of
    /// the project file and of a scenario file. A measurement demands nothing.
    pub fn weakened_in(&self, file: &ScenarioFile) -> Vec<String> {
        if self.is_measurement {
            return Vec::new();
        }
        let gate = &file.config().gate;
        let probability = probability_gate(gate).and_then(|gate| self.weaker_than_probability(&gate));
        let of_file = gate.require.iter().filter_map(|expression| self.weaker_than(expression));
        self.weakened.iter().cloned().chain(of_file).chain(probability).collect()
    }

    /// Returns the gates of one scenario: the gates of the campaign, the gates of its file that
    /// these do not replace, and the checks of its requirements.
    pub fn of_scenario(&self, file: &ScenarioFile) -> Vec<GateSpec> {
        let mut set = Self { specs: self.specs.clone(), ..Self::default() };
        for &expression in &file.config().gate.require {
            set.drop_weaker_preset(&expression);
            set.push(GateSpec { expression, source: GateSource::Scenario });
        }
        let mut specs = if self.is_measurement { Vec::new() } else { set.specs };
        for (mark, expressions) in &file.config().checks {
            for &expression in expressions {
                let source = GateSource::Requirement(mark.clone());
                specs.push(GateSpec { expression, source });
            }
        }
        specs
    }

    /// Returns the gate on the probability of a collision of one scenario.
    pub fn probability_of(&self, file: &ScenarioFile) -> Option<ProbabilitySpec> {
        if self.is_measurement {
            return None;
        }
        let of_file = || {
            let gate = probability_gate(&file.config().gate)?;
            Some(ProbabilitySpec { gate, source: GateSource::Scenario })
        };
        self.probability.clone().or_else(of_file)
    }
}

/// Returns the gate on the probability of a collision of a file; `None` if it has none.
fn probability_gate(gate: &GateConfig) -> Option<ProbabilityGate> {
    ProbabilityGate::new(gate.max_probability?, gate.confidence.unwrap_or(ProbabilityGate::CONFIDENCE)).ok()
}

/// Default of the share of checked verdicts that may flip at half the time step (-).
pub const MAX_FLIP_RATE: f64 = 0.05;

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_scenarios::library;

    use super::*;

    /// Returns a scenario with gates of its own.
    fn gated() -> ScenarioFile {
        let gate = "[gate]\nrequire = ['count(ego_collided) <= 0', 'upper(induced) <= 0.005']\nmax-probability = 0.01\n\n[parameters]";
        let text = library::text("low-thw-overtake").unwrap().replacen("[parameters]", gate, 1);
        ScenarioFile::parse(Path::new("a.toml"), &text, &[]).unwrap()
    }

    #[test]
    fn a_gate_that_demands_less_than_the_gate_of_the_file_is_named() {
        let weakened = |gate: &str| GateSet::of([gate.parse().unwrap()]).weakened_in(&gated());
        assert_eq!(
            weakened("count(ego_collided) <= 39"),
            ["gate count(ego_collided) <= 0, replaced by count(ego_collided) <= 39 (command line)"]
        );
        for gate in ["count(ego_collided) <= 0", "upper(induced) <= 0.001", "count(ego_collided | engaged) <= 39"] {
            assert_eq!(weakened(gate), Vec::<String>::new(), "{gate}");
        }
        let bounded = |max: f64, confidence: f64| {
            let gate = ProbabilityGate::new(max, confidence).unwrap();
            let probability = Some(ProbabilitySpec { gate, source: GateSource::CommandLine });
            GateSet { probability, ..GateSet::default() }.weakened_in(&gated())
        };
        assert_eq!(bounded(0.5, 0.95), ["gate max-probability 0.01, replaced by 0.5 (command line)"]);
        assert_eq!(
            bounded(0.01, 0.6),
            ["gate max-probability 0.01 with confidence 0.95, replaced by 0.01 with confidence 0.6 (command line)"],
            "less confidence is less"
        );
        assert!(bounded(0.001, 0.99).is_empty());
        let gates = GateSet::of(["count(ego_collided) <= 39".parse().unwrap()]);
        let measurement = GateSet { is_measurement: true, ..gates };
        assert!(measurement.weakened_in(&gated()).is_empty(), "a measurement judges nothing");
    }

    #[test]
    fn a_preset_replaces_no_gate_that_demands_more() {
        let of_preset = |gate: &str| {
            let mut set = GateSet::default();
            set.push(GateSpec { expression: gate.parse().unwrap(), source: GateSource::Preset("pr") });
            assert!(set.weakened_in(&gated()).is_empty());
            let specs = set.of_scenario(&gated());
            let induced = specs.into_iter().filter(|spec| !matches!(spec.source, GateSource::Requirement(_)));
            let mut induced = induced.map(|spec| spec.expression.to_string()).filter(|gate| gate.contains("induced"));
            (induced.next(), induced.next())
        };
        assert_eq!(of_preset("upper(induced) <= 0.01"), (Some("upper(induced) <= 0.005".to_owned()), None));
        assert_eq!(of_preset("upper(induced) <= 0.001"), (Some("upper(induced) <= 0.001".to_owned()), None));
    }
}
