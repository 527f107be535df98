//! The result of one run: collisions, margins, and the actions of the margin increase system (MIS).

use closecall_controllers::Reason;
use closecall_traffic::geometry::BoxSide;
pub use closecall_traffic::metrics::CRITICAL_THW_S;
use closecall_traffic::{Absent, ActorId, Measured, Parameters, Time};
use serde::{Deserialize, Serialize};

/// Longest duration of a run that a scenario file may state (s): an assumption, against a misprint;
/// 600 to 100,000 are plausible.
pub(crate) const LONGEST_RUN_S: f64 = 3_600.0;

/// The vehicle of two that closed the gap between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClosedBy {
    /// The first of the two moved towards the second.
    First,
    /// The second of the two moved towards the first.
    Second,
    /// Each moved towards the other.
    Both,
}

/// Returns the larger of two values. NaN counts as larger than every number, because it must never
/// look safe.
pub fn worse(first: f64, second: f64) -> f64 {
    if first.is_nan() || first >= second { first } else { second }
}

/// Phase of the encounter of the ego with a rear vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// The rear vehicle is far behind, or there is none.
    #[default]
    Approach,
    /// The rear vehicle follows in the ego's lane at a time headway below [`CRITICAL_THW_S`].
    Critical,
    /// The rear vehicle has left the ego's lane and has not passed the ego yet.
    Overtaking,
    /// The rear vehicle has passed the ego.
    After,
}

/// Relative speed below which two bumpers that meet touch, and do not collide (m/s): 1.5 mph. Up to
/// it a car must withstand a pendulum of its own mass at the corners of its bumpers, with lamps,
/// doors and brakes intact (49 CFR 581.5 and 581.7). It is an assumption that nobody calls such a
/// contact an accident: 0.1 to the 1.12 m/s of the other impacts of that standard (2.5 mph) are
/// plausible.
pub const TOUCH_MPS: f64 = 0.670_56;

/// Deceleration above which a vehicle behind brakes unduly hard (m/s²): a lane change is critical
/// if a vehicle that approaches from behind must brake harder (UN Regulation 79, paragraph 5.6.4.7;
/// UN Regulation 157 has the same criterion for its lane changes).
pub const IMPOSED_BRAKING_MPS2: f64 = 3.0;

/// The first contact of two vehicles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Collision {
    /// Time of the first contact.
    pub time: Time,
    /// The two vehicles, in the order of their names.
    pub between: [ActorId; 2],
    /// The side of each vehicle that was struck, in the order of `between`.
    pub struck_side: [BoxSide; 2],
    /// The vehicle that closed the gap.
    pub closed_by: ClosedBy,
    /// Phase of the encounter in which it happened.
    pub phase: Phase,
    /// Magnitude of the relative velocity at the first contact (m/s).
    pub relative_speed_mps: f64,
    /// Magnitude of each vehicle's change of velocity through the impact (m/s), in the order of
    /// `between`.
    pub delta_v_mps: [f64; 2],
}

impl Collision {
    /// Returns whether `actor` is one of the two vehicles.
    pub fn involves(&self, actor: &ActorId) -> bool {
        self.between.contains(actor)
    }

    /// Returns the indices of the striking and of the struck vehicle in `between`. If both moved
    /// towards each other, the vehicle whose front was struck is the striking one.
    pub fn roles(&self) -> [usize; 2] {
        match self.closed_by {
            ClosedBy::First => [0, 1],
            ClosedBy::Second => [1, 0],
            ClosedBy::Both if self.struck_side[0] != BoxSide::Front && self.struck_side[1] == BoxSide::Front => [1, 0],
            ClosedBy::Both => [0, 1],
        }
    }

    /// Returns the change of velocity of `actor` (m/s), or `None` if it is not one of the two
    /// vehicles.
    fn delta_v_of(&self, actor: &ActorId) -> Option<f64> {
        let index = self.between.iter().position(|id| id == actor)?;
        Some(self.delta_v_mps[index])
    }
}

