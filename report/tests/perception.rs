//! A small study. Some relations must hold for any optical sensor, and the result does not depend
//! on the threads.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::Command;

use closecall_report::perception::Studies;
use closecall_scenarios::source;
use closecall_sensors::SensorMode;
use closecall_studies::perception::figures::Figures;
use closecall_studies::perception::{Extent, Study, StudyError};
use closecall_testing::browser;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::Value;

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
    let case = study.cases.iter().find(|(case, _)| case.name.starts_with(name));
    &case.unwrap_or_else(|| panic!("no case {name}")).1
}

/// Asserts that the detection ranges fall in these lists of cases and in `more`, except for `tolerance_m`.
fn assert_ranges_fall(study: &Study, tolerance_m: f64, more: &[&str]) {
    for names in [
        &["paint 0.8", "usual", "paint 0.35", "paint 0.2"][..],
        &["usual", "rain 10", "rain 30"],
        &["usual", "fog, visibility 200", "fog, visibility 100"],
        &["truck", "usual", "motorcycle"],
        more,
    ] {
        let ranges_m: Vec<f64> = names.iter().map(|name| figures(study, name).range_m.value).collect();
        assert!(ranges_m.windows(2).all(|pair| pair[0] > pair[1] - tolerance_m), "{names:?}: {ranges_m:?}");
        assert!(ranges_m[0] > ranges_m[ranges_m.len() - 1] + 10.0, "{names:?}: {ranges_m:?}");
    }
}

#[test]
fn detection_falls_with_distance_darker_paint_rain_and_fog() {
    let study = of_lidar(8);
    assert_ranges_fall(&study, 1.0, &["car 25 m behind, 1.9 m aside", "car 25 m behind, in line"]);
    for (case, figures) in study.cases.iter().filter(|(case, _)| !matches!(case.factor, "fault" | "traffic")) {
        let shares: Vec<f64> = figures.curve.iter().map(|point| point.confirmed.value).collect();
        assert!(shares.windows(2).all(|pair| pair[0] >= pair[1] - 0.26), "{}: {shares:?}", case.name);
        assert!(
            shares[0] > 0.99
                && figures.curve.iter().all(|point| point.confirmed.interval_95[0] <= point.confirmed.value)
        );
    }
}

#[test]
fn faults_show_where_they_act() {
    let study = of_lidar(4);
    let usual = figures(&study, "usual");
    let fault = |name: &str| figures(&study, &format!("fault: {name}"));
    let rmse = |figures: &Figures, index: usize| figures.errors.unwrap()[index].rmse.value;
    assert!(rmse(fault("lidar-misaligned"), 1) > 5.0 * rmse(usual, 1));
    assert!(rmse(fault("lidar-clock-offset"), 0) > 3.0 * rmse(usual, 0));
    assert!(rmse(fault("lidar-noisy"), 0) > 3.0 * rmse(usual, 0));
    assert!(fault("lidar-dirty").range_m.value < usual.range_m.value - 10.0);
    assert!(fault("lidar-dead").unavailable.value > 0.3 && usual.unavailable.value == 0.0);
    assert!(fault("lidar-dead").confirmed_after_s.is_none() && usual.confirms.value == 1.0);
    assert!(fault("lidar-late").confirmed_after_s.unwrap().value > usual.confirmed_after_s.unwrap().value + 0.15);
    assert!(fault("lidar-misaligned").nees.unwrap().value > 10.0);
}

#[test]
fn the_object_level_sensor_detects_as_the_full_chain_does() {
    let (full, object) = (of_lidar(6), study(&[], SensorMode::Object, 6).unwrap());
    let range_m = |study: &Study, name: &str| figures(study, name).range_m.value;
    assert_ranges_fall(&object, 2.0, &["paint 0.2", "fog, visibility 100"]);
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
    let study_without_truth = study(&[], SensorMode::Object, 2).unwrap();
    let other = study(&["sensors.rear-object.range-m=60"], SensorMode::Object, 2).unwrap();
    assert!(figures(&other, "usual").range_m.value < figures(&study_without_truth, "usual").range_m.value - 30.0);
    let folder = tempfile::tempdir().unwrap();
    let studies = Studies(vec![study_without_truth, other]);
    let paths = studies.write(folder.path()).unwrap();
    assert_eq!(paths.len(), 5);
    let page = std::fs::read_to_string(&paths[0]).unwrap();
    assert!(page.contains("<svg") && page.contains("against") && !page.contains("NaN") && !page.contains("inf"));
    // The card of all pages, and lines of the legend that a dark page draws as the curves.
    assert!(page.contains("<main><header><div><h1>Sensors: "), "{page}");
    assert!(page.contains(".swatch { filter: invert(1)") && page.contains("<svg class=\"swatch\""));
    assert_eq!(studies.json().as_array().unwrap().len(), 2);
}

