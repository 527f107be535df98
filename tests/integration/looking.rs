//! Recordings are read by programs and shown in the browser as `docs/how-to/looking.md` says.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use closecall_testing::{python_with_rerun, viewer};
use serde_json::Value;

use crate::support::{ROOT, closecall, code, folder, library, message, program, stderr, stdout};

/// Writes a recording of the method's reference point, and returns the outcomes of the pair.
fn record_pair(file: &Path) -> Value {
    let scenario = library("paper-figure");
    let arguments =
        ["run", scenario.to_str().unwrap(), "--paired", "--format", "json", "--record", file.to_str().unwrap()];
    serde_json::from_str(&stdout(&closecall(arguments), 0)).unwrap()
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
    let [file, script] = ["pair.rrd", "columns.py"].map(|name| folder.path().join(name));
    record_pair(&file);
    let program = "import sys\nfrom rerun.experimental import RrdReader\n\
                   for column in RrdReader(sys.argv[1]).stream().collect().schema().component_columns():\n\
                   \x20   print(column.entity_path, column.component)\n";
    std::fs::write(&script, program).unwrap();
    let text = stdout(&Command::new(&python).arg(&script).arg(&file).output().unwrap(), 0);
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

/// A running server, ended when the value is dropped.
struct Served(Child, String);

impl Drop for Served {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// Serves a path with a folder that has the web build of a viewer.
fn serve(path: &Path, viewer: &Path) -> Served {
    let mut child = program()
        .args(["view", path.to_str().unwrap(), "--no-open", "--viewer", viewer.to_str().unwrap()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let address = line.trim().trim_start_matches("http://").trim_end_matches('/').to_owned();
    assert!(address.starts_with("127.0.0.1:"), "{line}");
    Served(child, address)
}

impl Served {
    /// Returns the head and the body of the answer to a request.
    fn get(&self, path: &str, host: &str) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.1).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").unwrap();
        (String::from_utf8(answer[..end].to_vec()).unwrap(), answer[end + 4..].to_vec())
    }
}

/// Writes files that stand for the web build of a viewer.
fn web_build(folder: &Path) -> PathBuf {
    let build = folder.join("web");
    std::fs::create_dir(&build).unwrap();
    for name in ["index.html", "re_viewer.js", "re_viewer_bg.wasm"] {
        std::fs::write(build.join(name), name).unwrap();
    }
    build
}

#[test]
fn a_recording_and_the_viewer_are_served_and_nothing_else() {
    let folder = folder();
    let (file, build) = (folder.path().join("pair.rrd"), web_build(folder.path()));
    record_pair(&file);
    std::fs::write(folder.path().join("secret.rrd"), "no").unwrap();
    let served = serve(&file, &build);
    let (head, _) = served.get("/", &served.1);
    assert!(head.starts_with("HTTP/1.1 302") && head.contains("Location: /viewer/?url=http%3A//127.0.0.1"), "{head}");
    assert_eq!(served.get("/viewer/", &served.1).1, b"index.html");
    assert!(served.get("/viewer/re_viewer_bg.wasm", &served.1).0.contains("application/wasm"));
    assert!(served.get("/files/pair.rrd", &served.1).1 == std::fs::read(&file).unwrap());
    for other in ["/files/secret.rrd", "/files/../pair.rrd", "/files/%2e%2e/web/index.html", "/viewer/other", "/files/"]
    {
        assert!(served.get(other, &served.1).0.starts_with("HTTP/1.1 404"), "{other}");
    }
    assert!(served.get("/", "elsewhere.example").0.starts_with("HTTP/1.1 403"));
}

#[test]
fn the_web_build_of_the_installed_viewer_is_served() {
    let Some(viewer) = viewer() else { return };
    let folder = folder();
    let file = folder.path().join("pair.rrd");
    record_pair(&file);
    let served = serve(folder.path(), &viewer);
    let page = String::from_utf8(served.get("/viewer/", &served.1).1).unwrap();
    assert!(page.contains("re_viewer.js"), "{page}");
    assert_eq!(served.get("/viewer/re_viewer_bg.wasm", &served.1).1[..4], *b"\0asm");
}

#[test]
fn a_missing_viewer_and_a_missing_recording_are_named() {
    let folder = folder();
    let file = folder.path().join("pair.rrd");
    let empty = closecall(["view", folder.path().to_str().unwrap(), "--no-open"]);
    assert_eq!(code(&empty), 3, "{}", stderr(&empty));
    assert!(message(&empty).contains("name a file .rrd"), "{}", message(&empty));
    record_pair(&file);
    let none = closecall(["view", file.to_str().unwrap(), "--no-open", "--viewer", "/nowhere/rerun"]);
    assert_eq!(code(&none), 6, "{}", stderr(&none));
    assert!(message(&none).contains("pip install rerun-sdk==0.36.3"), "{}", message(&none));
}
