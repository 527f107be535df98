//! The requirements that the scenarios of a campaign name, each with its result by the gates that were set.

use std::collections::BTreeMap;

use closecall_campaign::summary::Summary;
use closecall_campaign::verdict::{Gates, Verdict};
use closecall_simulation::scenario::ScenarioFile;

/// The result of a scenario or a requirement, in the order of gravity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// Every gate is met.
    Pass,
    /// No gate was set, so that nothing was judged.
    NotJudged,
    /// There are too few samples for an answer.
    Inconclusive,
    /// A validity check of the simulator failed, so that no result counts.
    Invalid,
    /// A gate is not met.
    Fail,
}

impl Status {
    /// Returns the word that reports use.
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

/// The result of one scenario that names a requirement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Evidence {
    /// The scenario's name.
    pub scenario: String,
    /// The number of samples of the arm under test that have an outcome.
    pub samples: u64,
    /// The number of these samples in which the ego collided.
    pub collisions: u64,
    /// The scenario's result.
    pub status: Status,
}

/// One requirement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Requirement {
    /// The requirement's identifier, as the scenario files write it.
    pub id: String,
    /// The scenarios that name it.
    pub evidence: Vec<Evidence>,
}

impl Requirement {
    /// Returns the gravest result of its scenarios.
    pub fn status(&self) -> Status {
        self.evidence.iter().map(|evidence| evidence.status).max().unwrap_or(Status::NotJudged)
    }
}

/// Returns the requirements that the scenarios name, in the order of their identifiers. Each scenario is judged alone.
pub fn requirements<'a>(
    files: impl IntoIterator<Item = &'a ScenarioFile>,
    summary: &Summary,
    gates: Gates,
) -> Vec<Requirement> {
    let mut by_id: BTreeMap<String, Vec<Evidence>> = BTreeMap::new();
    for file in files {
        let name = &file.config().name;
        let Some(counted) = summary.scenarios.iter().find(|(counted, _)| counted == name) else { continue };
        let alone = Summary { scenarios: vec![counted.clone()], ..summary.clone() };
        let tested = counted.1.arms.last().copied().unwrap_or_default();
        let status = match alone.judge(gates).verdict {
            Verdict::Pass if gates == Gates::default() => Status::NotJudged,
            Verdict::Pass => Status::Pass,
            Verdict::Fail => Status::Fail,
            Verdict::Inconclusive => Status::Inconclusive,
            Verdict::Invalid => Status::Invalid,
        };
        for id in &file.config().requirements {
            by_id.entry(id.clone()).or_default().push(Evidence {
                scenario: name.clone(),
                samples: tested.outcomes,
                collisions: tested.collisions,
                status,
            });
        }
    }
    by_id.into_iter().map(|(id, evidence)| Requirement { id, evidence }).collect()
}
