//! PASS means evidence: a mere appearance of evidence gives neither PASS nor exit code 0.

use std::path::{Path, PathBuf};
use std::process::Output;

use closecall_testing::has_python;

use crate::support::{ROOT, closecall, code, folder, headline_with, json, library, message, stderr, stdout};

/// Egos that are slower than the rest from the first second on, and do not look back.
const BLIND: [&str; 2] = ["blind", "crawl"];

fn campaign(scenario: &Path, more: &[&str]) -> Output {
    closecall(["campaign", scenario.to_str().unwrap()].iter().chain(more))
}

fn traffic(name: &str) -> PathBuf {
    library("low-thw-overtake").with_file_name("traffic").join(name).with_extension("toml")
}

/// Writes a scenario, and returns its path.
fn scenario(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("own.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// The scenario `paper-figure` with these parameters, and with `from` replaced by `to`.
fn paper_figure_with(parameters: &str, from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(library("paper-figure")).unwrap();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).replacen("[[actor]]", &format!("[parameters]\n{parameters}\n\n[[actor]]"), 1)
}

#[test]
fn an_ego_that_is_slower_and_does_not_look_back_fails_the_headline() {
    for controller in BLIND {
        let args = ["-n", "200", "--seed", "46", "--paired", "--sensors", "object", "--controller", controller];
        let text = stdout(&campaign(&library("low-thw-overtake"), &args), 1);
        assert!(
            text.contains("FAIL: the scenario misses a requirement: low-thw-overtake (MIS-9")
                && text.contains("NOT MET: low-thw-overtake: MIS-9"),
            "{text}"
        );
        // An ego that is always slower prevents more than the system does: the demand on prevented
        // collisions does not tell them apart.
        assert!(text.contains("\n  met: low-thw-overtake: MIS-1"), "{text}");
    }
}

#[test]
fn an_ego_that_is_slower_fails_where_nobody_comes_and_where_nothing_happens() {
    for controller in BLIND {
        for name in ["empty-wet-road", "slow-approach", "overtake-without-brake"] {
            let args = ["-n", "80", "--seed", "46", "--paired", "--sensors", "object", "--controller", controller];
            let output = campaign(&library(name), &args);
            let text = stdout(&output, 1);
            let is_refused = |line: &str| line.contains("NOT MET") && line.contains("upper(slowed_unprompted) <= 0.05");
            assert!(text.lines().any(is_refused), "{name} {controller}: {text}");
        }
    }
}

/// Writes a controller that does not measure what comes from behind: from a time on, which suits most
/// encounters of the headline, it brakes until it is 10 m/s slower, if `condition` holds.
fn clock(folder: &Path, condition: &str) -> String {
    let text = std::fs::read_to_string(Path::new(ROOT).join("examples/acc_controller.py")).unwrap();
    let last = "        answer = {\"acceleration_mps2\": a,";
    assert!(text.contains(last));
    let braking = format!(
        "        start, seen = (v, False) if step == 0.0 else (start, seen or any(t[\"x_m\"] < 0.0 for t in message[\"tracks\"]))\n        \
         a = min(a, -2.0) if now >= 5.7e9 and ({condition}) and v > start - 10.0 else a\n"
    );
    std::fs::write(folder.join("clock.py"), text.replace(last, &format!("{braking}{last}"))).unwrap();
    format!("exec:python3 {}", folder.join("clock.py").display())
}

#[test]
fn a_clock_in_place_of_a_measured_approach_fails_the_headline() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let out = folder.path().join("out");
    // The second controller looks whether a vehicle is behind, and the third whether one is at a
    // distance at which vehicles are that approach: neither looks whether that vehicle approaches.
    let at_a_distance = "any(-95.0 < t[\"x_m\"] < -62.0 for t in message[\"tracks\"])";
    for (condition, checks) in
        [("True", &[][..]), ("seen", &["--no-validity-checks"]), (at_a_distance, &["--no-validity-checks"])]
    {
        let controller = clock(folder.path(), condition);
        let _ = std::fs::remove_dir_all(&out);
        let args = ["-n", "40", "--seed", "31", "--paired", "--sensors", "object", "--controller", &controller];
        let args = [&args[..], checks, &["--out", out.to_str().unwrap()]].concat();
        let text = stdout(&campaign(&library("low-thw-overtake"), &args), 1);
        let reason = "low-thw-overtake (MIS-9): if no vehicle behind it approaches, the ego still slows down by up to ";
        let amount_mps = text.split_once(reason).and_then(|(_, rest)| rest.split(' ').next()?.parse::<f64>().ok());
        // Once the ego is slower than the vehicle behind by 10 km/h, that vehicle is a reason.
        assert!(amount_mps.is_some_and(|amount_mps| (2.0..11.0).contains(&amount_mps)), "{condition}: {text}");
        let junit = std::fs::read_to_string(out.join("junit.xml")).unwrap();
        assert!(junit.contains("the ego still slows down"), "{junit}");
    }
}

