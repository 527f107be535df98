//! Recordings are read by programs as `docs/how-to/looking.md` says.

use std::path::Path;
use std::process::Command;

use closecall_testing::{python_with_rerun, viewer};
use serde_json::Value;

use crate::support::{ROOT, closecall, folder, library, stdout};

/// Writes a recording of the method's reference point, and returns the outcomes of the pair.
fn record_pair(file: &Path) -> Value {
    let scenario = library("paper-figure");
    let arguments =
        ["run", scenario.to_str().unwrap(), "--paired", "--format", "json", "--record", file.to_str().unwrap()];
    serde_json::from_str(&stdout(&closecall(arguments), 0)).unwrap()
}

/// Writes a recording of a run with rear radars.
fn record_rear_radars(file: &Path) {
    let (scenario, file) = (library("low-thw-overtake"), file.to_str().unwrap());
    let sensors =
        ["--sensors", "full", "--set", "sensors.rear-camera.pipeline=\"off\"", "--set", "sensors.rear-radar={}"];
    let arguments = ["run", scenario.to_str().unwrap(), "--record", file];
    stdout(&closecall(arguments.iter().chain(&sensors)), 0);
}

/// Returns a Python program of the page.
fn program_of_page(number: usize) -> String {
    let page = std::fs::read_to_string(Path::new(ROOT).join("docs/how-to/looking.md")).unwrap();
    let after = page.split("```python\n").nth(number + 1).expect("a program");
    after.split_once("```").expect("its end").0.to_owned()
}

#[test]
fn the_program_of_the_page_reads_a_recording() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let [file, script] = ["pair.rrd", "read.py"].map(|name| folder.path().join(name));
    let outcomes = record_pair(&file);
    std::fs::write(&script, program_of_page(1)).unwrap();
    let python = viewer.with_file_name("python3");
    let output = Command::new(python).arg(&script).arg(&file).output().unwrap();
    let text = stdout(&output, 0);
    let words: Vec<&str> = text.split_whitespace().collect();
    assert_eq!(words[..2], ["paper-figure", "PREVENTED"], "{text}");
    let tested = outcomes.as_array().or(outcomes["results"].as_array()).unwrap().last().unwrap();
    let least_s = tested["margins"]["min_thw_rear_s"].as_f64().unwrap();
    let [property_s, curve_s] = [words[2], words[4]].map(|word| word.parse::<f64>().unwrap());
    assert!((property_s - least_s).abs() < 0.006, "{text} {least_s}");
    assert_eq!([words[3], words[5]], ["s", "s"], "{text}");
    // The curve has the control steps only.
    assert!(curve_s >= property_s && curve_s < property_s + 0.1, "{text}");
}

#[test]
fn the_first_program_of_the_page_plots_the_rear_headway_and_lists_the_collisions() {
    let Some(python) = python_with_rerun() else { return };
    let folder = folder();
    let [file, script, picture] = ["pair.rrd", "plot.py", "thw.png"].map(|name| folder.path().join(name));
    let outcomes = record_pair(&file);
    std::fs::write(&script, program_of_page(0)).unwrap();
    let output = Command::new(&python).arg(&script).args([&file, &picture]).output().unwrap();
    let text = stdout(&output, 0);
    assert_eq!(&std::fs::read(&picture).unwrap()[1..4], b"PNG");
    let outcomes = outcomes.as_array().or(outcomes["results"].as_array()).unwrap();
    let collisions = outcomes[0]["collisions"].as_array().unwrap();
    assert!(collisions.len() >= 2 && outcomes[1]["collisions"].as_array().unwrap().is_empty(), "{outcomes:?}");
    let printed: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(printed.len(), collisions.len(), "{text}");
    for (row, collision) in printed.iter().zip(collisions) {
        let between = [0, 1].map(|vehicle| collision["between"][vehicle].as_str().unwrap());
        assert_eq!([row[0], row[2], row[3]], ["acc", between[0], between[1]], "{text}");
        for (word, name) in [(row[1], "time_s"), (row[4], "relative_speed_mps")] {
            let difference = word.parse::<f64>().unwrap() - collision[name].as_f64().unwrap();
            assert!(difference.abs() < 1e-6, "{name}: {text}");
        }
    }
}

#[test]
fn the_table_of_the_page_names_what_a_recording_holds() {
    let Some(python) = python_with_rerun() else { return };
    let folder = folder();
    let [file, radars, script] = ["pair.rrd", "radars.rrd", "columns.py"].map(|name| folder.path().join(name));
    record_pair(&file);
    record_rear_radars(&radars);
    let program = "import sys\nfrom rerun.experimental import RrdReader\n\
                   for column in RrdReader(sys.argv[1]).stream().collect().schema().component_columns():\n\
                   \x20   print(column.entity_path, column.component)\n";
    std::fs::write(&script, program).unwrap();
    let columns = |file: &Path| stdout(&Command::new(&python).arg(&script).arg(file).output().unwrap(), 0);
    let text = columns(&file) + &columns(&radars);
    let held: Vec<&str> = text.lines().collect();
    let page = std::fs::read_to_string(Path::new(ROOT).join("docs/how-to/looking.md")).unwrap();
    let (_, table) = page.split_once("| entity below `ARM` | component |").expect("a table");
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let mut count = 0;
    for row in rows {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [entities, components] =
            [cells[1], cells[2]].map(|cell| cell.split('`').skip(1).step_by(2).collect::<Vec<_>>());
        assert!(!entities.is_empty() && !components.is_empty(), "{row}");
        for entity in entities {
            for component in &components {
                let paths = ["acc", "mis"].map(|arm| format!("/{arm}/{entity} {component}").replace("VEHICLE", "rear"));
                assert!(held.iter().any(|held| paths.contains(&(*held).to_owned())), "no {entity} {component}: {text}");
                count += 1;
            }
        }
    }
    assert!(count > 15, "{count} columns");
}

/// The folder of the code that draws runs.
const DRAWING: &str = "report/src/run";

/// Returns the files of a folder and of its folders, by their paths below the repository.
fn files_below(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(Path::new(ROOT).join(folder)).unwrap();
    let mut files = Vec::new();
    for entry in entries.map(Result::unwrap) {
        let path = folder.join(entry.file_name());
        if entry.path().is_dir() { files.extend(files_below(&path)) } else { files.push(path) }
    }
    files
}

#[test]
fn the_pictures_are_not_older_than_the_code_that_draws_them() {
    let mut files = files_below(Path::new(DRAWING));
    files.retain(|file| file.extension().is_some_and(|end| end == "rs") && !file.ends_with("tests.rs"));
    files.sort_by_key(|file| file.display().to_string());
    assert!(files.len() > 20, "{files:?}");
    let mut sum = flate2::Crc::new();
    for file in files {
        let text = std::fs::read_to_string(Path::new(ROOT).join(file)).unwrap();
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//"));
        lines.for_each(|line| sum.update(line.as_bytes()));
    }
    let drawn_by = std::fs::read_to_string(Path::new(ROOT).join("docs/how-to/looking/drawn-by.txt")).unwrap();
    assert_eq!(
        drawn_by.trim(),
        format!("{:08x}", sum.sum()),
        "the code that draws is newer than the pictures: `just pictures` draws them"
    );
}
