//! `drift` says whether new traffic matches fitted distributions.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{closecall, code, folder, json, library, message, stdout};

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
    let found = json(&closecall(["traffic", "drift", fitted, again.to_str().unwrap(), "--format", "json"]), 0);
    assert_eq!((&found["is_tested"], &found["has_drifted"]), (&true.into(), &false.into()), "{found}");
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
    let other = folder.path().join("other.toml");
    fs::write(&other, "[parameters]\nx = { fixed = 1.0 }\n").unwrap();
    refused(["traffic", "drift", other.to_str().unwrap(), first], 3, "no parameter has quantiles");
}
