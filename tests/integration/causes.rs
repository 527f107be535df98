//! From a collision to its cause: what `explain`, `minimize`, `map` and `exposure` say, and that it
//! can be repeated.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::native_controllers::{compile, lib};
use crate::support::{ROOT, closecall, code, folder, json, library, message, records, stderr, stdout};

/// The seed of all campaigns here.
const SEED: &str = "4021";

/// Runs a campaign of `low-thw-overtake` with object-level sensors, and returns its folder.
fn campaign(parent: &Path, name: &str, samples: u64, arguments: &[&str]) -> PathBuf {
    let path = parent.join(name);
    let (scenario, samples) = (library("low-thw-overtake"), samples.to_string());
    let base = ["campaign", scenario.to_str().unwrap(), "-n", &samples, "--seed", SEED, "--sensors", "object"];
    let place = ["--no-gate", "--out", path.to_str().unwrap()];
    stdout(&closecall([&base[..], &place, arguments].concat()), 0);
    path
}

/// Returns the samples of a campaign in which any vehicles collide in the arm under test.
fn failing(folder: &Path) -> BTreeSet<u64> {
    let fails = records(folder).into_iter().filter(|record| {
        record.arms.last().is_some_and(|arm| arm.result.as_ref().is_ok_and(|outcome| !outcome.collisions.is_empty()))
    });
    fails.map(|record| record.sample).collect()
}

fn number_of_collisions(run: &Value) -> usize {
    run["collisions"].as_array().unwrap().len()
}

#[test]
fn an_injected_fault_is_named_in_the_failures_that_it_causes() {
    let parent = folder();
    let usual = failing(&campaign(parent.path(), "usual", 400, &[]));
    for (fault, stage) in [
        ("fault.delay-s=0.1", "timing"),
        ("fault.class-background=true", "class"),
        ("fault.rear-reaction-s=1", "rear-reaction"),
    ] {
        let faulty = campaign(parent.path(), stage, 400, &["--set", fault]);
        let caused: BTreeSet<u64> = failing(&faulty).difference(&usual).copied().collect();
        assert!(caused.len() >= 3, "{fault} causes {} failures only", caused.len());
        let all = closecall(["explain", faulty.to_str().unwrap(), "--most", "1000", "--format", "json"]);
        let explained = json(&all, 0);
        let is_caused = |explanation: &&Value| caused.contains(&explanation["sample"].as_u64().unwrap());
        let explanations: Vec<&Value> = explained.as_array().unwrap().iter().filter(is_caused).collect();
        assert_eq!(explanations.len(), caused.len());
        let named = explanations.iter().filter(|explanation| explanation["cause"]["stage"] == stage).count();
        assert!(100 * named >= 95 * caused.len(), "{fault}: {stage} is named in {named} of {}", caused.len());
    }
}

