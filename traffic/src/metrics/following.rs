//! Metrics of a vehicle that follows another along the road. Gaps are measured bumper to bumper.

use crate::{Absent, Measured};

/// Time headway below which it is critical (s); the paper's threshold.
pub const CRITICAL_THW_S: f64 = 0.9;

/// Returns the distance between the centres of two vehicles of these lengths (m) if one touches the
/// other from behind.
pub const fn touching_distance_m(length_m: f64, other_length_m: f64) -> f64 {
    0.5 * (length_m + other_length_m)
}

/// Returns the gap, bumper to bumper, between two vehicles whose centres are `distance_m` apart
/// along the road (m).
///
/// It is negative if the two overlap along the road.
pub const fn bumper_gap_m(distance_m: f64, length_m: f64, other_length_m: f64) -> f64 {
    distance_m - touching_distance_m(length_m, other_length_m)
}

/// Returns the time headway (s): the time that a vehicle at `speed_mps` needs to cover its gap to
/// the vehicle ahead.
///
/// The result is 0 if the two vehicles overlap along the road.
///
/// # Errors
/// [`Absent::Standstill`] if the vehicle does not move forward.
pub fn time_headway_s(gap_m: f64, speed_mps: f64) -> Measured {
    debug_assert!(gap_m.is_finite() && speed_mps.is_finite(), "time headway of {gap_m} m at {speed_mps} m/s");
    if speed_mps <= 0.0 {
        return Err(Absent::Standstill);
    }
    Ok(or_most_critical(gap_m / speed_mps))
}

/// Returns the time to collision (s) with the vehicle ahead if both keep their speeds; 0 if they
/// touch already.
///
/// # Errors
/// [`Absent::NotApproaching`] if there is a gap and it does not shrink.
pub fn time_to_collision_s(gap_m: f64, own_speed_mps: f64, lead_speed_mps: f64) -> Measured {
    arrival_time_s(gap_m, own_speed_mps - lead_speed_mps, 0.0, 0.0)
}

/// Returns the time (s) after which a follower reaches the gap `critical_gap_m` while the vehicle
/// ahead brakes constantly.
///
/// ```text
/// t_c(a) = (−Δv + √(Δv² + 2·a·(g − d_c))) / a          Δv: closing speed, a: deceleration of the vehicle ahead,
///                                                      g: gap, d_c: critical gap
/// ```
///
/// The formula assumes that the follower keeps its speed and that the vehicle ahead does not stop
/// before. With a = 0 the result is the longitudinal time to closest encounter (g − d_c)/Δv. It is
/// 0 if the gap is critical already.
///
/// # Errors
/// [`Absent::NotApproaching`] if the gap never shrinks to the critical one.
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
    // Of the two equivalent forms of the root, each branch takes the form without cancellation; the
    // first also holds for a = 0.
    let root = discriminant.sqrt();
    Ok(or_most_critical(if closing_mps > 0.0 {
        2.0 * distance_m / (closing_mps + root)
    } else {
        (root - closing_mps) / deceleration_mps2
    }))
}

/// Returns the smallest constant deceleration (m/s²) with which a vehicle avoids a collision with
/// the vehicle ahead, which itself brakes at `lead_deceleration_mps2` to a standstill (negative: it
/// accelerates).
///
/// If both vehicles would still be moving when they meet, the result is the deceleration of the
/// vehicle ahead plus Δv²/(2g). Otherwise it is the deceleration that stops the vehicle where the
/// vehicle ahead comes to a standstill. No reaction time is included.
///
/// # Errors
/// [`Absent::Touching`] if there is no gap, so that no deceleration suffices;
/// [`Absent::NotApproaching`] if none is needed.
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

