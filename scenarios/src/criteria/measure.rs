//! Measures of one sample that a gate can judge.
//!
//! A measure has one value per sample and arm, or none. A *flag* is a measure that is 0 or 1. If
//! `outcomes.parquet` has a column for the measure, both have the same name.

use crate::harm::harm;
use crate::outcome::{Cost, EndReason, LONGEST_RUN_S, Margins, MisSummary, Moment, Outcome, Promise, worse};
use crate::promise::{Goal, HARD_BRAKING_MPS2, is_due};
use closecall_traffic::{Environment, GRAVITY_MPS2, LARGEST_JERK_MPS3, Measured, Range};

/// Whether a measure counts or quantifies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasureKind {
    /// Something that happened (1) or did not (0).
    Flag,
    /// A quantity, in the unit that its name ends with.
    Number,
}

/// A measure of one outcome.
#[derive(Clone, Copy)]
pub struct Measure {
    /// The name in gates.
    pub name: &'static str,
    /// Whether the measure counts or quantifies.
    pub kind: MeasureKind,
    /// The values that the measure can have, whatever happens in a run. A bound beyond them judges
    /// nothing.
    pub range: Range,
    /// The meaning of the measure, for people.
    pub meaning: &'static str,
    value: fn(&Outcome) -> Option<f64>,
}

impl std::fmt::Debug for Measure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Measure {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Measure {
    /// Returns the value of an outcome, or `None` if the outcome does not have it.
    pub fn of(&self, outcome: &Outcome) -> Option<f64> {
        (self.value)(outcome)
    }

    /// Returns true if the controller reports the measure of itself. The measure is then not
    /// evidence about a controller from outside.
    pub fn is_reported(&self) -> bool {
        REPORTED.contains(&self.name)
    }

    /// Returns the number and the threshold above which the flag holds, of a flag that one number
    /// decides.
    pub(super) fn exceeds(&self) -> Option<(&'static str, f64)> {
        match self.name {
            SLOWED_UNPROMPTED => Some((UNPROMPTED_DEFICIT, SLOWED_MPS)),
            "braked_at_crossing" => Some(("crossing_braking_mps2", HARD_BRAKING_MPS2)),
            _ => None,
        }
    }

    /// Returns the measures that rest on what happened, and not on what a controller reports.
    pub fn measured() -> impl Iterator<Item = &'static Self> {
        MEASURES.iter().filter(|measure| !measure.is_reported())
    }

    /// Returns the measure with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        MEASURES.iter().find(|measure| measure.name == name)
    }
}

/// The measures that rest on the states that a controller reports.
const REPORTED: [&str; 4] = ["engaged", "goal_in_reach", "thw_gain_s", "emergency_braked"];

/// Amount that no measure of a run exceeds, in its unit (s, m, m/s² or deaths): an assumption; 1e4
/// to 1e9 are plausible. Only a time to collision may exceed it, if two vehicles have almost the
/// same speed. The time then says nothing.
const LARGEST: f64 = 1e6;

/// Largest difference of two speeds (m/s): an assumption, twice the fastest speed that a scenario
/// file may state; 100 to 1,000 are plausible.
const LARGEST_SPEED_MPS: f64 = 200.0;

/// The numbers that are 0 or more by definition.
const NOT_NEGATIVE: Range = Range::closed(0.0, LARGEST);
/// The numbers that may be below 0.
const SIGNED: Range = Range::closed(-LARGEST, LARGEST);
/// Differences of two speeds (m/s).
const SPEED: Range = Range::closed(0.0, LARGEST_SPEED_MPS);
/// Deceleration of the ego (m/s²): the tyres transmit no more than the friction allows.
const BRAKING: Range = Range::closed(0.0, Environment::FRICTION.high() * GRAVITY_MPS2);
/// Jerk of the ego (m/s³): its actuators allow no more.
const JERK: Range = Range::closed(0.0, LARGEST_JERK_MPS3);
/// Times of a run (s), which is no longer than a scenario file may state.
const DURATION: Range = Range::closed(0.0, LONGEST_RUN_S);

