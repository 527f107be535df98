use proptest::prelude::*;

use super::*;
use crate::driver::wiedemann99::Wiedemann99;

/// Hardest braking of the driver (m/s²).
const HARDEST_MPS2: f64 = 8.0;

fn settings(cc1_s: f64) -> Wiedemann99 {
    let parameters = Parameters99 { cc1_s, ..Parameters99::VISSIM };
    let none = closecall_traffic::Parameters::default();
    let default = closecall_traffic::Check::check(&crate::driver::Wiedemann99Config::default(), &none).unwrap();
    Wiedemann99 { parameters, hardest_braking_mps2: HARDEST_MPS2, ..default }
}

/// A driver behind a lead vehicle. The actual acceleration follows the desired one with the
/// actuator lag of 0.15 s.
#[derive(Clone, Copy)]
struct Pair {
    gap_m: f64,
    speed_mps: f64,
    actual_mps2: f64,
}

/// Simulates 120 s behind a lead vehicle with the given acceleration over time, and returns the gap
/// at each step.
fn drive(cc1_s: f64, mut pair: Pair, mut lead_mps: f64, step_s: f64, lead_mps2: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut model = Wiedemann99Model::new(&settings(cc1_s));
    let steps = (120.0 / step_s).round() as usize;
    let mut gaps = Vec::with_capacity(steps);
    for step in 0..steps {
        let lead_mps2 = if lead_mps > 0.0 { lead_mps2(step as f64 * step_s) } else { 0.0 };
        let lead = Lead { gap_m: pair.gap_m, speed_mps: lead_mps, acceleration_mps2: lead_mps2 };
        let requested_mps2 = model.acceleration_mps2(pair.speed_mps, 36.0, Some(&lead));
        pair.actual_mps2 += (step_s / 0.15).min(1.0) * (requested_mps2 - pair.actual_mps2);
        let own_mps = (pair.speed_mps + step_s * pair.actual_mps2).max(0.0);
        let lead_next_mps = f64::max(lead_mps + step_s * lead_mps2, 0.0);
        pair.gap_m += 0.5 * step_s * (lead_mps + lead_next_mps - own_mps - pair.speed_mps);
        (pair.speed_mps, lead_mps) = (own_mps, lead_next_mps);
        gaps.push(pair.gap_m);
    }
    gaps
}

const APPROACH: Pair = Pair { gap_m: 120.0, speed_mps: 36.0, actual_mps2: 0.0 };

#[test]
fn behind_a_lead_vehicle_at_constant_speed_the_gap_settles_into_its_band() {
    for speed_mps in [20.0, 30.0] {
        for cc1_s in [0.2, 0.4, 0.6, 0.9, 1.5] {
            let safe_m = 1.5 + cc1_s * speed_mps;
            for step_s in [0.01, 0.02, 0.04, 0.1] {
                let gaps = drive(cc1_s, APPROACH, speed_mps, step_s, |_| 0.0);
                let settled = &gaps[gaps.len() / 2..];
                let least = settled.iter().copied().fold(f64::INFINITY, f64::min);
                let most = settled.iter().copied().fold(0.0, f64::max);
                // The coarsest step allows an overshoot of 0.25 m. At steps up to 0.04 s, only the
                // actuator lag causes overshoot.
                let overshoot_m = if step_s > 0.05 { 0.25 } else { 0.1 };
                assert!(
                    least > safe_m - overshoot_m && most < safe_m + 4.0 + overshoot_m,
                    "{speed_mps} m/s, cc1 {cc1_s} s, step {step_s} s: {least} to {most} around {safe_m}"
                );
                let overall = gaps.iter().copied().fold(f64::INFINITY, f64::min);
                assert!(overall > safe_m - 1.0, "{speed_mps} {cc1_s} {step_s}: {overall} below {safe_m}");
            }
        }
    }
}

#[test]
fn it_does_not_hit_a_braking_lead_vehicle() {
    for cc1_s in [0.4, 0.9, 1.5] {
        let start = Pair { gap_m: 2.5 + cc1_s * 30.0, speed_mps: 30.0, actual_mps2: 0.0 };
        for braking in [2.0, 4.0, 6.0] {
            let gaps = drive(cc1_s, start, 30.0, 0.01, |t| if t > 5.0 { -braking } else { 0.0 });
            let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
            assert!(least > 0.5, "cc1 {cc1_s} s, braking {braking} m/s²: {least} m");
        }
    }
}

#[test]
fn free_acceleration_is_cc8_at_standstill_and_cc9_at_80_kmh() {
    let mut model = Wiedemann99Model::new(&settings(0.9));
    assert_eq!(model.acceleration_mps2(0.0, 36.0, None), 3.5);
    assert!((model.acceleration_mps2(CC9_SPEED_MPS, 36.0, None) - 1.5).abs() < 1e-12);
    assert_eq!(model.acceleration_mps2(36.0, 36.0, None), 0.0);
}

