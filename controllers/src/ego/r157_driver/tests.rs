//! The reaction in time, and its outcome in a cut-in.

use super::*;

/// Control step (s).
const STEP_S: f64 = 0.04;

#[test]
fn braking_begins_after_the_delay_and_builds_up_within_its_jerk() {
    let mut reaction = Reaction::default();
    let braking: Vec<f64> = (0..50).map(|_| reaction.advance(STEP_S)).collect();
    let at = |time_s: f64| braking[(time_s / STEP_S) as usize];
    assert_eq!((at(0.0), at(0.7)), (0.4, 0.4));
    assert!(at(0.85) > 0.4 && at(0.85) < 3.0, "{}", at(0.85));
    assert!(braking.windows(2).all(|pair| pair[1] - pair[0] <= BUILD_UP_MPS3 * STEP_S + 1e-12));
    // 0.774 g is reached 0.6 s after the delay.
    assert!(at(1.2) < HARDEST_BRAKING_MPS2 && at(1.44) >= HARDEST_BRAKING_MPS2, "{braking:?}");
}

/// Returns whether the ego hits a vehicle that is `gap_m` ahead in its lane from now on, and slower by `closing_mps`.
fn collides(gap_m: f64, closing_mps: f64) -> bool {
    let (mut reaction, mut gap_m, mut closing_mps) = (Reaction::default(), gap_m, closing_mps);
    let is_at_risk = gap_m <= CRITICAL_TTC_S * closing_mps;
    while closing_mps > 0.0 && gap_m > 0.0 {
        closing_mps -= if is_at_risk { reaction.advance(0.001) * 0.001 } else { 0.0 };
        gap_m -= closing_mps * 0.001;
        if !is_at_risk && gap_m < 0.0 {
            return true;
        }
    }
    gap_m <= 0.0
}

#[test]
fn a_slow_cut_in_is_survived_and_a_fast_one_at_the_same_time_to_collision_is_not() {
    // The model stops closing in after 0.75 s of delay and a build-up of 0.6 s: at 1.9 s to collision it avoids a difference
    // of 10 m/s, and not one of 20 m/s.
    assert!(!collides(1.9 * 5.0, 5.0));
    assert!(!collides(1.9 * 10.0, 10.0));
    assert!(collides(1.9 * 20.0, 20.0));
    assert!(collides(1.0 * 10.0, 10.0));
}