/// Returns the rows of a Parquet file, each with the names of its columns.
fn rows(path: &Path) -> Vec<Vec<(String, Field)>> {
    let reader = SerializedFileReader::new(std::fs::File::open(path).unwrap()).unwrap();
    let row =
        |row: parquet::record::Row| row.get_column_iter().map(|(name, field)| (name.clone(), field.clone())).collect();
    reader.get_row_iter(None).unwrap().map(|result| row(result.unwrap())).collect()
}

/// Fails if a number of a Parquet file differs from the JSON; an absent one is `null` in both.
fn assert_same(row: &[(String, Field)], name: &str, json: &Value) {
    let (_, field) = row.iter().find(|(column, _)| column == name).unwrap_or_else(|| panic!("no column {name}"));
    match (field, json) {
        (Field::Null, Value::Null) => {}
        (Field::Double(bound), Value::Null) => assert!(bound.is_infinite(), "{name}: {bound}"),
        (Field::Double(value), Value::Number(number)) => assert_eq!(*value, number.as_f64().unwrap(), "{name}"),
        _ => panic!("{name}: {field:?} and {json}"),
    }
}

#[test]
fn the_parquet_files_have_the_figures_of_the_json() {
    let folder = tempfile::tempdir().unwrap();
    let studies = Studies(vec![study(&[], SensorMode::Object, 3).unwrap()]);
    studies.write(folder.path()).unwrap();
    let json: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("sensors.json")).unwrap()).unwrap();
    let cases = json["cases"].as_array().unwrap();
    let [figures, curves, bins] =
        ["sensors", "curves", "calibration"].map(|name| rows(&folder.path().join(format!("{name}.parquet"))));
    assert_eq!(figures.len(), cases.len());
    for (row, case) in figures.iter().zip(cases) {
        assert_same(row, "seed", &Value::from(5.0));
        assert_same(row, "approaches", &Value::from(3.0));
        for (key, stem, unit) in [
            ("range_m", "range", "_m"),
            ("confirmed_after_s", "confirmed_after", "_s"),
            ("confirms", "confirms", ""),
            ("false_tracks_per_h", "false_tracks", "_per_h"),
            ("id_switches", "id_switches", ""),
            ("unavailable", "unavailable", ""),
            ("gospa_m", "gospa", "_m"),
            ("class_accuracy", "class_accuracy", ""),
            ("nees", "nees", ""),
        ] {
            assert_same(row, &format!("{stem}{unit}"), &case[key]["value"]);
            assert_same(row, &format!("{stem}_low_95{unit}"), &case[key]["low_95"]);
            assert_same(row, &format!("{stem}_high_95{unit}"), &case[key]["high_95"]);
        }
        assert_same(row, "calibration_error", &case["calibration_error"]);
        for (key, stem, unit) in
            [("along_m", "along", "_m"), ("across_m", "across", "_m"), ("speed_mps", "speed", "_mps")]
        {
            let errors = &case["errors"][key];
            assert_same(row, &format!("{stem}_q95{unit}"), &errors["q95"]);
            for figure in ["bias", "rmse"] {
                assert_same(row, &format!("{stem}_{figure}{unit}"), &errors[figure]["value"]);
                assert_same(row, &format!("{stem}_{figure}_low_95{unit}"), &errors[figure]["low_95"]);
                assert_same(row, &format!("{stem}_{figure}_high_95{unit}"), &errors[figure]["high_95"]);
            }
        }
    }
    let points: Vec<&Value> = cases.iter().flat_map(|case| case["curve"].as_array().unwrap()).collect();
    assert_eq!(curves.len(), points.len());
    for (row, point) in curves.iter().zip(points) {
        assert_same(row, "confirmed", &point["confirmed"]["value"]);
        for name in
            ["gap_m", "along_bias_m", "along_rmse_m", "along_q95_m", "across_bias_m", "across_rmse_m", "across_q95_m"]
                .into_iter()
                .chain(["speed_bias_mps", "speed_rmse_mps", "speed_q95_mps"])
        {
            assert_same(row, name, &point[name]);
        }
    }
    let all: Vec<&Value> = cases.iter().flat_map(|case| case["calibration"].as_array().unwrap()).collect();
    assert_eq!(bins.len(), all.len());
    for (row, bin) in bins.iter().zip(all) {
        assert_same(row, "confidence", &bin["confidence"]);
        assert_same(row, "accuracy", &bin["accuracy"]);
        assert_same(row, "steps", &Value::from(bin["steps"].as_f64().unwrap()));
    }
}

