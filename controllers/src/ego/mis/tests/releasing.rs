//! Tests of releasing and of the return of the margin.

use super::*;

#[test]
fn it_releases_when_the_rear_vehicle_is_past() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.rear().state[0] = -5.0 - CAR_M;
    bench.step();
    bench.rear().lane = [1.0, 0.0, 0.0];
    // A rear vehicle alongside has not completed its overtaking yet.
    bench.rear().state[0] = 0.9 * CAR_M;
    assert_eq!(bench.step().state, EgoState::Holding);
    bench.rear().state[0] = 1.1 * CAR_M;
    bench.assert_released(0.0, Reason::RearPassed);
}

#[test]
fn it_releases_when_the_rear_vehicle_falls_back_follows_or_is_lost() {
    let mut bench = Bench::engaged();
    bench.rear().state[0] = -121.0 - CAR_M;
    bench.assert_released(0.0, Reason::RearFellBack);

    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.rear().state[2] = 30.5;
    assert_eq!(bench.step_for(0.9).state, EgoState::Increasing);
    bench.assert_released(0.3, Reason::RearFollows);

    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.tracks.remove(1);
    assert_eq!(bench.step_for(0.4).state, EgoState::Increasing);
    bench.assert_released(0.3, Reason::RearLost);
}

#[test]
fn a_track_that_returns_under_another_id_is_the_same_vehicle() {
    let mut bench = Bench::engaged();
    bench.rear().id = TrackId(77);
    let command = bench.step_for(1.0);
    assert_eq!(command.state, EgoState::Increasing);
    assert_eq!(command.plan.unwrap().track, TrackId(77));
}

#[test]
fn it_releases_when_the_passing_lane_is_occupied_or_the_rear_vehicle_changes_lane_early() {
    let mut bench = Bench::engaged();
    bench.tracks.push(track(3, -20.0, 31.0, 0));
    bench.assert_released(0.0, Reason::PassingLaneOccupied);

    let mut bench = Bench::engaged();
    bench.rear().lane = [1.0, 0.0, 0.0];
    bench.assert_released(0.0, Reason::RearChangedLane);
}

#[test]
fn the_extended_system_does_not_accelerate_towards_a_braking_lead_vehicle() {
    let least_mps2 = |mis: MisSettings| {
        let mut bench = Bench::with_mis(mis);
        assert_eq!(bench.step().state, EgoState::Increasing);
        // The rear vehicle is past, and the margin is long; then the lead vehicle brakes at 6 m/s².
        bench.tracks.truncate(1);
        bench.lead().state[0] = 100.0;
        bench.step_for(1.0);
        let mut most = f64::NEG_INFINITY;
        for step in 0..25 {
            bench.lead().state[2] = 30.0 - 6.0 * 0.04 * f64::from(step);
            let command = bench.step();
            // The acceleration of the lead vehicle is smoothed over 0.2 s, and the command changes
            // within its jerk limit.
            if step > 15 {
                most = most.max(command.acceleration_mps2);
            }
        }
        most
    };
    assert!(least_mps2(MisSettings::PAPER) >= 0.0, "the paper's system uses up the margin first");
    assert!(least_mps2(MisSettings::PAPER.extended()) < 0.0);
}

#[test]
fn the_margin_is_returned_gently_before_following_again() {
    let mut bench = Bench::engaged();
    bench.lead().state[0] = 60.0;
    bench.tracks.remove(1);
    let command = bench.step_for(2.0);
    assert_eq!(command.state, EgoState::Releasing);
    assert!(command.acceleration_mps2 > 0.0 && command.acceleration_mps2 <= 0.8, "{command:?}");
    bench.lead().state[0] = 22.0 + CAR_M;
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Following, Reason::MarginReturned));
}

#[test]
fn input_that_is_not_finite_is_an_error() {
    for index in [0, 1] {
        for element in 0..4 {
            let mut bench = Bench::new();
            bench.tracks[index].state[element] = f64::NAN;
            assert!(bench.try_step().is_err(), "track {index}, element {element}");
        }
    }
}
