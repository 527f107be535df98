//! Which criteria a campaign is judged by, and where each of them comes from.
//!
//! ```text
//!  command line ─┐ replaces, for the same left-hand side,
//!  preset        ├─▶ GateSet ─▶ one gate per criterion and scenario
//!  closecall.toml│ replaces
//!  scenario file ┘                      requirement checks of the scenario file: always
//! ```

use std::fmt;
use std::path::PathBuf;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::criteria::Expression;

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
        let subject = spec.expression.subject();
        let is_known = |gate: &GateSpec| {
            gate.expression.subject() == subject && gate.expression.operator == spec.expression.operator
        };
        if !self.specs.iter().any(is_known) {
            self.specs.push(spec);
        }
    }

    /// Returns the gates of one scenario: the gates of the campaign, the gates of its file that
    /// these do not replace, and the checks of its requirements.
    pub fn of_scenario(&self, file: &ScenarioFile) -> Vec<GateSpec> {
        let mut set = Self { specs: self.specs.clone(), ..Self::default() };
        for &expression in &file.config().gate.require {
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
            let gate = &file.config().gate;
            let confidence = gate.confidence.unwrap_or(ProbabilityGate::CONFIDENCE);
            let gate = ProbabilityGate::new(gate.max_probability?, confidence).ok()?;
            Some(ProbabilitySpec { gate, source: GateSource::Scenario })
        };
        self.probability.clone().or_else(of_file)
    }
}

/// Default of the share of checked verdicts that may flip at half the time step (-).
pub const MAX_FLIP_RATE: f64 = 0.05;