#[test]
fn the_regimes_agree_with_the_table() {
    let mut model = Wiedemann99Model::new(&settings(0.9));
    let mut regime = |gap_m, opening_mps| {
        let lead = Lead { gap_m, speed_mps: 30.0 + opening_mps, acceleration_mps2: 0.0 };
        model.acceleration_mps2(30.0, 36.0, Some(&lead));
        model.regime()
    };
    assert_eq!(regime(150.0, 0.0), Regime::Free);
    assert_eq!(regime(60.0, -10.0), Regime::Approaching);
    assert_eq!(regime(30.0, 0.0), Regime::Following);
    assert_eq!(regime(30.0, 5.0), Regime::Free);
    assert_eq!(regime(15.0, -5.0), Regime::Emergency);
}

/// Returns the gap every 0.2 s during the approach and the first oscillations of following (m).
fn approach_gaps(cc1_s: f64, speed_mps: f64, step_s: f64) -> Vec<f64> {
    let gaps = drive(cc1_s, APPROACH, speed_mps, step_s, |_| 0.0);
    let every = (0.2 / step_s).round() as usize;
    gaps.into_iter().skip(every - 1).step_by(every).take(200).collect()
}

#[test]
fn the_trajectory_converges_with_smaller_steps() {
    for (cc1_s, speed_mps) in [(0.2, 20.0), (0.4, 30.0), (0.9, 30.0), (1.5, 20.0)] {
        let reference = approach_gaps(cc1_s, speed_mps, 0.0025);
        let mut errors_m = Vec::new();
        for step_s in [0.1, 0.04, 0.02, 0.01] {
            let gaps = approach_gaps(cc1_s, speed_mps, step_s);
            let worst = gaps.iter().zip(&reference).map(|(gap, exact)| (gap - exact).abs()).fold(0.0, f64::max);
            errors_m.push(worst);
        }
        // First-order convergence: the error is bounded by a constant times the step.
        for (error, step_s) in errors_m.iter().zip([0.1, 0.04, 0.02, 0.01]) {
            assert!(*error < 10.0 * step_s, "cc1 {cc1_s} s, {speed_mps} m/s: {errors_m:?}");
        }
        assert!(errors_m[3] < 0.5 * errors_m[0], "cc1 {cc1_s} s, {speed_mps} m/s: {errors_m:?}");
    }
}

#[test]
fn a_driver_who_notices_closing_late_does_not_brake_hard_at_the_safe_gap() {
    let mut model = Wiedemann99Model::new(&settings(1.5));
    let lead = Lead { gap_m: 46.6, speed_mps: 30.0, acceleration_mps2: 0.0 };
    // 0.1 m above the safe gap and 4 m/s too fast: keeping the safe gap would need 160 m/s².
    let requested_mps2 = model.acceleration_mps2(34.0, 36.0, Some(&lead));
    assert_eq!(model.regime(), Regime::Approaching);
    assert!((requested_mps2 + COMFORTABLE_MPS2).abs() < 1e-12, "{requested_mps2}");
}

proptest! {
    /// The acceleration is continuous across the safe gap at every closing speed.
    #[test]
    fn the_acceleration_is_continuous_at_the_safe_gap(
        closing in 1.0..15.0, lead_mps in 0.0..40.0, lead_mps2 in -8.0..0.0, cc1 in 0.0..2.0,
    ) {
        let at = |gap_m: f64| {
            let lead = Lead { gap_m, speed_mps: lead_mps, acceleration_mps2: lead_mps2 };
            // The first step makes the driver notice the closing; the second one reacts.
            let mut model = Wiedemann99Model::new(&settings(cc1));
            model.acceleration_mps2(lead_mps + 30.0, 60.0, Some(&lead));
            (model.acceleration_mps2(lead_mps + closing, 60.0, Some(&lead)), model.regime())
        };
        let safe_m = 1.5 + cc1 * lead_mps;
        let (above, below) = (at(safe_m + 1e-6), at(safe_m - 1e-6));
        prop_assert_eq!((above.1, below.1), (Regime::Approaching, Regime::Emergency));
        prop_assert!((above.0 - below.0).abs() < 1e-3, "{above:?} {below:?}");
    }

    #[test]
    fn accelerations_are_bounded_everywhere(
        gap in -5.0..200.0, speed in 0.0..50.0, lead_mps in 0.0..50.0, lead_mps2 in -10.0..5.0, cc1 in 0.0..2.0,
    ) {
        let lead = Lead { gap_m: gap, speed_mps: lead_mps, acceleration_mps2: lead_mps2 };
        let requested_mps2 = Wiedemann99Model::new(&settings(cc1)).acceleration_mps2(speed, 36.0, Some(&lead));
        prop_assert!((-HARDEST_MPS2..=3.5).contains(&requested_mps2), "{requested_mps2}");
    }
}
