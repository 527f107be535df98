use closecall_traffic::{CONTROL_STEP, Lane, Time, Trajectory};

use super::*;
use crate::filters::smooth;
use crate::lane_change::detect;
use crate::trajectory_data::LaneMarkings;
use crate::trajectory_data::test_support::{changing_track, straight_track, trajectory_data_of};

/// Rear vehicle that changes from lane 2 to lane 1 between 10 and 15 s, 150 m behind the ego
/// vehicle and 10 m/s faster than the ego and the lead vehicle.
fn rear() -> Trajectory {
    changing_track(3, (0.0, 30.0), (-5.25, -1.75), (10.0, 5.0), 200)
}

/// Returns the encounter of the rear vehicle, track 3, among other vehicles.
fn encounter_among(others: Vec<Trajectory>, lead: Lead) -> Result<RecordedEncounter, NoEncounter> {
    let data = smooth(&trajectory_data_of(std::iter::once(rear()).chain(others).collect()));
    let changes = detect(&data);
    let change = changes.iter().find(|change| change.track_id == 3).unwrap();
    encounter(&data, change, &changes, CONTROL_STEP, lead)
}

/// Ego and lead vehicle, 30 m apart.
fn ego_and_lead() -> Vec<Trajectory> {
    vec![straight_track(1, 150.0, 20.0, -5.25, 250), straight_track(2, 180.0, 20.0, -5.25, 250)]
}

#[test]
fn roles_clock_and_road_are_assigned() {
    let encounter = encounter_among(ego_and_lead(), Lead::Required).unwrap();
    assert_eq!(encounter.ego_lead_rear().map(|track| track.track_id), [1, 2, 3]);
    assert_eq!((encounter.start, encounter.lanes, encounter.home, encounter.target), (Time::ZERO, 2, Lane(2), Lane(1)));
    let [ego, _, rear] = encounter.ego_lead_rear();
    assert!(ego.points[0].s_m.abs() < 1e-6 && (rear.points[0].s_m + 150.0).abs() < 1e-6);
    assert!(ego.points.windows(2).all(|pair| pair[1].time - pair[0].time == CONTROL_STEP));
    // The gap at the crossing is the initial 150 m less 10 m/s times the elapsed time and a
    // vehicle's length.
    assert!((encounter.crossing.s() - 12.5).abs() < 0.2, "{}", encounter.crossing);
    assert!((encounter.crossing_thw_s.unwrap() - (150.0 - 10.0 * encounter.crossing.s() - 4.5) / 30.0).abs() < 0.1);
    let crossing = rear.points.iter().find(|point| point.time >= encounter.crossing).unwrap();
    assert!((crossing.d_m + encounter.lane_width_m).abs() < 0.2, "{}", crossing.d_m);
    assert!(encounter.end <= Time::from_s(21.2) && encounter.end > Time::from_s(20.0), "{}", encounter.end);
}

#[test]
fn the_encounter_starts_once_the_ego_follows_the_lead() {
    // Until 5 s another vehicle drives between the ego and the lead vehicle.
    let mut between = straight_track(4, 165.0, 20.0, -5.25, 50);
    between.points.retain(|point| point.time < Time::from_s(5.0));
    let encounter = encounter_among(ego_and_lead().into_iter().chain([between]).collect(), Lead::Required).unwrap();
    assert!((encounter.start.s() - 5.0).abs() < 0.5, "{}", encounter.start);
    assert_eq!(encounter.ego_lead_rear().map(|track| track.track_id), [1, 2, 3]);
}

#[test]
fn vehicles_of_another_carriageway_are_left_out() {
    let mut far = straight_track(5, 150.0, 20.0, -1_005.25, 250);
    far.points.iter_mut().for_each(|point| point.lane = Lane(4));
    let near = straight_track(6, 150.0, 20.0, -1.75, 250);
    let encounter = encounter_among(ego_and_lead().into_iter().chain([far, near]).collect(), Lead::Required).unwrap();
    let tracks: Vec<u64> = encounter.vehicles.iter().map(|vehicle| vehicle.trajectory.track_id).collect();
    assert_eq!((tracks, encounter.lanes), (vec![1, 2, 3, 6], 2));
}

