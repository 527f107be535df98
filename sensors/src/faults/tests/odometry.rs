//! Errors of odometry and map, in the full chain and with object-level sensors.

use super::*;

const MODES: [&str; 2] = ["mode = \"full\"\nrear-camera.pipeline = \"off\"", ""];

/// Returns the track of a car behind after 95 steps.
fn seen(sensors: &str, errors: &str, car: SceneVehicle) -> Track {
    let faults = format!("[odometry]\n{errors}\n");
    Drive { sensors, faults: &faults, others: vec![car], ..Drive::default() }.run()[95].rear().unwrap().clone()
}

#[test]
fn wrong_odometry_changes_the_speeds_and_the_lanes_of_others_and_nothing_else() {
    for sensors in ["mode = \"full\"\nrear-camera.pipeline = \"off\"", ""] {
        let run = |faults: &str| {
            let others = vec![behind(50.0, OWN_LANE_M, 32.0)];
            Drive { sensors, faults, others, ..Drive::default() }.run()[95].rear().unwrap().clone()
        };
        let (usual, fast) = (run(""), run("[odometry]\nspeed-scale = 0.03"));
        assert!((fast.vx_mps() - usual.vx_mps() - 0.03 * 30.0).abs() < 0.05, "{} {}", fast.vx_mps(), usual.vx_mps());
        assert!((fast.x_m() - usual.x_m()).abs() < 0.1);
        let aside = run("[odometry]\nlateral-m = 1.0");
        assert!((aside.y_m() - usual.y_m()).abs() < 0.05, "{} {}", aside.y_m(), usual.y_m());
    }
}

#[test]
fn a_wrong_heading_moves_a_vehicle_behind_to_another_lane_but_not_relative_to_the_ego() {
    // The vehicle is 72 m behind the ego's middle. To an ego that believes itself to be turned to
    // the left, what lies straight behind it lies to the right on the map: by 2.5 m for 2 degrees,
    // which is the lane to the right.
    for sensors in MODES {
        let car = || behind(67.5, OWN_LANE_M, 30.0);
        let usual = seen(sensors, "", car());
        assert!(usual.lane[1] > 0.99, "{sensors}: {:?}", usual.lane);
        for (heading, lane) in [("2.0", 2), ("-2.0", 0)] {
            let turned = seen(sensors, &format!("heading-deg = {heading}"), car());
            assert!(turned.lane[lane] > 0.95, "{sensors} {heading}: {:?}", turned.lane);
            assert!((turned.y_m() - usual.y_m()).abs() < 0.1, "{sensors} {heading}: {} {}", turned.y_m(), usual.y_m());
            assert!((turned.x_m() - usual.x_m()).abs() < 0.15, "{sensors} {heading}: {} {}", turned.x_m(), usual.x_m());
        }
    }
}

#[test]
fn a_map_that_bends_too_far_to_the_left_puts_a_vehicle_behind_too_far_to_the_right() {
    // The own lane on such a map lies to the left of a straight line behind the ego, too: by 72² /
    // 2 · 0.001 = 2.6 m.
    for sensors in MODES {
        let car = || behind(67.5, OWN_LANE_M, 30.0);
        let usual = seen(sensors, "", car());
        for (curvature, lane) in [("0.001", 2), ("-0.001", 0)] {
            let bent = seen(sensors, &format!("curvature-per-m = {curvature}"), car());
            assert!(bent.lane[lane] > 0.95, "{sensors} {curvature}: {:?}", bent.lane);
            assert!((bent.y_m() - usual.y_m()).abs() < 0.2, "{sensors} {curvature}: {} {}", bent.y_m(), usual.y_m());
        }
    }
}

#[test]
fn lanes_that_are_too_wide_on_the_map_take_a_vehicle_near_the_marking_into_the_own_lane() {
    // The car is 2.1 m to the left of the ego. The own lane ends at 1.9 m, on the map with lanes of
    // 4.75 m at 2.4 m.
    for sensors in MODES {
        let car = || behind(40.0, OWN_LANE_M + 2.1, 30.0);
        let (usual, wide) = (seen(sensors, "", car()), seen(sensors, "lane-width-m = 1.0", car()));
        assert!(usual.lane[0] > 0.8 && wide.lane[1] > 0.8, "{sensors}: {:?} {:?}", usual.lane, wide.lane);
        let narrow = seen(sensors, "lane-width-m = -1.0", behind(40.0, OWN_LANE_M + 1.6, 30.0));
        assert!(narrow.lane[0] > 0.8, "{sensors}: {:?}", narrow.lane);
        assert!((wide.y_m() - usual.y_m()).abs() < 0.1, "{sensors}: {} {}", wide.y_m(), usual.y_m());
    }
}

