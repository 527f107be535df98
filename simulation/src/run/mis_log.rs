//! Summarises what the margin increase system (MIS) did in a run, from its commands.

use closecall_controllers::{EgoCommand, EgoState, Reason};
use closecall_traffic::{Absent, CONTROL_STEP, Measured, Time};

use closecall_scenarios::outcome::{MisSummary, Unavailability};

/// The ego at one control step, as the summary needs it.
pub(super) struct MisObservation<'a> {
    pub(super) time: Time,
    pub(super) command: &'a EgoCommand,
    pub(super) speed_mps: f64,
    pub(super) thw_front_s: Measured,
    /// True only at the first control step at which the rear vehicle is at the critical distance.
    pub(super) is_critical: bool,
    /// Why the system is not available; `None` if it is.
    pub(super) failed: Option<Reason>,
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
    last_reason: Option<Reason>,
    unavailable: Option<Unavailability>,
}

impl MisLog {
    /// Observes one control step.
    pub(super) fn observe(&mut self, now: &MisObservation<'_>) {
        self.last_reason = Some(now.command.reason);
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
        if now.is_critical {
            self.thw_front_at_critical_s.get_or_insert(now.thw_front_s);
        }
        if !is_active {
            self.released_at.get_or_insert(now.time);
        }
        if (now.is_critical || !is_active) && now.time > engaged.at {
            let lasted_s = (now.time - engaged.at).s();
            self.mean_deceleration_mps2.get_or_insert((engaged.speed_mps - now.speed_mps) / lasted_s);
        }
    }

    /// Returns the summary, or [`Absent::NoMis`] if the controller has no margin increase system.
    pub(super) fn finish(self, has_mis: bool) -> Result<MisSummary, Absent> {
        let last_reason = self.last_reason.filter(|_| has_mis).ok_or(Absent::NoMis)?;
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
            reason: engaged.map_or(last_reason, |engaged| engaged.reason),
            unavailable: self.unavailable,
        })
    }
}
