//! One sample of a campaign, as the journal keeps it.

use serde::{Deserialize, Serialize};

use super::harm::harm;
use super::ledger::Tally;
use super::validity::ArmChecks;
use closecall_simulation::SampleError;
use closecall_simulation::outcome::Outcome;

/// Why a sample has no outcome, as it is kept: the kind is stable, the message is for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleFailure {
    /// The kind of error.
    pub kind: String,
    /// What happened.
    pub message: String,
}

impl From<SampleError> for SampleFailure {
    fn from(error: SampleError) -> Self {
        Self { kind: error.kind().to_owned(), message: error.to_string() }
    }
}

/// One sample in one arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmRecord {
    /// The controller's name.
    pub controller: String,
    /// What came of it.
    pub result: Result<Outcome, SampleFailure>,
    /// What the validity checks found, where this sample was checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checks: Option<ArmChecks>,
}

impl ArmRecord {
    /// The counts of this sample, as it came out.
    pub fn tally(&self) -> Tally {
        match &self.result {
            Ok(outcome) => {
                let mis = outcome.mis.as_ref().ok();
                Tally {
                    collided: Some(outcome.ego_collided()),
                    engaged: mis.is_some_and(|mis| mis.engaged_at_s.is_ok()),
                    goal_in_reach: mis.is_some_and(|mis| mis.goal_in_reach == Some(true)),
                    speed_deficit_mps: outcome.margins.max_speed_deficit_mps,
                    jerk_mps3: outcome.margins.max_jerk_mps3,
                    delta_v_mps: outcome.ego_delta_v_mps().unwrap_or(0.0),
                    harm: harm(outcome),
                }
            }
            Err(_) => Tally::default(),
        }
    }
}

/// One sample in every arm of a campaign, the baseline first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// The arms.
    pub arms: Vec<ArmRecord>,
}

impl Record {
    /// True where a validity check made a difference where none may be.
    pub fn is_invalid(&self) -> bool {
        self.arms.iter().filter_map(|arm| arm.checks.as_ref()).any(|checks| !checks.broken.is_empty())
    }

    /// The counts of each arm, as they are judged: where a verdict flipped at half the time step, the arm under test,
    /// the last, counts as collided, and the baseline as not. Either speaks worse for the system under test.
    pub fn tallies(&self) -> Vec<Tally> {
        let tested = self.arms.len().saturating_sub(1);
        let judged = |(place, arm): (usize, &ArmRecord)| {
            let tally = arm.tally();
            let halved = arm.checks.as_ref().and_then(|checks| checks.collided_at_half_step);
            let worse = |collided: bool| match halved {
                Some(halved) if place == tested => collided || halved,
                Some(halved) => collided && halved,
                None => collided,
            };
            Tally { collided: tally.collided.map(worse), ..tally }
        };
        self.arms.iter().enumerate().map(judged).collect()
    }
}