/// The flags of a pair of arms on the same sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairFlag {
    /// The ego collides in the baseline, and no vehicle collides in the arm under test.
    Prevented,
    /// A collision of the ego, or the first of any vehicles, in the arm under test alone.
    Induced,
}

impl PairFlag {
    /// All flags.
    pub const ALL: [Self; 2] = [Self::Prevented, Self::Induced];

    /// Returns the name in gates.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Prevented => "prevented",
            Self::Induced => "induced",
        }
    }

    /// Returns the meaning of the flag, for people.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Prevented => "the ego collides in the baseline, and no vehicle collides in the arm under test",
            Self::Induced => {
                "the ego collides in the arm under test alone, or other vehicles do while none collides in the baseline"
            }
        }
    }

    /// Returns the flag with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|flag| flag.name() == name)
    }
}

const fn flag(name: &'static str, meaning: &'static str, value: fn(&Outcome) -> Option<f64>) -> Measure {
    Measure { name, kind: MeasureKind::Flag, range: Range::UNIT, meaning, value }
}

const fn number(
    name: &'static str,
    range: Range,
    meaning: &'static str,
    value: fn(&Outcome) -> Option<f64>,
) -> Measure {
    Measure { name, kind: MeasureKind::Number, range, meaning, value }
}

fn is(happened: bool) -> Option<f64> {
    Some(if happened { 1.0 } else { 0.0 })
}

fn reached(outcome: &Outcome, moment: Moment) -> Option<f64> {
    is(outcome.moment(moment).is_some())
}

fn margin(outcome: &Outcome, value: fn(&Margins) -> Measured) -> Option<f64> {
    value(&outcome.margins).ok()
}

fn mis(outcome: &Outcome, value: fn(&MisSummary) -> Measured) -> Option<f64> {
    value(outcome.mis.as_ref().ok()?).ok()
}

/// Amount by which an ego may be slower than its lead vehicle without a reason (m/s): an
/// assumption, above what a cruise control needs to keep its gap; 0.2 to 1 are plausible.
pub const SLOWED_MPS: f64 = 0.5;

fn cost(outcome: &Outcome, value: fn(&Cost) -> f64) -> Option<f64> {
    outcome.cost.as_ref().map(value)
}

fn promise(outcome: &Outcome, value: fn(&Promise) -> Measured) -> Option<f64> {
    value(outcome.promise.as_ref()?).ok()
}

/// Front time headway that the ego gained from the engagement to the critical distance (s).
fn thw_gain_s(outcome: &Outcome) -> Option<f64> {
    let at_engagement_s = mis(outcome, |mis| mis.thw_front_at_engagement_s)?;
    Some(mis(outcome, |mis| mis.thw_front_at_critical_s)? - at_engagement_s)
}

/// The measure of a system that acts for a vehicle behind, whatever it reports.
pub const SLOWED_FOR_REAR: &str = "slowed_for_rear";

/// The flag that the lead vehicle brakes.
pub const LEAD_BRAKED: &str = "lead_braked";

/// The flag that a vehicle behind meets the conditions for engaging.
pub const REAR_NEAR: &str = "rear_near";

/// The flag that the ego was slowed before a vehicle behind was near.
pub const SLOWED_UNPROMPTED: &str = "slowed_unprompted";

/// The number that decides that flag.
pub const UNPROMPTED_DEFICIT: &str = "unprompted_deficit_mps";

/// The measure that gates judge after the validity checks.
pub const EGO_COLLIDED: &str = "ego_collided";