/// A moment of the encounter in which a rear vehicle R approaches the ego E from behind while the
/// ego follows a lead vehicle F.
///
/// The letters follow the paper's figure: (a) is the hazard without the system, and (e) the rear
/// vehicle about 5 m behind the ego. (b) to (d) lead from the one to the other. Two further moments
/// have no letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Moment {
    /// (a) The lead vehicle brakes, and the ego brakes hard while the rear vehicle is near, in the
    /// ego's lane: the hazard that the system is meant to remove.
    Hazard,
    /// (b) The rear vehicle is within 100 m of the ego, in the ego's lane, and approaches at 10
    /// km/h or more.
    RearNear,
    /// (c) The rear vehicle starts to change lanes in order to overtake.
    CutOut,
    /// (d) The brake light of the lead vehicle is on.
    FrontBrakes,
    /// (e) The rear vehicle is at the critical distance behind the ego.
    CriticalDistance,
    /// The centre of the rear vehicle has left the ego's lane.
    Crossed,
    /// The rear vehicle has passed the ego: the overtaking is concluded, and the ego is free to
    /// brake.
    Concluded,
}

impl Moment {
    /// All moments: (a) to (e), then those without a letter.
    pub const ALL: [Self; 7] = [
        Self::Hazard,
        Self::RearNear,
        Self::CutOut,
        Self::FrontBrakes,
        Self::CriticalDistance,
        Self::Crossed,
        Self::Concluded,
    ];

    /// Returns the moment's letter in the paper's figure; `None` if the figure does not have the
    /// moment.
    pub const fn letter(self) -> Option<char> {
        match self {
            Self::Hazard => Some('a'),
            Self::RearNear => Some('b'),
            Self::CutOut => Some('c'),
            Self::FrontBrakes => Some('d'),
            Self::CriticalDistance => Some('e'),
            Self::Crossed | Self::Concluded => None,
        }
    }

    /// Returns a short phrase that says what happens. `vehicle` is the letter or the name of the
    /// vehicle besides the ego: the vehicle behind or, for [`Self::FrontBrakes`], the vehicle
    /// ahead.
    pub fn text(self, vehicle: &str) -> String {
        match self {
            Self::Hazard => format!("E brakes hard in front of {vehicle}"),
            Self::RearNear => format!("{vehicle} comes near"),
            Self::CutOut => format!("{vehicle} pulls out"),
            Self::FrontBrakes => format!("{vehicle} brakes"),
            Self::CriticalDistance => format!("{vehicle} is at the critical distance"),
            Self::Crossed => format!("{vehicle} has left the lane"),
            Self::Concluded => format!("{vehicle} has passed E"),
        }
    }

    /// Returns a word for the vehicle besides the ego if its name is not known.
    pub(crate) const fn unnamed_vehicle(self) -> &'static str {
        match self {
            Self::FrontBrakes => "the vehicle ahead",
            Self::Hazard | Self::RearNear | Self::CutOut | Self::CriticalDistance | Self::Crossed | Self::Concluded => {
                "the vehicle behind"
            }
        }
    }
}

/// A moment of the encounter, the time at which it was reached, and the vehicle that reached it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReachedMoment {
    /// The moment.
    pub moment: Moment,
    /// Time of the first control step at which the moment's condition held; the cut-out has the
    /// time of a physics step.
    pub time: Time,
    /// The vehicle besides the ego: the vehicle ahead if it brakes, else the vehicle that is or was
    /// last behind the ego. `None` in a journal that was written without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vehicle: Option<ActorId>,
}

/// The reason for the end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EndReason {
    /// The scenario's duration had passed.
    Duration,
    /// The ego, its lead vehicle and all vehicles behind it had come to a standstill.
    Standstill,
    /// Two seconds had passed since the first collision.
    Collision,
}

/// The extreme values of the ego's margins over a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// Smallest time headway of the ego to the vehicle ahead (s).
    pub min_thw_front_s: Measured,
    /// Smallest time headway of the vehicle behind to the ego (s).
    pub min_thw_rear_s: Measured,
    /// Smallest gap to the vehicle ahead (m).
    pub min_gap_front_m: Measured,
    /// Smallest gap to the vehicle behind (m).
    pub min_gap_rear_m: Measured,
    /// Smallest time to collision of the vehicle behind with the ego (s).
    pub min_ttc_rear_s: Measured,
    /// Largest deceleration of the ego before its first collision (m/s²).
    pub max_deceleration_mps2: f64,
    /// Largest jerk of the ego, as a magnitude, before its first collision (m/s³).
    pub max_jerk_mps3: f64,
    /// Largest amount by which the ego was slower than the vehicle ahead, or than its own speed at
    /// the start if there is no vehicle ahead (m/s). It is the cost of a margin: it shows
    /// unnecessary braking, even if the braking avoids collisions.
    pub max_speed_deficit_mps: f64,
}