#[test]
fn a_named_stage_is_confirmed_by_a_run_with_that_stage_alone_replaced() {
    let parent = folder();
    let path = campaign(parent.path(), "paired", 300, &["--paired"]);
    let dir = path.to_str().unwrap();
    let explained = json(&closecall(["explain", dir, "--format", "json"]), 0);
    let explained = explained.as_array().unwrap();
    assert_eq!(explained.len(), failing(&path).len());
    assert!(explained.len() >= 5, "{} failures only", explained.len());
    let mut confirmed = 0;
    for explanation in explained {
        let sample = explanation["sample"].to_string();
        let replayed = json(&closecall(["replay", dir, &sample, "--format", "json"]), 0);
        assert!(number_of_collisions(&replayed) > 0, "{sample} fails");
        let Some(stage) = explanation["cause"]["stage"].as_str() else { continue };
        let setting = format!("ideal.{stage}=true");
        let perfect = json(&closecall(["replay", dir, &sample, "--set", &setting, "--format", "json"]), 0);
        assert_eq!(number_of_collisions(&perfect), 0, "sample {sample} with {setting}");
        // A plain run of the scenario with the same seed and settings is the same run.
        let plain = ["run", "low-thw-overtake", "--seed", SEED, "--sample", &sample, "--sensors", "object"];
        let plain = json(&closecall(plain.into_iter().chain(["--set", &setting, "--format", "json"])), 0);
        assert_eq!(number_of_collisions(&plain), 0, "sample {sample} with {setting}");
        confirmed += 1;
    }
    assert!(confirmed >= 3, "{confirmed} stages only are confirmed");
    // The report names every failure with its cause and its commands.
    let page = std::fs::read_to_string(path.join("report.html")).unwrap();
    assert!(page.contains("<h2 id=\"part-") && page.contains(">Causes</h2>"), "no table of causes");
    assert!(page.contains("Cost where nothing happens"));
    for explanation in explained {
        for command in ["replay", "explain", "minimize"] {
            assert!(
                page.contains(&format!("<code>closecall {command} . {}</code>", explanation["sample"])),
                "{command}"
            );
        }
    }
    assert_eq!(page.matches("<!-- causes -->").count(), 1);
}

#[test]
fn a_minimized_case_fails_and_its_twin_passes_as_plain_scenario_files() {
    let parent = folder();
    let path = campaign(parent.path(), "usual", 300, &[]);
    let failing = failing(&path);
    assert!(failing.len() >= 5, "{} failures only", failing.len());
    for sample in failing.into_iter().take(5) {
        let file = parent.path().join(format!("case-{sample}.toml"));
        let (dir, name, number) = (path.to_str().unwrap(), file.to_str().unwrap(), sample.to_string());
        let output = closecall(["minimize", dir, &number, "--out", name, "--format", "json"]);
        let case = json(&output, 0);
        for key in ["failing", "twin"] {
            let written = format!("written: {}\n", case["files"][key].as_str().unwrap());
            assert!(stderr(&output).contains(&written), "{}", stderr(&output));
        }
        let off = case["minimized"]["off_nominal"].as_array().unwrap().len();
        assert!(off <= 3 || case["minimized"]["why_more_than_three"].is_string(), "{case:#}");
        // No parameter of this scenario is correlated: the distances add like the sides of a box.
        let offsets = case["minimized"]["off_nominal"].as_array().unwrap().iter();
        let squares: f64 = offsets.map(|offset| offset["distance_sd"].as_f64().unwrap().powi(2)).sum();
        let distance_sd = case["minimized"]["distance_sd"].as_f64().unwrap();
        assert!((distance_sd - squares.sqrt()).abs() < 1e-6 && (distance_sd > 0.0) == (off > 0), "{case:#}");
        let run = |file: &str| number_of_collisions(&json(&closecall(["run", file, "--format", "json"]), 0));
        assert!(run(name) > 0, "{name}");
        let twin = case["files"]["twin"].as_str().unwrap();
        assert_eq!(run(twin), 0, "{twin}");
        // A campaign judges both by the gates that they carry.
        stdout(&closecall(["campaign", name, twin, "-n", "1"]), 0);
    }
}

