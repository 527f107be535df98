//! Tests of the engaged system: holding, tolerance of losses, sensor failures, comfort.

use closecall_traffic::GRAVITY_MPS2;

use super::*;

#[test]
fn holding_begins_at_the_critical_distance_and_ends_after_two_seconds() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.rear().state[0] = -5.0 - CAR_M;
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Holding, Reason::CriticalDistance));
    // The lead vehicle brakes. The ego still holds while there is room.
    bench.lead().state[2] = 27.0;
    let command = bench.step_for(1.0);
    assert_eq!(command.state, EgoState::Holding);
    assert!(command.acceleration_mps2.abs() < 1e-9, "{command:?}");
    bench.assert_released(1.2, Reason::HoldExpired);
}

#[test]
fn holding_needs_room_for_the_worst_braking_of_the_lead_vehicle() {
    // At the time headway of following there is no room, so that holding does not even begin.
    let mut bench = Bench::engaged();
    bench.rear().state[0] = -5.0 - CAR_M;
    bench.assert_released(0.0, Reason::NoRoomToHold);

    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.rear().state[0] = -5.0 - CAR_M;
    assert_eq!(bench.step().state, EgoState::Holding);
    bench.lead().state[0] = 15.0;
    bench.lead().state[2] = 20.0;
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Releasing, Reason::NoRoomToHold));
    // The ACC brakes as strongly as it may, within its jerk limit.
    assert!(command.acceleration_mps2 < 0.0, "{command:?}");
    let command = bench.step_for(3.5 / 2.5);
    assert_eq!(command.acceleration_mps2, -3.5);
}

/// Finds the gaps at which the ego may just hold by time-stepping the worst case: the lead vehicle
/// brakes at 8 m/s² at once, the ego 0.3 s later at 0.6·g, and 2 m are left.
#[test]
fn it_holds_exactly_if_the_worst_case_leaves_room() {
    let left_m = |gap_m: f64, lead_mps: f64| {
        let (mut gap, mut lead, mut ego, step_s) = (gap_m, lead_mps, 30.0_f64, 1e-4);
        let mut time_s = 0.0;
        while ego > 0.0 {
            gap += (lead - ego) * step_s;
            lead = f64::max(lead - 8.0 * step_s, 0.0);
            ego -= if time_s < 0.3 { 0.0 } else { 0.6 * GRAVITY_MPS2 * step_s };
            time_s += step_s;
        }
        gap
    };
    for lead_mps in [20.0, 25.0, 30.0] {
        for gap_m in (20..80).map(f64::from) {
            let left = left_m(gap_m, lead_mps);
            if (left - 2.0).abs() < 0.1 {
                continue;
            }
            let mut bench = Bench::engaged();
            bench.lead().state = [gap_m + CAR_M, 0.0, lead_mps, 0.0].into();
            bench.rear().state[0] = -5.0 - CAR_M;
            let state = bench.step().state;
            let expected = if left > 2.0 { EgoState::Holding } else { EgoState::Releasing };
            assert_eq!(state, expected, "gap {gap_m} m, lead vehicle at {lead_mps} m/s: {left} m left");
        }
    }
}

#[test]
fn a_rear_vehicle_that_leaves_the_lane_late_stays_the_target_until_it_is_past() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.rear().lane = [1.0, 0.0, 0.0];
    // 8 m are 0.2 s: the time headway at which the rear vehicle is expected to cross the marking.
    bench.rear().state[0] = -8.0 - CAR_M;
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Holding, Reason::RearCrosses));
    bench.rear().state[0] = -5.0 - CAR_M;
    assert_eq!(bench.step().state, EgoState::Holding);
    bench.rear().state[0] = 1.1 * CAR_M;
    bench.assert_released(0.0, Reason::RearPassed);
}

#[test]
fn holding_ends_after_two_seconds_if_the_rear_vehicle_never_leaves_the_lane() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.rear().state[0] = -4.0 - CAR_M;
    bench.rear().state[2] = 30.0;
    assert_eq!(bench.step_for(1.9).state, EgoState::Holding);
    bench.assert_released(0.2, Reason::HoldExpired);
}

#[test]
fn the_second_of_two_rear_vehicles_becomes_the_target_once_the_first_is_past() {
    let mut bench = Bench::engaged();
    bench.tracks.push(track(3, -60.0, 38.0, 1));
    assert_eq!(bench.step().plan.unwrap().track, TrackId(2), "the first vehicle stays the target");
    bench.rear().state[0] = 1.1 * CAR_M;
    bench.rear().lane = [1.0, 0.0, 0.0];
    bench.lead().state[0] = 30.0 + CAR_M;
    bench.assert_released(0.0, Reason::RearPassed);
    // The system engages again as soon as the passing lane is free of the first vehicle.
    bench.rear().state = [60.0, 0.0, 50.0, 0.0].into();
    let command = bench.step();
    assert_eq!((command.state, command.plan.unwrap().track), (EgoState::Increasing, TrackId(3)));
}

#[test]
fn a_nearer_vehicle_that_does_not_approach_prevents_engaging() {
    let mut bench = Bench::new();
    bench.tracks.push(track(3, -40.0, 30.0, 1));
    bench.assert_not_engaged(Reason::RearNotApproaching);
}

