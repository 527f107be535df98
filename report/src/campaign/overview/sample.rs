//! Single samples that a report shows: what became of them, and which are the worst.

use std::cmp::Ordering;

use closecall_traffic::{ActorId, Parameters};

use closecall_campaign::record::Record;
use closecall_simulation::outcome::{Outcome, Phase};

/// What became of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    /// E does not collide in any arm.
    Passed,
    /// E collides in the baseline alone.
    Prevented,
    /// E collides in the arm under test, and in the baseline where there is one.
    Failed,
    /// E collides in the arm under test, and not in the baseline.
    Induced,
    /// Some arm ended in an error.
    Error,
}

impl Fate {
    /// Every fate.
    pub const ALL: [Self; 5] = [Self::Passed, Self::Prevented, Self::Failed, Self::Induced, Self::Error];

    /// What became of a record.
    pub fn of(record: &Record) -> Self {
        let collided = |place: usize| record.arms[place].result.as_ref().ok().map(|outcome| outcome.ego_collided());
        let Some(tested) = record.arms.len().checked_sub(1) else { return Self::Error };
        if record.arms.iter().any(|arm| arm.result.is_err()) {
            return Self::Error;
        }
        let baseline = (tested > 0).then(|| collided(0)).flatten();
        match (baseline, collided(tested)) {
            (Some(true), Some(false)) => Self::Prevented,
            (Some(false), Some(true)) => Self::Induced,
            (_, Some(true)) => Self::Failed,
            (_, Some(false)) => Self::Passed,
            (_, None) => Self::Error,
        }
    }

    /// What it is called; a campaign without a baseline has no pairs to speak of.
    pub const fn word(self, is_paired: bool) -> &'static str {
        match (self, is_paired) {
            (Self::Passed, _) => "no collision",
            (Self::Prevented, _) => "prevented",
            (Self::Failed, true) => "collision in both arms",
            (Self::Failed, false) => "collision",
            (Self::Induced, _) => "induced",
            (Self::Error, _) => "error",
        }
    }
}

/// One sample of the outcome map.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its number.
    pub sample: u64,
    /// What became of it.
    pub fate: Fate,
    /// The sampled values.
    pub parameters: Parameters,
}

/// One of the worst samples in the arm under test: induced collisions first, then the other ones, each by E's change of
/// velocity, then the narrowest escapes, by the smallest time to collision with the vehicle behind.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstSample {
    /// Its number.
    pub sample: u64,
    /// What became of it.
    pub fate: Fate,
    /// Largest change of velocity of E [m/s]; nothing where it did not collide.
    pub delta_v_mps: Option<f64>,
    /// With whom E collided first, and in which phase.
    pub collision: Option<(ActorId, Phase)>,
    /// The outcome.
    pub outcome: Box<Outcome>,
}

impl WorstSample {
    pub(super) fn of(record: &Record) -> Option<Self> {
        let outcome = record.arms.last()?.result.as_ref().ok()?;
        let collision = outcome.ego_collisions().next().map(|collision| {
            let [first, second] = &collision.between;
            (if *first == outcome.ego { second.clone() } else { first.clone() }, collision.phase)
        });
        Some(Self {
            sample: record.sample,
            fate: Fate::of(record),
            delta_v_mps: outcome.ego_delta_v_mps(),
            collision,
            outcome: Box::new(outcome.clone()),
        })
    }

    /// Worse ones first; of equals the one with the smaller number. A value that is not a number is the worst.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        let ttc_s = |sample: &Self| sample.outcome.margins.min_ttc_rear_s.unwrap_or(f64::INFINITY);
        let by_collision = match (self.delta_v_mps, other.delta_v_mps) {
            (Some(one_mps), Some(other_mps)) => other_mps.abs().total_cmp(&one_mps.abs()),
            (one_mps, other_mps) => other_mps.is_some().cmp(&one_mps.is_some()),
        };
        let by_ttc = || match (ttc_s(self).is_nan(), ttc_s(other).is_nan()) {
            (false, false) => ttc_s(self).total_cmp(&ttc_s(other)),
            (one, other) => other.cmp(&one),
        };
        let by_fate = (other.fate == Fate::Induced).cmp(&(self.fate == Fate::Induced));
        by_fate.then(by_collision).then_with(by_ttc).then(self.sample.cmp(&other.sample))
    }
}
