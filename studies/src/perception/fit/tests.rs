//! A fit finds the errors of a sensor that replaces the full chain. The shipped fit tells weather
//! and paint apart.

use std::path::Path;

use closecall_scenarios::source;
use closecall_traffic::{Appearance, Vehicle};

use super::errors::{Figures, Losses, figures, losses};
use super::*;
use crate::perception::approach::watching::{Seen, Step, steps};

fn file(settings: &[&str]) -> ScenarioFile {
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().unwrap()).collect();
    source::load(Path::new("low-thw-overtake"), &settings).unwrap()
}

#[test]
fn known_errors_and_losses_are_found_again() {
    let file = file(&[]);
    let plan = FitPlan { file: &file, seed: 0, approaches: 24, command: String::new(), version: String::new() };
    let mut fitter = Fitter::new(&plan).unwrap();
    let scenario = file.concrete(&file.space().nominal()).unwrap();
    let sensors = scenario.sensors.with_mode(SensorMode::Object);
    // These errors differ from the start of a fit, and each axis has different ones.
    let true_errors = FittedErrors {
        white_sd_m: [0.08, 0.02],
        far_white_sd_m: [0.3, 0.15],
        slow_sd_m: [0.15, 0.06],
        far_slow_sd_m: [0.2, 0.1],
        slow_time_s: [4.0, 0.6],
        all_scans_share: 0.5,
        lost_share: 0.5,
    };
    fitter.lidar = sensors.with_rear_errors(true_errors);
    let usual = Case::usual();
    let appearance = Appearance { paint_reflectivity: usual.paint, ..Vehicle::typical(usual.class).appearance };
    let usual_range_m = RearFit::shipped().unwrap().range_m(usual.class, &appearance, &usual.environment);
    let fitted = fitter.errors_at(&Case::usual(), &sensors, usual_range_m).unwrap().unwrap();
    let near = |figure: &str, fitted: f64, expected: f64, share: f64| {
        assert!((fitted / expected - 1.0).abs() < share, "{figure}: {fitted} instead of {expected}");
    };
    near("slow along", fitted.slow_sd_m[0], true_errors.slow_sd_m[0], 0.2);
    near("slow across", fitted.slow_sd_m[1], true_errors.slow_sd_m[1], 0.2);
    near("all scans", fitted.all_scans_share, true_errors.all_scans_share, 0.05);
    near("lost", fitted.lost_share, true_errors.lost_share, 0.05);
    // The fit asks for equal tracks, which other white errors can give, too. Under other noise than
    // the noise of the fit, they are equal.
    let from_m = losses(&series(&fitter.lidar, &scenario, &Case::usual())).from_m;
    let tracks = |errors| {
        let sensors = scenario.sensors.with_mode(SensorMode::Object).with_rear_errors(errors);
        tracks(&sensors, &scenario, &Case::usual(), from_m)
    };
    let [of_fitted, of_true] = [fitted, true_errors].map(tracks);
    for (figure, (fitted, expected)) in of_fitted.near.into_iter().zip(of_true.near).enumerate() {
        near(&format!("figure {figure}"), fitted, expected, if figure < 4 { 0.2 } else { 0.5 });
    }
    for (figure, (fitted, expected)) in of_fitted.far.unwrap().into_iter().zip(of_true.far.unwrap()).enumerate() {
        near(&format!("far figure {figure}"), fitted, expected, 0.2);
    }
    // The far errors are larger, and not only because a scan is lost.
    let without = tracks(FittedErrors {
        far_white_sd_m: true_errors.white_sd_m,
        far_slow_sd_m: true_errors.slow_sd_m,
        ..true_errors
    })
    .far
    .unwrap();
    assert!(of_fitted.far.unwrap()[2] > 1.2 * without[2], "{of_fitted:?} {without:?}");
}

#[test]
fn an_ego_whose_nose_dips_sees_a_dark_car_from_farther_away() {
    // A layer of the LiDAR then meets the plate farther away: by 5 m under 0.008°.
    let file = file(&[]);
    let plan = FitPlan { file: &file, seed: 0, approaches: 3, command: String::new(), version: String::new() };
    let fitter = Fitter::new(&plan).unwrap();
    let [lifted, level, dipped] =
        [-1.4e-4, 0.0, 1.4e-4].map(|pitch_rad| fitter.pitched_by(pitch_rad, &[0.05], &[10_000.0]).unwrap());
    assert_eq!([level.range["saloon"][0][0], level.class_range["saloon"][0][0]], [1.0, 1.0]);
    // Whether a layer meets the lamps of a dark SUV depends on its place in the lane.
    assert!(level.spread["suv"][0][0] > 0.1 && level.spread["saloon"][0][0] < 0.04, "{:?}", level.spread);
    for shape in ["saloon", "city-car"] {
        let ratio = |shapes: &PitchedShapes| shapes.range[shape][0][0] / level.range[shape][0][0];
        let [lifted, dipped] = [&lifted, &dipped].map(ratio);
        assert!((0.9..0.98).contains(&lifted) && (1.03..1.1).contains(&dipped), "{shape}: {lifted} {dipped}");
    }
}

