//! The table of scans is read back, and compared with itself and with the truth.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::collections::BTreeMap;
use std::path::Path;

use arrow::array::{Array, Float32Array, Float64Array, Int32Array, RecordBatch, StringArray, UInt16Array, UInt32Array};
use closecall_report::tables::{RunTables, TableFiles};
use closecall_scenarios::{Scenario, ScenarioFile};
use closecall_simulation::controller::BuiltIn;
use closecall_simulation::{Arm, RunKey, simulate};
use closecall_traffic::maths;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

/// Returns a scenario of the library with these sensors, cut to a second.
fn scenario(sensors: &str) -> Scenario {
    let text =
        format!("base = \"low-thw-overtake\"\nduration-s = 1.0\nsensors.rear-camera.pipeline = \"off\"\n{sensors}");
    let file = ScenarioFile::parse(Path::new("scans.toml"), &text, &[]).unwrap();
    file.concrete(&file.space().nominal()).unwrap()
}

/// Runs the scenario, writes its scans to `path`, and returns the error if there is one.
fn write(path: &Path, sensors: &str) -> Result<(), String> {
    let scenario = scenario(sensors);
    let arm = Arm { controller: BuiltIn::Acc.factory(), sensors: None };
    // A wrong request is answered before the run.
    let files = TableFiles { scans: Some(path), ..TableFiles::default() };
    let mut tables = RunTables::new((&scenario, Some(&arm)), files).map_err(|error| error.to_string())?;
    simulate(&scenario, RunKey { seed: 1, sample: 0 }, &arm, &mut tables).unwrap();
    tables.finish().unwrap();
    Ok(())
}

/// Returns all rows of a table.
fn read(path: &Path) -> Vec<RecordBatch> {
    let file = std::fs::File::open(path).unwrap();
    ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap().map(Result::unwrap).collect()
}

fn column<'a, T: 'static>(batch: &'a RecordBatch, name: &str) -> &'a T {
    batch.column_by_name(name).unwrap_or_else(|| panic!("{name}")).as_any().downcast_ref().unwrap()
}

#[test]
fn the_points_of_both_lidars_are_read_back_with_beam_range_time_and_truth() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scans.parquet");
    write(&path, "sensors.mode = \"full\"\nsensors.front-lidar.model = \"os1-64\"\n").unwrap();
    let (mut rows, mut of_actors, mut clustered, mut sides) = (0, 0, 0, Vec::new());
    let mut frames = [0, 0];
    for batch in read(&path) {
        let text = |name| column::<StringArray>(&batch, name);
        let single = |name| column::<Float32Array>(&batch, name);
        let (sensor, source, side) = (text("sensor"), text("source"), text("mirror_side"));
        let (range_m, true_range_m, intensity) = (single("range_m"), single("true_range_m"), single("intensity"));
        let width_ns = single("echo_pulse_width_ns");
        let [azimuth_rad, elevation_rad, x_m, y_m] = ["azimuth_rad", "elevation_rad", "x_m", "y_m"].map(single);
        let [beam, of_column, layer] = ["beam", "column", "layer"].map(|name| column::<UInt16Array>(&batch, name));
        let (cluster, frame) = (column::<Int32Array>(&batch, "cluster"), column::<UInt32Array>(&batch, "frame"));
        let (time_s, offset_ns) =
            (column::<Float64Array>(&batch, "time_s"), column::<UInt32Array>(&batch, "offset_ns"));
        for row in 0..batch.num_rows() {
            let is_rear = sensor.value(row) == "rear-lidar";
            let (layers, rate_hz) = if is_rear { (16, 25) } else { (64, 10) };
            assert_eq!(beam.value(row), of_column.value(row) * layers + layer.value(row));
            // The sensors settle in the second before the start.
            assert!((-1.0..=1.0).contains(&time_s.value(row)) && offset_ns.value(row) < 1_000_000_000 / rate_hz);
            // The error of a range is below five standard deviations at the threshold, which the
            // files of the two kinds state. There are no droplets and no faults.
            let five_sd_m = if is_rear { 0.5 } else { 1.2 };
            assert!(
                (range_m.value(row) - true_range_m.value(row)).abs() < five_sd_m,
                "{} {}",
                range_m.value(row),
                true_range_m.value(row)
            );
            assert!(
                intensity.value(row) > 0.0
                    && azimuth_rad.value(row).abs() < 1.17
                    && elevation_rad.value(row).abs() < 0.3
            );
            // Only a false alarm is exactly at the threshold. A plate gives some 20 ns.
            let width_ns = width_ns.value(row);
            assert!((0.0..40.0).contains(&width_ns), "{width_ns}");
            assert!(width_ns > 0.0 || source.value(row) == "false", "{}", source.value(row));
            assert_eq!(x_m.value(row) < 0.0, is_rear, "the rear sensor sees what is behind the ego's origin");
            // The left of the rear sensor's axis is the right of the ego.
            let left_m = range_m.value(row) * maths::cos(elevation_rad.value(row)) * maths::sin(azimuth_rad.value(row));
            let y_error_m = y_m.value(row) - if is_rear { -left_m } else { left_m };
            assert!(y_error_m.abs() < 0.1 + 0.01 * range_m.value(row), "{y_error_m} at {left_m}");
            assert_eq!(side.is_valid(row), is_rear, "the OS1 has no mirror");
            if is_rear && !sides.contains(&side.value(row).to_owned()) {
                sides.push(side.value(row).to_owned());
            }
            of_actors += usize::from(["front", "rear"].contains(&source.value(row)));
            clustered += usize::from(cluster.is_valid(row));
            let frames = &mut frames[usize::from(is_rear)];
            *frames = (frame.value(row) + 1).max(*frames);
        }
        rows += batch.num_rows();
    }
    assert!(rows > 10_000 && of_actors > 500 && clustered > 500, "{rows} {of_actors} {clustered}");
    assert!(clustered < rows, "the road belongs to no box");
    assert_eq!(sides.len(), 2, "{sides:?}");
    // The run has 26 control steps with its ends, and 25 before it.
    assert!((20..=21).contains(&frames[0]) && (50..=51).contains(&frames[1]), "{frames:?}");
}

