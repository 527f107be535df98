//! Summarises the actions of the margin increase system (MIS) in a run, from its commands.
//!
//! An engagement is the first command that increases the margin, with one exception. While
//! emergency braking acts, the states of the system continue beneath it, and emergency braking may
//! pause for some control steps:
//!
//! ```text
//!  emergency braking ───▶ increasing the margin ───▶ emergency braking
//!                         └ less than 0.5 s: a pause, and no engagement
//! ```
//!
//! Such a pause lies within emergency braking: it is too short for the system to build up its own
//! braking. The reasons keep every step of the pause.

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
    /// Whether the control step before it was one of emergency braking.
    is_after_braking: bool,
}

/// Time that an engagement after emergency braking must last without emergency braking. In it the
/// system builds up its whole braking: 1 m/s² within a jerk of 2 m/s³, the limits of the paper's
/// system. It is an assumption that a shorter one is a pause of emergency braking; 0.04 to 1 s are
/// plausible.
const LEAST_AFTER_BRAKING: Time = Time::from_ms(500);

/// Observes the margin increase system during a run.
#[derive(Debug, Default)]
pub(super) struct MisLog {
    engaged: Option<Engagement>,
    last_state: Option<EgoState>,
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

/// Returns the reason for an engagement. The first command after emergency braking states its end;
/// its plan has what the reason of the system would say.
fn engagement_reason(command: &EgoCommand) -> Reason {
    match (command.reason, command.plan) {
        (Reason::BrakingDone, Some(plan)) if plan.goal_in_reach => Reason::Engaged,
        (Reason::BrakingDone, Some(_)) => Reason::EngagedGoalOutOfReach,
        (reason, _) => reason,
    }
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
        let last_state = self.last_state.replace(now.command.state);
        if self.is_pause_over(now) {
            self.forget_engagement();
        }
        let is_active = matches!(now.command.state, EgoState::Increasing | EgoState::Holding);
        if self.engaged.is_none() && now.command.state == EgoState::Increasing {
            self.engaged = Some(Engagement {
                at: now.time,
                thw_front_s: now.thw_front_s,
                speed_mps: now.speed_mps,
                goal_in_reach: now.command.plan.map(|plan| plan.goal_in_reach),
                reason: engagement_reason(now.command),
                is_after_braking: last_state == Some(EgoState::EmergencyBraking),
            });
        }
        if let Some(engaged) = &mut self.engaged
            && engaged.reason == Reason::BrakingDone
            && now.command.state == EgoState::Increasing
        {
            // A command without a plan: the next one states why the system brakes.
            engaged.reason = now.command.reason;
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

    /// Returns whether emergency braking goes on so soon after the engagement that the engagement
    /// is a pause of it.
    fn is_pause_over(&self, now: &MisObservation<'_>) -> bool {
        let is_pause = |engaged: &Engagement| engaged.is_after_braking && now.time - engaged.at < LEAST_AFTER_BRAKING;
        now.command.state == EgoState::EmergencyBraking && self.engaged.as_ref().is_some_and(is_pause)
    }

    /// Forgets the engagement, and what was measured since.
    fn forget_engagement(&mut self) {
        self.engaged = None;
        self.released_at = None;
        self.thw_front_at_critical_s = None;
        self.mean_deceleration_mps2 = None;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Time headway and speed at every control step.
    const THW_S: f64 = 1.0;
    const SPEED_MPS: f64 = 30.0;

    /// Returns the summary of a run whose stack has these states for these numbers of control
    /// steps, one after the other. The vehicle behind is near from the start until a hazard at the
    /// first step of emergency braking.
    fn summary(states: &[(EgoState, Reason, usize)]) -> MisSummary {
        let mut log = MisLog::new();
        let mut time = Time::ZERO;
        for &(state, reason, steps) in states {
            for _ in 0..steps {
                let is_hazard = state == EgoState::EmergencyBraking;
                log.observe(&MisObservation {
                    time,
                    command: &EgoCommand { acceleration_mps2: 0.0, state, reason, plan: None },
                    speed_mps: SPEED_MPS,
                    thw_front_s: Ok(THW_S),
                    rear: RearObservation { near: Some(2), is_hazard, ..RearObservation::default() },
                    failed: None,
                });
                time += CONTROL_STEP;
            }
        }
        log.finish(true).unwrap()
    }

    const BRAKES: (EgoState, Reason, usize) = (EgoState::EmergencyBraking, Reason::BrakingRequired, 20);
    /// Steps of half a second, rounded up.
    const HALF_A_SECOND: usize = 13;

    fn increases(reason: Reason, steps: usize) -> (EgoState, Reason, usize) {
        (EgoState::Increasing, reason, steps)
    }

    #[test]
    fn a_pause_of_emergency_braking_is_no_engagement() {
        let off = (EgoState::Following, Reason::NoRear, 50);
        let pauses = [
            vec![increases(Reason::BrakingDone, 1)],
            vec![increases(Reason::BrakingDone, 1), increases(Reason::Engaged, HALF_A_SECOND - 2)],
            vec![increases(Reason::BrakingDone, 1), (EgoState::Releasing, Reason::RearLost, 2)],
        ];
        for pause in pauses {
            let mis = summary(&[vec![off, BRAKES], pause.clone(), vec![BRAKES]].concat());
            assert_eq!((mis.engaged_at_s, mis.reason), (Err(Absent::NeverEngaged), Reason::NoRear), "{pause:?}");
            assert_eq!(mis.released_at_s, Err(Absent::NeverEngaged), "{pause:?}");
            assert_eq!(mis.mean_deceleration_mps2, Err(Absent::NeverEngaged), "{pause:?}");
            assert_eq!(mis.reasons[2].reason, Reason::BrakingDone, "the reasons keep the pause");
        }
    }

    #[test]
    fn an_engagement_after_emergency_braking_counts_if_it_lasts_or_nothing_follows() {
        let off = (EgoState::Following, Reason::NoRear, 50);
        let at_s = Ok((CONTROL_STEP * 70).s());
        let lasts = [increases(Reason::BrakingDone, 1), increases(Reason::Engaged, HALF_A_SECOND - 1)];
        let mis = summary(&[&[off, BRAKES][..], &lasts, &[BRAKES]].concat());
        assert_eq!((mis.engaged_at_s, mis.reason), (at_s, Reason::Engaged), "it lasts half a second");
        assert!(mis.released_at_s.is_ok());
        let mis = summary(&[off, BRAKES, lasts[0]]);
        assert_eq!(mis.engaged_at_s, at_s, "no further emergency braking");
    }

    #[test]
    fn an_engagement_shortly_before_emergency_braking_counts() {
        let off = (EgoState::Following, Reason::RearUnconfirmed, 50);
        let mis = summary(&[off, increases(Reason::Engaged, 1), BRAKES]);
        assert_eq!((mis.engaged_at_s, mis.reason), (Ok((CONTROL_STEP * 50).s()), Reason::Engaged));
    }

    #[test]
    fn an_engagement_after_a_pause_counts() {
        let off = (EgoState::Following, Reason::NoRear, 50);
        let pause = increases(Reason::BrakingDone, 1);
        let mis = summary(&[off, BRAKES, pause, BRAKES, increases(Reason::Engaged, 100)]);
        assert_eq!((mis.engaged_at_s, mis.reason), (Ok((CONTROL_STEP * 91).s()), Reason::Engaged));
        assert_eq!(mis.released_at_s, Err(Absent::NotReleased));
    }
}
