//! Tests of each single condition for engaging.

use super::*;

#[test]
fn it_engages_at_the_first_step_at_which_every_condition_holds() {
    let command = Bench::new().step();
    assert_eq!((command.state, command.reason), (EgoState::Increasing, Reason::EngagedGoalOutOfReach));
    let plan = command.plan.unwrap();
    assert!((plan.goal_thw_s - 2.7).abs() < 1e-9 && plan.deceleration_mps2 == 1.0, "{plan:?}");
    assert!((plan.ttce_s.unwrap() - 90.0 / 8.0).abs() < 1e-9, "{plan:?}");
}

#[test]
fn braking_grows_within_the_jerk_limit() {
    let mut bench = Bench::engaged();
    let mut last = 0.0;
    for _ in 0..40 {
        let now = bench.step().acceleration_mps2;
        assert!((last - now) <= 2.0 * CONTROL_STEP.s() + 1e-9, "{last} to {now}");
        last = now;
    }
    assert_eq!(last, -1.0);
}

#[test]
fn not_automated() {
    Bench::with_automation(false).assert_not_engaged(Reason::NotAutomated);
}

#[test]
fn front_margin_long() {
    let mut bench = Bench::new();
    bench.lead().state[0] = 45.0 + CAR_M;
    bench.assert_not_engaged(Reason::FrontMarginLong);
    bench.tracks.remove(0);
    // A lead vehicle whose track vanishes is remembered for half a second.
    bench.assert_not_engaged(Reason::FrontMarginLong);
    bench.step_for(0.6);
    bench.assert_not_engaged(Reason::NoFront);
}

#[test]
fn rear_far_or_absent() {
    let mut bench = Bench::new();
    bench.rear().state[0] = -100.1 - CAR_M;
    bench.assert_not_engaged(Reason::RearFar);
    bench.tracks.remove(1);
    bench.assert_not_engaged(Reason::NoRear);
}

#[test]
fn rear_unconfirmed() {
    let mut bench = Bench::new();
    bench.rear().status = TrackStatus::Tentative;
    bench.assert_not_engaged(Reason::RearUnconfirmed);
}

#[test]
fn rear_unclassified() {
    let mut bench = Bench::new();
    for scores in [ClassScores::UNKNOWN, ClassScores([0.2, 0.1, 0.1, 0.6]), ClassScores([0.2, 0.2, 0.2, 0.4])] {
        bench.rear().class = scores;
        bench.assert_not_engaged(Reason::RearUnclassified);
    }
}

#[test]
fn rear_in_another_lane() {
    let mut bench = Bench::new();
    bench.rear().lane = [0.0, 0.4, 0.6];
    bench.assert_not_engaged(Reason::NoRear);
}

#[test]
fn rear_receding_or_slow() {
    let mut bench = Bench::new();
    for speed_mps in [25.0, 32.7] {
        bench.rear().state[2] = speed_mps;
        bench.assert_not_engaged(Reason::RearNotApproaching);
    }
}

#[test]
fn passing_lane_occupied_unknown_or_absent() {
    let mut bench = Bench::new();
    bench.sensors.surround = false;
    bench.assert_not_engaged(Reason::SurroundSensorsFailed);
    bench.sensors = SensorAvailability::ALL;
    bench.tracks.push(track(3, 5.0, 30.0, 0));
    bench.assert_not_engaged(Reason::PassingLaneOccupied);
    bench.tracks[2].status = TrackStatus::Tentative;
    bench.assert_not_engaged(Reason::PassingLaneUnknown);
    bench.tracks.pop();
    bench.lane = Lane(1);
    bench.assert_not_engaged(Reason::NoPassingLane);
}

#[test]
fn a_fast_vehicle_ahead_in_the_passing_lane_does_not_matter() {
    let mut bench = Bench::new();
    bench.tracks.push(track(3, 30.0, 40.0, 0));
    assert_eq!(bench.step().state, EgoState::Increasing);
}