#[test]
fn an_ego_keeps_its_place_between_the_markings_of_a_map_with_other_widths() {
    let errors = |text| toml::from_str::<OdometryErrorConfig>(text).unwrap().check(&Parameters::default()).unwrap();
    let road = Road::straight(3).with_lane_widths(&[3.0, 3.5, 4.0]);
    let wide = errors("lane-width-m = 0.5");
    let map = wide.map_of(&road);
    assert_eq!(map.lane_widths_m(0.0).collect::<Vec<_>>(), [3.5, 4.0, 4.5]);
    // At the edges, at the centre and a quarter of the way through the lanes.
    for (d_m, on_map_m) in [(0.0, 0.0), (-3.0, -3.5), (-4.75, -5.5), (-7.5, -8.625), (-10.5, -12.0)] {
        let own_d_m = wide.own_d_m(&road, 0.0, d_m);
        assert!((own_d_m - on_map_m).abs() < 1e-12, "{d_m}: {own_d_m}");
    }
    let lateral = errors("lateral-m = 0.25");
    assert_eq!((lateral.map_of(&road), lateral.own_d_m(&road, 0.0, -4.75)), (road.clone(), -4.5));
    // A width beyond the range of a road is at its end.
    let narrow = errors("lane-width-m = -1.0").map_of(&road);
    assert_eq!(narrow.lane_widths_m(0.0).collect::<Vec<_>>(), [2.5, 2.5, 3.0]);
}

#[test]
fn errors_of_odometry_and_map_hold_from_their_start_to_their_end() {
    for errors in ["lateral-m = 1.0", "heading-deg = 2.0", "curvature-per-m = 0.0005", "lane-width-m = 0.5"] {
        let run = |errors: &str| {
            let faults = format!("[odometry]\n{errors}\n");
            let others = vec![behind(50.0, OWN_LANE_M, 30.0)];
            let steps = Drive { sensors: "mode = \"object\"", faults: &faults, others, ..Drive::default() }.run();
            steps.into_iter().map(|step| step.tracks).collect::<Vec<_>>()
        };
        let (usual, wrong) = (run(""), run(&format!("{errors}\nfrom-s = 1.0\nuntil-s = 1.4")));
        assert_eq!(usual[..25], wrong[..25], "{errors}");
        assert_ne!(usual[26], wrong[26], "{errors}");
        // The filters have forgotten it.
        let [usual_m, wrong_m] = [&usual, &wrong].map(|tracks| tracks[99][0].y_m());
        assert!((usual_m - wrong_m).abs() < 0.05, "{errors}: {usual_m} {wrong_m}");
    }
}

#[test]
fn a_speed_that_was_wrong_for_a_while_leaves_no_jump_behind() {
    let faults = "[odometry]\nspeed-scale = 0.1\nfrom-s = 1.0\nuntil-s = 3.0";
    let others = vec![behind(50.0, OWN_LANE_M, 30.0)];
    let steps = Drive { sensors: "mode = \"object\"", faults, others, ..Drive::default() }.run();
    // The ego believes to have driven 6 m too far.
    assert!((steps[70].rear().unwrap().vx_mps() - 33.0).abs() < 0.3, "{}", steps[70].rear().unwrap().vx_mps());
    for (step, pair) in steps.windows(2).enumerate().skip(30) {
        let [before_m, after_m] = [0, 1].map(|at| pair[at].rear().unwrap().x_m());
        assert!((after_m - before_m).abs() < 0.5, "step {step}: {before_m} {after_m}");
    }
}

#[test]
fn a_map_without_the_rails_lets_their_mirror_images_become_vehicles_beside_the_road() {
    let run = |errors: &str| {
        let faults = format!("[[rear-lidar]]\nrail-ghosts = 0.5\n[odometry]\n{errors}\n");
        // A car with its middle 4.2 m to the left of the ego. The rail is at 6.4 m, its image at
        // 8.6 m.
        let others = vec![behind(25.0, LEFT_LANE_M + 0.45, 30.0)];
        Drive { sensors: MODES[0], faults: &faults, others, has_rails: true, ..Drive::default() }.run()
    };
    let beside = |steps: &[Step]| {
        let is_ghost = |track: &&Track| {
            track.source == Source::Rear && track.status == TrackStatus::Confirmed && track.y_m() > 7.4
        };
        let tracks: Vec<Track> = steps.iter().flat_map(|step| step.tracks.iter().filter(is_ghost).cloned()).collect();
        tracks
    };
    assert!(beside(&run("")).is_empty(), "the map keeps them away");
    let ghosts = beside(&run("rails-missing = true"));
    assert!(ghosts.len() > 30, "{} of 100 steps", ghosts.len());
    assert!(ghosts.iter().any(|track| (track.x_m() + 29.6).abs() < 2.0), "abreast of the car");
    // They are in no lane, so no function acts on them.
    assert!(ghosts.iter().all(|track| track.lane.iter().all(|probability| *probability < 0.1)), "{:?}", ghosts[0].lane);
}
