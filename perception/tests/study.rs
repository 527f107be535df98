//! A small study: what must hold of any sensor that looks by light, and that the result does not depend on the threads.

use std::path::Path;

use closecall_perception::figures::Figures;
use closecall_perception::output::Studies;
use closecall_perception::{Extent, Study, StudyError};
use closecall_sensors::SensorMode;
use closecall_simulation::scenario::source;

fn study(settings: &[&str], mode: SensorMode, runs: u64) -> Result<Study, StudyError> {
    let settings: Vec<_> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    let file = source::load(Path::new("low-thw-overtake"), &settings).expect("a scenario of the library");
    Study::of(&file, Some(mode), 5, Extent::Runs(runs))
}

/// Returns the study of the LiDAR without the camera, which no detection depends on.
fn of_lidar(runs: u64) -> Study {
    study(&["sensors.rear-camera.pipeline=\"off\""], SensorMode::Full, runs).expect("no model fails")
}

fn figures<'a>(study: &'a Study, name: &str) -> &'a Figures {
    let found = study.cases.iter().find(|(case, _)| case.name.starts_with(name));
    &found.unwrap_or_else(|| panic!("no case {name}")).1
}

#[test]
fn detection_falls_with_distance_darker_paint_rain_and_fog() {
    let study = of_lidar(8);
    let range_m = |name: &str| figures(&study, name).range_m.value;
    let falls = |names: &[&str]| {
        let ranges_m: Vec<f64> = names.iter().map(|name| range_m(name)).collect();
        assert!(ranges_m.windows(2).all(|pair| pair[0] > pair[1] - 1.0), "{names:?}: {ranges_m:?}");
        assert!(ranges_m[0] > ranges_m[ranges_m.len() - 1] + 10.0, "{names:?}: {ranges_m:?}");
    };
    falls(&["paint 0.8", "usual", "paint 0.35", "paint 0.2"]);
    falls(&["usual", "rain 10", "rain 30"]);
    falls(&["usual", "fog, visibility 200", "fog, visibility 100"]);
    falls(&["truck", "usual", "motorcycle"]);
    falls(&["car 25 m behind, 1.9 m aside", "car 25 m behind, in line"]);
    for (case, of) in study.cases.iter().filter(|(case, _)| !matches!(case.factor, "fault" | "traffic")) {
        let shares: Vec<f64> = of.curve.iter().map(|point| point.confirmed.value).collect();
        assert!(shares.windows(2).all(|pair| pair[0] >= pair[1] - 0.26), "{}: {shares:?}", case.name);
        assert!(
            shares[0] > 0.99 && of.curve.iter().all(|point| point.confirmed.interval_95[0] <= point.confirmed.value)
        );
    }
}

#[test]
fn faults_show_where_they_act() {
    let study = of_lidar(4);
    let usual = figures(&study, "usual");
    let of = |name: &str| figures(&study, &format!("fault: {name}"));
    let rmse = |figures: &Figures, index: usize| figures.errors.unwrap()[index].rmse.value;
    assert!(rmse(of("lidar-misaligned"), 1) > 5.0 * rmse(usual, 1));
    assert!(rmse(of("lidar-clock-offset"), 0) > 3.0 * rmse(usual, 0));
    assert!(rmse(of("lidar-noisy"), 0) > 3.0 * rmse(usual, 0));
    assert!(of("lidar-dirty").range_m.value < usual.range_m.value - 10.0);
    assert!(of("lidar-dead").unavailable.value > 0.3 && usual.unavailable.value == 0.0);
    assert!(of("lidar-dead").confirmed_after_s.is_none() && usual.confirms.value == 1.0);
    assert!(of("lidar-late").confirmed_after_s.unwrap().value > usual.confirmed_after_s.unwrap().value + 0.15);
    assert!(of("lidar-misaligned").nees.unwrap().value > 10.0);
}

#[test]
fn the_object_level_sensor_detects_as_the_full_chain_does() {
    let (full, object) = (of_lidar(6), study(&[], SensorMode::Object, 6).unwrap());
    let range_m = |study: &Study, name: &str| figures(study, name).range_m.value;
    let falls = |names: &[&str]| {
        let ranges_m: Vec<f64> = names.iter().map(|name| range_m(&object, name)).collect();
        assert!(ranges_m.windows(2).all(|pair| pair[0] > pair[1] - 2.0), "{names:?}: {ranges_m:?}");
        assert!(ranges_m[0] > ranges_m[ranges_m.len() - 1] + 10.0, "{names:?}: {ranges_m:?}");
    };
    falls(&["paint 0.8", "usual", "paint 0.35", "paint 0.2"]);
    falls(&["usual", "rain 10", "rain 30"]);
    falls(&["usual", "fog, visibility 200", "fog, visibility 100"]);
    falls(&["truck", "usual", "motorcycle"]);
    falls(&["paint 0.2", "fog, visibility 100"]);
    for name in [
        "usual",
        "paint 0.1,",
        "paint 0.2",
        "paint 0.8",
        "fog, visibility 200",
        "fog, visibility 100",
        "night",
        "motorcycle",
    ] {
        let [object_m, full_m] = [&object, &full].map(|study| range_m(study, name));
        assert!((object_m / full_m - 1.0).abs() < 0.12, "{name}: {object_m} m instead of {full_m} m");
    }
    // A usual car has the errors of the full chain, too.
    let rmse = |study: &Study, axis: usize| figures(study, "usual").errors.unwrap()[axis].rmse.value;
    for (axis, unit) in ["along", "across", "speed"].iter().enumerate() {
        let ratio = rmse(&object, axis) / rmse(&full, axis);
        assert!((0.4..2.5).contains(&ratio), "{unit}: {ratio}");
    }
}

#[test]
fn one_thread_and_several_give_the_same_bits() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Studies(vec![study(&[], SensorMode::Object, 3).unwrap()]).json().to_string())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn true_tracks_are_refused_and_the_files_of_two_configurations_are_written() {
    assert!(study(&[], SensorMode::GroundTruth, 1).unwrap_err().to_string().contains("ground-truth"));
    let one = study(&[], SensorMode::Object, 2).unwrap();
    let other = study(&["sensors.rear-object.range-m=60"], SensorMode::Object, 2).unwrap();
    assert!(figures(&other, "usual").range_m.value < figures(&one, "usual").range_m.value - 30.0);
    let folder = tempfile::tempdir().unwrap();
    let studies = Studies(vec![one, other]);
    let paths = studies.write(folder.path()).unwrap();
    assert_eq!(paths.len(), 4);
    let page = std::fs::read_to_string(&paths[0]).unwrap();
    assert!(page.contains("<svg") && page.contains("against") && !page.contains("NaN") && !page.contains("inf"));
    assert_eq!(studies.json().as_array().unwrap().len(), 2);
}