/// The cost for the ego and for the vehicle behind it, from the true states, until its lead vehicle
/// brakes for the first time or the ego collides.
///
/// No controller reports any of it: every controller is measured alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Largest amount by which the ego was slower than the vehicle ahead, or than its own speed at
    /// the start, before a vehicle behind had met the conditions for engaging (m/s).
    pub unprompted_deficit_mps: f64,
    /// The same after a vehicle behind had met the conditions (m/s): the vehicle behind is the
    /// reason for this part.
    pub prompted_deficit_mps: f64,
    /// Largest time by which the ego was late (s), compared with the speed of the vehicle ahead, or
    /// with its own speed at the start.
    pub time_lost_s: f64,
    /// Largest deceleration of the vehicle behind the ego in its lane (m/s²); 0 if there was none.
    pub imposed_braking_mps2: f64,
}

/// An interval in which the system gave one reason.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReasonSpan {
    /// The reason.
    pub reason: Reason,
    /// Time of the first control step with this reason (s).
    pub from_s: f64,
    /// Time of the first control step with another reason, or of the last one of all (s).
    pub until_s: f64,
}

/// Returns the reason with the longest total time in the interval. If several reasons held equally
/// long, returns the first.
///
/// Emergency braking hides the condition that is missing beneath it, and therefore counts only if
/// there is no other reason. In an interval without duration it is the last reason until then.
/// `None` if there is no reason until its end.
pub fn longest_reason(spans: &[ReasonSpan], [from_s, until_s]: [f64; 2]) -> Option<Reason> {
    let is_braking = |span: &ReasonSpan| matches!(span.reason, Reason::BrakingRequired | Reason::BrakingDone);
    let mut held: Vec<(Reason, f64)> = Vec::new();
    for span in spans.iter().filter(|span| !is_braking(span)) {
        let lasted_s = span.until_s.min(until_s) - span.from_s.max(from_s);
        if lasted_s > 0.0 {
            match held.iter_mut().find(|(reason, _)| *reason == span.reason) {
                Some((_, sum_s)) => *sum_s += lasted_s,
                None => held.push((span.reason, lasted_s)),
            }
        }
    }
    let longest = held.into_iter().reduce(|longest, other| if other.1 > longest.1 { other } else { longest });
    let before = || spans.iter().filter(|span| span.from_s <= until_s);
    longest
        .map(|(reason, _)| reason)
        .or_else(|| before().rfind(|span| !is_braking(span)).map(|span| span.reason))
        .or_else(|| before().next_back().map(|span| span.reason))
}

/// Time after which an engagement is late, and its delay has a reason that is told (s). It is an
/// assumption that a reader asks for the reason of a delay that a driver would notice: 0.5 to 2 s
/// are plausible.
const LATE_S: f64 = 1.0;

/// The reason of a system that sees no vehicle behind where there is one.
const NOT_SEEN: &str = "vehicle behind not seen in the lane";

/// The actions of the margin increase system (MIS) in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MisSummary {
    /// Time of its first engagement (s).
    pub engaged_at_s: Measured,
    /// Time of its release after the first engagement (s).
    pub released_at_s: Measured,
    /// Front time headway of the ego at the engagement (s).
    pub thw_front_at_engagement_s: Measured,
    /// Front time headway of the ego when the rear vehicle was at the critical distance (s).
    pub thw_front_at_critical_s: Measured,
    /// Mean deceleration of the ego from the engagement until the rear vehicle is at the critical
    /// distance, or until the release (m/s²).
    pub mean_deceleration_mps2: Measured,
    /// Whether the planned headway was within reach at the engagement. `None` if it never engaged
    /// or stated no plan.
    pub goal_in_reach: Option<bool>,
    /// The reason for the engagement or, if it never engaged, the reason that held longest in
    /// `decided_s`.
    pub reason: Reason,
    /// All reasons that it gave, in order of time.
    #[serde(default)]
    pub reasons: Vec<ReasonSpan>,
    /// From the time at which the vehicle behind met the conditions on distance and speed until the
    /// hazard, or until it had left the lane, or until the end (s). `None` if no vehicle behind met
    /// them.
    #[serde(default)]
    pub decided_s: Option<[f64; 2]>,
    /// When and why it was not available. `None` if it was available all the time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable: Option<Unavailability>,
}