/// A scenario in which vehicles collide if and only if one parameter, a gap of 17.5 m ± 5 m, is below
/// 10 m, and which has a second parameter that changes nothing.
fn gap_scenario(parent: &Path) -> PathBuf {
    let text = std::fs::read_to_string(Path::new(ROOT).join("tests/fixtures/known-rare-probability.toml")).unwrap();
    let unneeded = "[parameters]\npaint = { uniform = { min = 0.2, max = 0.8 } }";
    let text = text.replace("mean = 30.0", "mean = 17.5").replace("[parameters]", unneeded).replace(
        "vehicle = { class = \"car\" }\nstart = { behind",
        "vehicle = { class = \"car\", paint-reflectivity = \"$paint\" }\nstart = { behind",
    );
    assert!(text.contains("mean = 17.5") && text.contains("$paint"), "{text}");
    let path = parent.join("gap.toml");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_nearest_failure_is_at_the_known_distance_of_the_boundary() {
    let parent = folder();
    let (scenario, out) = (gap_scenario(parent.path()), parent.path().join("out"));
    let (scenario, dir) = (scenario.to_str().unwrap(), out.to_str().unwrap());
    let words = ["campaign", scenario, "-n", "200", "--seed", SEED, "--controller", "acc", "--no-gate", "--out", dir];
    stdout(&closecall(words), 0);
    let file = parent.path().join("nearest.toml");
    let words = ["minimize", dir, "--nearest", "--out", file.to_str().unwrap()];
    let result = json(&closecall(words.into_iter().chain(["--format", "json"])), 0);
    let minimized = &result["minimized"];
    // P(gap < 10 m) = (Φ(−1.5) − Φ(−3.3))/(Φ(8.5) − Φ(−3.3)) = 0.06636, hence β = 1.5035.
    let distance_sd = minimized["distance_sd"].as_f64().unwrap();
    assert!((1.5030..1.510).contains(&distance_sd), "{minimized:#}");
    let off = minimized["off_nominal"].as_array().unwrap();
    assert_eq!(off.len(), 1, "the paint is not needed: {minimized:#}");
    assert_eq!(off[0]["name"], "gap-m");
    // The nominal gap is the median of the truncated distribution, 17.503 m.
    let difference = off[0]["difference"].as_f64().unwrap();
    assert!((-7.6..-7.5).contains(&difference), "{minimized:#}");
    assert!((off[0]["distance_sd"].as_f64().unwrap() + distance_sd).abs() < 1e-6, "{minimized:#}");
    let nearest = &minimized["nearest"];
    assert!(nearest["runs"].as_u64().unwrap() <= nearest["most_runs"].as_u64().unwrap(), "{nearest:#}");
    assert!(nearest["starts"].as_u64().unwrap() <= nearest["failing"].as_u64().unwrap(), "{nearest:#}");
    assert_eq!(nearest["has_converged"], true);
    let run = |file: &str| {
        number_of_collisions(&json(&closecall(["run", file, "--controller", "acc", "--format", "json"]), 0))
    };
    assert!(run(file.to_str().unwrap()) > 0);
    assert_eq!(run(result["files"]["twin"].as_str().unwrap()), 0);
    // In words, and again to the same bytes.
    let text = stdout(&closecall(words), 0);
    assert!(text.contains("the nearest failure found is 1.50 standard deviations from the nominal case"), "{text}");
    assert!(
        text.contains("m less, -1.50 standard deviations") && text.contains("a nearer failure may exist"),
        "{text}"
    );
    assert_eq!(stdout(&closecall(words), 0), text);
}

/// A controller that has an error if the vehicle behind starts in a range of distances.
const LOSES_THE_REAR: &str = r#"
#include <stdlib.h>
#include "closecall_controller.h"
uint32_t closecall_controller_abi(void) { return CLOSECALL_CONTROLLER_ABI; }
void *closecall_controller_create(const closecall_setup *setup) { (void)setup; return calloc(1, sizeof(int)); }
void closecall_controller_destroy(void *controller) { free(controller); }
const char *closecall_controller_error(void *controller) { (void)controller; return "lost the vehicle behind"; }
int32_t closecall_controller_step(void *controller, const closecall_input *in, closecall_command *command) {
    int is_first = (*(int *)controller)++ == 0;
    for (uint64_t i = 0; i < in->track_count; i++)
        if (is_first && in->tracks[i].x_m > -19.5 && in->tracks[i].x_m < -17.5) return 7;
    command->acceleration_mps2 = 0.0;
    command->state = 0;
    return 0;
}
"#;

#[test]
fn runs_without_an_outcome_in_a_search_are_counted_with_a_message() {
    let parent = folder();
    let (scenario, out) = (gap_scenario(parent.path()), parent.path().join("out"));
    let source = parent.path().join("loses.c");
    std::fs::write(&source, LOSES_THE_REAR).unwrap();
    // The range lies between the gaps that fail and the nominal one.
    let controller = lib(&compile(source.to_str().unwrap(), &parent.path().join("loses.so"), &[]));
    let (scenario, dir) = (scenario.to_str().unwrap(), out.to_str().unwrap());
    let words =
        ["campaign", scenario, "-n", "60", "--seed", SEED, "--no-gate", "--out", dir, "--controller", &controller];
    let output = closecall(words.into_iter().chain(["--controller-timeout-ms", "60000", "--record", "failures:0"]));
    assert_eq!(code(&output), 5, "{}", stderr(&output));
    let file = parent.path().join("nearest.toml");
    // Each run starts a process.
    let text = stdout(&closecall(["minimize", dir, "--nearest", "-n", "20", "--out", file.to_str().unwrap()]), 0);
    let line =
        text.lines().find(|line| line.contains("of the search ended in an ERROR and count as not failing, such as: "));
    assert!(line.is_some_and(|line| line.ends_with("lost the vehicle behind")), "{text}");
}

#[test]
fn the_nearest_failure_of_several_parameters_fails_and_stays_within_its_runs() {
    let parent = folder();
    let path = campaign(parent.path(), "usual", 200, &[]);
    let sample = failing(&path).first().unwrap().to_string();
    let file = parent.path().join("nearest.toml");
    let (dir, name) = (path.to_str().unwrap(), file.to_str().unwrap());
    let all = json(&closecall(["minimize", dir, "--nearest", "-n", "600", "--out", name, "--format", "json"]), 0);
    let run = |file: &str| number_of_collisions(&json(&closecall(["run", file, "--format", "json"]), 0));
    assert!(run(name) > 0, "{all:#}");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("The nearest failure that a search has found: "), "{text}");
    assert!(all["minimized"]["nearest"]["runs"].as_u64().unwrap() <= 600, "{all:#}");
    // One sample alone is one start.
    let one = ["minimize", dir, &sample, "--nearest", "-n", "600", "--out", name, "--format", "json"];
    let one = json(&closecall(one), 0);
    assert_eq!(one["minimized"]["sample"].to_string(), sample);
    let counts = ["starts", "failing"].map(|key| one["minimized"]["nearest"][key].as_u64().unwrap());
    assert_eq!(counts, [1, 1]);
}