#[test]
fn the_system_passes_the_headline_on_seeds_that_nobody_tuned_on() {
    for seed in ["460", "461"] {
        let args = ["-n", "800", "--seed", seed, "--arms", "acc,blind,crawl,mis", "--sensors", "object"];
        let text = stdout(&campaign(&library("low-thw-overtake"), &args), 0);
        assert!(
            text.contains("met: low-thw-overtake: MIS-9: share of ")
                && text.contains("[upper(slowed_unprompted) <= 0.05]"),
            "{text}"
        );
    }
}

#[test]
fn a_parameter_that_nothing_uses_is_refused() {
    let folder = folder();
    let unused = "useless = { uniform = { min = 0.0, max = 1.0 }, assumed = \"nothing\" }\n";
    let path = scenario(folder.path(), &headline_with("[parameters]", &format!("[parameters]\n{unused}")));
    for command in ["check", "campaign", "run"] {
        let output = closecall([command, path.to_str().unwrap()]);
        assert_eq!(code(&output), 3, "{command}: {}", stderr(&output));
        assert!(message(&output).contains("unused parameter: `useless`"), "{}", message(&output));
    }
}

#[test]
fn three_hundred_runs_that_are_alike_are_one_sample() {
    let folder = folder();
    // The run uses the value, and nothing depends on it: true tracks have no limit of range, and a
    // straight road is the same everywhere, up to rounding.
    for (name, min, place, repeated) in
        [("sight-m", 5000.0, "visibility-m = 10000.0", 299), ("place-m", 400.0, "s-m = 500.0", 297)]
    {
        let max = 2.0 * min;
        let parameters =
            format!("{name} = {{ uniform = {{ min = {min:?}, max = {max:?} }}, assumed = \"no effect\" }}");
        let key = place.split_once(' ').unwrap().0;
        let text = paper_figure_with(&parameters, place, &format!("{key} = \"${name}\""));
        let path = scenario(folder.path(), &text);
        let args = ["-n", "300", "--sensors", "ground-truth", "--paired", "--max-probability", "0.01"];
        let text = stdout(&campaign(&path, &args), 4);
        let repeated = format!("{repeated} samples have the parameters or the outcome of an earlier one");
        assert!(text.contains(&repeated), "{text}");
        assert!(!text.contains("PASS"), "{text}");
    }
}

#[test]
fn a_parameter_that_varies_by_a_millionth_bounds_nothing() {
    let folder = folder();
    let parameters = "speed-mps = { uniform = { min = 30.0, max = 30.000001 }, assumed = \"hardly anything\" }";
    let text = paper_figure_with(
        parameters,
        "speed-mps = 30.0 } }\ndriver = { ego-stack",
        "speed-mps = \"$speed-mps\" } }\ndriver = { ego-stack",
    );
    let checked =
        text.replace("[\"count(ego_collided) <= 0\"]", "[\"lower(prevented | baseline.ego_collided) >= 0.5\"]");
    let path = scenario(folder.path(), &checked);
    for sensors in ["ground-truth", "object"] {
        let text = stdout(&campaign(&path, &["-n", "60", "--sensors", sensors, "--paired"]), 4);
        assert!(text.contains("no parameter varies enough"), "{text}");
    }
}

