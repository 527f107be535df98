//! `drift` says whether new traffic matches fitted distributions.

use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::data;
use serde_json::Value;

use crate::support::{ROOT, all_of_library, closecall, code, folder, json, library, message, stdout};

fn recorded(folder: &Path, name: &str, seed: &str, settings: &[&str]) -> PathBuf {
    let csv = folder.join(name);
    let scenario = library("overtake-without-brake");
    let args =
        ["traffic", "record", scenario.to_str().unwrap(), "-n", "40", "--controller", "acc", "--seed", seed, "-o"];
    stdout(&closecall(args.into_iter().chain([csv.to_str().unwrap()]).chain(settings.iter().copied())), 0);
    csv
}

#[test]
fn traffic_of_the_same_kind_matches_and_faster_traffic_does_not() {
    let folder = folder();
    let first = recorded(folder.path(), "first.csv", "1", &[]);
    let fitted = folder.path().join("fitted.toml");
    let fitted = fitted.to_str().unwrap();
    let table = stdout(&closecall(["traffic", "fit", first.to_str().unwrap(), "-o", fitted]), 0);
    assert!(table.contains("Kolmogorov-Smirnov distance"), "{table}");
    let again = recorded(folder.path(), "again.csv", "2", &[]);
    let drift = json(&closecall(["traffic", "drift", fitted, again.to_str().unwrap(), "--format", "json"]), 0);
    assert_eq!((&drift["is_tested"], &drift["has_drifted"]), (&true.into(), &false.into()), "{drift}");
    let slower = recorded(folder.path(), "slower.csv", "2", &["--set", "cruise-mps=24"]);
    let table = stdout(&closecall(["traffic", "drift", fitted, slower.to_str().unwrap()]), 1);
    assert!(table.contains("DRIFTED") && table.contains("crossing-mps"), "{table}");
    // The same seed gives the same result.
    assert_eq!(table, stdout(&closecall(["traffic", "drift", fitted, slower.to_str().unwrap()]), 1));
}

#[test]
fn too_few_values_are_inconclusive_and_other_files_are_refused() {
    let folder = folder();
    let first = recorded(folder.path(), "first.csv", "1", &[]);
    let (first, fitted, few) = (first.to_str().unwrap(), folder.path().join("f.toml"), folder.path().join("few.csv"));
    let (fitted, few) = (fitted.to_str().unwrap(), few.to_str().unwrap());
    stdout(&closecall(["traffic", "fit", first, "-o", fitted]), 0);
    let scenario = library("overtake-without-brake");
    stdout(
        &closecall(["traffic", "record", scenario.to_str().unwrap(), "-n", "1", "--controller", "acc", "-o", few]),
        0,
    );
    assert!(stdout(&closecall(["traffic", "drift", fitted, few]), 4).contains("INCONCLUSIVE"));
    let refused = |args: [&str; 4], expected: i32, words: &str| {
        let output = closecall(args);
        assert_eq!(code(&output), expected, "{}", message(&output));
        assert!(message(&output).contains(words), "{}", message(&output));
    };
    refused(["traffic", "drift", "/no/such.toml", first], 6, "/no/such.toml");
    refused(["traffic", "drift", "low-thw-overtak", first], 2, "did you mean `low-thw-overtake`?");
    // A scenario of the library by its name.
    let output = closecall(["traffic", "drift", "low-thw-overtake", first]);
    assert!([0, 1, 4].contains(&code(&output)), "{}", message(&output));
    assert!(stdout(&output, code(&output)).contains("front-thw-s"));
    let other = folder.path().join("other.toml");
    fs::write(&other, "[parameters]\nx = { fixed = 1.0 }\n").unwrap();
    refused(["traffic", "drift", other.to_str().unwrap(), first], 3, "no parameter has quantiles");
}

#[test]
fn the_library_has_not_drifted_from_the_recordings_that_it_was_fitted_to() {
    let Some(data) = data() else { return };
    let recordings = ["a", "b", "f", "g", "h", "i"]
        .map(|name| data.join(format!("ngsim_us101/trajectories/us101_{name}.csv")).to_str().unwrap().to_owned());
    let is_fitted = |path: &PathBuf| fs::read_to_string(path).unwrap().contains("quantiles");
    let scenarios: Vec<PathBuf> = all_of_library().into_iter().filter(is_fitted).collect();
    assert!(scenarios.len() >= 10, "{scenarios:?}");
    let fitted = Path::new(ROOT).join("scenarios/library/fitted/us101.toml");
    for file in scenarios.iter().chain([&fitted]) {
        let words = ["traffic", "drift", file.to_str().unwrap(), "--format", "json"].map(str::to_owned);
        let drift = json(&closecall(words.iter().chain(&recordings)), 0);
        let of_front = |quantity: &&Value| quantity["quantity"] == "front-thw-s";
        let front = drift["quantities"].as_array().unwrap().iter().find(of_front).unwrap();
        let of_itself = |quantity: &Value| quantity["fitted_n"] == quantity["n"];
        assert!(of_itself(front), "both sides have the same cut: {front}");
    }
    // What must not pass: the headways below half a second, as if they had the cut of the scenario.
    let folder = folder();
    let shifted = folder.path().join("shifted.toml");
    let text = fs::read_to_string(library("low-thw-overtake")).unwrap();
    fs::write(&shifted, text.replace("cut = [0.5, 0.9]", "cut = [0.0, 3.0]")).unwrap();
    let words = ["traffic", "drift", shifted.to_str().unwrap()].map(str::to_owned);
    assert!(stdout(&closecall(words.iter().chain(&recordings)), 1).contains("DRIFTED"));
}
