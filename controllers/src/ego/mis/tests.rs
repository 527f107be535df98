//! One test for each condition and transition, on the whole stack with tracks made by hand.

use closecall_traffic::{ClassScores, Lane, Road, Source, Time, Track, TrackId, TrackStatus, VehicleClass};

use super::MisSettings;
use crate::ego::{
    Acc, ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings, EgoStack, EgoState, Odometry, Reason,
    SensorAvailability,
};

const CAR_M: f64 = 4.6;
const PERIOD: Time = Time::from_ms(40);

/// E at 30 m/s, F at 21 m, R at 90 m and 8 m/s faster: every condition for engaging holds.
struct Bench {
    stack: EgoStack,
    time: Time,
    road: Road,
    lane: Lane,
    sensors: SensorAvailability,
    tracks: Vec<Track>,
}

fn track(id: u32, x_m: f64, speed_mps: f64, lane: usize) -> Track {
    let mut probability = [0.0; 3];
    probability[lane] = 1.0;
    Track {
        id: TrackId(id),
        source: if x_m > 0.0 { Source::Front } else { Source::Rear },
        status: TrackStatus::Confirmed,
        time: Time::ZERO,
        state: [x_m, 0.0, speed_mps, 0.0].into(),
        covariance: Default::default(),
        heading_rad: 0.0,
        length_m: CAR_M,
        width_m: 1.85,
        class: ClassScores::certain(VehicleClass::Car),
        existence: 1.0,
        lane: probability,
    }
}

impl Bench {
    fn new() -> Self {
        Self::with(true)
    }

    fn with(automated: bool) -> Self {
        let settings = EgoSettings {
            acc: Acc { time_gap_s: 0.7, set_speed_mps: None, standstill_gap_m: 3.0 },
            aeb: None,
            mis: Some(MisSettings::PAPER),
            automated,
        };
        Self {
            stack: EgoStack::new(settings),
            time: Time::ZERO,
            road: Road::straight(3),
            lane: Lane(2),
            sensors: SensorAvailability::ALL,
            tracks: vec![track(1, 21.0 + CAR_M, 30.0, 1), track(2, -90.0 - CAR_M, 38.0, 1)],
        }
    }

    fn front(&mut self) -> &mut Track {
        &mut self.tracks[0]
    }

    fn rear(&mut self) -> &mut Track {
        &mut self.tracks[1]
    }

    fn step(&mut self) -> EgoCommand {
        self.try_step().unwrap()
    }

    fn try_step(&mut self) -> Result<EgoCommand, ControllerError> {
        for track in &mut self.tracks {
            track.time = self.time;
        }
        let odometry = Odometry {
            speed_mps: 30.0,
            acceleration_mps2: 0.0,
            yaw_rate_radps: 0.0,
            lane: self.lane,
            lane_offset_m: 0.0,
            length_m: CAR_M,
            width_m: 1.85,
        };
        let (time, road) = (self.time, &self.road);
        self.time += PERIOD;
        self.stack.step(&EgoInput { time, odometry, road, tracks: &self.tracks, sensors: self.sensors })
    }

    /// Steps for `seconds`, and returns the last command.
    fn step_for(&mut self, seconds: f64) -> EgoCommand {
        let until = self.time + Time::from_s(seconds);
        let mut command = self.step();
        while self.time < until {
            command = self.step();
        }
        command
    }

    fn refuses(&mut self, reason: Reason) {
        let command = self.step();
        assert_eq!((command.state, command.reason), (EgoState::Following, reason));
        assert_eq!(command.plan, None);
    }

    fn engaged() -> Self {
        let mut bench = Self::new();
        assert_eq!(bench.step().state, EgoState::Increasing);
        bench
    }

    fn releases(&mut self, within_s: f64, reason: Reason) {
        let command = self.step_for(within_s);
        assert_eq!((command.state, command.reason), (EgoState::Releasing, reason));
    }
}