#[test]
fn a_close_follower_of_the_rear_vehicle_in_its_lane_matters_to_the_extended_system_alone() {
    // The rear vehicle drives at 38 m/s, its centre 94.6 m behind: 50 m are a headway of 1.2 s,
    // in which no driver reacts to a surprise, and 70 m one of 1.7 s.
    for (behind_m, engages) in [(30.0, false), (50.0, false), (70.0, true)] {
        for (mis, expected) in [(MisSettings::PAPER, true), (MisSettings::PAPER.extended(), engages)] {
            let mut bench = Bench::with_mis(mis);
            bench.tracks.push(track(3, -94.6 - behind_m, 38.0, 1));
            if expected {
                assert_eq!(bench.step().state, EgoState::Increasing, "{behind_m}");
            } else {
                bench.assert_not_engaged(Reason::RearFollowed);
            }
        }
    }
}

#[test]
fn a_close_follower_of_the_rear_vehicle_in_the_passing_lane_matters_to_the_extended_system_alone() {
    // The rear vehicle drives at 38 m/s, its centre 94.6 m behind. At the same speed, 30 m are a
    // headway of 0.67 s between the bumpers, and 50 m one of 1.2 s.
    for (behind_m, engages) in [(30.0, false), (50.0, true)] {
        for (mis, expected) in [(MisSettings::PAPER, true), (MisSettings::PAPER.extended(), engages)] {
            let mut bench = Bench::with_mis(mis);
            bench.tracks.push(track(3, -94.6 - behind_m, 38.0, 0));
            if expected {
                assert_eq!(bench.step().state, EgoState::Increasing, "{behind_m}");
            } else {
                bench.assert_not_engaged(Reason::PassingLaneOccupied);
            }
        }
    }
}

#[test]
fn a_motorcycle_or_truck_is_treated_like_a_car() {
    for class in [VehicleClass::Motorcycle, VehicleClass::Truck] {
        let mut bench = Bench::new();
        bench.rear().class = ClassScores::certain(class);
        assert_eq!(bench.step().state, EgoState::Increasing);
    }
}

#[test]
fn the_nearer_of_two_rear_vehicles_is_the_target() {
    let mut bench = Bench::new();
    bench.tracks.push(track(3, -50.0, 34.0, 1));
    assert_eq!(bench.step().plan.unwrap().track, TrackId(3));
}

#[test]
fn the_extended_system_does_not_engage_for_a_vehicle_farther_away_than_100_m() {
    // Requirement MIS-9: the ego does not slow down before a vehicle behind is within 100 m.
    for (gap_m, engages) in [(150.0, false), (101.0, false), (99.0, true)] {
        let mut bench = Bench::with_mis(MisSettings::PAPER.extended());
        bench.rear().state[0] = -gap_m - CAR_M;
        if engages {
            assert_eq!(bench.step().state, EgoState::Increasing, "{gap_m}");
        } else {
            bench.assert_not_engaged(Reason::RearFar);
            let braking_mps2 = -bench.step_for(2.0).acceleration_mps2;
            assert!(braking_mps2 <= 0.0, "{gap_m}: {braking_mps2}");
        }
    }
}

#[test]
fn the_extended_system_gains_the_margin_at_once_and_the_paper_s_just_in_time() {
    // The rear vehicle is 3 m/s faster: its arrival takes long, and gentle braking reaches the goal.
    let braking_mps2 = |mis: MisSettings| {
        let mut bench = Bench::with_mis(mis);
        bench.rear().state[2] = 33.0;
        -bench.step_for(1.5).acceleration_mps2
    };
    let [paper, extended] = [MisSettings::PAPER, MisSettings::PAPER.extended()].map(braking_mps2);
    assert!(paper > 0.0 && paper < 0.5, "{paper}");
    assert_eq!(extended, MisSettings::EXTENDED_MAX_DECELERATION_MPS2);
    // A margin that is long enough takes no more speed.
    let mut bench = Bench::with_mis(MisSettings::PAPER.extended());
    bench.rear().state[2] = 33.0;
    assert_eq!(bench.step().state, EgoState::Increasing);
    bench.lead().state[0] = 130.0;
    bench.step_for(0.2);
    let braking_mps2 = -bench.step_for(1.5).acceleration_mps2;
    assert!(braking_mps2 <= 0.0, "{braking_mps2}");
}
