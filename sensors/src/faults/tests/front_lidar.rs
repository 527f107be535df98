//! Faults of the LiDAR that looks ahead.

use super::*;

const SENSORS: &str = "mode = \"full\"\nrear-camera.pipeline = \"off\"\nfront-lidar = {}";

/// Returns a car whose rear is `gap_m` ahead of the ego's front.
fn ahead(gap_m: f64, d_m: f64) -> SceneVehicle {
    let car = scene_vehicle(1, VehicleClass::Car, 0.0, d_m);
    with_speed(scene_vehicle(1, VehicleClass::Car, EGO_S_M + gap_m + car.vehicle.dimensions.length_m, d_m), 30.0)
}

fn with(fault: &str, others: Vec<SceneVehicle>) -> Vec<Step> {
    let text = format!("[[front-lidar]]\n{fault}\n");
    Drive { sensors: SENSORS, faults: &text, others, ..Drive::default() }.run()
}

/// Returns the confirmed front tracks of the last step.
fn tracks(steps: &[Step]) -> Vec<&Track> {
    let is_front = |track: &&Track| track.source == Source::Front && track.status != TrackStatus::Tentative;
    steps.last().unwrap().tracks.iter().filter(is_front).collect()
}

#[test]
fn without_effect_the_lead_vehicle_is_tracked_and_the_rear_sensors_do_not_notice() {
    let steps = with("dropout = 0.0", vec![ahead(40.0, OWN_LANE_M)]);
    assert_eq!(tracks(&steps).len(), 1);
    assert!(steps.iter().all(|step| step.health == Health::Ok));
}

#[test]
fn a_dead_or_frozen_front_lidar_is_noticed_after_a_second() {
    for fault in ["dead = true\nfrom-s = 1.0", "frozen = true\nfrom-s = 1.0"] {
        let steps = with(fault, vec![ahead(40.0, OWN_LANE_M)]);
        let noticed = steps.iter().position(|step| step.health == Health::Failed).unwrap();
        assert_eq!(noticed as u32, 25 + NOTICED_AFTER_SCANS - 1, "{fault}");
    }
    assert!(tracks(&with("dead = true\nfrom-s = 1.0", vec![ahead(40.0, OWN_LANE_M)])).is_empty());
}

#[test]
fn a_blocked_sector_hides_the_side_that_it_names() {
    let beside = || vec![ahead(30.0, OWN_LANE_M), with_actor(2, ahead(30.0, LEFT_LANE_M))];
    assert_eq!(tracks(&with("dropout = 0.0", beside())).len(), 2);
    // The lane to the left lies 6 to 9 degrees to the left.
    let left = with("blocked-from-deg = 4.0\nblocked-to-deg = 20.0", beside());
    let [track] = tracks(&left)[..] else { panic!("{} tracks", tracks(&left).len()) };
    assert!(track.lane[1] > 0.9, "{:?}", track.lane);
    let right = with("blocked-from-deg = -20.0\nblocked-to-deg = -4.0", beside());
    assert_eq!(tracks(&right).len(), 2);
}

fn with_actor(actor: usize, vehicle: SceneVehicle) -> SceneVehicle {
    SceneVehicle { actor, ..vehicle }
}

#[test]
fn a_mounting_turned_to_the_left_moves_the_vehicle_to_the_right() {
    let y_m = |fault: &str| {
        let steps = with(fault, vec![ahead(40.0, OWN_LANE_M)]);
        tracks(&steps).first().map_or(f64::NAN, |track| track.y_m())
    };
    let moved_m = y_m("yaw-deg = 1.0") - y_m("yaw-deg = 0.0");
    // 1 degree at some 43 m.
    assert!((moved_m + 0.75).abs() < 0.15, "{moved_m} m");
}

#[test]
fn dirt_dropout_latency_and_a_wrong_clock_act_on_the_front_lidar() {
    let range = |fault: &str| tracks(&with(fault, vec![ahead(95.0, OWN_LANE_M)])).len();
    assert_eq!((range("dropout = 0.0"), range("window-transmission = 0.2"), range("dropout = 0.98")), (1, 0, 0));
    // The lead vehicle brakes at no time, so that only a clock that is wrong moves it: the ego
    // drives 30 m/s.
    let x_m = |fault: &str| tracks(&with(fault, vec![ahead(40.0, OWN_LANE_M)]))[0].x_m();
    assert!((x_m("delay-s = 0.2") - x_m("delay-s = 0.0")).abs() < 0.3);
    let first = |fault: &str| {
        with(fault, vec![ahead(40.0, OWN_LANE_M)])
            .iter()
            .position(|step| step.tracks.iter().any(|track| track.source == Source::Front))
            .unwrap()
    };
    assert_eq!(first("delay-s = 0.2") - first("delay-s = 0.0"), 5);
}

/// Position and status, in each step, of the confirmed front track of a vehicle `gap_m` ahead.
fn followed(fault: &str, lead: SceneVehicle) -> Vec<Option<(f64, TrackStatus)>> {
    let is_front = |track: &&Track| track.source == Source::Front && track.status != TrackStatus::Tentative;
    let shown = |step: &Step| step.tracks.iter().find(is_front).map(|track| (track.x_m(), track.status));
    with(fault, vec![lead]).iter().map(shown).collect()
}

