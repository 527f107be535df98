//! Faults of the rear camera.

use super::*;

/// Returns the mean score that the image of a car behind gives to its class, at these gaps.
fn score(fault: &str, environment: Environment, gaps_m: &[f64]) -> f64 {
    let text = format!("[[rear-camera]]\n{fault}\n");
    let fault = faults(&text).unwrap().rear_camera.at(Time::ZERO);
    let camera = crate::camera::CameraConfig::default().check(&Parameters::default()).unwrap();
    let mut classifier = CropClassifier::new(camera, &Backend::Tract).unwrap();
    let road = Road::straight(3);
    let ego = with_speed(scene_vehicle(0, VehicleClass::Car, EGO_S_M, OWN_LANE_M), 30.0);
    mean(gaps_m.iter().flat_map(|gap_m| (0..10).map(move |key| (*gap_m, key))).map(|(gap_m, key)| {
        let others = [behind(gap_m, OWN_LANE_M, 30.0)];
        let scene = Scene { time: Time::ZERO, road: &road, environment: &environment, ego, others: &others };
        let size = others[0].vehicle.dimensions;
        let mut detections = [Detection {
            time: Time::ZERO,
            face_x_m: -gap_m - 0.5 * size.length_m,
            face_y_m: 0.0,
            range_sd_m: 0.1,
            lateral_sd_m: 0.1,
            heading_rad: 0.0,
            length_m: size.length_m,
            length: Extent::Assumed,
            width_m: size.width_m,
            width: Extent::Seen,
            top_m: size.height_m,
            seen_by: crate::SeenBy::Lidar,
            points: 20,
            is_centred: false,
            seen: crate::SeenPart::FACE,
            class: ClassScores::UNKNOWN,
        }];
        let seen = ImagedScene { now: &scene, imaged: &scene, fault: fault.as_ref() };
        let key = ExposureKey(key);
        classifier.classify_with(seen, key, &mut ImageMemory::default(), &mut detections).unwrap();
        detections[0].class.0[VehicleClass::Car as usize]
    }))
}

#[test]
fn dirt_and_blur_cost_the_classification_of_a_car() {
    let gaps_m = [25.0, 40.0, 60.0];
    let usual = score("dirt = 0.0", Environment::CLEAR_DAY, &gaps_m);
    assert!(usual > 0.9, "{usual}");
    for fault in ["dirt = 0.6", "blur-px = 20.0"] {
        let spoilt = score(fault, Environment::CLEAR_DAY, &gaps_m);
        assert!(spoilt < usual - 0.05, "{fault}: {spoilt} of {usual}");
    }
}

#[test]
fn the_main_beam_blinds_at_night_and_adds_up() {
    let night = Environment { light: Light::Night, ..Environment::CLEAR_DAY };
    let at_night = |fault| score(fault, night, &[25.0, 60.0]);
    let [usual, blinded] = ["main-beam-glare = 0.0", "main-beam-glare = 10.0"].map(at_night);
    assert!(usual > blinded + 0.3, "{blinded} of {usual}");
    let by_day = |fault| score(fault, Environment::CLEAR_DAY, &[25.0]);
    assert_eq!(by_day("main-beam-glare = 10.0"), by_day("main-beam-glare = 0.0"));
    let two = faults("[[rear-camera]]\nsun-glare = 1.0\n[[rear-camera]]\nsun-glare = 0.5\n").unwrap();
    assert_eq!(two.rear_camera.at(Time::ZERO).unwrap().sun_glare, 1.5);
}

#[test]
fn a_dead_or_frozen_camera_is_noticed_after_a_second_and_one_frozen_before_the_vehicle_came_shows_none() {
    let run = |fault: &str| {
        let text = format!("[[rear-camera]]\n{fault}\n");
        // The car appears from beyond the range, long after the camera has failed.
        let others = vec![behind(45.0, OWN_LANE_M, 30.0)];
        Drive { sensors: "mode = \"full\"", faults: &text, others, steps: 60, ..Drive::default() }.run()
    };
    for fault in ["dead = true\nfrom-s = 1.0", "frozen = true\nfrom-s = 1.0"] {
        let noticed = run(fault).iter().position(|step| step.health == Health::Failed).unwrap();
        assert_eq!(noticed as u32, 25 + NOTICED_AFTER_SCANS - 1, "{fault}");
    }
    let car = |steps: &[Step]| steps[59].rear().unwrap().class.0[VehicleClass::Car as usize];
    assert!(car(&run("dead = true")) < car(&run("dirt = 0.0")), "only the shape is left");
}
