//! The outputs of a sample whose sensitivity is studied.

use crate::ledger::PairFate;
use crate::record::Record;

/// One output of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Output {
    /// The system prevents the collision of the sample: 1, else 0.
    Prevented,
    /// The system induces a collision: 1, else 0.
    Induced,
    /// Harm without the system, less the harm with it: the driver deaths that it prevents.
    HarmPrevented,
    /// The ego collides in the baseline: 1, else 0.
    CollidedWithout,
    /// The ego collides in the arm under test: 1, else 0.
    Collided,
    /// Harm in the arm under test.
    Harm,
}

impl Output {
    /// Returns the outputs of a study, the most important first.
    pub const fn of_study(is_paired: bool) -> &'static [Self] {
        if is_paired {
            &[Self::Prevented, Self::Induced, Self::HarmPrevented, Self::CollidedWithout, Self::Collided]
        } else {
            &[Self::Collided, Self::Harm]
        }
    }

    /// Returns the name, as a key of JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Prevented => "prevented",
            Self::Induced => "induced",
            Self::HarmPrevented => "harm_prevented",
            Self::CollidedWithout => "collided_without",
            Self::Collided => "collided",
            Self::Harm => "harm",
        }
    }

    /// Returns a title for readers.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Prevented => "prevented collisions",
            Self::Induced => "induced collisions",
            Self::HarmPrevented => "harm prevented, less harm induced",
            Self::CollidedWithout => "collisions in the baseline",
            Self::Collided => "collisions in the arm under test",
            Self::Harm => "harm in the arm under test",
        }
    }

    /// Returns true if the output is an event, 0 or 1.
    pub const fn is_event(self) -> bool {
        !matches!(self, Self::HarmPrevented | Self::Harm)
    }
}

/// Returns the outputs of a sample, in the order of [`Output::of_study`]; `None` if an arm ended in
/// an error.
pub fn values(record: &Record) -> Option<Vec<f64>> {
    let tallies: Vec<_> = record.arms.iter().map(|arm| arm.tally()).collect();
    let tested = tallies.last()?;
    let event = |happened: bool| f64::from(u8::from(happened));
    if tallies.iter().any(|tally| tally.collided.is_none()) {
        return None;
    }
    let collided = event(tested.collided?);
    if tallies.len() == 1 {
        return Some(vec![collided, tested.harm]);
    }
    let baseline = tallies.first()?;
    let fate = PairFate::of(baseline, tested)?;
    Some(vec![
        event(fate == PairFate::Prevented),
        event(fate == PairFate::Induced),
        baseline.harm - tested.harm,
        event(baseline.collided?),
        collided,
    ])
}