#[test]
fn a_nearest_failure_needs_a_failing_sample() {
    let parent = folder();
    let (scenario, out) = (gap_scenario(parent.path()), parent.path().join("out"));
    let dir = out.to_str().unwrap();
    let words = ["campaign", scenario.to_str().unwrap(), "-n", "5", "--set", "gap-m=30", "--no-gate", "--out", dir];
    stdout(&closecall(words), 0);
    let none = closecall(["minimize", dir, "--nearest"]);
    assert_eq!(code(&none), 2);
    assert!(message(&none).contains("no sample of `known-rare-probability` fails with `mis`"), "{}", message(&none));
    let passes = closecall(["minimize", dir, "3", "--nearest"]);
    assert!(message(&passes).contains("sample 3 does not fail with `mis`"), "{}", message(&passes));
    for words in [vec!["minimize", dir], vec!["minimize", dir, "3", "--runs", "5"]] {
        assert_eq!(code(&closecall(words)), 2);
    }
}

#[test]
fn a_minimized_case_of_another_controller_names_it_and_no_foreign_file_is_overwritten() {
    let parent = folder();
    let path = campaign(parent.path(), "acc", 120, &["--controller", "acc"]);
    let sample = failing(&path).first().unwrap().to_string();
    let (dir, file) = (path.to_str().unwrap(), parent.path().join("case acc.toml"));
    let words = ["minimize", dir, &sample, "--controller", "acc", "--out", file.to_str().unwrap()];
    let text = stdout(&closecall(words), 0);
    let commands = text.lines().filter(|line| line.contains("closecall run '") && line.ends_with("--controller acc"));
    assert!(commands.count() >= 1 && !text.contains("closecall run /"), "{text}");
    let run = ["run", file.to_str().unwrap(), "--controller", "acc", "--format", "json"];
    assert!(number_of_collisions(&json(&closecall(run), 0)) > 0);
    assert!(!std::fs::read_to_string(&file).unwrap().contains("[gate]"), "a gate would be judged with `mis`");
    // The command writes its own files again, and no others.
    stdout(&closecall(words), 0);
    let twin = parent.path().join("case acc-passes.toml");
    std::fs::write(&twin, "# by hand\n").unwrap();
    let refused = closecall(words);
    assert_eq!(code(&refused), 2);
    assert!(message(&refused).contains("closecall minimize` has not written it"), "{}", message(&refused));
    assert_eq!(std::fs::read_to_string(&twin).unwrap(), "# by hand\n");
}