#[test]
fn a_weakened_check_gives_overridden_and_exit_code_4() {
    let folder = folder();
    let out = folder.path().join("out");
    let run = |setting: &str, format: &str| {
        let _ = std::fs::remove_dir_all(&out);
        let args = [
            "-n",
            "80",
            "--sensors",
            "object",
            "--paired",
            "--set",
            setting,
            "--format",
            format,
            "--record",
            "worst:0",
        ];
        closecall(
            ["campaign", library("overtake-without-brake").to_str().unwrap(), "--out", out.to_str().unwrap()]
                .iter()
                .chain(&args),
        )
    };
    assert!(stdout(&run("duration-s=55", "human"), 0).contains("PASS"), "a setting that weakens nothing");
    let weaker = "checks.MIS-6=['max(max_speed_deficit_mps) <= 100', 'p95(max_deceleration_mps2) <= 2']";
    let text = stdout(&run(weaker, "human"), 4);
    assert!(
        text.contains("\nOVERRIDDEN: overtake-without-brake: a setting weakened")
            && text.contains("MIS-6: max(max_speed_deficit_mps) <= 10"),
        "{text}"
    );
    assert_eq!(json(&run(weaker, "json"), 4)["verdict"], "OVERRIDDEN");
    let junit = std::fs::read_to_string(out.join("junit.xml")).unwrap();
    assert!(junit.contains("OVERRIDDEN: overtake-without-brake") && junit.contains("errors=\"1\""), "{junit}");
    // A remark is not the sentence of the verdict.
    let path = library("overtake-without-brake");
    let unchecked = ["-n", "80", "--sensors", "object", "--paired", "--set", weaker, "--no-validity-checks"];
    let text = stdout(&campaign(&path, &unchecked), 4);
    assert!(
        text.contains("\nOVERRIDDEN: overtake-without-brake: a setting weakened")
            && text.contains("\n  the validity of the simulator was not checked"),
        "{text}"
    );
    // The saved campaign is overridden, too.
    let parts = ["1/2", "2/2"].map(|part| {
        let folder = folder.path().join(part.replace('/', "-"));
        let args = ["-n", "80", "--sensors", "object", "--paired", "--set", weaker, "--partition", part];
        let path = library("overtake-without-brake");
        let campaign = ["campaign", path.to_str().unwrap(), "--record", "worst:0", "--out", folder.to_str().unwrap()];
        closecall(campaign.iter().chain(&args));
        folder
    });
    let merged = folder.path().join("merged");
    let [first, second, merged] = [&parts[0], &parts[1], &merged].map(|path| path.to_str().unwrap());
    let args = ["tool", "merge", first, second, "--out", merged, "--record", "worst:0"];
    assert!(stdout(&closecall(args), 4).contains("OVERRIDDEN"));
}

#[test]
fn a_single_sample_meets_no_count_extreme_or_percentile() {
    let gates = [
        "p99(min_gap_front_m) >= 0.01",
        "count(others_collided) <= 5",
        "max(max_jerk_mps3) <= 39",
        "mean(harm) <= 1000",
    ];
    for gate in gates {
        let single = campaign(&library("slow-approach"), &["-n", "1", "--sensors", "object", "--gate", gate]);
        assert!(stdout(&single, 4).contains("too few samples to decide"), "{gate}");
    }
    // A count that is too high with one sample stays so with more.
    let args = ["-n", "1", "--sensors", "object", "--gate", "count(rear_passed) <= 0"];
    stdout(&campaign(&library("slow-approach"), &args), 1);
}

#[test]
fn a_system_that_the_ego_does_not_have_is_refused() {
    let folder = folder();
    let without = headline_with(", mis = { max-deceleration-mps2 = 1.0, critical-gap-m = 5.0 }", "");
    let path = scenario(folder.path(), &without);
    for command in ["campaign", "run"] {
        for controller in ["mis", "mis-extended"] {
            let output = closecall([command, path.to_str().unwrap(), "--controller", controller]);
            assert_eq!(code(&output), 3, "{}", stderr(&output));
            assert!(message(&output).contains("needs a margin increase system"), "{}", message(&output));
        }
    }
    stdout(&closecall(["run", path.to_str().unwrap(), "--controller", "acc", "--sensors", "object"]), 0);
}

#[test]
fn an_edited_baseline_is_refused_instead_of_no_regression() {
    let folder = folder();
    let [out, file] = ["out", "baseline.json"].map(|name| folder.path().join(name));
    let [out_text, file_text] = [&out, &file].map(|path| path.to_str().unwrap());
    let args = ["-n", "24", "--sensors", "object", "--controller", "acc", "--no-gate", "--record", "worst:0"];
    let path = library("low-thw-overtake");
    let campaign = ["campaign", path.to_str().unwrap(), "--out", out_text];
    stdout(&closecall(campaign.iter().chain(&args)), 0);
    stdout(&closecall(["baseline", "save", out_text, file_text]), 0);
    let compare = || closecall(["baseline", "compare", out_text, file_text]);
    assert!(stdout(&compare(), 0).contains("NO REGRESSION"));
    let text = std::fs::read_to_string(&file).unwrap();
    let edited = text.replacen("\"failing\": [", "\"failing\": [\n        1000000,", 1);
    assert_ne!(edited, text);
    std::fs::write(&file, edited).unwrap();
    let output = compare();
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(message(&output).contains("the file was edited"), "{}", message(&output));
}