#[test]
fn the_study_has_the_light_and_the_weather_of_its_scenario() {
    let [clear, foggy] =
        [&[][..], &["environment.visibility-m=100"]].map(|settings| study(settings, SensorMode::Object, 3).unwrap());
    let range_m = |study: &Study, name: &str| figures(study, name).range_m.value;
    assert!((range_m(&foggy, "usual") - range_m(&clear, "fog, visibility 100")).abs() < 1e-9);
    assert!(range_m(&foggy, "usual") < 0.7 * range_m(&clear, "usual"));
    assert_eq!(range_m(&foggy, "clear air"), range_m(&clear, "usual"));
    // Paint is varied in the fog.
    assert!(range_m(&foggy, "paint 0.8") < 0.8 * range_m(&clear, "paint 0.8"));
}

/// Opens a page without a window. Returns the document after its scripts have run, and the messages
/// of the browser's console.
fn opened(browser: &str, page: &Path, profile: &Path) -> (String, Vec<String>) {
    let quiet = [
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-quic",
    ];
    let shown = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--dump-dom"])
        .args(quiet)
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&shown.stderr);
    let console = errors.lines().filter(|line| line.contains("CONSOLE")).map(str::to_owned).collect();
    (String::from_utf8_lossy(&shown.stdout).into_owned(), console)
}

#[test]
fn a_browser_draws_the_curves_of_every_chart_of_the_page() {
    /// Appended to a copy of the page: the title becomes the number of drawn curves of each chart.
    const COUNT: &str = "<script>document.title = Array.from(document.querySelectorAll('figure svg'), chart => \
        Array.from(chart.querySelectorAll('path.curve')).filter(path => path.getTotalLength() > 0 \
        && path.getBoundingClientRect().width > 0).length).join(' ');</script>";
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let charted = study(&[], SensorMode::Object, 3).unwrap();
    let factors: std::collections::BTreeSet<&str> = charted.cases.iter().map(|(case, _)| case.factor).collect();
    let groups = factors.len() - 1;
    let paths = Studies(vec![charted]).write(folder.path()).unwrap();
    let page = std::fs::read_to_string(&paths[0]).unwrap();
    let open = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        opened(browser, &path, &folder.path().join("profile"))
    };
    let (document, console) = open("counted.html", &format!("{page}{COUNT}"));
    assert!(console.is_empty(), "{console:?}");
    let title = document.split("<title>").nth(1).unwrap().split("</title>").next().unwrap();
    let drawn: Vec<usize> = title.split(' ').map(|count| count.parse().unwrap()).collect();
    // A chart of the probability and nine charts of errors for each group of cases, each with the
    // standard case and another one.
    assert_eq!((drawn.len() % 10, page.matches("<figure>").count()), (0, drawn.len()), "{drawn:?}");
    assert!(drawn.len() >= 10 * groups && drawn.iter().all(|curves| *curves >= 2), "{drawn:?}");
    assert_eq!(drawn.iter().sum::<usize>(), page.matches("class=\"curve\"").count());
    // A curve that cannot be drawn is noticed.
    let broken = page.replacen("class=\"curve\" d=\"M", "class=\"curve\" d=\"MNaN ", 1);
    let (_, console) = open("broken.html", &broken);
    assert!(console.iter().any(|line| line.contains("attribute d")), "{console:?}");
}
