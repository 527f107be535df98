//! The tables of tracks and of clusters are read back, and compared with each other, with the trace and with the truth.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use arrow::array::{Array, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array};
use arrow::compute::concat_batches;
use closecall_report::tables::{RunTables, TableFiles};
use closecall_scenarios::ScenarioFile;
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, RunKey, simulate};
use closecall_traffic::maths;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

/// Runs a scenario with these sensors for eight seconds, writes its tables into `folder`, and returns the error if there is one.
fn write(folder: &Path, sensors: &str, names: [&str; 2]) -> Result<[PathBuf; 3], String> {
    let text =
        format!("base = \"low-thw-overtake\"\nduration-s = 8.0\nsensors.rear-camera.pipeline = \"off\"\n{sensors}");
    let file = ScenarioFile::parse(Path::new("tracks.toml"), &text, &[]).unwrap();
    let scenario = file.concrete(&file.space().nominal()).unwrap();
    let arm = Arm { controller: BuiltIn::Acc.factory(), sensors: None };
    let paths = [names[0], names[1], "trace.parquet"].map(|name| folder.join(name));
    let files = TableFiles { tracks: Some(&paths[0]), clusters: Some(&paths[1]), trace: Some(&paths[2]), scans: None };
    // A wrong request is answered before the run.
    let mut tables = RunTables::new((&scenario, Some(&arm)), files).map_err(|error| error.to_string())?;
    simulate(&scenario, RunKey { seed: 1, sample: 0 }, &arm, &mut tables).unwrap();
    tables.finish().unwrap();
    Ok(paths)
}

/// Returns all rows of a table.
fn read(path: &Path) -> RecordBatch {
    let file = std::fs::File::open(path).unwrap();
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let schema = builder.schema().clone();
    let batches: Vec<RecordBatch> = builder.build().unwrap().map(Result::unwrap).collect();
    concat_batches(&schema, &batches).unwrap()
}