#[test]
fn the_collected_regressions_have_the_outcomes_that_they_state() {
    let cases = Path::new(ROOT).join("scenarios/regressions");
    let files: Vec<_> = std::fs::read_dir(&cases).unwrap().map(|entry| entry.unwrap().path()).collect();
    let cases_of = |kind: &str| files.iter().filter(|file| file.to_string_lossy().ends_with(kind)).count();
    assert!(cases_of("-passes.toml") >= 3 && cases_of(".toml") == 2 * cases_of("-passes.toml"), "{files:?}");
    let text = stdout(&closecall(["campaign", cases.to_str().unwrap(), "-n", "1"]), 0);
    assert!(text.contains("PASS"), "{text}");
}

#[test]
fn the_map_agrees_with_theory_or_says_why() {
    let grid = ["study", "map", "--closing-kmh", "8,15,24,40", "--detection-m", "80,100", "--front-thw-s", "0.7,1.6"];
    let out = folder();
    let dir = out.path().join("map");
    let map = json(&closecall(grid.iter().copied().chain(["--format", "json", "--out", dir.to_str().unwrap()])), 0);
    let points = map["points"].as_array().unwrap();
    assert_eq!(points.len(), 16);
    for point in points {
        let differs = match (point["theory_s"].as_f64(), point["loop_s"].as_f64()) {
            (Some(theory_s), Some(loop_s)) => (theory_s - loop_s).abs() > 0.2,
            (theory, driven) => theory.is_some() != driven.is_some(),
        };
        assert_eq!(differs, point["reason"].is_string(), "{point}");
    }
    let page = std::fs::read_to_string(dir.join("map.html")).unwrap();
    assert!(page.contains("paper: always") && page.contains("paper: never"));
    // The style of all pages: the card with the title, and the frames of the pictures.
    assert!(page.contains("<main><header><div><h1>Margin that mis reaches</h1>"), "{page}");
    assert!(page.contains("prefers-color-scheme: dark") && page.matches("<figure class=\"broad\"").count() == 2);
    assert_eq!(std::fs::read_to_string(dir.join("map.csv")).unwrap().lines().count(), 17);
    let refused = closecall(["study", "map", "--controller", "acc"]);
    assert_eq!(code(&refused), 2);
    assert!(message(&refused).contains("the map needs `mis` or `mis-extended`"), "{}", message(&refused));
}

#[test]
fn a_value_that_no_point_of_the_map_can_have_names_its_option() {
    for (option, value, allowed) in [
        ("--front-thw-s", "0.7,1e9", "a number from 0.2 to 5 is needed (with front-thw-s = 1000000000)"),
        ("--speed-mps", "1e9", "is needed (with speed-mps = 1000000000)"),
        ("--closing-kmh", "1e9", "is needed (with closing-mps = "),
        ("--detection-m", "1e9", "is needed (with detection-m = 1000000000)"),
    ] {
        let refused = closecall(["study", "map", option, value]);
        let message = message(&refused);
        assert_eq!(code(&refused), 2, "{option}: {message}");
        assert!(message.contains("failed to make a point of the map: ") && message.contains(allowed), "{message}");
        assert!(message.contains(&format!("{option} sets it")), "{message}");
    }
}