impl MisSummary {
    /// Returns the longest time without a break over which a reason held in an interval (s). `None`
    /// if it held for no time.
    fn held_s(&self, reason: Reason, [from_s, until_s]: [f64; 2]) -> Option<[f64; 2]> {
        let spans = self.reasons.iter().filter(|span| span.reason == reason);
        let held = spans.map(|span| [span.from_s.max(from_s), span.until_s.min(until_s)]);
        let lasted_s = |span: &[f64; 2]| span[1] - span[0];
        held.filter(|span| lasted_s(span) > 0.0).max_by(|a, b| lasted_s(a).total_cmp(&lasted_s(b)))
    }

    /// Returns the reason in words, and over which time it held if the system never
    /// engaged: *passing lane occupied, 3.6 to 9.6 s*. A controller that gives no reason of this
    /// program has no such time.
    pub fn reason_words(&self) -> String {
        let says_nothing = self.engaged_at_s.is_ok() || self.reason == Reason::External;
        let interval_s = self.decided_s.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        match self.held_s(self.reason, interval_s).filter(|_| !says_nothing) {
            Some([from_s, until_s]) => format!("{}, {from_s:.1} to {until_s:.1} s", self.reason),
            None => self.reason.to_string(),
        }
    }

    /// Returns why the system did not engage sooner, and over which time that held: *vehicle behind
    /// not seen in the lane, 2.7 to 6.2 s*. `None` if it engaged within one second after the
    /// vehicle behind met the conditions on distance and speed, or never.
    pub fn delay_words(&self) -> Option<String> {
        let (engaged_at_s, [from_s, until_s]) = (self.engaged_at_s.ok()?, self.decided_s?);
        let waited_s = [from_s, engaged_at_s.min(until_s)];
        if !(waited_s[1] - waited_s[0] > LATE_S) {
            return None;
        }
        let reason = longest_reason(&self.reasons, waited_s)?;
        let [from_s, until_s] = self.held_s(reason, waited_s).filter(|_| reason != Reason::External)?;
        // A vehicle behind is near and in the lane all this time.
        let words = if reason == Reason::NoRear { NOT_SEEN.to_owned() } else { reason.to_string() };
        Some(format!("{words}, {from_s:.1} to {until_s:.1} s"))
    }
}

/// The method's promise, from the true states, in every arm.
///
/// The promise: when the vehicle behind is at the critical distance, the front time headway has
/// grown by 2 s, and the ego does not brake hard while that vehicle leaves the lane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Promise {
    /// Whether the ego could reach the goal when a vehicle behind was near for the first time:
    /// braking within its limit, with everybody else at constant speed. `None` if no vehicle behind
    /// was near, or none was ahead.
    pub in_reach: Option<bool>,
    /// Front time headway when the vehicle behind is at the critical distance, minus the smallest
    /// one until it was near (s).
    pub thw_raised_s: Measured,
    /// Hardest braking of the ego from 2 s before until 2 s after the vehicle behind crosses the
    /// marking (m/s²).
    pub crossing_braking_mps2: Measured,
}

/// The ego and the vehicle ahead, until the ego collides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ahead {
    /// Smallest time to collision with the vehicle ahead, in the lane or in the path, from the true
    /// states (s).
    pub min_ttc_front_s: Measured,
    /// Time at which the controller says for the first time that it brakes in an emergency (s).
    pub emergency_braking_at_s: Measured,
}

/// When the margin increase system was not available, because the ego knew that sensors had failed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unavailability {
    /// Time from which on it was not available, for the first time (s).
    pub from_s: f64,
    /// Time for which it was not available, in sum (s).
    pub lasted_s: f64,
    /// The reason, at that first time.
    pub reason: Reason,
}

/// The result of one run. A collision is a result, not an error. A run that cannot be completed has
/// no outcome but a `closecall_simulation::SampleError`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The scenario's name.
    pub scenario: String,
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's number, from 0.
    pub sample: u64,
    /// The ego controller's name.
    pub controller: String,
    /// The ego vehicle's name.
    pub ego: ActorId,
    /// The sampled parameter values.
    pub parameters: Parameters,
    /// The reason for the end of the run.
    pub end: EndReason,
    /// Simulated duration of the run.
    pub duration: Time,
    /// The first contact of every pair of vehicles that collided, in order of time.
    pub collisions: Vec<Collision>,
    /// The first touch of every pair of vehicles whose bumpers met at less than [`TOUCH_MPS`], in
    /// order of time. No collision is among them: if the pair meets again and faster, that is its
    /// collision.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub touches: Vec<Collision>,
    /// The moments of the encounter that were reached before the ego collided, in order of time.
    #[serde(default)]
    pub moments: Vec<ReachedMoment>,
    /// The extremes of the ego's margins.
    pub margins: Margins,
    /// What the margin increase system did, or the reason why there is no summary of it.
    pub mis: Result<MisSummary, Absent>,
    /// The cost for the ego and for the vehicle behind it. `None` in a journal that was written
    /// without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<Cost>,
    /// What became of the method's promise. `None` in a journal that was written without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub promise: Option<Promise>,
    /// The ego and the vehicle ahead. `None` in a journal that was written without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ahead: Option<Ahead>,
}

