//! The scenarios of the library are valid, name the source of their numbers, and behave as their
//! descriptions promise.

use std::path::Path;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::parameters::{ParameterConfig, ParametersConfig, Provenance};

use crate::support::{
    all_of_library, closecall, code, families_of_library, folder, headline_with, json, library, message, stdout,
};

/// The smallest number of scenarios that the library holds.
const LEAST_SCENARIOS: usize = 14;

/// Returns what `check` prints for a valid scenario file.
fn verdict(path: &Path) -> String {
    let file = ScenarioFile::load(path, &[]).unwrap();
    let count = file.space().iter().len();
    format!("{}: valid, {} with {count} parameters", path.display(), file.config().name)
}

#[test]
fn check_calls_every_scenario_valid() {
    let files = all_of_library();
    assert!(files.len() >= LEAST_SCENARIOS, "{files:?}");
    let text =
        stdout(&closecall(std::iter::once(Path::new("check")).chain(files.iter().map(|file| file.as_path()))), 0);
    let expected: Vec<String> = files.iter().map(|path| verdict(path)).collect();
    assert_eq!(text.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn check_does_not_call_a_scenario_valid_that_is_not() {
    let folder = folder();
    let broken = folder.path().join("broken.toml");
    std::fs::write(&broken, headline_with("friction = 0.9", "friction = -0.9")).unwrap();
    let good = library("slow-approach");
    let output = closecall([Path::new("check"), &broken, &good]);
    assert_eq!(stdout(&output, 3).lines().collect::<Vec<_>>(), [verdict(&good)]);
    assert!(message(&output).contains("environment.friction"), "{}", message(&output));
}

#[test]
fn every_parameter_is_fitted_or_assumed() {
    for path in all_of_library().into_iter().chain(families_of_library().into_iter().flatten()) {
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
fn every_scenario_names_a_requirement_of_the_list() {
    let list = include_str!("../../docs/reference/requirements.md");
    for path in all_of_library().into_iter().chain(families_of_library().into_iter().flatten()) {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        let requirements = &file.config().requirements;
        assert!(!requirements.is_empty(), "{}", path.display());
        for name in requirements {
            assert!(list.contains(&format!("| `{name}` |")), "{}: {name}", path.display());
        }
    }
}

#[test]
fn fitted_distributions_equal_those_of_the_committed_fit() {
    let committed = include_str!("../../scenarios/library/fitted/us101.toml");
    let document: toml::Table = committed.parse().unwrap();
    let tables: Vec<ParametersConfig> =
        ["parameters", "parametric"].map(|table| document[table].clone().try_into().unwrap()).into();
    let mut count = 0;
    for path in all_of_library().into_iter().chain(families_of_library().into_iter().flatten()) {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        for (name, config) in &file.config().parameters.0 {
            if config.fitted.is_none() {
                continue;
            }
            count += 1;
            // A quantity of another vehicle is drawn from the fit of all vehicles, or of the
            // vehicle ahead.
            let name = name.to_string();
            let quantity = name.split_once('-').map_or("", |(_, quantity)| quantity);
            let names: Vec<String> = [name.clone(), quantity.to_owned(), format!("front-{quantity}")]
                .iter()
                .flat_map(|name| [name.clone(), format!("critical-{name}"), format!("short-{name}")])
                .collect();
            let is_committed = tables
                .iter()
                .flat_map(|table| &table.0)
                .any(|(fitted, committed)| names.contains(&fitted.to_string()) && is_cut_of(config, committed));
            assert!(is_committed, "{}: {name} is not a distribution of the fit", path.display());
        }
    }
    assert!(count >= 10, "only {count} fitted distributions");
}

/// Returns true if `config` is the distribution `committed`, whether or not it is truncated.
fn is_cut_of(config: &ParameterConfig, committed: &ParameterConfig) -> bool {
    let form = |config: &ParameterConfig| config.log_normal.map(|log_normal| (log_normal.median, log_normal.sigma));
    config.fitted == committed.fitted && config.empirical == committed.empirical && form(config) == form(committed)
}

/// Samples of each scenario in which the lead vehicle does not brake.
const SAMPLES: &str = "250";
/// The same with the full chain.
const SAMPLES_IN_FULL: &str = "10";

#[test]
fn the_ego_does_not_collide_if_the_lead_vehicle_does_not_brake() {
    for path in all_of_library() {
        let file = ScenarioFile::load(&path, &[]).unwrap();
        if !file.config().tags.iter().any(|tag| tag == "no-collision") {
            continue;
        }
        let path = path.to_str().unwrap();
        // Ten samples do not decide the checks, but the ego must not collide in any of them.
        let in_full = ["-n", SAMPLES_IN_FULL, "--no-gate", "--no-validity-checks"];
        for (sensors, options) in [("object", &["-n", SAMPLES][..]), ("full", &in_full[..])] {
            let args = ["campaign", path, "--paired", "--sensors", sensors, "--format", "json"];
            let report = json(&closecall(args.iter().chain(options)), 0);
            for arm in ["acc", "mis"] {
                assert_eq!(report["controllers"][arm]["collisions"], 0, "{path} with {arm} and {sensors} sensors");
            }
            assert_eq!(report["errors"], 0);
        }
    }
}

#[test]
fn the_mis_does_not_engage_in_scenarios_that_give_no_reason_to() {
    for name in ["left-lane-blocked", "slow-approach", "empty-wet-road"] {
        let path = library(name);
        let args = [
            "campaign",
            path.to_str().unwrap(),
            "-n",
            "100",
            "--sensors",
            "ground-truth",
            "--no-gate",
            "--format",
            "json",
        ];
        let report = json(&closecall(args), 0);
        assert_eq!(report["controllers"]["mis"]["engagements"], 0, "{name}");
    }
}

/// Samples of a family of another function: enough for the bounds of its checks.
const SAMPLES_OF_FAMILY: &str = "400";

#[test]
fn emergency_braking_and_cruise_control_are_judged_in_arms_of_their_own() {
    for (family, arms) in [("aeb", ["acc-aeb", "acc+aeb"]), ("acc", ["cruise+aeb", "acc+aeb"])] {
        let path = library(family).with_extension("");
        let args = ["campaign", path.to_str().unwrap(), "--paired", "-n", SAMPLES_OF_FAMILY, "--format", "json"];
        let report = json(&closecall(args), 0);
        assert_eq!(report["verdict"], "PASS", "{family}: {}", report["reasons"]);
        for arm in arms {
            assert_eq!(report["controllers"][arm]["errors"], 0, "{family}: {arm}");
        }
        assert_eq!(report["controllers"]["acc+aeb"]["collisions"], 0, "{family}");
    }
}

#[test]
fn without_emergency_braking_its_family_fails() {
    let path = library("aeb/aeb-lead-brakes");
    let same = ["campaign", path.to_str().unwrap(), "-n", "40", "--format", "json", "--arms", "cruise-aeb,acc-aeb"];
    let report = json(&closecall(same), 1);
    assert!(
        report["reasons"][0].as_str().unwrap().starts_with("NOT MET: aeb-lead-brakes: AEB-1"),
        "{}",
        report["reasons"]
    );
}

#[test]
fn an_ego_that_is_always_slower_fails_the_families_of_the_other_functions() {
    let scenarios = [
        "aeb/aeb-lead-brakes",
        "aeb/aeb-lead-brakes-gently",
        "acc/acc-lead-slows",
        "acc/acc-slow-vehicle-ahead",
        "anchor/anchor-lead-brakes",
    ];
    for (scenario, controller) in scenarios.iter().flat_map(|name| ["blind", "crawl"].map(|slow| (name, slow))) {
        let path = library(scenario);
        let args = ["campaign", path.to_str().unwrap(), "-n", "60", "--paired", "--controller", controller];
        let text = stdout(&closecall(args), 1);
        assert!(text.contains("<= 0.05]") && text.contains("NOT MET"), "{scenario} {controller}: {text}");
    }
}

#[test]
fn a_setting_acts_on_the_arm_that_it_names_alone() {
    let path = library("aeb/aeb-lead-brakes");
    let arms = ["--arms", "acc-aeb,acc+aeb", "--set", "acc+aeb:aeb.max-deceleration-mps2=4.5"];
    let args = ["campaign", path.to_str().unwrap(), "-n", "40", "--no-gate", "--format", "json"];
    let weak = json(&closecall(args.iter().chain(&arms)), 0);
    let usual = json(&closecall(args.iter().chain(&arms[..2])), 0);
    let collisions = |report: &serde_json::Value, arm: &str| report["controllers"][arm]["collisions"].as_u64().unwrap();
    assert_eq!(collisions(&weak, "acc-aeb"), collisions(&usual, "acc-aeb"));
    assert!(collisions(&weak, "acc+aeb:aeb.max-deceleration-mps2=4.5") > collisions(&usual, "acc+aeb"));
}

#[test]
fn arms_and_settings_that_change_nothing_are_refused() {
    for (scenario, options, part) in [
        ("aeb/aeb-lead-brakes", &["--arms", "acc,acc+aeb"][..], "are the same stack in this scenario"),
        (
            "aeb/aeb-lead-brakes",
            &["--arms", "acc-aeb,acc+aeb", "--set", "acc-aeb:aeb.trigger-mps2=6"],
            "change nothing",
        ),
        ("aeb/aeb-lead-brakes", &["--arms", "acc-aeb,acc+aeb", "--set", "mis:aeb.trigger-mps2=6"], "no arm is `mis`"),
        ("aeb/aeb-lead-brakes", &["--set", "acc+aeb:aeb.onset-mps2=6"], "trigger-mps2"),
        ("aeb/aeb-lead-brakes", &["--controller", "mis"], "needs a margin increase system"),
        ("low-thw-overtake", &["--arms", "acc+abs,mis"], "a list of functions has"),
    ] {
        let path = library(scenario);
        let output = closecall(["campaign", path.to_str().unwrap(), "-n", "4"].iter().chain(options));
        assert!(message(&output).contains(part), "{options:?}: {}", message(&output));
        assert!(matches!(output.status.code(), Some(2 | 3)), "{options:?}: {:?}", output.status);
    }
}

#[test]
fn a_folder_runs_the_scenarios_of_one_function_and_names_the_others() {
    let folder = folder();
    for name in ["aeb/aeb-lead-brakes", "paper-figure"] {
        let name = library(name);
        std::fs::copy(&name, folder.path().join(name.file_name().unwrap())).unwrap();
    }
    let output = closecall(["campaign", folder.path().to_str().unwrap(), "-n", "2", "--no-gate", "--format", "json"]);
    let report = json(&output, 0);
    assert_eq!(report["controllers"].as_object().unwrap().keys().collect::<Vec<_>>(), ["mis"]);
    assert!(message(&output).contains("aeb-lead-brakes: not run, because it judges `aeb`"), "{}", message(&output));
    let both = ["aeb/aeb-lead-brakes", "paper-figure"].map(|name| library(name).display().to_string());
    let refused = closecall(["campaign", &both[0], &both[1], "-n", "2"]);
    assert!(message(&refused).contains("run them apart"), "{}", message(&refused));
}

#[test]
fn a_folder_leaves_out_the_scenarios_whose_faults_cannot_act_and_does_not_pass() {
    let folder = folder();
    for name in ["overtake-without-brake", "faults/camera-dead", "faults/camera-dirty"] {
        let name = library(name);
        std::fs::copy(&name, folder.path().join(name.file_name().unwrap())).unwrap();
    }
    let (path, out) = (folder.path().to_str().unwrap().to_owned(), folder.path().join("out"));
    let campaign = |mode: &str, more: &[&str]| {
        let usual =
            ["campaign", &path, "-n", "60", "--sensors", mode, "--format", "json", "--out", out.to_str().unwrap()];
        closecall(usual.iter().chain(more))
    };
    // The other scenario passes.
    let gate = ["--max-collisions", "0"];
    let output = campaign("object", &gate);
    let report = json(&output, 4);
    assert_eq!(report["verdict"], "NOT JUDGED", "{report:#}");
    let why = "not run: camera-dead, camera-dirty: `fault.rear-camera` contradicts `sensors.mode`";
    assert!(report["reasons"][0].as_str().unwrap().starts_with(why), "{report:#}");
    assert!(message(&output).contains(why), "{}", message(&output));
    assert_eq!(report["scenarios"].as_object().unwrap().keys().collect::<Vec<_>>(), ["overtake-without-brake"]);
    // The folder of the results knows it: the campaign that goes on does not pass either.
    let again = json(&campaign("object", &["--resume", gate[0], gate[1]]), 4);
    assert_eq!(again["verdict"], "NOT JUDGED");
    std::fs::remove_dir_all(&out).unwrap();
    // A measurement has no verdict, and says it all the same.
    let measured = json(&campaign("object", &["--no-gate"]), 0);
    assert!(measured["reasons"].to_string().contains(why), "{measured:#}");
    // None of the named scenarios can run.
    let alone = closecall(["campaign", "camera-dead", "lidar-dead", "-n", "2", "--sensors", "object"]);
    assert!(message(&alone).contains("camera-dead.toml") && code(&alone) == 3, "{}", message(&alone));
}

#[test]
fn a_verdict_names_what_its_scenario_extrapolates() {
    let text = |name: &str| {
        let path = library(name);
        stdout(&closecall(["campaign", path.to_str().unwrap(), "-n", "3", "--sensors", "ground-truth", "--no-gate"]), 0)
    };
    let headline = text("low-thw-overtake");
    assert!(headline.contains("extrapolates beyond recorded traffic: closing-mps 2.800 to 13.900, observed 0.001 to 4.15 (13 observations), 87.8 % of the distribution beyond"), "{headline}");
    assert!(!text("as-recorded/low-thw-overtake-as-recorded").contains("extrapolates"));
}

#[test]
fn the_schema_has_the_tables_of_a_scenario_file() {
    let schema = json(&closecall(["tool", "schema"]), 0);
    assert_eq!(schema["title"], "ScenarioConfig");
    for key in ["schema-version", "name", "road", "parameters", "actor", "sensors"] {
        assert!(schema["properties"].get(key).is_some(), "{key}");
    }
}