/// A controller in Python whose steps run `step`, which sets `state` and `acceleration`.
fn python_controller(folder: &Path, step: &str) -> String {
    let script = folder.join("controller.py");
    let text = format!(
        "import json, sys, time\nfor line in sys.stdin:\n    message = json.loads(line)\n    state, acceleration = 'following', 0.0\n    if message['type'] == \
         'hello':\n        answer = {{'type': 'hello', 'protocol': 1}}\n    else:\n        {step}\n        answer = {{'acceleration_mps2': acceleration, 'state': \
         state}}\n    print(json.dumps(answer), flush=True)\n"
    );
    std::fs::write(&script, text).unwrap();
    format!("exec:python3 {}", script.display())
}

#[test]
fn what_a_controller_from_outside_says_of_itself_is_no_evidence() {
    if !has_python() {
        return;
    }
    let folder = folder();
    // The controller claims to act, and does nothing.
    let controller = python_controller(folder.path(), "state = 'increasing'");
    let path = library("overtake-without-brake");
    let gated = |gate: &str, expected| {
        let args = [
            "-n",
            "20",
            "--sensors",
            "ground-truth",
            "--set",
            "duration-s=8",
            "--set",
            "checks={}",
            "--set",
            "expects=[]",
            "--controller",
            &controller,
            "--gate",
            gate,
        ];
        stdout(&campaign(&path, &args), expected)
    };
    assert!(gated("share(engaged) >= 1", 4).contains("a controller from outside reports it of itself"));
    assert!(gated("share(slowed_for_rear) >= 1", 1).contains("NOT MET"), "the measured value");
}

#[test]
fn a_controller_that_computes_for_longer_than_its_period_ends_its_sample_as_an_error() {
    if !has_python() {
        return;
    }
    let folder = folder();
    // In the mean, and in every fifth step while the mean is below the period.
    for (step, reason) in [
        ("time.sleep(0.06)", "ms in the mean of"),
        ("time.sleep(0.15 if message['time_ns'] // 40_000_000 % 5 == 0 else 0)", "computes for more than its 40 ms in"),
    ] {
        let controller = python_controller(folder.path(), step);
        let args =
            ["-n", "1", "--sensors", "ground-truth", "--set", "duration-s=8", "--no-gate", "--controller", &controller];
        let output = campaign(&library("overtake-without-brake"), &args);
        let said = stdout(&output, 5);
        assert!(said.contains("ERROR") && said.contains(reason), "{said} {}", stderr(&output));
    }
    // A run that ends before the fifth second.
    let controller = python_controller(folder.path(), "time.sleep(0.06)");
    let args = [
        "-n",
        "1",
        "--sensors",
        "ground-truth",
        "--set",
        "duration-s=2",
        "--set",
        "expects=[]",
        "--no-gate",
        "--controller",
        &controller,
    ];
    let said = stdout(&campaign(&library("overtake-without-brake"), &args), 5);
    assert!(said.contains("ms in the mean of"), "{said}");
}

#[test]
fn sixty_milliseconds_in_every_fiftieth_step_are_an_error() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let run = |step: &str, settings: &[&str], expected| {
        let controller = python_controller(folder.path(), step);
        let fixed =
            ["-n", "1", "--sensors", "ground-truth", "--set", "duration-s=20", "--set", "expects=[]", "--no-gate"];
        let args = [&fixed[..], &["--controller", &controller], settings].concat();
        stdout(&campaign(&library("overtake-without-brake"), &args), expected)
    };
    let in_every_fiftieth = "message['time_ns'] // 40_000_000 % 50 == 7";
    // Its own processor time, and a wait for something else.
    let computes = format!(
        "start = time.process_time()\n        while {in_every_fiftieth} and time.process_time() < start + 0.06: pass"
    );
    assert!(run(&computes, &[], 5).contains("computes for more than its 40 ms in"));
    let sleeps = format!("time.sleep(0.06 if {in_every_fiftieth} else 0)");
    assert!(run(&sleeps, &[], 5).contains("computes for more than its 40 ms in 5 of"));
    // A stated computing time is the budget, and the command comes that much later.
    assert!(run("time.sleep(0.03)", &["--set", "controller.computing-s=0.02"], 5).contains("and has 20 ms"));
}

