//! Tests of the comfort command beneath emergency braking.

use closecall_traffic::{Check, Parameters};

use super::*;
use crate::ego::AebConfig;

impl Bench {
    fn with_emergency_braking() -> Self {
        let aeb = AebConfig::default().check(&Parameters::default()).unwrap();
        let mut bench = Self::with_settings(EgoSettings { aeb: Some(aeb), ..Self::SETTINGS });
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
