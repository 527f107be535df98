//! The record of one sample in the journal of a campaign.

use closecall_scenarios::criteria::SLOWED_MPS;
use closecall_scenarios::outcome::{IMPOSED_BRAKING_MPS2, Outcome};
use closecall_simulation::SampleError;
use serde::{Deserialize, Serialize};

use super::ledger::{Cost, Tally};
use super::validity::{ArmChecks, Invariance};
use closecall_scenarios::harm::harm;

/// How an outcome compares with the outcome in the journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Agreement {
    /// Every bit is the same.
    Same,
    /// Some bit differs, or the journal has an error.
    Differs,
    /// The journal has no result of this sample in this arm.
    NotCompared,
}

/// The reason for which a sample has no outcome.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleFailure {
    /// The kind of error: a stable name for programs.
    pub kind: String,
    /// The message for human readers.
    pub message: String,
}

impl From<SampleError> for SampleFailure {
    fn from(error: SampleError) -> Self {
        Self { kind: error.kind().to_owned(), message: error.to_string() }
    }
}

/// What happened before the run of a sample that has been run again, because its process crashed or
/// hung, or because it had ended in an error.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flaky {
    /// Number of runs that failed.
    pub crashes: u32,
    /// The first failure.
    pub first: SampleFailure,
}

/// What the ego does in the same sample without the vehicles behind it, and with vehicles behind it
/// that do not approach, while nothing happens ahead.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NobodyComing {
    /// The largest amount by which the ego was slower than its lead vehicle in either run (m/s);
    /// `None` if one of them ended in an error, or both took too long.
    pub deficit_mps: Option<f64>,
    /// True if one of the runs took too long, or its process failed, so that it has no result.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_late: bool,
}

impl NobodyComing {
    /// A run that took too long.
    pub(crate) const LATE: Self = Self { deficit_mps: None, is_late: true };

    /// Returns a run with its result: by how much the ego was slower than its lead vehicle (m/s), or
    /// `None` if its controller failed.
    pub(crate) const fn of(deficit_mps: Option<f64>) -> Self {
        Self { deficit_mps, is_late: false }
    }

    /// Returns the worse of two runs.
    pub(crate) fn worse(self, other: Self) -> Self {
        let deficit_mps = match (self.deficit_mps, other.deficit_mps) {
            (Some(one), Some(another)) => Some(one.max(another)),
            (Some(one), None) if other.is_late => Some(one),
            (None, Some(another)) if self.is_late => Some(another),
            _ => None,
        };
        Self { deficit_mps, is_late: self.is_late || other.is_late }
    }

    /// Returns true if the ego slowed down by more than it does with the baseline, or its
    /// controller failed. A run that took too long does not say so.
    pub fn is_slowed(self, baseline: Option<Self>) -> bool {
        let baseline_mps = baseline.and_then(|baseline| baseline.deficit_mps).unwrap_or(0.0);
        let most_mps = SLOWED_MPS + baseline_mps.max(0.0);
        self.deficit_mps.map_or(!self.is_late, |deficit_mps| deficit_mps > most_mps)
    }
}

/// The result of one sample in one arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmRecord {
    /// The controller's name.
    pub controller: String,
    /// The outcome, or the reason for which there is none.
    pub result: Result<Outcome, SampleFailure>,
    /// The findings of the validity checks; `None` if this sample was not checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checks: Option<ArmChecks>,
    /// The runs in which nobody comes from behind; `None` if this sample was not chosen for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nobody_behind: Option<NobodyComing>,
    /// The failures before this outcome, if a repeated run has it (`--retry-crashed`,
    /// `--retry-errors`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flaky: Option<Flaky>,
}

impl ArmRecord {
    /// Returns the result of a single run that was not checked.
    pub const fn new(controller: String, result: Result<Outcome, SampleFailure>) -> Self {
        Self { controller, result, checks: None, nobody_behind: None, flaky: None }
    }
}

impl ArmRecord {
    /// Returns true if there is no outcome, or a check of the outcome took too long: another run
    /// may be complete.
    pub fn is_incomplete(&self) -> bool {
        self.result.is_err()
            || self.checks.as_ref().is_some_and(|checks| checks.not_checked.is_some())
            || self.nobody_behind.is_some_and(|nobody_behind| nobody_behind.is_late)
    }