#[test]
fn a_road_is_one_carriageway_of_several_with_markings() {
    let edges = [(1, -3.5), (2, -7.0), (3, -1_007.0), (4, -1_010.5), (5, -1_014.0)];
    let markings = LaneMarkings::from_right_edges(edges.map(|(lane, edge_m)| (Lane(lane), edge_m)));
    for shift_m in [0.0, -1_007.0] {
        let tracks = std::iter::once(rear()).chain(ego_and_lead()).map(|mut track| {
            let moved = track.points.iter_mut().filter(|_| shift_m < 0.0);
            moved.for_each(|point| (point.d_m, point.lane) = (point.d_m + shift_m, Lane(point.lane.0 + 3)));
            track
        });
        let mut data = trajectory_data_of(tracks.collect());
        data.markings = markings.clone();
        let data = smooth(&data);
        let changes = detect(&data);
        let encounter = encounter(&data, &changes[0], &changes, CONTROL_STEP, Lead::Required).unwrap();
        assert_eq!((encounter.lanes, encounter.home, encounter.target), (2, Lane(2), Lane(1)), "{shift_m}");
        let [ego, ..] = encounter.ego_lead_rear();
        assert!((ego.points[0].d_m + 5.25).abs() < 1e-6, "{}", ego.points[0].d_m);
    }
}

#[test]
fn a_lane_change_that_is_no_encounter_states_the_reason() {
    let message = |others| encounter_among(others, Lead::Required).unwrap_err().to_string();
    assert!(message(Vec::new()).contains("no vehicle is ahead of track 3 in lane 2"));
    assert!(
        message(ego_and_lead()[..1].to_vec())
            .contains("no vehicle is ahead of track 1, the ego vehicle in front of track 3")
    );
    let late = |mut track: Trajectory| {
        track.points.retain(|point| point.time > Time::from_s(11.0));
        track
    };
    let late = ego_and_lead().into_iter().map(late).collect();
    let error = message(late);
    assert!(error.contains("no vehicle is ahead") || error.contains("2.0 s are needed"), "{error}");
    // The lead vehicle is recorded for long enough, but not until the crossing.
    let mut early_end = ego_and_lead();
    early_end[1].points.retain(|point| point.time < Time::from_s(11.5));
    let error = message(early_end);
    assert!(error.contains("s after the end of its own track") && !error.contains("needed"), "{error}");
    // The rear vehicle has passed the ego vehicle before it crosses the marking.
    let passed = vec![straight_track(1, 110.0, 20.0, -5.25, 250), straight_track(2, 180.0, 20.0, -5.25, 250)];
    assert!(message(passed).contains("has to be above 0"));
}

#[test]
fn a_crossing_at_the_start_is_not_repeated() {
    // The rear vehicle comes from lane 3, and the encounter starts as soon as it is in the lane of
    // the ego vehicle.
    let mut rear = rear();
    let from = changing_track(3, (0.0, 30.0), (-8.75, -5.25), (2.15, 4.0), 200);
    let before = |time: Time| time < Time::from_s(8.0);
    for (point, from) in rear.points.iter_mut().zip(&from.points) {
        if before(point.time) {
            *point = *from;
        }
    }
    let data = smooth(&trajectory_data_of(std::iter::once(rear).chain(ego_and_lead()).collect()));
    let changes = detect(&data);
    let of_rear: Vec<_> = changes.iter().filter(|change| change.track_id == 3).collect();
    let [first, second] = of_rear[..] else { panic!("{of_rear:?}") };
    let encounter = encounter(&data, second, &changes, CONTROL_STEP, Lead::Required).unwrap();
    assert_eq!(encounter.start, Time::from_s(first.crossing_s), "the encounter starts with the crossing");
    let kept: Vec<_> = encounter.vehicles[REAR_INDEX].changes.iter().map(|change| change.crossing_s).collect();
    assert_eq!(kept, [second.crossing_s]);
}

