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
    let [own] = tracks(&left)[..] else { panic!("{} tracks", tracks(&left).len()) };
    assert!(own.lane[1] > 0.9, "{:?}", own.lane);
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
    // The lead vehicle brakes at no time, so that only a clock that is wrong moves it: the ego drives 30 m/s.
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
