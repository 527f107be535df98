//! Summarises the actions of the margin increase system (MIS) in a run, from its commands.

use closecall_controllers::{EgoCommand, EgoState, Reason};
use closecall_traffic::{Absent, CONTROL_STEP, Measured, Time};

use closecall_scenarios::outcome::{MisSummary, ReasonSpan, Unavailability, longest_reason};

/// The ego at one control step, as the summary needs it.
pub(super) struct MisObservation<'a> {
    pub(super) time: Time,
    pub(super) command: &'a EgoCommand,
    pub(super) speed_mps: f64,
    pub(super) thw_front_s: Measured,
    /// The position of the vehicle behind.
    pub(super) rear: RearObservation,
    /// The reason for which the system is not available; `None` if it is.
    pub(super) failed: Option<Reason>,
}

/// The vehicle behind at one control step, from the true states.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RearObservation {
    /// Index of the vehicle behind in the lane, if it meets the conditions on distance and speed.
    pub(super) near: Option<usize>,
    /// Whether the lead vehicle brakes and the ego brakes hard in front of it.
    pub(super) is_hazard: bool,
    /// Whether the vehicle has left the lane.
    pub(super) has_crossed: bool,
    /// True only at the first control step at which it is at the critical distance.
    pub(super) is_critical: bool,
}

/// Until when the decision to engage counts.
#[derive(Clone, Copy, Debug)]
enum DecisionEnd {
    /// The vehicle behind has left the lane.
    Crossing,
    /// The hazard for which the system is made.
    Hazard,
}

/// The ego at the first engagement.
#[derive(Clone, Copy, Debug)]
struct Engagement {
    at: Time,
    thw_front_s: Measured,
    speed_mps: f64,
    goal_in_reach: Option<bool>,
    reason: Reason,
}

/// Observes the margin increase system during a run.
#[derive(Debug, Default)]
pub(super) struct MisLog {
    engaged: Option<Engagement>,
    released_at: Option<Time>,
    thw_front_at_critical_s: Option<Measured>,
    mean_deceleration_mps2: Option<f64>,
    reasons: Vec<ReasonSpan>,
    /// The vehicles that were near, and since when (s).
    near_since_s: Vec<(usize, f64)>,
    /// The last of them.
    last_near: Option<usize>,
    /// From when to when the decision counts (s), and what ended it.
    decided: Option<([f64; 2], DecisionEnd)>,
    unavailable: Option<Unavailability>,
}

/// Reasons, one after the other, for which a run has room from the start: more than most runs have.
const RESERVED: usize = 32;

impl MisLog {
    pub(super) fn new() -> Self {
        let (reasons, near_since_s) = (Vec::with_capacity(RESERVED), Vec::with_capacity(RESERVED));
        Self { reasons, near_since_s, ..Self::default() }
    }

    /// Observes one control step.
    pub(super) fn observe(&mut self, now: &MisObservation<'_>) {
        self.note_reason(now.time.s(), now.command.reason);
        self.note_decision(now.time.s(), now.rear);
        if let Some(reason) = now.failed {
            let first = Unavailability { from_s: now.time.s(), lasted_s: 0.0, reason };
            self.unavailable.get_or_insert(first).lasted_s += CONTROL_STEP.s();
        }
        let is_active = matches!(now.command.state, EgoState::Increasing | EgoState::Holding);
        if self.engaged.is_none() && now.command.state == EgoState::Increasing {
            self.engaged = Some(Engagement {
                at: now.time,
                thw_front_s: now.thw_front_s,
                speed_mps: now.speed_mps,
                goal_in_reach: now.command.plan.map(|plan| plan.goal_in_reach),
                reason: now.command.reason,
            });
        }
        let Some(engaged) = self.engaged else { return };
        if now.rear.is_critical {
            self.thw_front_at_critical_s.get_or_insert(now.thw_front_s);
        }
        if !is_active {
            self.released_at.get_or_insert(now.time);
        }
        if (now.rear.is_critical || !is_active) && now.time > engaged.at {
            let lasted_s = (now.time - engaged.at).s();
            self.mean_deceleration_mps2.get_or_insert((engaged.speed_mps - now.speed_mps) / lasted_s);
        }
    }

    fn note_reason(&mut self, time_s: f64, reason: Reason) {
        if let Some(last) = self.reasons.last_mut() {
            last.until_s = time_s;
            if last.reason == reason {
                return;
            }
        }
        self.reasons.push(ReasonSpan { reason, from_s: time_s, until_s: time_s });
    }

    /// Notes the interval in which the system could have engaged for the vehicle behind that
    /// matters: the first one that is near in a hazard, else the first one that leaves the lane
    /// after it was near.
    fn note_decision(&mut self, time_s: f64, rear: RearObservation) {
        if let Some(near) = rear.near {
            self.last_near = Some(near);
            if !self.near_since_s.iter().any(|(actor, _)| *actor == near) {
                self.near_since_s.push((near, time_s));
            }
        }
        let since_s = |actor: Option<usize>| {
            self.near_since_s.iter().find(|(near, _)| Some(*near) == actor).map(|(_, since_s)| *since_s)
        };
        match self.decided {
            Some((_, DecisionEnd::Hazard)) => {}
            _ if rear.is_hazard => {
                self.decided = since_s(rear.near).map(|from_s| ([from_s, time_s], DecisionEnd::Hazard));
            }
            None if rear.has_crossed => {
                self.decided = since_s(self.last_near).map(|from_s| ([from_s, time_s], DecisionEnd::Crossing));
            }
            _ => {}
        }
    }

    /// Returns the interval in which the system could have engaged (s): without a hazard and a
    /// crossing until the end. `None` if no vehicle behind was near.
    fn decided_s(&self) -> Option<[f64; 2]> {
        let until_the_end = || Some([self.near_since_s.first()?.1, self.reasons.last()?.until_s]);
        self.decided.map(|(interval_s, _)| interval_s).or_else(until_the_end)
    }

    /// Returns the summary, or [`Absent::NoMis`] if the controller has no margin increase system.
    pub(super) fn finish(self, has_mis: bool) -> Result<MisSummary, Absent> {
        if !has_mis {
            return Err(Absent::NoMis);
        }
        let decided_s = self.decided_s();
        let all_s = [f64::NEG_INFINITY, f64::INFINITY];
        let reason = longest_reason(&self.reasons, decided_s.unwrap_or(all_s)).ok_or(Absent::NoMis)?;
        let never = Absent::NeverEngaged;
        let engaged = self.engaged;
        let after_engagement = |absent| if engaged.is_some() { absent } else { never };
        Ok(MisSummary {
            engaged_at_s: engaged.map(|engaged| engaged.at.s()).ok_or(never),
            released_at_s: self.released_at.map(Time::s).ok_or(after_engagement(Absent::NotReleased)),
            thw_front_at_engagement_s: engaged.map_or(Err(never), |engaged| engaged.thw_front_s),
            thw_front_at_critical_s: self
                .thw_front_at_critical_s
                .unwrap_or(Err(after_engagement(Absent::NeverCritical))),
            mean_deceleration_mps2: self.mean_deceleration_mps2.ok_or(after_engagement(Absent::NotReleased)),
            goal_in_reach: engaged.and_then(|engaged| engaged.goal_in_reach),
            reason: engaged.map_or(reason, |engaged| engaged.reason),
            reasons: self.reasons,
            decided_s,
            unavailable: self.unavailable,
        })
    }
}