impl Outcome {
    /// Returns whether two outcomes are equal to the last bit, including the signs of zeros.
    ///
    /// The vehicles of the moments are not compared if one of the outcomes comes from a journal
    /// without them.
    pub fn has_same_bits(&self, other: &Self) -> bool {
        // serde_json writes floats so that they read back exactly, so equal text means equal bits.
        let text = |outcome: &Self| serde_json::to_string(outcome).ok();
        let is_same = |first: &Self, second: &Self| text(first).is_some_and(|first| text(second) == Some(first));
        let has_vehicles = |outcome: &Self| outcome.moments.iter().any(|noted| noted.vehicle.is_some());
        if has_vehicles(self) == has_vehicles(other) {
            is_same(self, other)
        } else {
            is_same(&self.without_vehicles_of_moments(), &other.without_vehicles_of_moments())
        }
    }

    /// Returns the outcome without the vehicles of its moments.
    #[must_use]
    pub fn without_vehicles_of_moments(&self) -> Self {
        let mut outcome = self.clone();
        outcome.moments.iter_mut().for_each(|noted| noted.vehicle = None);
        outcome
    }

    /// Returns the time at which `moment` was reached, or `None` if it was not.
    pub fn moment(&self, moment: Moment) -> Option<Time> {
        self.reached(moment).map(|noted| noted.time)
    }

    /// Returns the time and the vehicle of `moment`, or `None` if it was not reached.
    pub fn reached(&self, moment: Moment) -> Option<&ReachedMoment> {
        self.moments.iter().find(|noted| noted.moment == moment)
    }

    /// Returns the collisions of the ego, in order of time.
    pub fn ego_collisions(&self) -> impl Iterator<Item = &Collision> {
        self.collisions.iter().filter(|collision| collision.involves(&self.ego))
    }

    /// Returns the ego's largest change of velocity in a collision (m/s), or `None` if it did not
    /// collide.
    pub fn ego_delta_v_mps(&self) -> Option<f64> {
        self.ego_collisions().filter_map(|collision| collision.delta_v_of(&self.ego)).reduce(worse)
    }

    /// Returns whether the ego was part of a touch.
    pub fn ego_touched(&self) -> bool {
        self.touches.iter().any(|touch| touch.involves(&self.ego))
    }

    /// Returns the collisions in which the ego struck another vehicle.
    pub fn ego_strikes(&self) -> impl Iterator<Item = &Collision> {
        self.ego_collisions().filter(|collision| collision.between[collision.roles()[0]] == self.ego)
    }

    /// Returns the collisions in which another vehicle struck the ego.
    pub fn ego_struck(&self) -> impl Iterator<Item = &Collision> {
        self.ego_collisions().filter(|collision| collision.between[collision.roles()[1]] == self.ego)
    }

    /// Returns whether two vehicles other than the ego collided with each other.
    pub fn others_collided(&self) -> bool {
        self.collisions.iter().any(|collision| !collision.involves(&self.ego))
    }

    /// Returns whether any two vehicles collided with each other.
    pub fn any_collided(&self) -> bool {
        !self.collisions.is_empty()
    }

