//! The room that the ego needs in order to hold: enough to stop behind a lead vehicle that brakes
//! at its worst. And the room that it needs in order to defer its braking: enough to stop behind a
//! lead vehicle that goes on as it does.

use closecall_traffic::GRAVITY_MPS2;

use crate::ego::surroundings::Front;

/// Delay until braking takes effect: one control step, and twice the lag of the actuators, rounded
/// down (s). An assumption; 0.2 to 0.5 are plausible.
const BRAKING_DELAY_S: f64 = 0.3;

/// Braking that the ego is sure to achieve (m/s²): what a wet road allows, with a friction of 0.6
/// (an assumption; 0.5 to 0.7 are plausible).
const ASSURED_BRAKING_MPS2: f64 = 0.6 * GRAVITY_MPS2;

/// Gap to be left behind a standing lead vehicle (m): an assumption; 1 to 5 are plausible.
const STANDSTILL_GAP_M: f64 = 2.0;

/// Returns true if the ego at `speed_mps` can stop behind the lead vehicle in case that brakes at
/// `worst_mps2` from now on.
pub(super) fn has_room(speed_mps: f64, lead: &Front, worst_mps2: f64) -> bool {
    let lead_stopping_m = lead.speed_mps * lead.speed_mps / (2.0 * worst_mps2);
    let own_stopping_m = speed_mps * BRAKING_DELAY_S + speed_mps * speed_mps / (2.0 * ASSURED_BRAKING_MPS2);
    lead.gap_m + lead_stopping_m - own_stopping_m > STANDSTILL_GAP_M
}

/// Returns true if the ego at `speed_mps` can defer its braking for the lead vehicle: the assured
/// braking still suffices after the delay, if that vehicle goes on braking as it does.
pub(super) fn can_defer(speed_mps: f64, lead: &Front) -> bool {
    let lost_m = STANDSTILL_GAP_M + BRAKING_DELAY_S * speed_mps;
    lead.required_braking_mps2(speed_mps, lost_m) <= ASSURED_BRAKING_MPS2
}
