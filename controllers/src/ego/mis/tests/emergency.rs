//! Tests of the comfort command beneath emergency braking.

use closecall_traffic::{Check, Parameters};

use super::*;
use crate::ego::AebConfig;

/// The settings of the bench, with emergency braking.
fn with_aeb() -> EgoSettings {
    let aeb = AebConfig::default().check(&Parameters::default()).unwrap();
    EgoSettings { aeb: Some(aeb), ..Bench::SETTINGS }
}

impl Bench {
    fn with_emergency_braking() -> Self {
        let mut bench = Self::with_settings(with_aeb());
        assert_eq!(bench.step().state, EgoState::Increasing);
        bench
    }
}

#[test]
fn the_ego_lets_go_of_the_brake_when_emergency_braking_ends() {
    let mut bench = Bench::with_emergency_braking();
    // The rear vehicle is past, so that the system releases; then the lead vehicle brakes hard.
    bench.lead().state[0] = 40.0;
    bench.rear().state[0] = 1.1 * CAR_M;
    bench.rear().lane = [1.0, 0.0, 0.0];
    assert_eq!(bench.step().state, EgoState::Releasing);
    bench.lead().state[0] = 16.0;
    bench.lead().state[2] = 20.0;
    let command = bench.step();
    assert_eq!(command.state, EgoState::EmergencyBraking);
    assert!(command.acceleration_mps2 < -4.0, "{command:?}");
    // The lead vehicle is far ahead again at once. The comfort command had just begun to brake.
    bench.lead().state[0] = 60.0;
    bench.lead().state[2] = 30.0;
    let mut command = bench.step();
    while command.state == EgoState::EmergencyBraking {
        command = bench.step();
    }
    assert_eq!(command.reason, Reason::BrakingDone);
    assert!(command.acceleration_mps2 > -1.5, "{command:?}");
}

/// Lead vehicles that brake hard once: the gap (m) and the speed (m/s) for each control step.
fn hard_braking() -> Vec<[f64; 2]> {
    let far = [[60.0, 30.0]; 10];
    let near = [[16.0, 20.0]; 8];
    [&far[..], &near, &[[60.0, 30.0]; 30], &near, &[[30.0, 31.0]; 40]].concat()
}

/// The comfort command goes on beneath emergency braking. In every step without emergency braking,
/// a stack with the function therefore gives the same command as a stack without it. If the ramp
/// that releases the brake started from the command of emergency braking, the ego would still brake
/// after it.
#[test]
fn the_ramp_that_releases_the_brake_starts_from_the_comfort_command() {
    for mis in [Some(MisSettings::PAPER), None] {
        let mut with = Bench::with_emergency_braking();
        with.stack = EgoStack::new(EgoSettings { mis, ..with_aeb() });
        let mut without = Bench::with_settings(EgoSettings { mis, ..Bench::SETTINGS });
        with.time = without.time;
        let (mut braked, mut compared_after) = (0, 0);
        for [gap_m, lead_mps] in hard_braking() {
            let [with_braking, without_braking] = [&mut with, &mut without].map(|bench| {
                // The rear vehicle has passed: nothing but the lead vehicle matters.
                bench.rear().state[0] = 1.1 * CAR_M;
                bench.rear().lane = [1.0, 0.0, 0.0];
                bench.lead().state[0] = gap_m + CAR_M;
                bench.lead().state[2] = lead_mps;
                bench.step()
            });
            if with_braking.state == EgoState::EmergencyBraking {
                assert!(
                    with_braking.acceleration_mps2 <= without_braking.acceleration_mps2,
                    "{with_braking:?} {without_braking:?}"
                );
                braked += 1;
            } else {
                assert_eq!(
                    with_braking.acceleration_mps2.to_bits(),
                    without_braking.acceleration_mps2.to_bits(),
                    "{with_braking:?} {without_braking:?}"
                );
                compared_after += u32::from(braked > 0);
            }
        }
        assert!(braked > 10 && compared_after > 40, "{braked} steps of emergency braking, {compared_after} after it");
    }
}

