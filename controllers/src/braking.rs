//! The constant braking that a follower needs behind another vehicle.

/// Lower bound of the room in the calculation (m): without it the required deceleration would
/// diverge.
const MIN_ROOM_M: f64 = 0.1;

/// The situation of a vehicle behind a lead vehicle that keeps its speed, or brakes to a
/// standstill.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Behind {
    /// Speed of the own vehicle (m/s).
    pub(crate) speed_mps: f64,
    /// Speed of the lead vehicle (m/s).
    pub(crate) lead_mps: f64,
    /// Acceleration of the lead vehicle (m/s²); only braking counts.
    pub(crate) lead_mps2: f64,
    /// The part of the gap that may be used up (m).
    pub(crate) room_m: f64,
}

impl Behind {
    /// Returns the constant deceleration that uses up exactly the available room (m/s²), or 0 if
    /// none is needed.
    ///
    /// With the room r, the own speed v, and the speed v_l and braking b_l of the lead vehicle:
    ///
    /// - if the lead vehicle stops first: b = v²/(2·(r + v_l²/(2·b_l)));
    /// - otherwise, while the gap shrinks: b = b_l + (v − v_l)²/(2·r).
    pub(crate) fn required_mps2(&self) -> f64 {
        let Self { speed_mps, lead_mps, .. } = *self;
        let room_m = self.room_m.max(MIN_ROOM_M);
        let closing_mps = speed_mps - lead_mps;
        let to_match_speed_mps2 = if closing_mps > 0.0 { closing_mps * closing_mps / (2.0 * room_m) } else { 0.0 };
        let lead_braking_mps2 = -self.lead_mps2;
        if lead_braking_mps2 <= 0.0 || lead_mps <= 0.0 {
            return to_match_speed_mps2;
        }
        let to_stop_mps2 = speed_mps * speed_mps / (2.0 * (room_m + lead_mps * lead_mps / (2.0 * lead_braking_mps2)));
        // The follower stops later exactly if its braking time v/b is the longer one.
        if speed_mps * lead_braking_mps2 >= lead_mps * to_stop_mps2 {
            to_stop_mps2
        } else if closing_mps > 0.0 {
            lead_braking_mps2 + to_match_speed_mps2
        } else {
            0.0
        }
    }
}