#[test]
fn a_controller_that_changes_after_the_first_checks_makes_a_small_campaign_invalid() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let (script, starts) = (folder.path().join("changing.py"), folder.path().join("starts"));
    // Each process has a number. From one number on, the ego brakes.
    let run = |from: usize| {
        let _ = std::fs::remove_file(&starts);
        let text = format!(
            "import json, sys\nwith open({starts:?}, 'a+') as file:\n    file.write('x')\n    file.seek(0)\n    number = len(file.read())\n\
             for line in sys.stdin:\n    message = json.loads(line)\n    hello = {{'type': 'hello', 'protocol': 1}}\n    \
             answer = {{'acceleration_mps2': -1.0 if number > {from} else 0.0, 'state': 'following'}}\n    \
             print(json.dumps(hello if message['type'] == 'hello' else answer), flush=True)\n"
        );
        std::fs::write(&script, text).unwrap();
        let controller = format!("exec:python3 {}", script.display());
        let out = folder.path().join("out");
        let _ = std::fs::remove_dir_all(&out);
        let args = [
            "-n",
            "6",
            "--jobs",
            "1",
            "--sensors",
            "ground-truth",
            "--set",
            "duration-s=4",
            "--set",
            "expects=[]",
            "--no-gate",
            "--out",
            out.to_str().unwrap(),
            "--controller",
            &controller,
        ];
        (campaign(&library("slow-approach"), &args), std::fs::read_to_string(&starts).unwrap().len())
    };
    let (unchanged, processes) = run(usize::MAX);
    stdout(&unchanged, 0);
    // Two samples run again at the end.
    let (changed, _) = run(processes - 2);
    let text = stdout(&changed, 7);
    assert!(text.contains("sample 0 of slow-approach with exec ran again after the last one"), "{text}");
}

#[test]
fn a_system_that_never_acts_where_a_vehicle_comes_near_is_not_judged() {
    let run = |name: &str, controller: &str, expected| {
        let args = ["-n", "60", "--seed", "31", "--sensors", "object", "--arms", controller];
        stdout(&campaign(&library(name), &args), expected)
    };
    const HARMLESS: &str =
        "a system that does nothing passes as well, so that this shows only that the system does no harm";
    // Cruise control has no sensors that look back.
    for name in ["overtake-without-brake", "rear-follower-stays"] {
        let text = run(name, "acc,gap-1.2", 4);
        assert!(
            text.contains("NOT JUDGED") && text.contains("never slowed the ego for a vehicle behind in 60 samples"),
            "{text}"
        );
        let text = run(name, "acc,mis", 0);
        assert!(text.contains("PASS: ") && text.contains(HARMLESS), "{text}");
    }
    // It is to stay off there.
    assert!(run("left-lane-blocked", "acc,gap-1.2", 0).contains(HARMLESS));
    assert!(!run("low-thw-overtake-at-cut-out", "acc,mis", 4).contains(HARMLESS));
}

#[test]
fn a_secret_seed_is_drawn_stated_and_resumed() {
    let folder = folder();
    let out = folder.path().join("out");
    let path = library("overtake-without-brake");
    let args = ["-n", "2", "--sensors", "object", "--judge-seed", "secret", "--no-gate"];
    let seed_of =
        |text: &str| text.split_once("drawn for this campaign: --seed ").unwrap().1.lines().next().unwrap().to_owned();
    let first = seed_of(&stdout(&campaign(&path, &args), 0));
    let kept = |more: &[&str]| {
        let kept = ["campaign", path.to_str().unwrap(), "--record", "worst:0", "--out", out.to_str().unwrap()];
        seed_of(&stdout(&closecall(kept.iter().chain(&args).chain(more)), 0))
    };
    let second = kept(&[]);
    assert_ne!(first, second, "nobody knows the seed before");
    assert_eq!(kept(&["--resume"]), second, "the campaign goes on with its seed");
    let manifest = std::fs::read_to_string(out.join("manifest.json")).unwrap();
    assert!(manifest.contains(&format!("\"seed\": {second}")), "{manifest}");
    let refused = campaign(&path, &["--judge-seed", "secret", "--seed", "1"]);
    assert_eq!(code(&refused), 2, "{}", stderr(&refused));
    // A campaign that grows keeps the fact, also if the command names the number that was drawn.
    let grown = stdout(
        &campaign(
            &path,
            &["-n", "3", "--sensors", "object", "--seed", &second, "--no-gate", "--record", "worst:0", "--resume"]
                .iter()
                .copied()
                .chain(["--out", out.to_str().unwrap()])
                .collect::<Vec<_>>(),
        ),
        0,
    );
    assert_eq!(seed_of(&grown), second);
    let manifest = std::fs::read_to_string(out.join("manifest.json")).unwrap();
    assert!(manifest.contains("\"has_drawn_seed\": true") && manifest.contains("\"samples\": 3"), "{manifest}");
}

