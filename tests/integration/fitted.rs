//! `--fitted` applies fitted distributions to the parameters of a scenario.

use std::fs;

use crate::support::{ROOT, closecall, code, folder, journal, json, json_file, library, message, stdout};

#[test]
fn fitted_distributions_replace_those_of_a_scenario_and_stand_in_the_manifest() {
    let folder = folder();
    let fitted = folder.path().join("fitted.toml");
    let entry = "brake-mps2 = { empirical = { quantiles = [5.0, 5.5, 6.0] }, fitted = { n = 9, source = \"own\" } }";
    fs::write(&fitted, format!("[parameters]\n{entry}\n")).unwrap();
    let (fitted, out, scenario) = (fitted.to_str().unwrap(), folder.path().join("out"), library("low-thw-overtake"));
    let scenario = scenario.to_str().unwrap();
    stdout(&closecall(["check", scenario, "--fitted", fitted]), 0);
    let words = ["campaign", scenario, "-n", "8", "--sensors", "object", "--no-gate", "--fitted", fitted, "--out"];
    stdout(&closecall(words.into_iter().chain([out.to_str().unwrap()])), 0);
    let manifest = json_file(&out.join("manifest.json"));
    let settings = manifest["scenarios"][0]["settings"].to_string();
    assert!(settings.contains("parameters.brake-mps2") && settings.contains("blake3"), "{settings}");
    let text = manifest["scenarios"][0]["text"].as_str().unwrap();
    assert!(text.contains("quantiles = [5.0, 5.5, 6.0]") && !text.contains("min = 4.0, max = 8.0"), "{text}");
    for record in journal(&out) {
        let drawn = record["arms"][0]["result"]["Ok"]["parameters"]["brake-mps2"].as_f64().unwrap();
        assert!((5.0..=6.0).contains(&drawn), "{drawn}");
    }
    // The same with a value that is set afterwards.
    let run = ["run", scenario, "--sensors", "object", "--fitted", fitted, "--set", "brake-mps2=7", "--format", "json"];
    let outcome = json(&closecall(run), 0);
    assert_eq!(outcome["parameters"]["brake-mps2"], 7.0);
    assert!(outcome["settings"].to_string().contains("blake3"), "{}", outcome["settings"]);
}

#[test]
fn an_unknown_name_in_a_fitted_file_is_refused_with_the_allowed_ones() {
    let folder = folder();
    let fitted = folder.path().join("fitted.toml");
    fs::write(&fitted, "[parameters]\nbrake = { uniform = { min = 1, max = 2 } }\n").unwrap();
    let scenario = library("low-thw-overtake");
    for command in ["run", "campaign", "check"] {
        let output = closecall([command, scenario.to_str().unwrap(), "--fitted", fitted.to_str().unwrap()]);
        assert_eq!(code(&output), 3, "{command}: {}", message(&output));
        let said = message(&output);
        assert!(said.contains("`brake` is not a parameter of low-thw-overtake: allowed are brake-mps2"), "{said}");
    }
    let missing = closecall(["check", scenario.to_str().unwrap(), "--fitted", "/no/such.toml"]);
    assert_eq!(code(&missing), 6, "{}", message(&missing));
}

#[test]
fn the_fit_of_the_library_applies_to_its_scenarios_with_a_note_on_what_is_cut() {
    // US-101 has closing speeds of a millimetre per second, which no encounter of these scenarios can
    // have.
    let us101 = std::path::Path::new(ROOT).join("scenarios/library/fitted/us101.toml");
    for name in ["low-thw-overtake", "lead-brakes-partially", "busy-overtake", "rear-vehicle-is-followed"] {
        let output = closecall(["check", name, "--fitted", us101.to_str().unwrap()]);
        stdout(&output, 0);
        let note = "`closing-mps`: 4.1 % of the fitted values lie beyond the 0.101 to 4.15 that";
        let is_cut = name != "rear-vehicle-is-followed";
        assert_eq!(message(&output).contains(note), is_cut, "{name}: {}", message(&output));
    }
}