#[test]
fn it_engages_at_the_first_step_where_every_condition_holds() {
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
        assert!((last - now) <= 2.0 * 0.04 + 1e-9, "{last} to {now}");
        last = now;
    }
    assert_eq!(last, -1.0);
}

#[test]
fn not_automated() {
    Bench::with(false).refuses(Reason::NotAutomated);
}

#[test]
fn front_margin_long() {
    let mut bench = Bench::new();
    bench.front().state[0] = 45.0 + CAR_M;
    bench.refuses(Reason::FrontMarginLong);
    bench.tracks.remove(0);
    // One that vanishes is remembered for half a second.
    bench.refuses(Reason::FrontMarginLong);
    bench.step_for(0.6);
    bench.refuses(Reason::NoFront);
}

#[test]
fn rear_far_or_absent() {
    let mut bench = Bench::new();
    bench.rear().state[0] = -100.1 - CAR_M;
    bench.refuses(Reason::RearFar);
    bench.tracks.remove(1);
    bench.refuses(Reason::NoRear);
}

#[test]
fn rear_unconfirmed() {
    let mut bench = Bench::new();
    bench.rear().status = TrackStatus::Tentative;
    bench.refuses(Reason::RearUnconfirmed);
}

#[test]
fn rear_unclassified() {
    let mut bench = Bench::new();
    for scores in [ClassScores::UNKNOWN, ClassScores([0.2, 0.1, 0.1, 0.6]), ClassScores([0.2, 0.2, 0.2, 0.4])] {
        bench.rear().class = scores;
        bench.refuses(Reason::RearUnclassified);
    }
}

#[test]
fn rear_in_another_lane() {
    let mut bench = Bench::new();
    bench.rear().lane = [0.0, 0.4, 0.6];
    bench.refuses(Reason::NoRear);
}

#[test]
fn rear_receding_or_slow() {
    let mut bench = Bench::new();
    for speed_mps in [25.0, 32.7] {
        bench.rear().state[2] = speed_mps;
        bench.refuses(Reason::RearNotApproaching);
    }
}

#[test]
fn passing_lane_occupied_unknown_or_absent() {
    let mut bench = Bench::new();
    bench.sensors.surround = false;
    bench.refuses(Reason::PassingLaneUnknown);
    bench.sensors = SensorAvailability::ALL;
    bench.tracks.push(track(3, 5.0, 30.0, 0));
    bench.refuses(Reason::PassingLaneOccupied);
    bench.tracks[2].status = TrackStatus::Tentative;
    bench.refuses(Reason::PassingLaneUnknown);
    bench.tracks.pop();
    bench.lane = Lane(1);
    bench.refuses(Reason::NoPassingLane);
}

#[test]
fn a_fast_vehicle_ahead_in_the_passing_lane_does_not_matter() {
    let mut bench = Bench::new();
    bench.tracks.push(track(3, 30.0, 40.0, 0));
    assert_eq!(bench.step().state, EgoState::Increasing);
}

#[test]
fn a_motorcycle_or_truck_counts_like_a_car() {
    for class in [VehicleClass::Motorcycle, VehicleClass::Truck] {
        let mut bench = Bench::new();
        bench.rear().class = ClassScores::certain(class);
        assert_eq!(bench.step().state, EgoState::Increasing);
    }
}

#[test]
fn of_two_behind_the_nearer_one_counts() {
    let mut bench = Bench::new();
    bench.tracks.push(track(3, -50.0, 34.0, 1));
    assert_eq!(bench.step().plan.unwrap().track, TrackId(3));
}

#[test]
fn holding_begins_at_the_critical_distance_and_ends_after_two_seconds() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.rear().state[0] = -5.0 - CAR_M;
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Holding, Reason::CriticalDistance));
    // F brakes: E holds all the same, while there is room.
    bench.front().state[2] = 27.0;
    let command = bench.step_for(1.0);
    assert_eq!(command.state, EgoState::Holding);
    assert!(command.acceleration_mps2.abs() < 1e-9, "{command:?}");
    bench.releases(1.2, Reason::HoldExpired);
}