/// Returns `time_s`, or 0 if it is negative or NaN.
fn or_most_critical(time_s: f64) -> f64 {
    time_s.max(0.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns the smallest gap to the lead vehicle (m) over small steps of time, each vehicle
    /// braking to a standstill.
    fn smallest_gap_m(gap_m: f64, follower: (f64, f64), lead: (f64, f64)) -> f64 {
        let travelled_m = |(speed, deceleration): (f64, f64), time: f64| {
            let time = if deceleration > 0.0 { time.min(speed / deceleration) } else { time };
            speed * time - 0.5 * deceleration * time * time
        };
        let gap_at = |step: i32| {
            let time = f64::from(step) * 0.01;
            gap_m + travelled_m(lead, time) - travelled_m(follower, time)
        };
        (0..10_000).map(gap_at).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn headway_in_closed_form() {
        assert_eq!(time_headway_s(21.0, 30.0), Ok(0.7));
        assert_eq!(time_headway_s(-0.5, 30.0), Ok(0.0), "side by side in one lane is the most critical headway");
        assert_eq!(time_headway_s(21.0, 0.0), Err(Absent::Standstill));
        assert_eq!(time_headway_s(21.0, -1.0), Err(Absent::Standstill));
    }

    #[test]
    fn time_to_collision_in_closed_form() {
        assert_eq!(time_to_collision_s(50.0, 35.0, 30.0), Ok(10.0));
        assert_eq!(time_to_collision_s(50.0, 30.0, 30.0), Err(Absent::NotApproaching));
        assert_eq!(time_to_collision_s(0.0, 20.0, 30.0), Ok(0.0));
    }

    /// A case computed by hand. E, at 30 m/s with a front time headway of 0.7 s, brakes at 1 m/s²
    /// from the detection of R at 100 m, closing at 24 km/h, until R is 5 m behind: −20/3 +
    /// √((20/3)² + 190) = 8.645 s.
    #[test]
    fn the_papers_reference_point_gains_two_seconds_of_headway() {
        let arrival_s = arrival_time_s(100.0, 24.0 / 3.6, 1.0, 5.0).unwrap();
        assert!((arrival_s - 8.645).abs() < 1e-3, "{arrival_s}");
        let front_gap_m = 0.7 * 30.0 + 0.5 * arrival_s * arrival_s;
        let headway_s = time_headway_s(front_gap_m, 30.0 - arrival_s).unwrap();
        assert!((headway_s - 2.7).abs() < 0.05, "{headway_s}");
    }

    #[test]
    fn a_follower_that_falls_back_arrives_once_the_lead_has_braked() {
        // Closing at −2 m/s, braking at 1 m/s², 16 m to go: −2t + t²/2 = 16 at t = 8 s.
        assert_eq!(arrival_time_s(21.0, -2.0, 1.0, 5.0), Ok(8.0));
        assert_eq!(arrival_time_s(21.0, -2.0, 0.0, 5.0), Err(Absent::NotApproaching));
        // A lead vehicle that accelerates at 1 m/s² escapes a follower that closes in at 5 m/s if
        // the gap exceeds 12.5 m.
        assert_eq!(arrival_time_s(12.5, 5.0, -1.0, 0.0), Ok(5.0));
        assert_eq!(arrival_time_s(12.6, 5.0, -1.0, 0.0), Err(Absent::NotApproaching));
    }

    #[test]
    fn required_deceleration_in_closed_form() {
        assert_eq!(required_deceleration_mps2(25.0, 30.0, 20.0, 0.0), Ok(2.0));
        assert_eq!(required_deceleration_mps2(50.0, 20.0, 0.0, 0.0), Ok(4.0), "a standing lead");
        assert_eq!(required_deceleration_mps2(25.0, 30.0, 20.0, 1.0), Ok(3.0), "met while it still moves");
        // The lead vehicle stops after 20²/(2·8) = 25 m: 30²/(2·(25 + 25)).
        assert_eq!(required_deceleration_mps2(25.0, 30.0, 20.0, 8.0), Ok(9.0));
        assert_eq!(required_deceleration_mps2(25.0, 20.0, 20.0, 0.0), Err(Absent::NotApproaching));
        assert_eq!(required_deceleration_mps2(25.0, 21.0, 20.0, -1.0), Err(Absent::NotApproaching));
        assert_eq!(required_deceleration_mps2(0.0, 30.0, 20.0, 0.0), Err(Absent::Touching));
    }

    #[cfg(not(debug_assertions))]
    #[test]
    fn nan_never_looks_safe() {
        let nan = f64::NAN;
        assert_eq!(time_headway_s(nan, 30.0), Ok(0.0));
        assert_eq!(time_headway_s(20.0, nan), Ok(0.0));
        for [gap, ego, lead] in [[nan, 30.0, 20.0], [50.0, nan, 20.0], [50.0, 30.0, nan], [nan, nan, nan]] {
            assert_eq!(time_to_collision_s(gap, ego, lead), Ok(0.0));
            for lead_deceleration in [0.0, 4.0, -1.0, nan] {
                let required = required_deceleration_mps2(gap, ego, lead, lead_deceleration);
                assert_eq!(required, Ok(f64::INFINITY), "{gap} {ego} {lead} {lead_deceleration}");
            }
        }
        assert_eq!(required_deceleration_mps2(50.0, 30.0, 20.0, nan), Ok(f64::INFINITY));
        assert_eq!(arrival_time_s(50.0, 5.0, nan, 5.0), Ok(0.0));
        assert_eq!(arrival_time_s(50.0, -5.0, nan, 5.0), Ok(0.0));
        assert_eq!(arrival_time_s(50.0, nan, 1.0, 5.0), Ok(0.0));
    }

    proptest! {
        #[test]
        fn at_the_arrival_the_gap_is_the_critical_gap(
            gap in 5.0..200.0, closing in -10.0..20.0, deceleration in -0.5..5.0, critical in 0.0..10.0,
        ) {
            if let Ok(time) = arrival_time_s(gap, closing, deceleration, critical) {
                let gap_then = gap - closing * time - 0.5 * deceleration * time * time;
                prop_assert!(time >= 0.0);
                prop_assert!((gap_then - critical.min(gap)).abs() < 1e-6 * (1.0 + time * time));
            }
        }

        #[test]
        fn a_larger_gap_is_never_more_critical(
            gap in 0.1..100.0, more in 0.1..50.0, ego in 10.0..40.0, lead in 0.0..40.0, lead_deceleration in -1.0..8.0,
        ) {
            prop_assert!(time_headway_s(gap, ego).unwrap() < time_headway_s(gap + more, ego).unwrap());
            if let Ok(time) = time_to_collision_s(gap, ego, lead) {
                prop_assert!(time < time_to_collision_s(gap + more, ego, lead).unwrap());
            }
            let required = |gap| required_deceleration_mps2(gap, ego, lead, lead_deceleration).unwrap_or(0.0);
            prop_assert!(required(gap + more) <= required(gap) * (1.0 + 1e-12));
        }

        #[test]
        fn the_required_deceleration_just_suffices(
            gap in 1.0..80.0, ego in 5.0..40.0, lead in 0.0..40.0, lead_deceleration in 0.0..9.0,
        ) {
            if let Ok(required) = required_deceleration_mps2(gap, ego, lead, lead_deceleration) {
                let smallest = |own_deceleration| smallest_gap_m(gap, (ego, own_deceleration), (lead, lead_deceleration));
                prop_assert!(smallest(required * 1.001) > -1e-6);
                prop_assert!(smallest(required * 0.95) < 0.0 || ego / required > 90.0);
            }
        }
    }
}