    /// Notes an earlier run of the sample in the same arm, whose place this run takes. An outcome
    /// after a failure is flaky. Two outcomes are the same, or the run does not repeat.
    fn follow(&mut self, earlier: &Self) {
        let before = earlier.flaky.clone();
        match (&earlier.result, &self.result) {
            (Err(failure), Ok(_)) => {
                let crashes = [&earlier.flaky, &self.flaky].into_iter().flatten().map(|flaky| flaky.crashes);
                let first = before.map_or_else(|| failure.clone(), |flaky| flaky.first);
                self.flaky = Some(Flaky { crashes: 1 + crashes.sum::<u32>(), first });
            }
            (Err(failure), Err(_)) => {
                let first = before.unwrap_or_else(|| Flaky { crashes: 0, first: failure.clone() });
                self.flaky = Some(Flaky { crashes: first.crashes + 1, ..first });
            }
            (Ok(outcome), Ok(again)) => {
                self.flaky = before.or(self.flaky.take());
                if !again.has_same_bits(outcome) {
                    let broken = &mut self.checks.get_or_insert_default().broken;
                    broken.extend((!broken.contains(&Invariance::Repetition)).then_some(Invariance::Repetition));
                }
            }
            (Ok(_), Err(_)) => {}
        }
    }

    /// Returns the contribution of this arm to the counts, before the validity checks are taken
    /// into account.
    pub fn tally(&self) -> Tally {
        match &self.result {
            Ok(outcome) => {
                let mis = outcome.mis.as_ref().ok();
                Tally {
                    collided: Some(outcome.ego_collided()),
                    flaky: self.flaky.is_some(),
                    others_collided: outcome.others_collided(),
                    touched: !outcome.touches.is_empty(),
                    imposed: outcome.cost.is_some_and(|cost| cost.imposed_braking_mps2 > IMPOSED_BRAKING_MPS2),
                    engaged: mis.is_some_and(|mis| mis.engaged_at_s.is_ok()),
                    goal_in_reach: mis.is_some_and(|mis| mis.goal_in_reach == Some(true)),
                    unavailable: mis.is_some_and(|mis| mis.unavailable.is_some()),
                    speed_deficit_mps: outcome.margins.max_speed_deficit_mps,
                    jerk_mps3: outcome.margins.max_jerk_mps3,
                    delta_v_mps: outcome.ego_delta_v_mps().unwrap_or(0.0),
                    harm: harm(outcome),
                    cost: outcome.cost.map(|cost| Cost {
                        time_lost_s: cost.time_lost_s,
                        speed_deficit_mps: outcome.margins.max_speed_deficit_mps,
                        imposed_braking_mps2: cost.imposed_braking_mps2,
                    }),
                }
            }
            Err(_) => Tally::default(),
        }
    }
}

/// The results of one sample in every arm of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// The arms: the baseline first if there are several, the arm under test last, references
    /// between them.
    pub arms: Vec<ArmRecord>,
}

impl Record {
    /// Notes an earlier run of the same sample, whose place this run takes.
    pub(crate) fn follow(&mut self, earlier: &Self) {
        self.arms.iter_mut().zip(&earlier.arms).for_each(|(arm, earlier)| arm.follow(earlier));
    }

    /// Returns the sample with the baseline in place of the arm under test; `None` without a
    /// baseline.
    pub(crate) fn of_baseline(&self) -> Option<Self> {
        let baseline = self.arms.first().filter(|_| self.arms.len() > 1)?;
        Some(Self { arms: vec![baseline.clone(), baseline.clone()], ..self.clone() })
    }

    /// Returns how the result of this sample compares with an outcome, to the last bit. An outcome of
    /// another sample is not compared.
    pub fn agreement(&self, outcome: &Outcome) -> Agreement {
        let is_same = self.sample == outcome.sample && self.scenario == outcome.scenario;
        let arm = self.arms.iter().find(|arm| is_same && arm.controller == outcome.controller);
        match arm.map(|arm| arm.result.as_ref()) {
            None => Agreement::NotCompared,
            Some(Ok(kept)) if kept.has_same_bits(outcome) => Agreement::Same,
            Some(_) => Agreement::Differs,
        }
    }

    /// Returns true if a validity check other than a flipped verdict failed in any arm.
    pub fn is_invalid(&self) -> bool {
        self.arms.iter().filter_map(|arm| arm.checks.as_ref()).any(|checks| !checks.broken.is_empty())
    }

    /// Returns the contribution of each arm to the judged counts.
    ///
    /// If halving the time step flips a verdict, the worse case for the system under test counts:
    /// the arm under test counts as collided, the baseline and the references as not collided.
    pub fn tallies(&self) -> Vec<Tally> {
        let tested = self.arms.len().saturating_sub(1);
        let judged = |(index, arm): (usize, &ArmRecord)| {
            let tally = arm.tally();
            let halved = arm.checks.as_ref().and_then(|checks| checks.collided_at_half_step);
            let worse = |collided: bool| match halved {
                Some(halved) if index == tested => collided || halved,
                Some(halved) => collided && halved,
                None => collided,
            };
            Tally { collided: tally.collided.map(worse), ..tally }
        };
        self.arms.iter().enumerate().map(judged).collect()
    }
}