    /// Returns whether the ego was part of a collision. Gates count samples for which this holds.
    pub fn ego_collided(&self) -> bool {
        self.ego_collisions().next().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(reason: Reason, from_s: f64, until_s: f64) -> ReasonSpan {
        ReasonSpan { reason, from_s, until_s }
    }

    #[test]
    fn the_reason_is_the_one_that_held_longest_and_not_the_last_one() {
        let spans = [
            span(Reason::RearFar, 0.0, 3.6),
            span(Reason::PassingLaneOccupied, 3.6, 9.6),
            span(Reason::BrakingRequired, 9.6, 30.0),
        ];
        assert_eq!(longest_reason(&spans, [3.6, 9.6]), Some(Reason::PassingLaneOccupied));
        assert_eq!(longest_reason(&spans, [3.6, 30.0]), Some(Reason::PassingLaneOccupied), "braking hides the reason");
        assert_eq!(longest_reason(&spans, [0.0, 5.0]), Some(Reason::RearFar));
    }

    #[test]
    fn intervals_of_one_reason_add_up() {
        let spans = [
            span(Reason::RearUnconfirmed, 0.0, 1.0),
            span(Reason::RearNotApproaching, 1.0, 2.5),
            span(Reason::RearUnconfirmed, 2.5, 3.5),
        ];
        assert_eq!(longest_reason(&spans, [0.0, 3.5]), Some(Reason::RearUnconfirmed));
        assert_eq!(longest_reason(&spans, [0.5, 3.0]), Some(Reason::RearNotApproaching), "only the interval counts");
    }

    #[test]
    fn the_time_of_the_reason_is_its_longest_one_in_which_the_system_could_have_engaged() {
        let never = Err(Absent::NeverEngaged);
        let mut mis = MisSummary {
            engaged_at_s: never,
            released_at_s: never,
            thw_front_at_engagement_s: never,
            thw_front_at_critical_s: never,
            mean_deceleration_mps2: never,
            goal_in_reach: None,
            reason: Reason::PassingLaneOccupied,
            reasons: vec![
                span(Reason::PassingLaneOccupied, 0.0, 3.0),
                span(Reason::RearFar, 3.0, 3.2),
                span(Reason::PassingLaneOccupied, 3.2, 9.6),
                span(Reason::BrakingRequired, 9.6, 30.0),
            ],
            decided_s: Some([3.6, 12.0]),
            unavailable: None,
        };
        assert_eq!(mis.reason_words(), "passing lane occupied, 3.6 to 9.6 s", "not from 0 s, and not until 30 s");
        mis.decided_s = None;
        assert_eq!(mis.reason_words(), "passing lane occupied, 3.2 to 9.6 s");
        // Before it could have engaged, and at an instant, the reason held for no time.
        mis.decided_s = Some([9.6, 12.0]);
        assert_eq!(mis.reason_words(), "passing lane occupied");
        mis.decided_s = None;
        mis.engaged_at_s = Ok(2.0);
        assert_eq!(mis.reason_words(), "passing lane occupied", "an engagement has a time of its own");
        mis.engaged_at_s = never;
        mis.reason = Reason::External;
        mis.reasons = vec![span(Reason::External, 0.0, 30.0)];
        assert_eq!(mis.reason_words(), "the controller's own reason");
    }

    #[test]
    fn a_late_engagement_has_the_reason_that_held_longest_until_then() {
        let never = Err(Absent::NeverEngaged);
        let mut mis = MisSummary {
            engaged_at_s: Ok(6.2),
            released_at_s: never,
            thw_front_at_engagement_s: never,
            thw_front_at_critical_s: never,
            mean_deceleration_mps2: never,
            goal_in_reach: None,
            reason: Reason::EngagedGoalOutOfReach,
            reasons: vec![
                span(Reason::RearFar, 0.0, 3.0),
                span(Reason::NoRear, 3.0, 6.2),
                span(Reason::EngagedGoalOutOfReach, 6.2, 9.0),
            ],
            decided_s: Some([2.7, 9.0]),
            unavailable: None,
        };
        let expected = "vehicle behind not seen in the lane, 3.0 to 6.2 s";
        assert_eq!(mis.delay_words().as_deref(), Some(expected), "neither what held before nor the engagement");
        mis.decided_s = Some([5.9, 9.0]);
        assert_eq!(mis.delay_words(), None, "not late");
        mis.decided_s = Some([7.0, 9.0]);
        assert_eq!(mis.delay_words(), None, "engaged for an earlier vehicle");
        mis.decided_s = None;
        assert_eq!(mis.delay_words(), None);
        mis.decided_s = Some([2.7, 9.0]);
        mis.engaged_at_s = never;
        assert_eq!(mis.delay_words(), None, "never engaged: the stated reason says why");
    }

    #[test]
    fn without_an_interval_the_reason_is_the_last_condition_that_was_missing() {
        let spans = [span(Reason::RearFar, 0.0, 3.6), span(Reason::BrakingRequired, 3.6, 9.0)];
        assert_eq!(longest_reason(&spans, [5.0, 5.0]), Some(Reason::RearFar));
        assert_eq!(longest_reason(&spans[1..], [3.6, 9.0]), Some(Reason::BrakingRequired), "nothing else is known");
        assert_eq!(longest_reason(&[], [0.0, 9.0]), None);
    }
}
