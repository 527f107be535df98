//! One sample of a campaign, as the journal keeps it.

use closecall_traffic::ActorId;
use serde::{Deserialize, Serialize};

use super::ledger::Tally;
use crate::outcome::Outcome;
use crate::simulation::SampleError;

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
}

impl ArmRecord {
    /// The counts of this sample.
    pub fn tally(&self, ego: &ActorId) -> Tally {
        match &self.result {
            Ok(outcome) => {
                let mis = outcome.mis.as_ref().ok();
                Tally {
                    collided: Some(outcome.ego_collided(ego)),
                    engaged: mis.is_some_and(|mis| mis.engaged_at_s.is_ok()),
                    goal_in_reach: mis.is_some_and(|mis| mis.goal_in_reach == Some(true)),
                    speed_deficit_mps: outcome.margins.max_speed_deficit_mps,
                }
            }
            Err(_) => Tally { collided: None, engaged: false, goal_in_reach: false, speed_deficit_mps: 0.0 },
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
    /// True where some arm was repeated and came out differently.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub repeat_differs: bool,
}