#[test]
fn without_a_margin_system_no_lead_vehicle_is_required() {
    let ego = straight_track(1, 150.0, 20.0, -5.25, 250);
    let data = smooth(&trajectory_data_of(vec![rear(), ego]));
    let changes = detect(&data);
    let choose_with = |number, lead| choose(&data, Wanted { track: Some(3), number, lead }, CONTROL_STEP);
    let no_lead = NoEncounter::NoLead { track_id: 3, ego_id: 1 };
    let refused = choose_with(None, Lead::Required).unwrap_err();
    assert_eq!(refused, ChoiceError::NoEncounter { source: no_lead, possible: Vec::new() });
    let encounter = choose_with(Some(1), Lead::LeftOut).unwrap();
    assert_eq!((encounter.vehicles.len(), encounter.rear().trajectory.track_id), (2, 3));
    assert_eq!(encounter.overtaken_index().map(|index| encounter.vehicles[index].trajectory.track_id), Some(1));
    assert_eq!(changes.len(), 1);
    assert_eq!(choose_with(Some(2), Lead::LeftOut).unwrap_err(), ChoiceError::NoSuchNumber { count: 1 });
    let unknown =
        choose(&data, Wanted { track: Some(9), number: None, lead: Lead::LeftOut }, CONTROL_STEP).unwrap_err();
    assert_eq!(unknown, ChoiceError::NoLaneChange { is_recorded: false, others: vec![3] });
}

#[test]
fn without_a_vehicle_ahead_there_is_an_encounter_without_an_ego_vehicle() {
    let encounter = encounter_among(Vec::new(), Lead::LeftOut).unwrap();
    assert_eq!((encounter.overtaken_index(), encounter.roles(), encounter.vehicles.len()), (None, 1, 1));
    assert_eq!((encounter.start, encounter.rear().trajectory.points[0].s_m.abs() < 1e-6), (Time::ZERO, true));
    assert_eq!(encounter.crossing_thw_s, Err(closecall_traffic::Absent::NoLead));
}

#[test]
fn a_vehicle_ahead_may_be_far_or_leave_the_record_before_the_crossing() {
    let far = straight_track(1, 600.0, 20.0, -5.25, 250);
    assert!(encounter_among(vec![far], Lead::LeftOut).is_ok());
    let mut leaves = straight_track(1, 150.0, 20.0, -5.25, 250);
    leaves.points.retain(|point| point.time < Time::from_s(11.5));
    let encounter = encounter_among(vec![leaves], Lead::LeftOut).unwrap();
    assert!(encounter.crossing > Time::from_s(12.0) && encounter.overtaken_index() == Some(1));
}

#[test]
fn the_encounter_starts_with_the_record_of_the_vehicle_ahead_and_needs_two_seconds() {
    let since = |since_s: f64| {
        let mut ahead = straight_track(1, 150.0, 20.0, -5.25, 250);
        ahead.points.retain(|point| point.time >= Time::from_s(since_s));
        encounter_among(vec![ahead], Lead::LeftOut)
    };
    assert_eq!(since(6.0).unwrap().start, Time::from_s(6.0));
    // A vehicle that appears after the start of the lane change is not ahead at its start.
    assert!(since(11.0).is_ok_and(|encounter| !encounter.has_ego && encounter.start == Time::ZERO));
    let mut late = rear();
    late.points.retain(|point| point.time >= Time::from_s(11.5));
    let data = smooth(&trajectory_data_of(vec![late]));
    let changes = detect(&data);
    let refused = encounter(&data, &changes[0], &changes, CONTROL_STEP, Lead::LeftOut).unwrap_err().to_string();
    assert!(refused.starts_with("track 3 is recorded for") && refused.contains("2.0 s are needed"), "{refused}");
}

#[test]
fn the_second_of_two_quick_lane_changes_starts_before_the_first_one() {
    let mut twice = rear();
    let second = changing_track(3, (0.0, 30.0), (-1.75, 1.75), (14.5, 4.0), 200);
    for (point, second) in twice.points.iter_mut().zip(&second.points) {
        point.d_m -= 3.5;
        if point.time > Time::from_s(14.6) {
            point.d_m = second.d_m - 3.5;
            point.lateral_speed_mps = second.lateral_speed_mps;
        }
        point.lane = Lane((-point.d_m / 3.5).floor() as u8 + 1);
    }
    let data = smooth(&trajectory_data_of(vec![twice]));
    let changes = detect(&data);
    let [_, second] = &changes[..] else { panic!("{changes:?}") };
    let encounter = encounter(&data, second, &changes, CONTROL_STEP, Lead::LeftOut).unwrap();
    assert!(encounter.start < Time::from_s(1.0) && encounter.rear().changes.len() == 2, "{}", encounter.start);
}