#[test]
fn after_emergency_braking_the_system_takes_no_more_speed_while_the_front_gap_does_not_close() {
    let mut bench = Bench::with_emergency_braking();
    assert!(bench.step_for(1.0).acceleration_mps2 < -0.9, "the margin is out of reach: the system brakes in full");
    bench.lead().state[0] = 14.0 + CAR_M;
    bench.lead().state[2] = 22.0;
    assert_eq!(bench.step_for(0.5).state, EgoState::EmergencyBraking);
    // The lead vehicle is as fast as the ego again, at a gap that the cruise control need not
    // extend.
    bench.lead().state[0] = 30.0 + CAR_M;
    bench.lead().state[2] = 30.5;
    let command = bench.step_for(2.0);
    assert_eq!(command.state, EgoState::Increasing);
    assert!(command.acceleration_mps2 > -0.05, "{command:?}");
    assert_eq!(command.plan.unwrap().deceleration_mps2, 0.0);
    // As soon as the gap closes, the margin is worth speed again.
    bench.lead().state[2] = 29.0;
    assert!(bench.step_for(1.0).acceleration_mps2 < -0.9);
}

#[test]
fn the_comfort_command_starts_at_zero_and_stays_within_the_jerk_limit_of_the_acc() {
    for lead_mps in [20.0, 30.0, 40.0] {
        let mut bench = Bench::new();
        bench.tracks.truncate(1);
        let mut last_mps2 = 0.0;
        for step in 0..100 {
            // The lead vehicle appears after one second and jumps in speed after two.
            bench.tracks[0].state[0] = if step < 25 { -500.0 } else { 30.0 };
            bench.tracks[0].state[2] = if step < 50 { 30.0 } else { lead_mps };
            let now_mps2 = bench.step().acceleration_mps2;
            let jerk_mps3 = (now_mps2 - last_mps2) / CONTROL_STEP.s();
            assert!(jerk_mps3.abs() <= 2.5 + 1e-9, "step {step}: {jerk_mps3} m/s³");
            last_mps2 = now_mps2;
        }
    }
}

/// Returns the command for a lead vehicle at 10 m/s and a rear vehicle at 45 m/s, the ego driving at
/// 30 m/s. `change` changes the bench before.
fn between(mis: MisSettings, front_gap_m: f64, rear_gap_m: f64, change: fn(&mut Bench)) -> EgoCommand {
    let mut bench = Bench::with_settings(EgoSettings { mis: Some(mis), ..with_aeb() });
    bench.lead().state[0] = front_gap_m + CAR_M;
    bench.lead().state[2] = 10.0;
    bench.rear().state[0] = -rear_gap_m - CAR_M;
    bench.rear().state[2] = 45.0;
    change(&mut bench);
    bench.step()
}

#[test]
fn the_extended_system_does_not_brake_in_front_of_a_rear_vehicle_that_is_about_to_pass() {
    let extended = MisSettings::PAPER.extended();
    // The rear vehicle arrives after 1.3 s. 4.3 m/s² suffice in front, and 5.4 m/s² after the delay.
    let deferred = between(extended, 48.0, 20.0, |_| {});
    assert_ne!(deferred.state, EgoState::EmergencyBraking);
    assert!(deferred.acceleration_mps2 >= 0.0, "{deferred:?}");
    let brakes = |command: EgoCommand| {
        assert_eq!(command.state, EgoState::EmergencyBraking, "{command:?}");
        assert!(command.acceleration_mps2 < -4.0, "{command:?}");
    };
    // The paper's system leaves emergency braking alone.
    brakes(between(MisSettings::PAPER, 48.0, 20.0, |_| {}));
    // After the delay, 10 m/s² would be needed in front: more than is assured.
    brakes(between(extended, 30.0, 20.0, |_| {}));
    // The rear vehicle arrives after 2.7 s.
    brakes(between(extended, 48.0, 40.0, |_| {}));
    // It has left the lane of the ego, has no lane or no free lane to pass in, or may be no vehicle.
    brakes(between(extended, 48.0, 20.0, |bench| bench.rear().lane = [1.0, 0.0, 0.0]));
    brakes(between(extended, 48.0, 20.0, |bench| bench.lane = Lane(1)));
    brakes(between(extended, 48.0, 20.0, |bench| bench.tracks.push(track(3, -15.0, 45.0, 0))));
    brakes(between(extended, 48.0, 20.0, |bench| bench.rear().status = TrackStatus::Tentative));
    brakes(between(extended, 48.0, 20.0, |bench| bench.rear().class = ClassScores::UNKNOWN));
    brakes(between(MisSettings { hold_s: 0.0, ..extended }, 48.0, 20.0, |_| {}));
}