#[test]
fn losses_begin_where_scans_are_lost() {
    let step = |gap_m: f64, is_coasting| Step { gap_m, seen: Some(Seen { errors: [0.0; 4], is_coasting }) };
    // From 100 m on. Beyond 60 m every other scan is lost.
    let gap_m = |index: i32| 100.0 - 0.5 * f64::from(index);
    let series: Vec<Step> = (0..160).map(|index| step(gap_m(index), index < 80 && index % 2 == 1)).collect();
    let none: Vec<Step> = series.iter().map(|series_step| step(series_step.gap_m, false)).collect();
    let fitted @ Losses { from_m, lost_share } = losses(&[series]);
    assert!((from_m - 60.0).abs() < 2.0 && (lost_share - 0.5).abs() < 0.02, "{fitted:?}");
    assert_eq!(losses(&[none]).lost_share, 0.0);
}

/// Returns the steps of the tracks of a case.
fn series(sensors: &Sensors, scenario: &Scenario, case: &Case) -> Vec<Vec<Step>> {
    let run_steps = |run| steps(case, sensors, &scenario.road, Address { seed: 5, run }, 20.0).unwrap();
    (0..24).map(run_steps).collect()
}

/// Returns the figures of the tracks of a case. Vehicles beyond `from_m` (m) are far.
fn tracks(sensors: &Sensors, scenario: &Scenario, case: &Case, from_m: f64) -> Figures {
    figures(&series(sensors, scenario, case), from_m).unwrap()
}

/// Returns the figures of the tracks of a car at object level, of a paint (-) in fog of a
/// visibility (m).
fn car(file: &ScenarioFile, paint: f64, visibility_m: f64) -> [f64; 6] {
    let scenario = file.concrete(&file.space().nominal()).unwrap();
    let case = Fitter::case(VehicleClass::Car, paint, Plate::Clean, visibility_m);
    tracks(&scenario.sensors.with_mode(SensorMode::Object), &scenario, &case, f64::INFINITY).near
}

#[test]
fn a_dark_car_in_fog_errs_more_across_than_a_light_one_and_a_car_in_fog_more_along() {
    let fitted = file(&[]);
    let [clear, fog, light, dark] =
        [(0.5, 10_000.0), (0.5, 100.0), (0.5, 300.0), (0.1, 300.0)].map(|(paint, m)| car(&fitted, paint, m));
    assert!(dark[1] > 1.3 * light[1], "across: {dark:?} {light:?}");
    assert!(fog[0] > 2.0 * clear[0], "along: {fog:?} {clear:?}");
    // Errors that the scenario gives hold for all vehicles.
    let with_errors = file(&[
        "sensors.rear-object.range-sd-m=0.05",
        "sensors.rear-object.lateral-sd-m=0.05",
        "sensors.rear-object.drift-sd-m=0.1",
        "sensors.rear-object.drift-time-s=1.0",
        "sensors.rear-object.dropout=0.0",
    ]);
    // The errors of the speed depend on the time since the vehicle came into range, which differs.
    let [dark, light] = [0.1, 0.5].map(|paint| car(&with_errors, paint, 10_000.0)[1]);
    assert!((dark / light - 1.0).abs() < 0.1, "{dark} {light}");
}

#[test]
fn errors_on_a_bound_are_warned_about() {
    let mut fit = RearFit::shipped().unwrap().clone();
    fit.errors.truck.slow_along_time_s.iter_mut().flatten().for_each(|time_s| *time_s = 5.0);
    let before = at_bounds(&fit);
    assert!(!before.iter().any(|warning| warning.contains("truck.slow-along-time-s")), "{before:?}");
    fit.errors.truck.slow_along_time_s[0][1] = 20.0;
    let warnings = at_bounds(&fit);
    assert_eq!(warnings.len(), before.len() + 1);
    assert!(
        warnings.iter().any(|warning| warning.contains("`errors.truck.slow-along-time-s`: 1 of its values")),
        "{warnings:?}"
    );
}