/// Every measure.
pub const MEASURES: &[Measure] = &[
    flag(EGO_COLLIDED, "the ego collides", |outcome| is(outcome.ego_collided())),
    flag("others_collided", "two vehicles other than the ego collide with each other", |outcome| {
        is(outcome.others_collided())
    }),
    flag(
        "others_collided_alone",
        "two vehicles other than the ego collide with each other, and the ego does not collide",
        |outcome| is(outcome.others_collided() && !outcome.ego_collided()),
    ),
    flag("ego_strikes", "the ego strikes another vehicle", |outcome| is(outcome.ego_strikes().next().is_some())),
    flag("ego_is_struck", "another vehicle strikes the ego", |outcome| is(outcome.ego_struck().next().is_some())),
    flag("ego_touched", "the bumpers of the ego and of another vehicle meet at less than 0.67 m/s", |outcome| {
        is(outcome.ego_touched())
    }),
    flag("touched", "two bumpers meet at less than 0.67 m/s", |outcome| is(!outcome.touches.is_empty())),
    flag("engaged", "the margin increase system engages", |outcome| {
        is(outcome.mis.as_ref().is_ok_and(|mis| mis.engaged_at_s.is_ok()))
    }),
    flag("emergency_braked", "the controller says that it brakes in an emergency", |outcome| {
        is(outcome.ahead?.emergency_braking_at_s.is_ok())
    }),
    flag("goal_in_reach", "the system says, when it engages, that its goal is in reach", |outcome| {
        is(outcome.mis.as_ref().is_ok_and(|mis| mis.goal_in_reach == Some(true)))
    }),
    flag(
        SLOWED_UNPROMPTED,
        "the ego is slower than the lead vehicle by more than 0.5 m/s before a vehicle behind is within 100 m and approaches at 10 km/h or more",
        |outcome| cost(outcome, |cost| if cost.unprompted_deficit_mps > SLOWED_MPS { 1.0 } else { 0.0 }),
    ),
    flag(
        SLOWED_FOR_REAR,
        "the ego is slower than the lead vehicle by more than 0.5 m/s after a vehicle behind is within 100 m and approaches at 10 km/h or more",
        |outcome| cost(outcome, |cost| if cost.prompted_deficit_mps > SLOWED_MPS { 1.0 } else { 0.0 }),
    ),
    flag(
        "goal_due",
        "a gain of 2 s of front time headway is in reach when the rear vehicle is near, and the lead vehicle does not brake before the rear vehicle is at the critical distance",
        |outcome| is(is_due(outcome)?),
    ),
    flag(
        "goal_reached",
        "the front time headway has grown by 1.9 s when the rear vehicle is at the critical distance",
        |outcome| {
            outcome.promise?;
            is(Goal::of(outcome) == Some(Goal::Reached))
        },
    ),
    flag(
        "braked_at_crossing",
        "the ego brakes harder than 1.5 m/s² within 2 s of the crossing of the rear vehicle",
        |outcome| {
            outcome.promise?;
            is(promise(outcome, |promise| promise.crossing_braking_mps2).is_some_and(|mps2| mps2 > HARD_BRAKING_MPS2))
        },
    ),
    flag("ended_in_standstill", "the ego and the vehicles near it come to a stop", |outcome| {
        is(outcome.end == EndReason::Standstill)
    }),
    flag(REAR_NEAR, "the rear vehicle comes near: within 100 m, at 10 km/h or more", |outcome| {
        reached(outcome, Moment::RearNear)
    }),
    flag("rear_cut_out", "the rear vehicle starts to change lanes in order to overtake", |outcome| {
        reached(outcome, Moment::CutOut)
    }),
    flag("rear_crossed", "the rear vehicle leaves the lane of the ego", |outcome| reached(outcome, Moment::Crossed)),
    flag(
        "hazard",
        "the lead vehicle brakes, and the ego brakes hard while the rear vehicle is near in its lane",
        |outcome| reached(outcome, Moment::Hazard),
    ),
    flag("rear_critical", "the rear vehicle reaches the critical distance", |outcome| {
        reached(outcome, Moment::CriticalDistance)
    }),
    flag("rear_passed", "the rear vehicle passes the ego", |outcome| reached(outcome, Moment::Concluded)),
    flag(LEAD_BRAKED, "the lead vehicle brakes", |outcome| reached(outcome, Moment::FrontBrakes)),
    number("min_thw_front_s", NOT_NEGATIVE, "smallest time headway to the lead vehicle", |outcome| {
        margin(outcome, |margins| margins.min_thw_front_s)
    }),
    number("min_thw_rear_s", NOT_NEGATIVE, "smallest time headway of the rear vehicle", |outcome| {
        margin(outcome, |margins| margins.min_thw_rear_s)
    }),
    number("min_gap_front_m", NOT_NEGATIVE, "smallest gap to the lead vehicle", |outcome| {
        margin(outcome, |margins| margins.min_gap_front_m)
    }),
    number("min_gap_rear_m", NOT_NEGATIVE, "smallest gap of the rear vehicle", |outcome| {
        margin(outcome, |margins| margins.min_gap_rear_m)
    }),
    number("min_ttc_rear_s", NOT_NEGATIVE, "smallest time to collision of the rear vehicle", |outcome| {
        margin(outcome, |margins| margins.min_ttc_rear_s)
    }),
    number("min_ttc_front_s", NOT_NEGATIVE, "smallest time to collision with the vehicle ahead", |outcome| {
        outcome.ahead?.min_ttc_front_s.ok()
    }),
    number(
        "impact_speed_mps",
        SPEED,
        "largest relative speed with which the ego strikes another vehicle (0 if it strikes none)",
        |outcome| Some(outcome.ego_strikes().map(|collision| collision.relative_speed_mps).fold(0.0, worse)),
    ),
    number("max_deceleration_mps2", BRAKING, "largest deceleration of the ego before it collides", |outcome| {
        Some(outcome.margins.max_deceleration_mps2)
    }),
    number("max_jerk_mps3", JERK, "largest jerk of the ego before it collides", |outcome| {
        Some(outcome.margins.max_jerk_mps3)
    }),
    number(
        "max_speed_deficit_mps",
        SPEED,
        "largest speed by which the ego is slower than the lead vehicle",
        |outcome| Some(outcome.margins.max_speed_deficit_mps),
    ),
    number(
        UNPROMPTED_DEFICIT,
        SPEED,
        "largest speed by which the ego is slower than the lead vehicle before a vehicle behind gives a reason, and before the lead vehicle brakes",
        |outcome| cost(outcome, |cost| cost.unprompted_deficit_mps),
    ),
    number(
        "time_lost_s",
        DURATION,
        "longest time by which the ego is late before the lead vehicle brakes",
        |outcome| cost(outcome, |cost| cost.time_lost_s),
    ),
    number(
        "imposed_braking_mps2",
        NOT_NEGATIVE,
        "largest deceleration of the vehicle behind before the lead vehicle brakes",
        |outcome| cost(outcome, |cost| cost.imposed_braking_mps2),
    ),
    number("delta_v_mps", SPEED, "largest change of the ego's velocity in a collision (0 without one)", |outcome| {
        Some(outcome.ego_delta_v_mps().unwrap_or(0.0))
    }),
    number("harm", NOT_NEGATIVE, "driver deaths expected from all collisions of the sample", |outcome| {
        Some(harm(outcome))
    }),
    number("duration_s", DURATION, "duration of the run", |outcome| Some(outcome.duration.s())),
    number("thw_gain_s", SIGNED, "front time headway gained from the engagement to the critical distance", thw_gain_s),
    number(
        "thw_raised_s",
        SIGNED,
        "front time headway at the critical distance, minus the smallest one until the rear vehicle was near",
        |outcome| promise(outcome, |promise| promise.thw_raised_s),
    ),
    number(
        "crossing_braking_mps2",
        BRAKING,
        "hardest braking of the ego within 2 s of the crossing of the rear vehicle",
        |outcome| promise(outcome, |promise| promise.crossing_braking_mps2),
    ),
];