fn column<'a, T: 'static>(batch: &'a RecordBatch, name: &str) -> &'a T {
    batch.column_by_name(name).unwrap_or_else(|| panic!("{name}")).as_any().downcast_ref().unwrap()
}

/// The time as a key (ms).
fn ms(time_s: f64) -> i64 {
    (1e3 * time_s).round() as i64
}

#[test]
fn tracks_stand_beside_the_vehicles_of_the_trace() {
    let folder = tempfile::tempdir().unwrap();
    let [tracks, _, trace] = write(folder.path(), "", ["tracks.parquet", "clusters.parquet"]).unwrap();
    let (tracks, trace) = (read(&tracks), read(&trace));
    let number = |name| column::<Float64Array>(&tracks, name);
    let text = |name| column::<StringArray>(&tracks, name);
    let [time_s, vx_mps, error_vx_mps] = ["time_s", "vx_mps", "error_vx_mps"].map(number);
    let [x_m, error_x_m, length_m] = ["x_m", "error_x_m", "length_m"].map(number);
    let (actor, source, status) = (text("actor"), text("source"), text("status"));
    let confirmed = column::<BooleanArray>(&tracks, "confirmed");
    // The road is straight, and its vehicles keep their lanes up to a small heading.
    let mut truth: BTreeMap<(i64, &str), [f64; 2]> = BTreeMap::new();
    let of_trace = |name| column::<Float64Array>(&trace, name);
    let [trace_s, s_m, speed_mps] = ["time_s", "s_m", "speed_mps"].map(of_trace);
    let names = column::<StringArray>(&trace, "actor");
    for row in 0..trace.num_rows() {
        truth.insert((ms(trace_s.value(row)), names.value(row)), [s_m.value(row), speed_mps.value(row)]);
    }
    let mut matched = BTreeSet::new();
    for row in 0..tracks.num_rows() {
        assert_eq!(confirmed.value(row), status.value(row) != "tentative");
        let scores = ["car", "truck", "motorcycle", "background"].map(|name| number(name).value(row));
        assert!((scores.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{scores:?}");
        assert_eq!(number("class_score").value(row), scores[..3].iter().copied().fold(0.0, f64::max));
        if actor.is_null(row) {
            assert!(error_x_m.is_null(row) && number("distance_m").is_null(row));
            continue;
        }
        matched.insert((source.value(row), actor.value(row)));
        let at = ms(time_s.value(row));
        let [ego_m, _] = truth[&(at, "ego")];
        let [actor_m, actor_mps] = truth[&(at, actor.value(row))];
        assert!((vx_mps.value(row) - error_vx_mps.value(row) - actor_mps).abs() < 0.1);
        // The errors are errors of the nearest face: half of the lengths' difference from the errors of the centre.
        let centre_error_m = x_m.value(row) - (actor_m - ego_m);
        let of_length_m = (centre_error_m - error_x_m.value(row)).abs();
        assert!(of_length_m <= 0.5 * (length_m.value(row) - 4.6).abs() + 0.6, "{of_length_m}");
        let distance_m = maths::hypot(error_x_m.value(row), number("error_y_m").value(row));
        assert!((distance_m - number("distance_m").value(row)).abs() < 1e-12);
        for name in ["cov_x_x", "cov_y_y", "cov_vx_vx", "cov_vy_vy"] {
            assert!(number(name).value(row) > 0.0, "{name}");
        }
    }
    assert!(matched.contains(&("rear", "rear")) && matched.contains(&("front", "front")), "{matched:?}");
}

#[test]
fn the_fate_of_every_box_is_known_and_its_points_are_those_of_its_clusters() {
    let folder = tempfile::tempdir().unwrap();
    let [tracks, clusters, _] =
        write(folder.path(), "sensors.front-lidar.model = \"os1-64\"\n", ["t.parquet", "c.parquet"]).unwrap();
    let (tracks, clusters) = (read(&tracks), read(&clusters));
    let text = |name| column::<StringArray>(&clusters, name);
    let count = |name| column::<UInt32Array>(&clusters, name);
    let number = |name| column::<Float64Array>(&clusters, name);
    let ids: BTreeSet<u32> = column::<UInt32Array>(&tracks, "track").values().iter().copied().collect();
    let last_ms = number("time_s").values().iter().map(|time_s| ms(*time_s)).max().unwrap();
    let (mut points_of, mut boxes, mut roles) = (BTreeMap::new(), 0, BTreeMap::<&str, u32>::new());
    for row in 0..clusters.num_rows() {
        let at = |number| (text("sensor").value(row), count("frame").value(row), number);
        let points = count("points").value(row);
        if text("kind").value(row) == "cluster" {
            assert!(text("role").is_null(row) && number("face_x_m").is_null(row));
            let of_box = count("box");
            assert!(of_box.is_valid(row), "each cluster is a part of some box");
            *points_of.entry(at(of_box.value(row))).or_insert(0) += points;
            continue;
        }
        boxes += 1;
        // Each box comes after the clusters of its scan.
        assert_eq!(points_of.get(&at(count("number").value(row))), Some(&points));
        assert_eq!(text("sensor").value(row) == "rear-lidar", number("x_m").value(row) < 0.0);
        let role = text("role");
        if ms(number("time_s").value(row)) <= last_ms - 80 {
            assert!(role.is_valid(row), "a box of an earlier scan has no fate");
        }
        if role.is_null(row) {
            continue;
        }
        *roles.entry(role.value(row)).or_default() += 1;
        let (track, innovation) = (count("track"), number("innovation_along_m"));
        assert_eq!(innovation.is_valid(row), role.value(row) == "corrects");
        assert_eq!(track.is_null(row), role.value(row) == "ignored");
        if role.value(row) == "corrects" {
            assert!(ids.contains(&track.value(row)));
            assert!(number("innovation_across_variance_m2").value(row) > 0.0);
        }
    }
    assert!(boxes > 100 && roles["corrects"] > 90 && roles["starts"] > 1, "{boxes} {roles:?}");
}

#[test]
fn clusters_without_a_lidar_and_wrong_extensions_are_answered() {
    let folder = tempfile::tempdir().unwrap();
    let error = write(folder.path(), "sensors.mode = \"object\"\n", ["t.parquet", "c.parquet"]).unwrap_err();
    assert!(error.contains("c.parquet") && error.contains("only sensors of mode `full` have"), "{error}");
    let error = write(folder.path(), "", ["t.csv", "c.parquet"]).unwrap_err();
    assert!(error.contains("t.csv") && error.contains("tracks are a file *.parquet"), "{error}");
    let error = write(folder.path(), "", ["t.parquet", "c.pcd"]).unwrap_err();
    assert!(error.contains("c.pcd") && error.contains("clusters are a file *.parquet"), "{error}");
}
