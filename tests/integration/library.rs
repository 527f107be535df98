//! The scenarios that ship: each is valid, says where its numbers come from, and does what it promises.

use std::path::PathBuf;

use closecall_scenarios::parameters::{ParameterConfig, ParametersConfig, Provenance};
use closecall_simulation::scenario::ScenarioFile;

use crate::support::{closecall, json, library, stdout};

fn all() -> Vec<PathBuf> {
    let folder = library("x").parent().unwrap().to_owned();
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    files
}

#[test]
fn every_scenario_is_valid() {
    let files = all();
    assert!(files.len() >= 7);
    let text = stdout(&closecall(std::iter::once("check").chain(files.iter().map(|file| file.to_str().unwrap()))), 0);
    assert_eq!(text.lines().filter(|line| line.contains("valid")).count(), files.len());
}

#[test]
fn every_distribution_is_labelled() {
    for path in all() {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        for (name, entry) in file.space().iter() {
            match &entry.provenance {
                Provenance::Fitted(fitted) => assert!(fitted.n >= 5 && fitted.interval_95.is_some()),
                Provenance::Assumed(why) => assert!(why.len() > 20, "{}: {name}", path.display()),
                Provenance::Unstated => panic!("{}: {name} is neither fitted nor assumed", path.display()),
            }
        }
    }
}

#[test]
fn every_scenario_is_evidence_for_a_requirement_that_is_written_down() {
    let listed = include_str!("../../docs/requirements.md");
    for path in all() {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        let requirements = &file.config().requirements;
        assert!(!requirements.is_empty(), "{}", path.display());
        for mark in requirements {
            assert!(listed.contains(&format!("| `{mark}` |")), "{}: {mark}", path.display());
        }
    }
}

#[test]
fn fitted_distributions_are_those_of_the_committed_fit() {
    let committed = include_str!("../../scenarios/library/fitted/us101.toml");
    let document: toml::Table = committed.parse().unwrap();
    let tables: Vec<ParametersConfig> =
        ["parameters", "parametric"].map(|table| document[table].clone().try_into().unwrap()).into();
    let mut fitted = 0;
    for path in all() {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        for (name, config) in &file.config().parameters.0 {
            if config.fitted.is_none() {
                continue;
            }
            fitted += 1;
            let names = [name.to_string(), format!("critical-{name}"), format!("short-{name}")];
            let same = tables
                .iter()
                .flat_map(|table| &table.0)
                .any(|(fitted, committed)| names.contains(&fitted.to_string()) && is_cut_of(config, committed));
            assert!(same, "{}: {name} is not what was fitted", path.display());
        }
    }
    assert!(fitted >= 10);
}

/// True where a distribution is a fitted one, perhaps cut off.
fn is_cut_of(config: &ParameterConfig, committed: &ParameterConfig) -> bool {
    let form = |config: &ParameterConfig| config.log_normal.map(|log_normal| (log_normal.median, log_normal.sigma));
    config.fitted == committed.fitted && config.empirical == committed.empirical && form(config) == form(committed)
}

/// Samples of each scenario without a braking front vehicle.
const SAMPLES: &str = "250";

#[test]
fn nobody_collides_where_the_front_vehicle_does_not_brake() {
    for path in all() {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        if !file.config().tags.iter().any(|tag| tag == "no-collision") {
            continue;
        }
        let args = ["campaign", path.to_str().unwrap(), "-n", SAMPLES, "--paired", "--format", "json"];
        let report = json(&closecall(args), 0);
        for arm in ["acc", "mis"] {
            assert_eq!(report["controllers"][arm]["collisions"], 0, "{} with {arm}", path.display());
        }
        assert_eq!(report["errors"], 0);
    }
}

#[test]
fn the_system_stays_off_where_it_should() {
    for name in ["left-lane-blocked", "slow-approach", "empty-wet-road"] {
        let path = library(name);
        let args = ["campaign", path.to_str().unwrap(), "-n", "100", "--sensors", "ground-truth", "--format", "json"];
        let report = json(&closecall(args), 0);
        assert_eq!(report["controllers"]["mis"]["engagements"], 0, "{name}");
    }
}

#[test]
fn the_schema_describes_what_is_read() {
    let schema: serde_json::Value = serde_json::from_str(&stdout(&closecall(["schema"]), 0)).unwrap();
    assert_eq!(schema["title"], "ScenarioConfig");
    for key in ["schema-version", "name", "road", "parameters", "actor", "sensors"] {
        assert!(schema["properties"].get(key).is_some(), "{key}");
    }
}