#[test]
fn a_run_without_a_lidar_and_a_wrong_extension_are_answered() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scans.parquet");
    let error = write(&path, "sensors.mode = \"object\"\n").unwrap_err();
    assert!(error.contains("scans.parquet") && error.contains("only sensors of mode `full` have"), "{error}");
    assert!(!path.exists());
    let error = write(&folder.path().join("scans.las"), "sensors.mode = \"full\"\n").unwrap_err();
    assert!(error.contains("*.parquet or a folder *.pcd"), "{error}");
    let taken = folder.path().join("taken.pcd");
    std::fs::create_dir(&taken).unwrap();
    std::fs::write(taken.join("notes"), "kept").unwrap();
    let error = write(&taken, "sensors.mode = \"full\"\n").unwrap_err();
    assert!(error.contains("taken.pcd") && error.contains("not an empty folder"), "{error}");
    assert_eq!(std::fs::read_to_string(taken.join("notes")).unwrap(), "kept");
}

/// A point cloud: position, intensity and echo pulse width, beam and time of each point.
type Cloud = Vec<([f32; 5], u16, f64)>;

/// Reads a binary PCD file as its header describes it.
fn read_pcd(path: &Path) -> Cloud {
    let bytes = std::fs::read(path).unwrap();
    let marker = b"DATA binary\n";
    let data = bytes.windows(marker.len()).position(|window| window == marker).unwrap() + marker.len();
    let header = std::str::from_utf8(&bytes[..data]).unwrap();
    let entry = |key: &str| -> Vec<String> {
        let line = header.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_else(|| panic!("{key}"));
        line.split_whitespace().map(str::to_owned).collect()
    };
    assert_eq!(entry("VERSION"), ["0.7"]);
    assert_eq!(entry("FIELDS"), ["x", "y", "z", "intensity", "beam", "time", "echo_pulse_width_ns"]);
    assert_eq!((entry("TYPE"), entry("COUNT")), (entry("TYPE"), vec!["1".to_owned(); 7]));
    let sizes: Vec<usize> = entry("SIZE").iter().map(|size| size.parse().unwrap()).collect();
    let points: usize = entry("POINTS")[0].parse().unwrap();
    assert_eq!((entry("WIDTH"), entry("HEIGHT")[0].as_str()), (entry("POINTS"), "1"));
    assert_eq!(bytes.len() - data, points * sizes.iter().sum::<usize>());
    let fields = |record: &[u8]| -> Vec<Vec<u8>> {
        let mut rest = record;
        sizes
            .iter()
            .map(|size| {
                let (field, after) = rest.split_at(*size);
                rest = after;
                field.to_vec()
            })
            .collect()
    };
    let single = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().unwrap());
    bytes[data..]
        .chunks(sizes.iter().sum())
        .map(fields)
        .map(|field| {
            let at = [0, 1, 2, 3, 6].map(|index| single(&field[index]));
            (
                at,
                u16::from_le_bytes(field[4][..].try_into().unwrap()),
                f64::from_le_bytes(field[5][..].try_into().unwrap()),
            )
        })
        .collect()
}