#[test]
fn the_net_effect_is_recomputed_from_its_inputs_or_cannot_be_said() {
    let parent = folder();
    let path = campaign(parent.path(), "paired", 100, &["--paired"]);
    let dir = path.to_str().unwrap();
    let report =
        json(&closecall(["study", "exposure", "--counted", "20/5000", "--campaign", dir, "--format", "json"]), 0);
    let shares = &report["exposure"]["campaign"];
    let share = |key: &str| shares[key].as_f64().unwrap();
    let by_hand = 1e6 * 20.0 / 5_000.0 * (share("prevented") - share("induced")) / share("samples");
    assert!((report["exposure"]["effect"]["net"].as_f64().unwrap() - by_hand).abs() < 1e-6, "{report:#}");
    // The lead vehicle brakes in every sample.
    assert_eq!(report["cost"]["scenarios"][0]["samples"], 0, "{report:#}");
    let nothing = closecall(["study", "exposure"]);
    let text = stdout(&nothing, 4);
    assert!(
        text.contains("cannot be said") && text.contains("--per-million-km") && text.contains("--campaign"),
        "{text}"
    );
}

#[test]
fn a_sample_that_does_not_fail_has_no_cause() {
    let parent = folder();
    let path = campaign(parent.path(), "usual", 30, &[]);
    let failing = failing(&path);
    let passes = (0..30).find(|sample| !failing.contains(sample)).unwrap().to_string();
    for command in ["explain", "minimize"] {
        let refused = closecall([command, path.to_str().unwrap(), &passes]);
        assert_eq!(code(&refused), 2);
        assert!(message(&refused).contains("does not fail with `mis`: no vehicle collides"), "{}", message(&refused));
    }
    let unknown = closecall(["explain", path.to_str().unwrap(), "--scenario", "nope"]);
    assert_eq!(code(&unknown), 2);
    assert!(message(&unknown).contains("the campaign has no scenario `nope`"), "{}", message(&unknown));
    let none = closecall(["explain", path.to_str().unwrap(), "--most", "0"]);
    assert_eq!(code(&none), 2);
    assert!(message(&none).contains("a whole number of 1 or more is needed"), "{}", message(&none));
    let beyond = closecall(["explain", path.to_str().unwrap(), "400"]);
    assert!(message(&beyond).contains("there is no sample 400"), "{}", message(&beyond));
}

#[test]
fn every_stage_of_the_full_sensors_can_be_replaced_and_the_system_still_engages() {
    // The system engages seconds late on a dark vehicle, unless a stage is replaced.
    let [paint, colour] = ["actor.rear.vehicle.paint-reflectivity=0.5", "actor.rear.vehicle.paint-rgb=[128,128,128]"];
    let run = |setting: &str| {
        let words = ["run", "low-thw-overtake", "--seed", SEED, "--sensors", "full", "--format", "json"];
        let settings = [paint, colour, setting].into_iter().flat_map(|setting| ["--set", setting]);
        json(&closecall(words.into_iter().chain(settings)), 0)["mis"]["engaged_at_s"].as_f64()
    };
    let usual = run("ideal.points=false").unwrap();
    for stage in ["points", "clusters", "class", "tracks", "timing", "actuation"] {
        let engaged = run(&format!("ideal.{stage}=true")).unwrap();
        assert!((engaged - usual).abs() < 1.0, "{stage}: engaged at {engaged} s instead of {usual} s");
    }
    assert_eq!(run("fault.class-background=true"), None, "a vehicle without a class is no target");
}