#[test]
fn a_named_seed_does_not_become_a_secret_one_by_resumption() {
    let folder = folder();
    let out = folder.path().join("out");
    let path = library("overtake-without-brake");
    let run = |more: &[&str]| {
        let kept = ["-n", "2", "--sensors", "object", "--record", "worst:0", "--out", out.to_str().unwrap()];
        campaign(&path, &[&kept[..], more].concat())
    };
    let is_named = || {
        let manifest = std::fs::read_to_string(out.join("manifest.json")).unwrap();
        assert!(manifest.contains("\"has_drawn_seed\": false") && manifest.contains("\"seed\": 5"), "{manifest}");
    };
    stdout(&run(&["--seed", "5", "--no-gate"]), 0);
    is_named();
    let refused = run(&["--judge-seed", "secret", "--no-gate", "--resume"]);
    let said = message(&refused);
    assert_eq!(code(&refused), 2, "{said}");
    assert!(said.contains("began with the seed 5, which was known beforehand") && said.contains("--seed 5"), "{said}");
    is_named();
    let resumed = stdout(&run(&["--seed", "5", "--no-gate", "--resume"]), 0);
    assert!(!resumed.contains("drawn for this campaign"), "{resumed}");
}

#[test]
fn a_preset_that_draws_goes_on_with_a_seed_that_was_named() {
    let folder = folder();
    let out = folder.path().join("out");
    let path = library("overtake-without-brake");
    let run = |more: &[&str]| {
        let kept = ["--preset", "pr", "-n", "2", "--sensors", "object", "--record", "worst:0"];
        campaign(&path, &[&kept[..], &["--out", out.to_str().unwrap()], more].concat())
    };
    let first = run(&["--seed", "5"]);
    assert!(out.join("manifest.json").is_file(), "{}", stderr(&first));
    let resumed = run(&["--resume"]);
    assert_eq!(code(&resumed), code(&first), "{}", stderr(&resumed));
    assert!(message(&resumed).contains("began with the seed 5, which was known beforehand"), "{}", message(&resumed));
    assert!(!String::from_utf8_lossy(&resumed.stdout).contains("drawn for this campaign"));
    let manifest = std::fs::read_to_string(out.join("manifest.json")).unwrap();
    assert!(manifest.contains("\"has_drawn_seed\": false"), "{manifest}");
}

#[test]
fn a_verdict_on_a_controller_from_outside_says_that_its_seed_was_known() {
    const REMARK: &str = "the seed was known before the run: a controller could recognise its samples";
    if !has_python() {
        return;
    }
    let folder = folder();
    let out = folder.path().join("out");
    let path = library("overtake-without-brake");
    let small = ["-n", "2", "--sensors", "ground-truth", "--no-validity-checks"];
    let outside = ["--controller", "exec:python3 examples/acc_controller.py", "--controller-timeout-ms", "60000"];
    let limit = ["--max-collisions", "2"];
    let run = |more: &[&str]| {
        let output = campaign(&path, &[&small[..], more].concat());
        assert!([0, 1, 4, 7].contains(&code(&output)), "{more:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    for seed in [&[][..], &["--seed", "5"], &["--judge-seed", "5"]] {
        let text = run(&[&outside[..], &limit, seed].concat());
        assert!(text.contains(&format!("\n  {REMARK}; `--judge-seed secret` draws one\n")), "{seed:?}: {text}");
    }
    let kept = ["--seed", "5", "--record", "worst:0", "--format", "json", "--out", out.to_str().unwrap()];
    let json: serde_json::Value = serde_json::from_str(&run(&[&outside[..], &limit, &kept].concat())).unwrap();
    assert!(json["reasons"].to_string().contains(REMARK), "{json}");
    for name in ["report.html", "summary.md", "junit.xml"] {
        assert!(std::fs::read_to_string(out.join(name)).unwrap().contains(REMARK), "{name}");
    }
    // A part has the seed of the other parts. The verdict of the merged campaign has the remark, too.
    let parts = ["1/2", "2/2"].map(|part| folder.path().join(part.replace('/', "-")).display().to_string());
    for (part, folder) in ["1/2", "2/2"].into_iter().zip(&parts) {
        let text =
            run(&[&outside[..], &limit, &["--partition", part, "--record", "worst:0", "--out", folder]].concat());
        assert!(text.contains(&format!("\n  {REMARK}\n")), "{text}");
    }
    let merged = folder.path().join("merged");
    let merge = ["tool", "merge", &parts[0], &parts[1], "--record", "worst:0", "--out", merged.to_str().unwrap()];
    let output = closecall(merge.iter().chain(&limit));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains(&format!("\n  {REMARK}\n")), "{text} {}", stderr(&output));
    for silent in [
        &["--judge-seed", "secret", limit[0], limit[1], outside[0], outside[1], outside[2], outside[3]][..],
        &["--no-gate", outside[0], outside[1], outside[2], outside[3]],
        &["--controller", "acc", limit[0], limit[1]],
        &["--arms", "acc,mis", limit[0], limit[1]],
    ] {
        let text = run(silent);
        assert!(!text.contains("the seed was known"), "{silent:?}: {text}");
    }
}

