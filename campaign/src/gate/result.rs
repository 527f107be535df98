//! The results of gates, requirements and expectations.

use std::fmt;

use closecall_scenarios::criteria::{Expression, FlagName};
use closecall_traffic::statistics::format::without_trailing_zeros;
use closecall_traffic::words::counted;

use super::evaluate::{Answer, Evaluation, OpenReason};
use super::set::GateSource;

/// How a requirement or a gate fares; graver results last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Standing {
    /// Every criterion is met.
    Pass,
    /// Nothing checks it.
    NotChecked,
    /// The samples do not decide.
    Inconclusive,
    /// Some criterion is not met.
    Fail,
}

impl Standing {
    /// Returns the word for reports. The words for an undecided campaign are kept for its verdict.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "met",
            Self::NotChecked => "not checked",
            Self::Inconclusive => "open",
            Self::Fail => "NOT MET",
        }
    }
}

/// One gate with its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct GateResult {
    /// The scenario.
    pub scenario: String,
    /// The criterion.
    pub expression: Expression,
    /// The origin of the gate.
    pub source: GateSource,
    /// The value of the criterion, and the answer.
    pub evaluation: Evaluation,
}

impl GateResult {
    /// Returns how the gate fares.
    pub fn standing(&self) -> Standing {
        match self.evaluation.answer {
            Answer::Met => Standing::Pass,
            Answer::Missed => Standing::Fail,
            Answer::Open(OpenReason::NotPaired | OpenReason::NotInCoverage) => Standing::NotChecked,
            Answer::Open(_) => Standing::Inconclusive,
        }
    }

    /// Returns true if the gate checks the requirement `mark`.
    pub fn is_of(&self, mark: &str) -> bool {
        matches!(&self.source, GateSource::Requirement(checked) if checked == mark)
    }

    /// Returns true if the gate has an answer.
    pub fn is_decided(&self) -> bool {
        matches!(self.evaluation.answer, Answer::Met | Answer::Missed)
    }

    /// Returns true if the gate judges the arm under test. A gate on the baseline alone does not,
    /// and a gate that is not checked judges nothing.
    pub fn judges_tested(&self) -> bool {
        self.standing() != Standing::NotChecked && !self.expression.quantity.is_of_baseline()
    }

    /// Returns a name that no other gate of the campaign has.
    pub fn name(&self) -> String {
        let scenario = &self.scenario;
        match &self.source {
            GateSource::Requirement(mark) => format!("{scenario}: {mark}: {}", self.expression),
            _ => format!("{scenario}: {}", self.expression),
        }
    }
}

impl fmt::Display for GateResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Evaluation { value, interval_95, samples, .. } = self.evaluation;
        write!(f, "{}: {}", self.standing().word(), self.name())?;
        match value {
            Some(value) => write!(f, " (is {}", shown(value))?,
            None => f.write_str(" (has no value")?,
        }
        if let Some([low, high]) = interval_95 {
            write!(f, ", share {} to {} with 95 %", shown(low), shown(high))?;
        }
        write!(f, ", {}", counted(samples, "sample"))?;
        if let Some(why) = self.evaluation.undecided() {
            write!(f, "; {why}")?;
        }
        match self.source {
            // The name says so already.
            GateSource::Requirement(_) => f.write_str(")"),
            _ => write!(f, "; from {})", self.source),
        }
    }
}

impl Evaluation {
    /// Returns why the samples do not decide, and how many would; `None` if they decide.
    pub fn undecided(&self) -> Option<String> {
        let Answer::Open(reason) = self.answer else { return None };
        Some(undecided(reason, self.needed))
    }
}

/// Returns why samples do not decide, and how many would, in words.
pub(crate) fn undecided(reason: OpenReason, needed: Option<u64>) -> String {
    let more = match needed {
        Some(needed) => format!(", some {} would if they are like these", rounded_up(needed)),
        None if reason == OpenReason::TooFewSamples => ", and no number would if they are like these".to_owned(),
        None => String::new(),
    };
    format!("{}{more}", reason.text())
}

/// Returns a number of samples with its first two digits, rounded up: the rest of it rests on a
/// share that is not known better.
pub(crate) fn rounded_up(samples: u64) -> u64 {
    let step = samples.checked_ilog10().and_then(|digits| digits.checked_sub(1)).map_or(1, |digits| 10_u64.pow(digits));
    samples.div_ceil(step) * step
}

/// Writes a value with as many digits as tell it apart, and no more than four.
fn shown(value: f64) -> String {
    without_trailing_zeros(&format!("{value:.4}"))
}

/// One requirement in one scenario that is evidence for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RequirementResult {
    /// The requirement's mark.
    pub mark: String,
    /// The scenario.
    pub scenario: String,
    /// How it fares there.
    pub standing: Standing,
}

/// Whether the expectation of a scenario happened.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectationResult {
    /// The scenario.
    pub scenario: String,
    /// The expected flags.
    pub expects: Vec<FlagName>,
    /// Samples in which all of it happened, in every arm; a run that the ego's collision ended
    /// counts.
    pub happened: u64,
    /// Samples with an outcome in every arm.
    pub samples: u64,
    /// The share that is asked for.
    pub least_share: f64,
}

impl ExpectationResult {
    /// Returns the share of samples in which what is expected happened; `None` of no samples.
    pub fn share(&self) -> Option<f64> {
        (self.samples > 0).then(|| self.happened as f64 / self.samples as f64)
    }

    /// Returns true if the share is as high as is asked for.
    pub fn is_met(&self) -> bool {
        self.share().is_some_and(|share| share >= self.least_share)
    }
}

impl fmt::Display for ExpectationResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.expects.iter().map(|flag| flag.measure().name).collect();
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let (happened, samples) = (self.happened, self.samples);
        let share = self.share().map_or("none".to_owned(), percent);
        let least = percent(self.least_share);
        write!(
            f,
            "{}: {} in {happened} of {} ({share}, at least {least} expected)",
            self.scenario,
            names.join(" and "),
            counted(samples, "sample")
        )
    }
}
