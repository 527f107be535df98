//! The constant braking that keeps a vehicle behind another one.

/// Room below which no required deceleration is worked out [m]: it would diverge.
const LEAST_ROOM_M: f64 = 0.1;

/// A vehicle behind another one that brakes, or keeps its speed, until it stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Behind {
    /// Own speed [m/s].
    pub(crate) speed_mps: f64,
    /// Speed of the vehicle ahead [m/s].
    pub(crate) lead_mps: f64,
    /// Its acceleration [m/s²]; only braking counts.
    pub(crate) lead_mps2: f64,
    /// The gap that may be used up [m].
    pub(crate) room_m: f64,
}

impl Behind {
    /// The constant deceleration with which the room is just used up [m/s²]; 0 where none is needed.
    ///
    /// With the room r, speeds v and v_l and the braking b_l of the vehicle ahead:
    ///
    /// - where it stands first: b = v²/(2·(r + v_l²/(2·b_l)));
    /// - else, while closing: b = b_l + (v − v_l)²/(2·r).
    pub(crate) fn required_mps2(&self) -> f64 {
        let Self { speed_mps, lead_mps, .. } = *self;
        let room_m = self.room_m.max(LEAST_ROOM_M);
        let closing_mps = speed_mps - lead_mps;
        let removing = if closing_mps > 0.0 { closing_mps * closing_mps / (2.0 * room_m) } else { 0.0 };
        let braking = -self.lead_mps2;
        if braking <= 0.0 || lead_mps <= 0.0 {
            return removing;
        }
        let to_stop = speed_mps * speed_mps / (2.0 * (room_m + lead_mps * lead_mps / (2.0 * braking)));
        // The one behind stands later exactly where its braking time v/b is the longer one.
        if speed_mps * braking >= lead_mps * to_stop {
            to_stop
        } else if closing_mps > 0.0 {
            braking + removing
        } else {
            0.0
        }
    }
}