#[test]
fn holding_needs_room_for_the_worst_braking_of_f() {
    // At the headway of following there is none: it does not even begin.
    let mut bench = Bench::engaged();
    bench.rear().state[0] = -5.0 - CAR_M;
    bench.releases(0.0, Reason::NoRoomToHold);

    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.rear().state[0] = -5.0 - CAR_M;
    assert_eq!(bench.step().state, EgoState::Holding);
    bench.front().state[0] = 15.0;
    bench.front().state[2] = 20.0;
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Releasing, Reason::NoRoomToHold));
    assert!(command.acceleration_mps2 < -3.0, "{command:?}");
}

/// E's room behind F at which it may just hold, by stepping the worst case: F brakes at 8 m/s² at once, E 0.3 s later at
/// 6 m/s², and 2 m are left.
#[test]
fn it_holds_exactly_where_the_worst_case_leaves_room() {
    let left_m = |gap_m: f64, front_mps: f64| {
        let (mut gap, mut front, mut ego, step_s) = (gap_m, front_mps, 30.0_f64, 1e-4);
        let mut time_s = 0.0;
        while ego > 0.0 {
            gap += (front - ego) * step_s;
            front = f64::max(front - 8.0 * step_s, 0.0);
            ego -= if time_s < 0.3 { 0.0 } else { 6.0 * step_s };
            time_s += step_s;
        }
        gap
    };
    for front_mps in [20.0, 25.0, 30.0] {
        for gap_m in (20..80).map(f64::from) {
            let left = left_m(gap_m, front_mps);
            if (left - 2.0).abs() < 0.1 {
                continue;
            }
            let mut bench = Bench::engaged();
            bench.front().state = [gap_m + CAR_M, 0.0, front_mps, 0.0].into();
            bench.rear().state[0] = -5.0 - CAR_M;
            let state = bench.step().state;
            let expected = if left > 2.0 { EgoState::Holding } else { EgoState::Releasing };
            assert_eq!(state, expected, "gap {gap_m}, F at {front_mps}: {left} m left");
        }
    }
}

#[test]
fn one_that_leaves_the_lane_late_is_awaited_until_it_is_past() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.rear().lane = [1.0, 0.0, 0.0];
    // 8 m are 0.2 s: the very headway at which it is expected to cross the marking.
    bench.rear().state[0] = -8.0 - CAR_M;
    assert_eq!(bench.step().state, EgoState::Increasing);
    bench.rear().state[0] = -5.0 - CAR_M;
    assert_eq!(bench.step().state, EgoState::Holding);
    bench.rear().state[0] = 1.1 * CAR_M;
    bench.releases(0.0, Reason::RearPassed);
}

#[test]
fn one_that_never_leaves_the_lane_is_held_for_two_seconds_only() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.rear().state[0] = -4.0 - CAR_M;
    bench.rear().state[2] = 30.0;
    assert_eq!(bench.step_for(1.9).state, EgoState::Holding);
    bench.releases(0.2, Reason::HoldExpired);
}

#[test]
fn the_second_of_two_behind_is_prepared_for_once_the_first_is_past() {
    let mut bench = Bench::engaged();
    bench.tracks.push(track(3, -60.0, 38.0, 1));
    assert_eq!(bench.step().plan.unwrap().track, TrackId(2), "the first stays the one that counts");
    bench.rear().state[0] = 1.1 * CAR_M;
    bench.rear().lane = [1.0, 0.0, 0.0];
    bench.front().state[0] = 30.0 + CAR_M;
    bench.releases(0.0, Reason::RearPassed);
    // As soon as the passing lane is free of the first one.
    bench.rear().state = [60.0, 0.0, 50.0, 0.0].into();
    let command = bench.step();
    assert_eq!((command.state, command.plan.unwrap().track), (EgoState::Increasing, TrackId(3)));
}

