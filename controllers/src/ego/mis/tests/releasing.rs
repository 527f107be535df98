//! When it ends, and how the margin is given back.

use super::*;

#[test]
fn it_releases_when_the_rear_vehicle_is_past() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.rear().state[0] = -5.0 - CAR_M;
    bench.step();
    bench.rear().lane = [1.0, 0.0, 0.0];
    // Alongside it has not concluded yet.
    bench.rear().state[0] = 0.9 * CAR_M;
    assert_eq!(bench.step().state, EgoState::Holding);
    bench.rear().state[0] = 1.1 * CAR_M;
    bench.releases(0.0, Reason::RearPassed);
}

#[test]
fn it_releases_when_the_rear_vehicle_fell_back_follows_or_is_lost() {
    let mut bench = Bench::engaged();
    bench.rear().state[0] = -121.0 - CAR_M;
    bench.releases(0.0, Reason::RearFellBack);

    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.rear().state[2] = 30.5;
    assert_eq!(bench.step_for(0.9).state, EgoState::Increasing);
    bench.releases(0.3, Reason::RearFollows);

    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.tracks.remove(1);
    assert_eq!(bench.step_for(0.4).state, EgoState::Increasing);
    bench.releases(0.3, Reason::RearLost);
}

#[test]
fn a_track_that_comes_back_under_another_number_is_the_same_vehicle() {
    let mut bench = Bench::engaged();
    bench.rear().id = TrackId(77);
    let command = bench.step_for(1.0);
    assert_eq!(command.state, EgoState::Increasing);
    assert_eq!(command.plan.unwrap().track, TrackId(77));
}

#[test]
fn it_releases_when_the_passing_lane_fills_or_the_rear_vehicle_changes_early() {
    let mut bench = Bench::engaged();
    bench.tracks.push(track(3, -20.0, 31.0, 0));
    bench.releases(0.0, Reason::PassingLaneOccupied);

    let mut bench = Bench::engaged();
    bench.rear().lane = [1.0, 0.0, 0.0];
    bench.releases(0.0, Reason::RearChangedLane);
}

#[test]
fn the_margin_is_given_back_gently_and_then_it_follows_again() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.tracks.remove(1);
    let command = bench.step_for(2.0);
    assert_eq!(command.state, EgoState::Releasing);
    assert!(command.acceleration_mps2 > 0.0 && command.acceleration_mps2 <= 0.8, "{command:?}");
    bench.front().state[0] = 22.0 + CAR_M;
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Following, Reason::MarginReturned));
}

#[test]
fn what_is_not_finite_is_an_error_not_a_command() {
    for place in [0, 1] {
        for element in 0..4 {
            let mut bench = Bench::new();
            bench.tracks[place].state[element] = f64::NAN;
            assert!(bench.try_step().is_err(), "track {place}, element {element}");
        }
    }
}