#[test]
fn of_two_values_that_contradict_each_other_none_wins_in_silence() {
    let path = library("low-thw-overtake");
    let refused = |args: &[&str], named: &[&str]| {
        let output = closecall(args);
        let said = message(&output);
        assert_eq!(code(&output), 2, "{args:?}: {said}");
        for words in named {
            assert!(said.contains(words), "{args:?}: {words}: {said}");
        }
    };
    let campaign = ["campaign", path.to_str().unwrap(), "-n", "2", "--sensors", "ground-truth"];
    let with = |more: &[&'static str]| [&campaign[..], more].concat();
    refused(&with(&["--set", "brake-mps2=5", "--set", "brake-mps2=6"]), &["brake-mps2=5", "brake-mps2=6"]);
    refused(
        &with(&["--set", "actor.rear.start.behind.gap-m=90", "--set", "actor.rear.start={behind={gap-m=120}}"]),
        &["gap-m=90", "gap-m=120"],
    );
    let arms = ["--arms", "acc,mis", "--set", "acc:aeb.trigger-mps2=5", "--set"];
    refused(&with(&[&arms[..], &["acc:aeb.trigger-mps2=6"]].concat()), &["trigger-mps2=5", "trigger-mps2=6"]);
    // The same value by its whole path, and within the name of the controller.
    let whole = "acc:actor.ego.driver.ego-stack.aeb.trigger-mps2=6";
    refused(&with(&[&arms[..], &[whole]].concat()), &["trigger-mps2=5", "trigger-mps2=6"]);
    let twice = "acc+aeb:aeb.trigger-mps2=5:aeb.trigger-mps2=6";
    refused(&with(&["--controller", twice]), &["trigger-mps2=5", "trigger-mps2=6"]);
    let gates = ["--gate", "count(ego_collided) <= 100"];
    refused(&with(&[&gates[..], &["--gate", "count(ego_collided) <= 0"]].concat()), &["<= 100", "<= 0"]);
    refused(&with(&[&gates[..], &["--max-collisions", "0"]].concat()), &["<= 100", "<= 0"]);
    refused(
        &["run", path.to_str().unwrap(), "--set", "brake-mps2=5", "--set", "brake-mps2=6"],
        &["brake-mps2=5", "brake-mps2=6"],
    );
    let frontier = ["study", "frontier", path.to_str().unwrap(), "--vary", "brake-mps2=5,6", "--vary"];
    refused(&[&frontier[..], &["brake-mps2=7"]].concat(), &["--vary brake-mps2 is given twice"]);
    // A file whose gates contradict each other.
    let folder = folder();
    let text = "[gate]\nrequire = ['count(ego_collided) <= 100', 'count(ego_collided) <= 0']\n";
    let own = scenario(folder.path(), &headline_with("[[actor]]", &format!("{text}\n[[actor]]")));
    refused_by_file(&own);
    // What does not contradict: one value twice, both sides of a range, and a value of one arm.
    let fits = [
        "--set",
        "brake-mps2=5",
        "--set",
        "brake-mps2=5",
        "--gate",
        "share(engaged) >= 0.1",
        "--gate",
        "share(engaged) <= 0.9",
        "--arms",
        "acc,mis",
        "--set",
        "actor.ego.driver.ego-stack.acc.time-gap-s=1.5",
        "--set",
        "acc:acc.time-gap-s=1.6",
    ];
    let output = closecall(with(&fits));
    assert!([0, 1, 4].contains(&code(&output)), "{}", stderr(&output));
}

/// Checks that a scenario file with two contradictory gates is refused.
fn refused_by_file(path: &Path) {
    let output = closecall(["check", path.to_str().unwrap()]);
    let said = message(&output);
    assert_eq!(code(&output), 3, "{said}");
    assert!(said.contains("`gate.require`") && said.contains("<= 100") && said.contains("<= 0"), "{said}");
}

#[test]
fn a_twin_finds_what_the_system_induces_where_nothing_happens() {
    let path = library("rear-vehicle-is-followed-without-brake");
    let args = ["-n", "400", "--seed", "46", "--paired", "--sensors", "object"];
    // A system that brakes hard for the rear vehicle is struck by the one that follows it.
    let hard = ["--set", "actor.ego.driver.ego-stack.mis.max-deceleration-mps2=4"];
    let text = stdout(&campaign(&path, &[&args[..], &hard].concat()), 1);
    assert!(text.contains("NOT MET") && text.contains("[count(induced) <= 0]"), "{text}");
    let busy = traffic("busy-overtake-without-brake");
    assert!(busy.is_file(), "{}", busy.display());
}

#[test]
fn the_points_of_a_design_bound_no_probability() {
    for design in ["sobol", "grid"] {
        let folder = folder();
        let text = paper_figure_with(
            "brake-mps2 = { uniform = { min = 5.0, max = 6.0 }, assumed = \"any range does\" }",
            "deceleration-mps2 = 6.0",
            "deceleration-mps2 = \"$brake-mps2\"",
        );
        let text = format!("{text}\n[gate]\nmax-probability = 0.9\n");
        let path = scenario(folder.path(), &text);
        let more =
            ["-n", "64", "--paired", "--sensors", "object", "--design", design, "--gate", "upper(induced) <= 0.9"];
        let value = json(&campaign(&path, &[&more[..], &["--format", "json"]].concat()), 4);
        assert_eq!(value["verdict"], "INCONCLUSIVE", "{design}");
        for arm in ["acc", "mis"] {
            assert!(value["controllers"][arm]["interval_95"].is_null(), "{design} {arm}");
        }
        assert!(value["paired"]["mcnemar_p"].is_null(), "{design}");
        let text = stdout(&campaign(&path, &more), 4);
        assert!(
            text.contains("the designs sobol, grid and coverage are not independent") && !text.contains("(95 %"),
            "{text}"
        );
    }
    let message = message(&campaign(&library("low-thw-overtake"), &["--design", "grid", "--time-budget", "1s"]));
    assert!(message.contains("the design `random` draws them"), "{message}");
}

#[test]
fn a_limit_of_collisions_holds_for_each_scenario() {
    let scenarios = ["low-thw-overtake", "low-thw-overtake-at-cut-out"];
    let paths = scenarios.map(library);
    // Other requirements of the two scenarios may be open.
    let run = |limit: u64| -> serde_json::Value {
        let limit = limit.to_string();
        let more =
            ["-n", "60", "--controller", "acc", "--sensors", "ground-truth", "--format", "json", "--max-collisions"];
        let paths = paths.iter().map(|path| path.to_str().unwrap());
        let output = closecall(["campaign"].into_iter().chain(paths).chain(more).chain([limit.as_str()]));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let value = run(0);
    let collisions =
        scenarios.map(|name| value["scenarios"][name]["controllers"]["acc"]["collisions"].as_u64().unwrap());
    let most = collisions.into_iter().max().unwrap();
    assert!(collisions.iter().sum::<u64>() > most, "{collisions:?}");
    let passed = |value: &serde_json::Value| -> Vec<Option<bool>> {
        let is_limit = |gate: &&serde_json::Value| gate["subject"] == "count(ego_collided)";
        value["gates"].as_array().unwrap().iter().filter(is_limit).map(|gate| gate["passed"].as_bool()).collect()
    };
    // Both scenarios together have more collisions than the limit, which applies to each of them.
    assert_eq!(passed(&run(most)), [Some(true); 2]);
    assert!(passed(&run(most - 1)).contains(&Some(false)));
}