#[test]
fn the_point_clouds_are_read_back_as_the_rows_of_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let [table, clouds] = ["scans.parquet", "scans.pcd"].map(|name| folder.path().join(name));
    let sensors = "sensors.mode = \"full\"\nsensors.front-lidar.model = \"os1-64\"\n";
    write(&table, sensors).unwrap();
    write(&clouds, sensors).unwrap();
    let mut expected: BTreeMap<String, Cloud> = BTreeMap::new();
    for batch in read(&table) {
        let single = |name| column::<Float32Array>(&batch, name);
        let values = ["x_m", "y_m", "z_m", "intensity", "echo_pulse_width_ns"].map(single);
        let (sensor, frame) = (column::<StringArray>(&batch, "sensor"), column::<UInt32Array>(&batch, "frame"));
        let (beam, offset_ns) = (column::<UInt16Array>(&batch, "beam"), column::<UInt32Array>(&batch, "offset_ns"));
        for row in 0..batch.num_rows() {
            let name = format!("{}-{:05}.pcd", sensor.value(row), frame.value(row));
            let at = values.map(|column| column.value(row));
            let offset_s = f64::from(offset_ns.value(row)) * 1e-9;
            expected.entry(name).or_default().push((at, beam.value(row), offset_s));
        }
    }
    let mut names: Vec<String> =
        std::fs::read_dir(&clouds).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let tables: Vec<String> = names.extract_if(.., |name| name.ends_with(".csv")).collect();
    assert_eq!(tables, ["labels.csv", "poses.csv", "scans.csv"]);
    let index = std::fs::read_to_string(clouds.join("scans.csv")).unwrap();
    assert_eq!(index.lines().skip(1).count(), names.len());
    assert_eq!(names, expected.keys().cloned().collect::<Vec<_>>());
    assert!(names.len() > 30, "{} files", names.len());
    for (name, rows) in expected {
        let cloud = read_pcd(&clouds.join(&name));
        assert_eq!(cloud.len(), rows.len(), "{name}");
        // Times differ by the start of the sweep, which is the same for all points of a scan.
        let start_s = cloud[0].2 - rows[0].2;
        for ((at, beam, time_s), (expected_at, expected_beam, offset_s)) in cloud.iter().zip(&rows) {
            assert_eq!((at.map(f32::to_bits), beam), (expected_at.map(f32::to_bits), expected_beam), "{name}");
            assert!((time_s - offset_s - start_s).abs() < 1e-9, "{name}: {time_s} {offset_s}");
        }
    }
}

/// The intensities and echo pulse widths of the returns of each beam of each scan.
type Echoes = BTreeMap<(u32, u16), Vec<[f32; 2]>>;

/// Returns the echoes of a run with these sensors, without false alarms.
fn echoes(sensors: &str) -> Echoes {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scans.parquet");
    write(&path, &format!("sensors.mode = \"full\"\n{sensors}")).unwrap();
    let mut echoes = Echoes::new();
    for batch in read(&path) {
        let [intensity, width_ns] =
            ["intensity", "echo_pulse_width_ns"].map(|name| column::<Float32Array>(&batch, name));
        let (frame, beam) = (column::<UInt32Array>(&batch, "frame"), column::<UInt16Array>(&batch, "beam"));
        let source = column::<StringArray>(&batch, "source");
        for row in (0..batch.num_rows()).filter(|&row| source.value(row) != "false") {
            let echo = [intensity.value(row), width_ns.value(row)];
            echoes.entry((frame.value(row), beam.value(row))).or_default().push(echo);
        }
    }
    echoes
}

#[test]
fn dirt_on_the_window_lowers_the_intensities_and_the_echo_pulse_widths_of_the_table() {
    let [clean, dirty] = ["", "sensors.rear-lidar.window-transmission = 0.8\n"].map(echoes);
    let mut compared = 0;
    for (at, dirty) in &dirty {
        // The single return of a beam is the same one in both runs, with the same noise.
        if let ([[dirty, dirty_ns]], [[clean, clean_ns]]) = (&dirty[..], &clean[at][..]) {
            assert!(dirty <= clean && dirty_ns < clean_ns, "{at:?}: {dirty} {clean} {dirty_ns} {clean_ns}");
            compared += 1;
        }
    }
    assert!(compared > 10_000, "{compared}");
    let sum = |echoes: &Echoes| echoes.values().flatten().map(|[intensity, _]| f64::from(*intensity)).sum::<f64>();
    assert!(sum(&dirty) < 0.7 * sum(&clean), "{} {}", sum(&dirty), sum(&clean));
}
