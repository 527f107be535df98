//! Gap acceptance: whether an adjacent lane is free enough to change into it.

use crate::driver::perception::{PerceivedLane, PerceivedVehicle};

/// Smallest gap to a follower that a driver accepts, whatever its speed (m): an assumption; 0.5
/// (the default of Vissim) to 5 are plausible.
const MIN_FOLLOWER_GAP_M: f64 = 3.0;

/// Time headway left to a follower in the passing lane (s): an assumption; 0 to 1 are plausible.
pub(in crate::driver) const FOLLOWER_HEADWAY_S: f64 = 0.3;

/// Least gain of speed for which a driver overtakes (m/s). The own desired speed and the speed of a
/// lead vehicle in the passing lane must both exceed the speed of the vehicle to overtake by this
/// amount. An assumption; 0.5 to 2.8 are plausible. German law asks for a speed that is
/// *substantially higher* (StVO § 5 (2)); courts take 10 km/h for trucks (OLG Hamm, 4 Ss OWi
/// 629/08).
pub(super) const MIN_GAIN_MPS: f64 = 1.0;

/// Share of the accepted own braking below which a slow lead vehicle in the passing lane is too far
/// ahead to matter: an assumption; 0.1 to 0.5 are plausible.
const IRRELEVANT_LEAD_BRAKING_SHARE: f64 = 0.25;

/// Braking that a driver who changes lanes accepts, of itself and of the follower in the adjacent
/// lane.
#[derive(Clone, Copy, Debug)]
pub(in crate::driver) struct Tolerance {
    /// Accepted own braking behind a slower lead vehicle in the adjacent lane (m/s²).
    pub(in crate::driver) own_mps2: f64,
    /// Accepted braking of the follower in the adjacent lane (m/s²).
    pub(in crate::driver) follower_mps2: f64,
    /// Time headway left to that follower (s).
    pub(in crate::driver) follower_headway_s: f64,
}

impl Tolerance {
    /// Tolerance for pulling out. A follower need not brake by more than 2 m/s²: half of the limit
    /// of MOBIL's safety criterion, 4 m/s² (Kesting, Treiber and Helbing, Transportation Research
    /// Record 1999 (2007) 86–94). The half is an assumption, as is the own braking; Vissim's
    /// defaults are 1 to 4 m/s².
    pub(super) const TO_START: Self =
        Self { own_mps2: 1.0, follower_mps2: 2.0, follower_headway_s: FOLLOWER_HEADWAY_S };
    /// Tolerance for continuing after pulling out: MOBIL's limit itself. The own braking is an
    /// assumption.
    pub(super) const TO_CONTINUE: Self =
        Self { own_mps2: 3.0, follower_mps2: 4.0, follower_headway_s: FOLLOWER_HEADWAY_S };
}

/// The criterion by which a driver accepts an adjacent lane.
#[derive(Clone, Copy, Debug)]
pub(in crate::driver) struct GapAcceptance {
    /// Own speed (m/s).
    pub(in crate::driver) speed_mps: f64,
    /// Speed of the vehicle to overtake (m/s).
    pub(in crate::driver) overtaken_mps: f64,
    /// Own safe gap at the present speed (m).
    pub(in crate::driver) safe_gap_m: f64,
    /// Accepted braking.
    pub(in crate::driver) tolerance: Tolerance,
}

impl GapAcceptance {
    /// Returns true if the lane is free enough and a change into it is worthwhile.
    pub(super) fn accepts(&self, lane: &PerceivedLane) -> bool {
        self.is_free(lane) && lane.lead.as_ref().is_none_or(|lead| self.gains_speed(lead))
    }

    /// Returns true if the lane is free enough.
    pub(in crate::driver) fn is_free(&self, lane: &PerceivedLane) -> bool {
        !lane.alongside
            && lane.lead.as_ref().is_none_or(|lead| self.accepts_lead(lead))
            && lane.follower.as_ref().is_none_or(|follower| self.accepts_follower(follower))
    }

    /// Returns the distance to a lead vehicle beyond the safe gap (m) and the closing speed (m/s).
    fn room_and_closing(&self, vehicle: &PerceivedVehicle) -> (f64, f64) {
        (vehicle.lead.gap_m - self.safe_gap_m, (self.speed_mps - vehicle.lead.speed_mps).max(0.0))
    }

    fn accepts_lead(&self, vehicle: &PerceivedVehicle) -> bool {
        let (room_m, closing_mps) = self.room_and_closing(vehicle);
        room_m > 0.0 && closing_mps * closing_mps <= 2.0 * room_m * self.tolerance.own_mps2
    }

    /// Returns true if the change gains speed: the lead vehicle in the lane is faster than the
    /// vehicle to overtake, or so far ahead that it does not matter.
    fn gains_speed(&self, vehicle: &PerceivedVehicle) -> bool {
        let (room_m, closing_mps) = self.room_and_closing(vehicle);
        vehicle.lead.speed_mps >= self.overtaken_mps + MIN_GAIN_MPS
            || room_m > closing_mps * closing_mps / (2.0 * IRRELEVANT_LEAD_BRAKING_SHARE * self.tolerance.own_mps2)
    }

    fn accepts_follower(&self, vehicle: &PerceivedVehicle) -> bool {
        let room_m =
            vehicle.lead.gap_m - MIN_FOLLOWER_GAP_M - self.tolerance.follower_headway_s * vehicle.lead.speed_mps;
        let closing_mps = (vehicle.lead.speed_mps - self.speed_mps).max(0.0);
        room_m > 0.0 && closing_mps * closing_mps <= 2.0 * room_m * self.tolerance.follower_mps2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::Lead;

    fn vehicle(gap_m: f64, speed_mps: f64) -> PerceivedVehicle {
        let lead = Lead { gap_m, speed_mps, acceleration_mps2: 0.0 };
        PerceivedVehicle { actor: 3, lead, brake_light: false, width_m: 1.85, d_m: -1.875 }
    }

    const ACCEPTANCE: GapAcceptance =
        GapAcceptance { speed_mps: 38.0, overtaken_mps: 30.0, safe_gap_m: 4.0, tolerance: Tolerance::TO_START };

    #[test]
    fn an_empty_lane_is_accepted_and_a_vehicle_alongside_is_not() {
        assert!(ACCEPTANCE.accepts(&PerceivedLane::default()));
        assert!(!ACCEPTANCE.accepts(&PerceivedLane { alongside: true, ..PerceivedLane::default() }));
    }

    #[test]
    fn a_slow_or_near_lead_vehicle_is_not_accepted() {
        let lane = |lead| PerceivedLane { lead: Some(lead), ..PerceivedLane::default() };
        assert!(ACCEPTANCE.accepts(&lane(vehicle(30.0, 38.0))));
        assert!(!ACCEPTANCE.accepts(&lane(vehicle(30.0, 29.0))));
        assert!(!ACCEPTANCE.accepts(&lane(vehicle(3.0, 40.0))));
        assert!(!ACCEPTANCE.accepts(&lane(vehicle(f64::NAN, 40.0))));
    }

    #[test]
    fn a_fast_or_near_follower_is_not_accepted() {
        let lane = |follower| PerceivedLane { follower: Some(follower), ..PerceivedLane::default() };
        assert!(ACCEPTANCE.accepts(&lane(vehicle(40.0, 40.0))));
        assert!(!ACCEPTANCE.accepts(&lane(vehicle(10.0, 40.0))));
        assert!(!ACCEPTANCE.accepts(&lane(vehicle(40.0, 55.0))));
    }
}