/// Returns the output of the rear sensors in each step, with a car behind and a car ahead.
fn behind_with(fault: &str) -> Vec<Vec<Track>> {
    let others = vec![behind(40.0, OWN_LANE_M, 31.0), with_actor(2, ahead(40.0, OWN_LANE_M))];
    let of_rear = |step: Step| step.tracks.into_iter().filter(|track| track.source == Source::Rear).collect();
    with(fault, others).into_iter().map(of_rear).collect()
}

#[test]
fn a_wrong_clock_of_the_front_lidar_moves_a_lead_vehicle_by_its_closing_speed() {
    // The ego closes by 5 m/s: a scan that is dated 0.2 s too late puts the vehicle 1 m too far
    // away by the time it counts for.
    let x_m = |offset: &str| {
        let lead = with_speed(ahead(60.0, OWN_LANE_M), 25.0);
        followed(&format!("clock-offset-s = {offset}"), lead)[95].unwrap().0
    };
    let right_m = x_m("0.0");
    for (offset, expected_m) in [("-0.2", -1.0), ("-0.1", -0.5), ("0.1", 0.5), ("0.2", 1.0)] {
        let shift_m = x_m(offset) - right_m;
        assert!((shift_m - expected_m).abs() < 0.2, "{offset}: {shift_m}");
    }
}

#[test]
fn lost_frames_let_the_track_of_a_lead_vehicle_coast() {
    let coasting = |fault: &str| {
        let steps = followed(fault, ahead(40.0, OWN_LANE_M));
        steps.into_iter().flatten().filter(|(_, status)| *status == TrackStatus::Coasting).count()
    };
    let (usual, lossy) = (coasting("lost-frames = 0.0"), coasting("lost-frames = 0.5"));
    assert!(usual < 10 && (30..70).contains(&lossy), "{usual} {lossy}");
}

#[test]
fn jitter_of_the_front_lidar_makes_tracks_old_by_turns_and_loses_none() {
    let shown = |fault: &str| {
        let steps = followed(fault, with_speed(ahead(80.0, OWN_LANE_M), 20.0));
        let settled = || steps.iter().skip(50).flatten();
        (settled().count(), settled().filter(|(_, status)| *status == TrackStatus::Coasting).count())
    };
    assert_eq!(shown("jitter-s = 0.0"), (50, 0));
    assert_eq!(shown("jitter-s = 0.4"), (50, 0));
    let confirmed = |fault: &str| followed(fault, ahead(40.0, OWN_LANE_M)).iter().position(Option::is_some).unwrap();
    let (usual, jittered) = (confirmed("jitter-s = 0.0"), confirmed("jitter-s = 0.4"));
    assert!((usual + 1..=usual + 10).contains(&jittered), "{usual} {jittered}");
}

#[test]
fn a_wrong_pitch_or_height_of_the_front_lidar_raises_or_lowers_its_points() {
    let height_m = |fault: &str| {
        let text = format!("[[front-lidar]]\n{fault}\n");
        let drive =
            Drive { sensors: SENSORS, faults: &text, others: vec![ahead(40.0, OWN_LANE_M)], ..Drive::default() };
        mean(drive.run().iter().flat_map(|step| step.front_points_z_m.iter().copied()))
    };
    let right_m = height_m("dropout = 0.0");
    // The axis points upward, and the ego believes it to be level: an object lies higher than the
    // ego believes.
    assert!(height_m("pitch-deg = 1.0") < right_m - 0.3, "{} {right_m}", height_m("pitch-deg = 1.0"));
    assert!(height_m("pitch-deg = -1.0") > right_m + 0.3, "{} {right_m}", height_m("pitch-deg = -1.0"));
    assert!(height_m("height-m = -0.2") > right_m + 0.05 && height_m("height-m = 0.4") < right_m - 0.05);
}

#[test]
fn faults_of_the_front_lidar_leave_the_rear_tracks_as_they_are() {
    let usual = behind_with("dropout = 0.0");
    assert!(usual[99].iter().any(|track| track.status == TrackStatus::Confirmed));
    for fault in [
        "clock-offset-s = 0.2",
        "lost-frames = 0.5",
        "jitter-s = 0.4",
        "delay-s = 0.2",
        "pitch-deg = 2.0",
        "yaw-deg = 2.0",
        "height-m = 0.4",
        "dead = true",
        "crosstalk = 5.0",
    ] {
        let faulty = behind_with(fault);
        for (step, (usual, faulty)) in usual.iter().zip(&faulty).enumerate() {
            let states =
                |tracks: &[Track]| tracks.iter().map(|track| (track.state, track.covariance)).collect::<Vec<_>>();
            assert!(states(usual) == states(faulty), "{fault}, step {step}");
        }
    }
}

#[test]
fn faults_of_the_rear_lidar_leave_the_front_tracks_as_they_are() {
    let front = |fault: &str| -> Vec<_> {
        let others = vec![behind(40.0, OWN_LANE_M, 31.0), with_actor(2, ahead(40.0, OWN_LANE_M))];
        let steps = Drive { sensors: SENSORS, faults: fault, others, ..Drive::default() }.run();
        let of_front = |step: &Step| -> Vec<_> {
            step.tracks.iter().filter(|track| track.source == Source::Front).map(|track| track.state).collect()
        };
        steps.iter().map(of_front).collect()
    };
    let usual = front("");
    assert!(!usual[99].is_empty());
    for fault in ["dead = true", "clock-offset-s = 0.2", "pitch-deg = 2.0", "yaw-deg = 1.0", "jitter-s = 0.4"] {
        assert!(front(&lidar(fault)) == usual, "{fault}");
    }
}
