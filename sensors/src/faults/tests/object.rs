//! Faults of the object-level sensors.

use super::*;

fn object(sensor: &str, fault: &str, others: Vec<SceneVehicle>) -> Vec<Step> {
    let text = format!("[[{sensor}]]\n{fault}\n");
    Drive { sensors: "mode = \"object\"", faults: &text, others, ..Drive::default() }.run()
}

#[test]
fn an_object_level_sensor_loses_measurements_and_is_late() {
    let near = || vec![behind(40.0, OWN_LANE_M, 30.0)];
    let coasting = |fault: &str| {
        let steps = object("rear-object", fault, near());
        steps.iter().filter_map(Step::rear).filter(|track| track.status == TrackStatus::Coasting).count()
    };
    assert!(coasting("dropout = 0.6") > coasting("dropout = 0.0") + 20);
    let confirmed = |fault: &str| first_confirmed(&object("rear-object", fault, near())).unwrap();
    assert_eq!(confirmed("delay-s = 0.2"), confirmed("delay-s = 0.0") + 5);
}

#[test]
fn a_dead_object_level_sensor_is_silent_and_a_frozen_one_repeats_itself_until_it_is_noticed() {
    for sensor in ["rear-object", "front-radar"] {
        let place = |speed_mps| match sensor {
            "rear-object" => vec![behind(60.0, OWN_LANE_M, speed_mps)],
            _ => vec![with_speed(scene_vehicle(1, VehicleClass::Car, EGO_S_M + 60.0, OWN_LANE_M), speed_mps)],
        };
        let dead = object(sensor, "dead = true\nfrom-s = 2.0", place(33.0));
        assert!(!dead[49].tracks.is_empty() && dead[50].tracks.is_empty(), "{sensor}");
        let noticed = dead.iter().position(|step| step.health == Health::Failed).unwrap();
        assert_eq!(noticed as u32, 50 + NOTICED_AFTER_SCANS - 1, "{sensor}");
        let frozen = object(sensor, "frozen = true\nfrom-s = 2.0\nuntil-s = 3.5", place(33.0));
        assert_eq!(frozen[50].tracks[0].state, frozen[80].tracks[0].state);
        assert_ne!(frozen[49].tracks[0].state, frozen[90].tracks[0].state);
        assert_eq!((frozen[80].health, frozen[95].health), (Health::Failed, Health::Ok));
    }
}

#[test]
fn a_ghost_is_a_track_without_a_vehicle_that_approaches_as_stated() {
    let steps =
        object("rear-object", "ghost-gap-m = 50.0\nghost-closing-mps = 10.0\nfrom-s = 1.0\nuntil-s = 3.0", vec![]);
    assert!(steps[24].tracks.is_empty() && steps[75].tracks.is_empty());
    let [first, last] = [25, 74].map(|step| steps[step].rear().unwrap().clone());
    assert_eq!(first.id, last.id);
    assert!((last.x_m() - first.x_m() - 10.0 * 49.0 * PERIOD_S).abs() < 1e-9);
    assert!((first.vx_mps() - 40.0).abs() < 1e-9 && first.lane[1] > 0.99);
}

#[test]
fn a_sensor_that_loses_every_measurement_is_noticed_after_a_second_and_one_that_loses_many_is_not() {
    for (dropout, noticed) in [("1.0", Some(50 + NOTICED_AFTER_SCANS - 1)), ("0.6", None)] {
        let fault = format!("dropout = {dropout}\nfrom-s = 2.0");
        let steps = object("rear-object", &fault, vec![behind(40.0, OWN_LANE_M, 30.0)]);
        let failed_at = steps.iter().position(|step| step.health == Health::Failed);
        assert_eq!(failed_at.map(|step| step as u32), noticed, "{dropout}");
    }
    let alone = object("rear-object", "dropout = 1.0", vec![]);
    assert!(alone.iter().all(|step| step.health == Health::Ok), "nothing is there to be lost");
}

#[test]
fn a_latency_that_starts_and_ends_moves_no_track_beyond_its_motion() {
    let fault = "delay-s = 0.28\nfrom-s = 1.5\nuntil-s = 3.0";
    let steps = object("rear-object", fault, vec![behind(70.0, OWN_LANE_M, 40.0)]);
    let confirmed = first_confirmed(&steps).unwrap();
    assert!(confirmed < 35, "{confirmed}");
    for (step, pair) in steps.windows(2).enumerate().skip(confirmed) {
        let [before_m, after_m] = [0, 1].map(|at| pair[at].rear().unwrap().x_m());
        let jump_m = after_m - before_m - 10.0 * PERIOD_S;
        assert!(jump_m.abs() < 1.0, "step {step}: {jump_m} m");
    }
}

#[test]
fn a_ghost_goes_on_while_another_fault_begins() {
    let faults = "[[rear-object]]\nghost-gap-m = 50.0\nghost-closing-mps = 10.0\nfrom-s = 1.0\n\
                  [[rear-object]]\ndelay-s = 0.2\nfrom-s = 2.0\n";
    let steps = Drive { sensors: "mode = \"object\"", faults, others: vec![], ..Drive::default() }.run();
    let [first, last] = [25, 75].map(|step| steps[step].rear().unwrap().x_m());
    assert!((last - first - 10.0 * 50.0 * PERIOD_S).abs() < 1e-9, "{first} {last}");
}
