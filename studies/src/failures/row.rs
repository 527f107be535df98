//! One failure of a campaign.

use std::cmp::Ordering;

use closecall_campaign::ledger::PairFate;
use closecall_campaign::record::Record;
use closecall_scenarios::harm::harm;
use closecall_scenarios::outcome::{Moment, Outcome, Phase};
use serde::{Deserialize, Serialize};

use crate::attribution::Attribution;
use crate::case::fails;
use crate::explain::{Cause, Explanation};

/// One failure of the arm under test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FailureRow {
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// The controller.
    pub controller: String,
    /// Whether the system induces the failure; `None` without a baseline.
    pub is_induced: Option<bool>,
    /// The harm of the sample, see [`closecall_scenarios::harm`].
    pub harm: f64,
    /// Time of the first collision (s).
    pub time_s: f64,
    /// The vehicle that closed the gap, and the other one.
    pub vehicles: [String; 2],
    /// Phase of the encounter at the first collision.
    pub phase: Phase,
    /// Whether the lead vehicle had begun to brake.
    pub is_after_lead_braking: bool,
    /// How the collision was avoidable; `None` if the sample was not run again.
    pub attribution: Option<Attribution>,
    /// The cause of the failure; `None` if it was not explained.
    pub cause: Option<Cause>,
    /// The explanation in a sentence; `None` if it was not explained.
    pub sentence: Option<String>,
}

impl FailureRow {
    /// Returns the failure of the arm under test in a record; `None` if no vehicle collides in it.
    pub(super) fn of(record: &Record) -> Option<Self> {
        let arm = record.arms.last()?;
        let outcome: &Outcome = arm.result.as_ref().ok().filter(|outcome| fails(outcome))?;
        let tallies = record.tallies();
        let fate = match &tallies[..] {
            [baseline, .., tested] => PairFate::of(baseline, tested),
            _ => None,
        };
        let first = outcome.collisions.first()?;
        Some(Self {
            scenario: record.scenario.clone(),
            sample: record.sample,
            controller: arm.controller.clone(),
            is_induced: fate.map(|fate| fate == PairFate::Induced),
            harm: harm(outcome),
            time_s: first.time.s(),
            vehicles: first.roles().map(|role| first.between[role].to_string()),
            phase: first.phase,
            is_after_lead_braking: outcome.moment(Moment::FrontBrakes).is_some_and(|time| time <= first.time),
            attribution: None,
            cause: None,
            sentence: None,
        })
    }

    /// Returns whether no stage and no pair of stages explains the failure.
    fn is_unexplained(&self) -> bool {
        self.cause == Some(Cause::None)
    }

    /// Returns whether the row is of the same sample in the same arm.
    pub fn is_same(&self, other: &Self) -> bool {
        (&self.scenario, self.sample, &self.controller) == (&other.scenario, other.sample, &other.controller)
    }

    /// Adds an explanation.
    pub(super) fn explain(&mut self, explanation: Explanation) {
        self.sentence = Some(explanation.sentence());
        self.cause = Some(explanation.cause);
        self.attribution = Some(explanation.collision);
    }
}

/// The order of the table: induced failures first, then unexplained ones, then failures with the
/// most harm.
pub fn order(a: &FailureRow, b: &FailureRow) -> Ordering {
    let rank = |row: &FailureRow| (row.is_induced == Some(true), row.is_unexplained());
    rank(b).cmp(&rank(a)).then(b.harm.total_cmp(&a.harm)).then((&a.scenario, a.sample).cmp(&(&b.scenario, b.sample)))
}
