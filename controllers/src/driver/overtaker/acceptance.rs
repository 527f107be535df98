//! Is the passing lane free enough to change into it?

use crate::driver::perception::{PassingLane, Perceived};

/// Gap below which no one changes lanes in front of a follower, whatever its speed [m].
const LEAST_FOLLOWER_GAP_M: f64 = 3.0;

/// Time headway that is left to a follower in the passing lane [s].
const FOLLOWER_HEADWAY_S: f64 = 0.3;

/// By how much a lead in the passing lane has to be faster than the vehicle to be overtaken, to be worth following [m/s].
const GAIN_MPS: f64 = 1.0;

/// Share of the accepted braking below which a slow lead in the passing lane is too far ahead to matter [1].
const DOES_NOT_MATTER: f64 = 0.25;

/// What braking an overtaking driver accepts, of itself and of the follower in the passing lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerance {
    /// Of itself, for a slower lead in the passing lane [m/s²].
    pub(super) own_mps2: f64,
    /// Of the follower in the passing lane [m/s²].
    pub(super) follower_mps2: f64,
    /// Time headway that is left to that follower [s].
    pub(super) follower_headway_s: f64,
}

impl Tolerance {
    /// To pull out. A follower is not made to brake by more than 2 m/s² (the safety criterion of MOBIL: Kesting, Treiber
    /// and Helbing, Transportation Research Record 1999 (2007) 86–94, with half of its limit of 4 m/s²).
    pub(super) const TO_START: Self =
        Self { own_mps2: 1.0, follower_mps2: 2.0, follower_headway_s: FOLLOWER_HEADWAY_S };
    /// To go on once pulled out: MOBIL's limit itself.
    pub(super) const TO_GO_ON: Self =
        Self { own_mps2: 3.0, follower_mps2: 4.0, follower_headway_s: FOLLOWER_HEADWAY_S };
}

/// The overtaking driver's own side of the question.
#[derive(Clone, Copy, Debug)]
pub(super) struct Intent {
    /// Own speed [m/s].
    pub(super) speed_mps: f64,
    /// Speed of the vehicle to be overtaken [m/s].
    pub(super) slow_mps: f64,
    /// Own safe gap at its present speed [m].
    pub(super) safe_gap_m: f64,
    /// What braking is accepted.
    pub(super) tolerance: Tolerance,
}

impl Intent {
    /// True where the passing lane is free enough, and it is worth to change into it.
    pub(super) fn accepts(&self, lane: &PassingLane) -> bool {
        self.allows(lane) && lane.lead.as_ref().is_none_or(|lead| self.gains(lead))
    }

    /// True where a lane is free enough.
    pub(super) fn allows(&self, lane: &PassingLane) -> bool {
        !lane.alongside
            && lane.lead.as_ref().is_none_or(|lead| self.allows_lead(lead))
            && lane.follower.as_ref().is_none_or(|follower| self.accepts_follower(follower))
    }

    fn room_and_closing(&self, seen: &Perceived) -> (f64, f64) {
        (seen.lead.gap_m - self.safe_gap_m, (self.speed_mps - seen.lead.speed_mps).max(0.0))
    }

    fn allows_lead(&self, seen: &Perceived) -> bool {
        let (room_m, closing_mps) = self.room_and_closing(seen);
        room_m > 0.0 && closing_mps * closing_mps <= 2.0 * room_m * self.tolerance.own_mps2
    }

    /// A lead in the passing lane that is no faster than the vehicle to be overtaken gains nothing, unless it is so far
    /// ahead that it will not matter.
    fn gains(&self, seen: &Perceived) -> bool {
        let (room_m, closing_mps) = self.room_and_closing(seen);
        seen.lead.speed_mps >= self.slow_mps + GAIN_MPS
            || room_m > closing_mps * closing_mps / (2.0 * DOES_NOT_MATTER * self.tolerance.own_mps2)
    }

    fn accepts_follower(&self, seen: &Perceived) -> bool {
        let room_m = seen.lead.gap_m - LEAST_FOLLOWER_GAP_M - self.tolerance.follower_headway_s * seen.lead.speed_mps;
        let closing_mps = (seen.lead.speed_mps - self.speed_mps).max(0.0);
        room_m > 0.0 && closing_mps * closing_mps <= 2.0 * room_m * self.tolerance.follower_mps2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::Lead;

    fn seen(gap_m: f64, speed_mps: f64) -> Perceived {
        let lead = Lead { gap_m, speed_mps, acceleration_mps2: 0.0 };
        Perceived { actor: 3, lead, brake_light: false, width_m: 1.85, d_m: -1.875 }
    }

    const INTENT: Intent = Intent { speed_mps: 38.0, slow_mps: 30.0, safe_gap_m: 4.0, tolerance: Tolerance::TO_START };

    #[test]
    fn an_empty_lane_is_accepted_and_one_alongside_is_not() {
        assert!(INTENT.accepts(&PassingLane::default()));
        assert!(!INTENT.accepts(&PassingLane { alongside: true, ..PassingLane::default() }));
    }

    #[test]
    fn a_slow_or_near_lead_is_not_accepted() {
        let lane = |lead| PassingLane { lead: Some(lead), ..PassingLane::default() };
        assert!(INTENT.accepts(&lane(seen(30.0, 38.0))));
        assert!(!INTENT.accepts(&lane(seen(30.0, 29.0))));
        assert!(!INTENT.accepts(&lane(seen(3.0, 40.0))));
        assert!(!INTENT.accepts(&lane(seen(f64::NAN, 40.0))));
    }

    #[test]
    fn a_fast_or_near_follower_is_not_accepted() {
        let lane = |follower| PassingLane { follower: Some(follower), ..PassingLane::default() };
        assert!(INTENT.accepts(&lane(seen(40.0, 40.0))));
        assert!(!INTENT.accepts(&lane(seen(10.0, 40.0))));
        assert!(!INTENT.accepts(&lane(seen(40.0, 55.0))));
    }
}