#[test]
fn a_nearer_one_that_does_not_approach_keeps_it_off() {
    let mut bench = Bench::new();
    bench.tracks.push(track(3, -40.0, 30.0, 1));
    bench.refuses(Reason::RearNotApproaching);
}

#[test]
fn a_truck_or_motorcycle_is_past_by_its_own_length() {
    for (length_m, past_m) in [(16.5, 10.6), (2.2, 3.5)] {
        let mut bench = Bench::engaged();
        bench.front().state[0] = 60.0;
        bench.rear().length_m = length_m;
        bench.rear().state[0] = -5.0 - 0.5 * (length_m + CAR_M);
        assert_eq!(bench.step().state, EgoState::Holding);
        bench.rear().lane = [1.0, 0.0, 0.0];
        bench.rear().state[0] = past_m - 0.2;
        assert_eq!(bench.step().state, EgoState::Holding, "{length_m}");
        bench.rear().state[0] = past_m;
        bench.releases(0.0, Reason::RearPassed);
    }
}

#[test]
fn a_sensor_that_fails_ends_it_after_half_a_second() {
    for broken in [
        SensorAvailability { surround: false, ..SensorAvailability::ALL },
        SensorAvailability { rear: false, ..SensorAvailability::ALL },
        SensorAvailability { front: false, ..SensorAvailability::ALL },
    ] {
        let mut bench = Bench::engaged();
        bench.front().state[0] = 60.0;
        bench.sensors = broken;
        assert_eq!(bench.step_for(0.4).state, EgoState::Increasing);
        bench.releases(0.2, Reason::PassingLaneUnknown);
        // And it does not engage again while the sensor is missing.
        bench.front().state[0] = 21.0 + CAR_M;
        assert_eq!(bench.step_for(1.0).state, EgoState::Following);
    }
}

#[test]
fn the_front_vehicle_s_track_is_waited_for() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    bench.step();
    bench.tracks.remove(0);
    assert_eq!(bench.step_for(0.4).state, EgoState::Increasing);
    let mut command = bench.step();
    while command.state == EgoState::Increasing {
        command = bench.step();
    }
    assert_eq!((command.state, command.reason), (EgoState::Releasing, Reason::FrontLost));
    // Nobody is left to keep a margin to.
    let command = bench.step();
    assert_eq!((command.state, command.reason), (EgoState::Following, Reason::MarginReturned));
}

#[test]
fn what_wavers_about_a_threshold_does_not_switch_it() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    for step in 0..200 {
        let sign = if step % 2 == 0 { 1.0 } else { -1.0 };
        bench.rear().state = [-100.0 - CAR_M - 5.0 * sign, 0.0, 30.0 + 10.0 / 3.6 + sign, 0.0].into();
        assert_eq!(bench.step().state, EgoState::Increasing, "step {step}");
    }
}

#[test]
fn every_command_but_a_needed_braking_stays_within_the_comfort_limits() {
    let mut bench = Bench::engaged();
    bench.front().state[0] = 60.0;
    let mut last_mps2 = 0.0;
    for step in 0..250 {
        let r_m = -90.0 + 0.6 * f64::from(step);
        bench.rear().state[0] = r_m;
        bench.rear().lane = if r_m > -10.0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let now_mps2 = bench.step().acceleration_mps2;
        assert!((-1.0..=0.8).contains(&now_mps2), "{now_mps2}");
        let jerk_mps3 = (now_mps2 - last_mps2) / 0.04;
        assert!((-2.0 - 1e-9..=3.0 + 1e-9).contains(&jerk_mps3), "step {step}: {jerk_mps3}");
        last_mps2 = now_mps2;
    }
    assert!(last_mps2 > 0.0, "the margin is given back");
}

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
