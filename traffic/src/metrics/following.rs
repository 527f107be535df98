//! Metrics of one vehicle behind another, along the road. Gaps are bumper to bumper.

use crate::{Absent, Measured};

/// Time headway [s]: the time in which a vehicle at `speed_mps` covers its gap to the vehicle ahead.
///
/// 0 where the two overlap along the road.
///
/// # Errors
/// [`Absent::Standstill`] where the vehicle does not move forward.
pub fn time_headway_s(gap_m: f64, speed_mps: f64) -> Measured {
    debug_assert!(gap_m.is_finite() && speed_mps.is_finite(), "time headway of {gap_m} m at {speed_mps} m/s");
    if speed_mps <= 0.0 {
        return Err(Absent::Standstill);
    }
    Ok(or_most_critical(gap_m / speed_mps))
}

/// Time to collision [s] with the vehicle ahead, both at constant speed; 0 where they touch already.
///
/// # Errors
/// [`Absent::NotApproaching`] where there is a gap and it does not shrink.
pub fn time_to_collision_s(gap_m: f64, own_speed_mps: f64, lead_speed_mps: f64) -> Measured {
    arrival_time_s(gap_m, own_speed_mps - lead_speed_mps, 0.0, 0.0)
}

/// Time [s] after which a follower reaches the gap `critical_gap_m`, while the vehicle ahead brakes constantly.
///
/// ```text
/// t_c(a) = (−Δv + √(Δv² + 2·a·(g − d_c))) / a          Δv: closing speed, a: deceleration of the vehicle ahead
/// ```
///
/// The follower keeps its speed, and the vehicle ahead does not come to a standstill before. With a = 0 this is the
/// longitudinal time to closest encounter (g − d_c)/Δv. 0 where the gap is critical already.
///
/// # Errors
/// [`Absent::NotApproaching`] where the gap never shrinks to the critical one.
pub fn arrival_time_s(gap_m: f64, closing_mps: f64, deceleration_mps2: f64, critical_gap_m: f64) -> Measured {
    let distance_m = gap_m - critical_gap_m;
    debug_assert!(
        distance_m.is_finite() && closing_mps.is_finite() && deceleration_mps2.is_finite(),
        "arrival from {gap_m} m to {critical_gap_m} m, closing at {closing_mps} m/s and {deceleration_mps2} m/s²"
    );
    if distance_m <= 0.0 {
        return Ok(0.0);
    }
    let discriminant = closing_mps * closing_mps + 2.0 * deceleration_mps2 * distance_m;
    if discriminant < 0.0 || (closing_mps <= 0.0 && deceleration_mps2 <= 0.0) {
        return Err(Absent::NotApproaching);
    }
    // Of the two forms of the root, the one that does not cancel; the first also holds for a = 0.
    let root = discriminant.sqrt();
    Ok(or_most_critical(if closing_mps > 0.0 {
        2.0 * distance_m / (closing_mps + root)
    } else {
        (root - closing_mps) / deceleration_mps2
    }))
}

/// The smallest constant deceleration [m/s²] by which a vehicle avoids hitting the one ahead, which itself brakes at
/// `lead_deceleration_mps2` until it stands (negative: it accelerates).
///
/// Where both still move when they would meet, Δv²/(2g) more than the lead's; else the deceleration that stops the
/// vehicle at the place where the lead comes to stand. Without reaction time.
///
/// # Errors
/// [`Absent::Touching`] where there is no gap, so that no deceleration suffices; [`Absent::NotApproaching`] where none
/// is needed.
pub fn required_deceleration_mps2(
    gap_m: f64,
    own_speed_mps: f64,
    lead_speed_mps: f64,
    lead_deceleration_mps2: f64,
) -> Measured {
    debug_assert!(
        [gap_m, own_speed_mps, lead_speed_mps, lead_deceleration_mps2].iter().all(|x| x.is_finite()),
        "deceleration for {gap_m} m at {own_speed_mps} m/s behind {lead_speed_mps} m/s, {lead_deceleration_mps2} m/s²"
    );
    if gap_m <= 0.0 {
        return Err(Absent::Touching);
    }
    let closing_mps = own_speed_mps - lead_speed_mps;
    let meets_moving_lead = closing_mps > 0.0 && 2.0 * gap_m * lead_deceleration_mps2 <= closing_mps * lead_speed_mps;
    if closing_mps <= 0.0 && lead_deceleration_mps2 <= 0.0 && gap_m > 0.0 {
        return Err(Absent::NotApproaching);
    }
    let required = if meets_moving_lead {
        lead_deceleration_mps2 + closing_mps * closing_mps / (2.0 * gap_m)
    } else {
        let lead_stops_after_m = lead_speed_mps * lead_speed_mps / (2.0 * lead_deceleration_mps2);
        own_speed_mps * own_speed_mps / (2.0 * (gap_m + lead_stops_after_m))
    };
    if required <= 0.0 {
        return Err(Absent::NotApproaching);
    }
    Ok(if required.is_nan() { f64::INFINITY } else { required })
}

/// `time_s`, but 0 where it is negative or NaN.
fn or_most_critical(time_s: f64) -> f64 {
    time_s.max(0.0)
}
