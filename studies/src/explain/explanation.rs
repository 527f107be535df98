//! The result of an explanation.

use closecall_scenarios::MisState;
use closecall_scenarios::outcome::Outcome;
use closecall_traffic::Measured;
use serde::{Deserialize, Serialize};

use super::Stage;
use crate::attribution::Attribution;
use crate::case::fails;

/// A run with stages replaced by the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageRun {
    /// The stages that are replaced.
    pub stages: Vec<Stage>,
    /// Whether the stage is made as usual, instead of perfect.
    pub is_usual: bool,
    /// The settings that replace them, each as `key=value`.
    pub settings: Vec<String>,
    /// How the stage is worse than usual, or differs from it; `None` if it does not.
    pub unusual: Option<String>,
    /// Whether no vehicle collides.
    pub prevents: bool,
    /// Number of collisions; `None` if the run has no outcome.
    pub collisions: Option<usize>,
    /// Smallest gap to the vehicle behind (m).
    pub min_gap_rear_m: Option<f64>,
    /// Smallest gap to the vehicle ahead (m).
    pub min_gap_front_m: Option<f64>,
    /// The reason for which the run has no outcome.
    pub error: Option<String>,
}

impl StageRun {
    pub(super) fn new(stages: &[Stage], settings: Vec<String>, result: Result<Outcome, String>) -> Self {
        let value = |measured: Measured| measured.ok();
        let outcome = result.as_ref().ok();
        Self {
            stages: stages.to_vec(),
            is_usual: false,
            settings,
            unusual: None,
            prevents: outcome.is_some_and(|outcome| !fails(outcome)),
            collisions: outcome.map(|outcome| outcome.collisions.len()),
            min_gap_rear_m: outcome.and_then(|outcome| value(outcome.margins.min_gap_rear_m)),
            min_gap_front_m: outcome.and_then(|outcome| value(outcome.margins.min_gap_front_m)),
            error: result.err(),
        }
    }
}

/// The cause of the failure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Cause {
    /// The stage whose perfection prevents the failure: the first in the chain that is unusual, or
    /// else the first.
    Stage {
        /// The stage.
        stage: Stage,
    },
    /// No stage alone prevents the failure; this pair does, the first in the order of the chain.
    Pair {
        /// The stages.
        stages: [Stage; 2],
    },
    /// No stage and no pair of stages prevents the failure.
    None,
}

/// A run with the margin increase system switched off in one of its states, or in all of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MisRun {
    /// The states in which the system does not drive.
    pub off: Vec<MisState>,
    /// The setting, as `key=value`.
    pub setting: String,
    /// Whether no vehicle collides.
    pub prevents: bool,
}

/// The role of the margin increase system in the failure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MisEffect {
    /// Whether no vehicle collides without the system: the system induces the failure.
    pub is_induced: bool,
    /// The runs without the system in some of its states. Empty if the failure is not induced.
    pub runs: Vec<MisRun>,
    /// The first state, in the order of an encounter, without which no vehicle collides.
    pub state: Option<MisState>,
    /// Time of the engagement (s).
    pub engaged_at_s: Option<f64>,
    /// Time of the release (s).
    pub released_at_s: Option<f64>,
    /// Mean braking of the ego from the engagement until the rear vehicle is near (m/s²).
    pub mean_deceleration_mps2: Option<f64>,
}

impl MisEffect {
    /// Returns whether the controller reports states of the system: it engaged, or switching its
    /// states off has an effect. An external controller may report none.
    pub(super) fn reports_states(&self) -> bool {
        self.engaged_at_s.is_some() || self.runs.iter().any(|run| run.prevents)
    }
}

/// The explanation of a failure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// The scenario's name.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// The sample's number.
    pub sample: u64,
    /// The controller of the arm.
    pub controller: String,
    /// Depth of the sensor simulation: `full`, `object` or `ground-truth`.
    pub sensors: String,
    /// The event in one sentence: who struck whom, after what, the actions of the system and their
    /// reasons, and the faults that held.
    pub happened: String,
    /// The collision.
    pub collision: Attribution,
    /// The runs with one stage replaced, in the order of the chain.
    pub stages: Vec<StageRun>,
    /// The stages that the run does not have, each with the reason.
    pub missing: Vec<(Stage, String)>,
    /// The runs with two stages replaced. Empty if a stage alone prevents the failure.
    pub pairs: Vec<StageRun>,
    /// The cause of the failure.
    pub cause: Cause,
    /// The role of the margin increase system; `None` if the controller has none.
    pub mis: Option<MisEffect>,
}

impl Explanation {
    /// Returns the run that confirms the cause; `None` if there is no cause.
    pub fn confirmation(&self) -> Option<&StageRun> {
        let stages: Vec<Stage> = match self.cause {
            Cause::Stage { stage } => vec![stage],
            Cause::Pair { stages } => stages.to_vec(),
            Cause::None => return None,
        };
        self.stages.iter().chain(&self.pairs).find(|run| run.prevents && run.stages == stages)
    }
}