#[test]
fn the_length_of_a_truck_or_motorcycle_decides_when_it_is_past() {
    for (length_m, past_m) in [(16.5, 10.6), (2.2, 3.5)] {
        let mut bench = Bench::engaged();
        bench.lead().state[0] = 60.0;
        bench.rear().length_m = length_m;
        bench.rear().state[0] = -5.0 - 0.5 * (length_m + CAR_M);
        assert_eq!(bench.step().state, EgoState::Holding);
        bench.rear().lane = [1.0, 0.0, 0.0];
        bench.rear().state[0] = past_m - 0.2;
        assert_eq!(bench.step().state, EgoState::Holding, "length {length_m} m");
        bench.rear().state[0] = past_m;
        bench.assert_released(0.0, Reason::RearPassed);
    }
}

#[test]
fn a_sensor_failure_releases_after_half_a_second() {
    for (broken, reason) in [
        (SensorAvailability { surround: false, ..SensorAvailability::ALL }, Reason::SurroundSensorsFailed),
        (SensorAvailability { rear: false, ..SensorAvailability::ALL }, Reason::RearSensorsFailed),
        (SensorAvailability { front: false, ..SensorAvailability::ALL }, Reason::FrontSensorFailed),
    ] {
        let mut bench = Bench::engaged();
        bench.lead().state[0] = 60.0;
        bench.sensors = broken;
        assert_eq!(bench.step_for(0.4).state, EgoState::Increasing);
        bench.assert_released(0.2, reason);
        // The system does not engage again while the sensor is missing.
        bench.lead().state[0] = 21.0 + CAR_M;
        assert_eq!(bench.step_for(1.0).state, EgoState::Following);
    }
}

#[test]
fn a_lost_lead_track_is_tolerated_for_half_a_second() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.step();
    bench.tracks.remove(0);
    assert_eq!(bench.step_for(0.4).state, EgoState::Increasing);
    let mut command = bench.step();
    while command.state == EgoState::Increasing {
        command = bench.step();
    }
    assert_eq!((command.state, command.reason), (EgoState::Releasing, Reason::FrontLost));
    // No lead vehicle is left to keep a margin to.
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Following, Reason::MarginReturned));
}

#[test]
fn fluctuations_about_a_threshold_do_not_change_the_state() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    for step in 0..200 {
        let sign = if step % 2 == 0 { 1.0 } else { -1.0 };
        bench.rear().state = [-100.0 - CAR_M - 5.0 * sign, 0.0, 30.0 + 10.0 / 3.6 + sign, 0.0].into();
        assert_eq!(bench.step().state, EgoState::Increasing, "step {step}");
    }
}

#[test]
fn commands_stay_within_the_comfort_limits() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    let mut last_mps2 = 0.0;
    for step in 0..250 {
        let rear_m = -90.0 + 0.6 * f64::from(step);
        bench.rear().state[0] = rear_m;
        bench.rear().lane = if rear_m > -10.0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let now_mps2 = bench.step().acceleration_mps2;
        assert!((-1.0..=0.8).contains(&now_mps2), "{now_mps2}");
        let jerk_mps3 = (now_mps2 - last_mps2) / CONTROL_STEP.s();
        assert!((-2.0 - 1e-9..=3.0 + 1e-9).contains(&jerk_mps3), "step {step}: {jerk_mps3}");
        last_mps2 = now_mps2;
    }
    assert!(last_mps2 > 0.0, "the margin is returned");
}

/// Returns how long the ego does not brake for a slower lead vehicle far ahead, once the rear
/// vehicle crosses the marking (s), at most 12 s.
fn without_braking_s(hold_s: f64) -> f64 {
    let mut bench = Bench::with_mis(MisSettings { hold_s, ..MisSettings::PAPER });
    assert_eq!(bench.step().state, EgoState::Increasing);
    // At the critical gap, the plan asks for no braking either.
    bench.rear().lane = [1.0, 0.0, 0.0];
    bench.rear().state[0] = -4.0 - CAR_M;
    bench.rear().state[2] = 31.5;
    bench.lead().state[0] = 75.0 + CAR_M;
    bench.lead().state[2] = 15.0;
    let from = bench.time;
    while bench.step().acceleration_mps2 >= -0.2 && bench.time < from + Time::from_s(12.0) {}
    (bench.time - from).s()
}

#[test]
fn the_holding_time_is_the_time_without_braking() {
    let [none_s, two_s, ten_s] = [0.0, 2.0, 10.0].map(without_braking_s);
    assert!(none_s < 0.3, "{none_s}");
    assert!((two_s - none_s - 2.0).abs() < 0.1, "{two_s}");
    assert!((ten_s - none_s - 10.0).abs() < 0.1, "{ten_s}");
}

#[test]
fn the_brake_is_released_while_the_rear_vehicle_crosses_and_the_acc_is_ignored() {
    let mut bench = Bench::engaged();
    bench.step_for(1.0);
    bench.lead().state[0] = 75.0 + CAR_M;
    bench.lead().state[2] = 15.0;
    bench.rear().lane = [1.0, 0.0, 0.0];
    bench.rear().state[0] = -10.0 - CAR_M;
    let command = bench.step_for(1.0);
    assert_eq!((command.state, command.reason), (EgoState::Holding, Reason::RearCrosses));
    assert_eq!(command.acceleration_mps2, 0.0, "{command:?}");
}
