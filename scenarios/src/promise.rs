//! What became of the method's promise in a run, and why a collision was not prevented.
//!
//! ```text
//!  R is near ──▶ the system engages ──▶ F brakes ──▶ R is at the critical distance ──▶ R crosses
//!      │                │                  │                     │                    └ no hard braking
//!      │ out of reach   │ no longer        │ before that:        └ the headway has grown by 2 s
//!      └ too fast       └ too late         └ hazard first
//! ```
//!
//! R is the vehicle behind the ego, F the one ahead. The system cannot know when F brakes. The
//! promise is *due* if the goal was in reach when R was near, and F did not brake before R was at
//! the critical distance.

use std::fmt;

use closecall_controllers::{GOAL_TOLERANCE_S, Reason};

use crate::outcome::{Moment, Outcome};

/// Front time headway that the system has to gain (s) (the method's figure).
pub const GOAL_GAIN_S: f64 = 2.0;

/// Largest shortfall with which the goal counts as reached (s): the shortfall of the plan, and one
/// control step of rounding.
pub(crate) const SHORTFALL_S: f64 = 0.1;
const _: () = assert!(GOAL_TOLERANCE_S < SHORTFALL_S);

/// Braking of the ego around the crossing above which it is hard (m/s²): an assumption,
/// above the comfort limit of 1 m/s² with its overshoot; 1.2 to 3 are plausible.
pub const HARD_BRAKING_MPS2: f64 = 1.5;

/// The result for the goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Goal {
    /// The headway has grown by the goal.
    Reached,
    /// The rear vehicle was too fast for the goal when it was near: out of reach within the braking
    /// limit.
    TooFast,
    /// The goal was in reach when the rear vehicle came near, but not when the system engaged.
    TooLate,
    /// The lead vehicle braked before the rear vehicle was at the critical distance.
    HazardFirst,
    /// The goal was in reach, and nothing happened ahead, but the system stopped short: it
    /// released, or another vehicle changed speed.
    CutShort,
}

impl Goal {
    /// Every case, in the order of reports.
    pub const ALL: [Self; 5] = [Self::Reached, Self::TooFast, Self::TooLate, Self::HazardFirst, Self::CutShort];

    /// Returns the case as words.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Reached => "goal reached",
            Self::TooFast => "rear vehicle too fast",
            Self::TooLate => "engaged too late",
            Self::HazardFirst => "lead vehicle braked first",
            Self::CutShort => "stopped short",
        }
    }

    /// Returns what became of the goal in a run. `None` if no vehicle behind was near, or if it
    /// neither came to the critical distance nor was anticipated by a braking lead vehicle: then
    /// nothing was promised.
    pub fn of(outcome: &Outcome) -> Option<Self> {
        let promise = outcome.promise?;
        let in_reach = promise.in_reach?;
        if promise.thw_raised_s.is_ok_and(|raised_s| raised_s >= GOAL_GAIN_S - SHORTFALL_S) {
            return Some(Self::Reached);
        }
        let critical = outcome.moment(Moment::CriticalDistance);
        let brakes = outcome.moment(Moment::FrontBrakes);
        let is_first = brakes.is_some_and(|brakes| critical.is_none_or(|critical| brakes <= critical));
        if critical.is_none() && !is_first {
            return None;
        }
        let is_late = outcome.mis.as_ref().is_ok_and(|mis| mis.goal_in_reach == Some(false));
        Some(match (in_reach, is_first) {
            (false, _) => Self::TooFast,
            (true, _) if is_late => Self::TooLate,
            (true, true) => Self::HazardFirst,
            (true, false) => Self::CutShort,
        })
    }
}

/// Returns whether the goal was due: in reach when the rear vehicle was near, which then came to
/// the critical distance before the lead vehicle braked.
pub fn is_due(outcome: &Outcome) -> Option<bool> {
    let in_reach = outcome.promise?.in_reach == Some(true);
    let critical = outcome.moment(Moment::CriticalDistance);
    let is_calm = critical.is_some_and(|critical| outcome.moment(Moment::FrontBrakes).is_none_or(|at| at > critical));
    Some(in_reach && is_calm)
}

/// Why the system under test did not prevent a collision, in one word of a tally.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Hindrance {
    /// The system never engaged.
    NotEngaged(Reason),
    /// The system engaged, with this effect.
    Engaged(Goal),
    /// The system engaged, and nothing was promised.
    NothingPromised,
}

impl Hindrance {
    /// Returns why the system of an arm did not help. `None` if the arm has no such system.
    pub fn of(outcome: &Outcome) -> Option<Self> {
        let mis = outcome.mis.as_ref().ok()?;
        if mis.engaged_at_s.is_err() {
            return Some(Self::NotEngaged(mis.reason));
        }
        Some(Goal::of(outcome).map_or(Self::NothingPromised, Self::Engaged))
    }
}

impl fmt::Display for Hindrance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotEngaged(reason) => reason.fmt(f),
            Self::Engaged(goal) => f.write_str(goal.text()),
            Self::NothingPromised => f.write_str("engaged, nothing promised"),
        }
    }
}
