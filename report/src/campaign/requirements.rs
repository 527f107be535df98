//! Which requirements the scenarios of a campaign are evidence for, and how they fare by the gates that were set.

use std::collections::BTreeMap;

use closecall_campaign::summary::Summary;
use closecall_campaign::verdict::{Gates, Verdict};
use closecall_simulation::scenario::ScenarioFile;

/// How something fares, graver answers last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Standing {
    /// Every gate is met.
    Pass,
    /// No gate was set: nothing was judged.
    NotJudged,
    /// Too few samples to say.
    Inconclusive,
    /// The campaign cannot be believed.
    Invalid,
    /// Some gate is not met.
    Fail,
}

impl Standing {
    /// The word for it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "PASS",
            Self::NotJudged => "no gate was set",
            Self::Inconclusive => "INCONCLUSIVE",
            Self::Invalid => "INVALID",
            Self::Fail => "FAIL",
        }
    }
}

/// One scenario as evidence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Evidence {
    /// The scenario's name.
    pub scenario: String,
    /// Samples of the arm under test with an outcome.
    pub samples: u64,
    /// Those in which E collided.
    pub collisions: u64,
    /// How it fares.
    pub standing: Standing,
}

/// One requirement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Requirement {
    /// Its mark.
    pub mark: String,
    /// The scenarios that name it.
    pub evidence: Vec<Evidence>,
}

impl Requirement {
    /// The gravest of what its scenarios say.
    pub fn standing(&self) -> Standing {
        self.evidence.iter().map(|evidence| evidence.standing).max().unwrap_or(Standing::NotJudged)
    }
}

/// The requirements that the scenarios name, in the order of their marks. Each scenario is judged alone.
pub fn requirements<'a>(
    files: impl IntoIterator<Item = &'a ScenarioFile>,
    summary: &Summary,
    gates: Gates,
) -> Vec<Requirement> {
    let mut by_mark: BTreeMap<String, Vec<Evidence>> = BTreeMap::new();
    for file in files {
        let name = &file.config().name;
        let Some(counted) = summary.scenarios.iter().find(|(counted, _)| counted == name) else { continue };
        let alone = Summary { scenarios: vec![counted.clone()], ..summary.clone() };
        let tested = counted.1.arms.last().copied().unwrap_or_default();
        let standing = match alone.judge(gates).verdict {
            Verdict::Pass if gates == Gates::default() => Standing::NotJudged,
            Verdict::Pass => Standing::Pass,
            Verdict::Fail => Standing::Fail,
            Verdict::Inconclusive => Standing::Inconclusive,
            Verdict::Invalid => Standing::Invalid,
        };
        for mark in &file.config().requirements {
            by_mark.entry(mark.clone()).or_default().push(Evidence {
                scenario: name.clone(),
                samples: tested.outcomes,
                collisions: tested.collisions,
                standing,
            });
        }
    }
    by_mark.into_iter().map(|(mark, evidence)| Requirement { mark, evidence }).collect()
}
