//! Single samples that a report shows: their fate, and which of them are the worst.

use std::cmp::Ordering;

use closecall_traffic::{ActorId, Parameters};

use closecall_campaign::ledger::PairFate;
use closecall_campaign::record::Record;
use closecall_scenarios::outcome::{Outcome, Phase};

/// The outcome of a sample over all arms, in the order of gravity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    /// The ego does not collide in any arm.
    Passed,
    /// The ego collides in the baseline, and no vehicle collides in the arm under test.
    Prevented,
    /// The ego collides in the arm under test, and in the baseline if there is one. In a pair, a
    /// collision of other vehicles in the arm under test counts as well.
    Failed,
    /// The system under test adds a collision of the ego, or of other vehicles.
    Induced,
    /// An arm ended in an error.
    Error,
}

impl Fate {
    /// All fates, in the order of gravity.
    pub const ALL: [Self; 5] = [Self::Passed, Self::Prevented, Self::Failed, Self::Induced, Self::Error];

    /// Returns the fate of the sample of a journal record.
    pub fn of(record: &Record) -> Self {
        if record.arms.iter().any(|arm| arm.result.is_err()) {
            return Self::Error;
        }
        match &record.arms[..] {
            [] => Self::Error,
            [tested] if tested.tally().collided == Some(true) => Self::Failed,
            [_] => Self::Passed,
            [baseline, .., tested] => match PairFate::of(&baseline.tally(), &tested.tally()) {
                Some(PairFate::Prevented) => Self::Prevented,
                Some(PairFate::Induced) => Self::Induced,
                Some(PairFate::Both) => Self::Failed,
                Some(PairFate::Neither) => Self::Passed,
                None => Self::Error,
            },
        }
    }

    /// Returns the name of the fate in reports. It depends on whether the campaign has a baseline.
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
    /// The sample's number.
    pub sample: u64,
    /// The fate of the sample.
    pub fate: Fate,
    /// The sampled values.
    pub parameters: Parameters,
}

/// One of the worst samples of the arm under test. Induced collisions come first, then the other
/// collisions, each in falling order of the ego's change of velocity; then samples without a
/// collision, in rising order of the smallest time to collision with the vehicle behind.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstSample {
    /// The sample's number.
    pub sample: u64,
    /// The fate of the sample.
    pub fate: Fate,
    /// The ego's largest change of velocity (m/s); `None` if the ego did not collide.
    pub delta_v_mps: Option<f64>,
    /// The actor that the ego collided with first, and the phase of the encounter.
    pub collision: Option<(ActorId, Phase)>,
    /// The outcome in the arm under test.
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

    /// Compares two samples: the worse one is less. Of equal samples, the one with the smaller
    /// number is less. A value that is not a number is the worst.
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
