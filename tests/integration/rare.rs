//! `campaign --design subset|importance` estimates the probability of a rare event, and `--design
//! search` looks for its first case. They resume to the same bytes, and refuse options that do not
//! fit.

use std::fs;
use std::path::{Path, PathBuf};

use closecall_testing::has_python;

use crate::support::{closecall, code, folder, json, json_file, message, program, stderr, stdout};

/// The collision probability of the fixture, by construction.
const TRUTH: f64 = 3.166_793e-5;

fn fixture() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/known-rare-probability.toml")
}

fn rare(words: &str) -> std::process::Output {
    let path = fixture();
    let fixed = ["campaign", path.to_str().unwrap(), "--controller", "acc"];
    closecall(fixed.into_iter().chain(words.split_whitespace()))
}

/// The words of a campaign by importance sampling.
const BY_IMPORTANCE: &str = "--design importance --event collision --format json";

#[test]
fn both_methods_cover_a_probability_that_plain_sampling_does_not_reach() {
    for method in ["importance", "subset"] {
        let value = json(&rare(&format!("--design {method} --event collision --seed 1 --format json")), 0);
        let report = &value["scenarios"][0];
        let estimate = &report["estimates"][0];
        let [low, high] = [0, 1].map(|end| estimate["interval_95"][end].as_f64().unwrap());
        assert!(low <= TRUTH && TRUTH <= high, "{method}: {low} to {high}");
        assert!((high - low) / estimate["value"].as_f64().unwrap() < 0.8, "{method}: {low} to {high}");
        // Plain sampling needs 61.47/p runs for a relative width of 0.5: 1.9 million.
        assert!(report["runs"].as_u64().unwrap() < 200_000, "{report}");
        assert_eq!(report["parameters"][0], "gap-m");
    }
}

#[test]
fn two_independent_methods_agree_on_the_headline() {
    let interval = |method: &str| {
        let fixed = "campaign low-thw-overtake --controller mis-extended --sensors ground-truth --event collision";
        let words = format!("{fixed} --design {method} --relative-width 1 -n 30000 --seed 1 --format json");
        let value = json(&closecall(words.split_whitespace()), 0);
        [0, 1].map(|end| value["scenarios"][0]["estimates"][0]["interval_95"][end].as_f64().unwrap())
    };
    let ([low, high], [other_low, other_high]) = (interval("importance"), interval("subset"));
    assert!(low <= other_high && other_low <= high, "{low} to {high}, and {other_low} to {other_high}");
}

#[test]
fn a_number_with_a_bound_is_an_event_of_its_own() {
    // The smallest gap is the gap at the start less 10 m: below 2 m beyond (30 − 12) / 5 = 3.6
    // standard deviations.
    let path = fixture();
    let event = "min_gap_rear_m < 2";
    let words = ["campaign", path.to_str().unwrap(), "--controller", "acc", "--design", "importance", "--event", event];
    let value = json(&closecall(words.into_iter().chain(["--format", "json"])), 0);
    let interval = &value["scenarios"][0]["estimates"][0]["interval_95"];
    let [low, high] = [0, 1].map(|end| interval[end].as_f64().unwrap());
    assert!(low <= 1.591e-4 && 1.591e-4 <= high, "{low} to {high}");
    assert_eq!(value["scenarios"][0]["event"], event);
}

#[test]
fn a_campaign_that_was_cut_off_goes_on_to_the_same_bytes_with_any_number_of_threads() {
    let place = folder();
    let [whole_run, other] = ["one", "other"].map(|name| place.path().join(name));
    let run = |out: &Path, more: &str| rare(&format!("{BY_IMPORTANCE} --seed 3 --out {} {more}", out.display()));
    let whole = stdout(&run(&whole_run, "--jobs 1"), 0);
    stdout(&run(&other, "--jobs 2"), 0);
    let journal = |out: &Path| fs::read(out.join("rare-journal.jsonl")).unwrap();
    assert_eq!(journal(&whole_run), journal(&other));
    // As a kill leaves it: within a line, and without a result.
    let kept = journal(&other);
    for share in [3, 2] {
        fs::write(other.join("rare-journal.jsonl"), &kept[..kept.len() / share]).unwrap();
        fs::remove_file(other.join("rare.json")).unwrap();
        assert_eq!(stdout(&run(&other, "--jobs 3 --resume"), 0), whole);
        assert_eq!(journal(&other), kept);
        assert_eq!(fs::read(other.join("rare.json")).unwrap(), fs::read(whole_run.join("rare.json")).unwrap());
    }
    let refused = run(&other, "--jobs 2");
    assert_eq!(code(&refused), 2, "{}", stderr(&refused));
    let seed = rare(&format!("{BY_IMPORTANCE} --seed 4 --resume --out {}", other.display()));
    assert_eq!(code(&seed), 2);
    assert!(message(&seed).contains("seed"), "{}", message(&seed));
    let event = rare(&format!(
        "--design importance --event others_collided --guide min_gap_rear_m --seed 3 --resume --out {}",
        other.display()
    ));
    assert!(message(&event).contains("event: ego_collided there, others_collided here"), "{}", message(&event));
    // No other command takes the weighted runs for samples.
    let compared = closecall(["compare", whole_run.to_str().unwrap(), other.to_str().unwrap()]);
    assert_ne!(code(&compared), 0);
    // A damaged line ends the kept part: its run and all later runs are run again.
    let mut damaged = kept.clone();
    damaged[30] ^= 1;
    fs::write(other.join("rare-journal.jsonl"), damaged).unwrap();
    assert_eq!(stdout(&run(&other, "--resume"), 0), whole);
    assert_eq!(journal(&other), kept);
}

#[test]
fn the_nearest_event_can_be_run_again() {
    let output = rare("--design importance --event collision");
    let shown = stderr(&output);
    let command = shown.lines().find_map(|line| line.strip_prefix("look: closecall ")).unwrap();
    let words = command.split("  #").next().unwrap().replace('\'', "");
    let text = stdout(&closecall(words.split_whitespace()), 0);
    assert!(text.contains("COLLISION of ego and rear"), "{text}");
}

#[test]
fn a_gate_on_the_probability_is_judged_by_the_weighted_runs() {
    let verdict = |max: &str| code(&rare(&format!("--design importance --event collision --max-probability {max}")));
    assert_eq!([verdict("1e-4"), verdict("1e-6"), verdict("3.1e-5")], [0, 1, 4]);
}

#[test]
fn the_gate_of_a_file_on_the_probability_is_judged_as_the_option_is() {
    let place = folder();
    let event = |event: &str, more: &str| {
        let path = fixture();
        let fixed = ["campaign", path.to_str().unwrap(), "--controller", "acc", "--design", "importance", "--event"];
        let words = fixed.into_iter().chain([event]).chain(more.split_whitespace());
        program().args(words).current_dir(place.path()).output().unwrap()
    };
    let project = |max: &str| {
        let text = format!("[gate]\nmax-probability = {max}\nrequire = ['count(ego_collided) <= 0']\n");
        fs::write(place.path().join("closecall.toml"), text).unwrap();
    };
    for (max, exit, word) in [("1e-4", 0, "PASS"), ("1e-6", 1, "FAIL"), ("3.1e-5", 4, "INCONCLUSIVE")] {
        project(max);
        let text = stdout(&event("collision", ""), exit);
        assert!(text.contains(&format!("  {word}: ")), "{max}: {text}");
        assert!(text.contains("not judged by --design importance: count(ego_collided) <= 0 ("), "{max}: {text}");
    }
    project("1e-6");
    let weaker = stdout(&event("collision", "--max-probability 1e-4"), 4);
    assert!(weaker.contains("NOT JUDGED") && weaker.contains("gate max-probability 0.000001, replaced by"), "{weaker}");
    assert!(!stdout(&event("collision", "--no-gate"), 0).contains("allowed"), "a measurement");
    // It bounds collisions, and no other event.
    let other = stdout(&event("ego_is_struck", "--guide min_gap_rear_m"), 0);
    assert!(other.contains("max-probability 0.000001 of a collision (") && !other.contains("FAIL"), "{other}");
}

#[test]
fn the_criteria_of_the_scenario_file_are_named_as_not_judged_and_each_once() {
    let place = folder();
    let text = fs::read_to_string(fixture()).unwrap();
    let gated = text.replacen("[sensors]", "[gate]\nrequire = ['count(ego_strikes) <= 0']\n\n[sensors]", 1);
    assert_ne!(gated, text);
    let paths = ["known-rare-probability", "another"].map(|name| {
        let path = place.path().join(format!("{name}.toml"));
        fs::write(&path, gated.replacen("known-rare-probability", name, 1)).unwrap();
        path.to_str().unwrap().to_owned()
    });
    let words = "--controller acc --design importance --event collision --max-probability 0.5 -n 3000";
    let files = ["campaign", &paths[0], &paths[1]];
    let said = stdout(&closecall(files.into_iter().chain(words.split_whitespace())), 0);
    assert!(said.contains("  not judged by --design importance: count(ego_strikes) <= 0 (scenario file)\n"), "{said}");
}

#[test]
fn a_budget_that_is_too_small_gives_no_number() {
    for method in ["importance", "subset"] {
        let output = rare(&format!("--design {method} --event collision -n 500"));
        let text = stdout(&output, 4);
        assert!(!text.contains("interval"), "{text}");
        assert!(text.contains("no run came to the event") || text.contains("the budget ended"), "{text}");
    }
    let value = json(&rare("--design importance --event collision -n 100 --format json"), 4);
    assert_eq!(value["scenarios"][0]["estimates"].as_array().unwrap().len(), 0);
}

#[test]
fn what_does_not_fit_weighted_runs_is_refused_with_its_name() {
    for (words, part) in [
        ("--design importance", "name one with --event"),
        ("--design subset --event collision --gate count(ego_collided)<=0", "a gate other than --max-probability"),
        ("--design subset --event collision --max-collisions 3", "a gate other than --max-probability"),
        ("--design subset --event collision --preset pr", "--preset"),
        ("--design subset --event collision --partition 1/2 --out unused", "--design subset has no parts"),
        ("--design search --event collision --partition 1/2 --out unused", "--design search has no parts"),
        ("--design importance --event collision --partition 1/2", "--out"),
        (
            "--design importance --event collision --partition 1/2 --out unused --max-probability 0.1",
            "a part has no estimate",
        ),
        ("--design subset --event collision --fail-fast", "--fail-fast"),
        ("--design subset --event collision --until-certain --max-probability 0.1", "--until-certain"),
        ("--design subset --event collision --time-budget 9s", "--time-budget"),
        ("--design subset --event collision --no-validity-checks", "--no-validity-checks"),
        ("--design subset --event engaged", "with --guide MEASURE"),
        ("--design subset --event collision --relative-width 0", "not a finite number above 0"),
        ("--design subset --event crash", "not a measure; there are"),
        ("--design subset --event induced", "it needs --paired or --arms"),
        ("--design subset --event collision --guide engaged", "is not a number of a sample"),
        ("--design search --event collision --max-probability 0.1", "--design search states no probability"),
        ("--design search --event collision --relative-width 0.3", "--design search states no probability"),
        ("--design search", "name one with --event"),
        (
            "--design halton --event collision",
            "one of `random`, `sobol`, `grid`, `coverage`, `subset`, `importance`, `search`",
        ),
        ("--event collision", "--design subset, importance or search"),
        ("--guide min_gap_rear_m --design subset", "--event"),
    ] {
        let output = rare(words);
        assert_eq!(code(&output), 2, "{words}: {}", stderr(&output));
        assert!(message(&output).contains(part), "{words}: {}", message(&output));
    }
    let fixed = rare("--design importance --event collision --set gap-m=20");
    assert_eq!(code(&fixed), 2);
    assert!(message(&fixed).contains("no parameter of `known-rare-probability` varies"), "{}", message(&fixed));
}

#[test]
fn parts_of_weighted_runs_merge_to_the_bytes_of_one_machine() {
    let place = folder();
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let run = |more: &str| rare(&format!("{BY_IMPORTANCE} --seed 3 {more}"));
    let whole = stdout(&run(&format!("--out {}", at("whole"))), 0);
    let parts = [1, 2, 3].map(|part| at(&format!("part-{part}")));
    for (number, part) in (1..).zip(&parts) {
        let value = json(&run(&format!("--partition {number}/3 --jobs {number} --out {part}")), 0);
        assert_eq!(value["partition"], format!("{number}/3"));
        assert!(!Path::new(part).join("rare.json").exists(), "a part has no estimate");
    }
    let lines = |path: &str| fs::read_to_string(Path::new(path).join("rare-journal.jsonl")).unwrap().lines().count();
    let counts = parts.each_ref().map(|part| lines(part));
    let of_whole = lines(&at("whole"));
    assert!(counts.iter().all(|count| *count < of_whole), "{counts:?} of {of_whole}");
    // Each last run is in one part, and all others are in every part.
    let common = (counts.iter().sum::<usize>() - of_whole) / 2;
    assert!(common > 800 && of_whole - common >= 600, "{common} common runs of {of_whole}");
    let merge = |parts: &[&str], out: &str, more: &str| {
        let words = ["tool", "merge", "--format", "json", "--out", out];
        closecall(words.into_iter().chain(parts.iter().copied()).chain(more.split_whitespace()))
    };
    let [first, second, third] = parts.each_ref().map(String::as_str);
    let merged = at("merged");
    assert_eq!(stdout(&merge(&[third, first, second], &merged, ""), 0), whole);
    let bytes = |path: &str, file: &str| fs::read(Path::new(path).join(file)).unwrap();
    for file in ["rare.json", "rare-journal.jsonl"] {
        assert!(bytes(&merged, file) == bytes(&at("whole"), file), "{file}");
    }
    // The merged runs are judged as runs of one machine.
    let verdict = |max: &str| {
        code(&merge(&[first, second, third], &at(&format!("judged-{max}")), &format!("--max-probability {max}")))
    };
    assert_eq!([verdict("1e-4"), verdict("1e-6")], [0, 1]);
    let refused = |parts: &[&str], more: &str| {
        let output = merge(parts, &at("refused"), more);
        assert_eq!(code(&output), 2, "{}", stderr(&output));
        message(&output)
    };
    assert!(refused(&[first, third], "").contains("1 of 3 parts is missing: 2/3"));
    assert!(refused(&[first, second, second], "").contains("both hold part 2/3"));
    assert!(refused(&[first, second, &at("whole")], "").contains("holds a whole campaign"));
    assert!(refused(&[first, second, third], "--record worst:1").contains("cannot be merged with --record"));
    let other = at("other");
    json(&rare(&format!("{BY_IMPORTANCE} --seed 4 --partition 3/3 --out {other}")), 0);
    assert!(refused(&[first, second, &other], "").contains("different campaigns"));
    // A part that was killed is named, and resumed.
    let journal = Path::new(second).join("rare-journal.jsonl");
    let kept = fs::read(&journal).unwrap();
    fs::write(&journal, &kept[..kept.len() - 40]).unwrap();
    assert!(refused(&[first, second, third], "").contains("a part has not run to its end"));
    stdout(&run(&format!("--partition 2/3 --resume --out {second}")), 0);
    assert_eq!(fs::read(&journal).unwrap(), kept);
}

#[test]
fn an_event_that_cannot_happen_is_not_judged() {
    let run = |words: &str| {
        let words = format!("campaign low-thw-overtake --sensors object --event collision {words}");
        closecall(words.split_whitespace())
    };
    // After 2 s no vehicle has come near, and nothing can collide.
    for method in ["importance", "subset"] {
        let text = stdout(&run(&format!("--design {method} -n 3000 --max-probability 0.1 --set duration-s=2")), 4);
        if method == "importance" {
            assert!(text.contains("NOT JUDGED: 1.000e-1 allowed"), "{text}");
        }
        assert!(text.contains("what the scenario is about did not happen: low-thw-overtake: lead_braked"), "{text}");
    }
    let value = json(&run("--design importance -n 3000 --max-probability 0.1 --set duration-s=2 --format json"), 4);
    assert_eq!(value["gate"]["verdicts"][0], "NOT JUDGED");
    assert!(value["scenarios"][0]["not_judged"][0].as_str().unwrap().contains("at least 95.0 % expected"), "{value}");
    let search = stdout(&run("--design search -n 300 --set duration-s=2"), 4);
    assert!(search.contains("not found") && search.contains("did not happen"), "{search}");
    // A setting that no longer asks for what the scenario is about does not make it pass.
    let text = stdout(&run("--design importance -n 3000 --max-probability 0.1 --set duration-s=2 --set expects=[]"), 4);
    assert!(text.contains("weakened what the scenario is judged by: expects lead_braked"), "{text}");
    assert!(text.contains("NOT JUDGED: 1.000e-1 allowed"), "{text}");
    // As it is, the scenario is about what it says, and a limit that is too low still fails.
    let value = json(&run("--design importance -n 3000 --max-probability 0.9 --format json"), 0);
    assert_eq!(value["scenarios"][0]["not_judged"].as_array().unwrap().len(), 0, "{value}");
}

#[test]
fn a_bound_on_slowing_that_compares_with_a_baseline_is_not_judged_without_one() {
    let run = |words: &str| {
        let fixed = "campaign anchor-lead-brakes --design subset --event collision --max-probability 0.9 -n 40 --sensors ground-truth";
        let output = closecall(fixed.split_whitespace().chain(words.split_whitespace()));
        (code(&output), String::from_utf8(output.stdout).unwrap())
    };
    let unknown = "whether the system under test slows the ego before a vehicle behind is near is not known";
    let (code, text) = run("");
    assert!(
        code == 4 && text.contains(unknown) && text.contains("compares with a baseline, and there is none"),
        "{text}"
    );
    let (_, text) = run("--paired");
    assert!(!text.contains(unknown), "{text}");
}

#[test]
fn a_gate_that_can_only_fail_ends_a_campaign_that_fails_fast() {
    // The ego collides in neither arm; its smallest gap falls below 30 m in most samples.
    let path = fixture();
    let gate = "min(min_gap_rear_m) >= 30";
    let campaign = |more: &[&str]| {
        let fixed = ["campaign", path.to_str().unwrap(), "-n", "400", "--controller", "acc", "--gate", gate];
        closecall(fixed.iter().chain(more))
    };
    let text = stdout(&campaign(&["--fail-fast"]), 1);
    assert!(text.contains("ENDED EARLY, without a verdict: min(min_gap_rear_m) >= 30 can only fail"), "{text}");
    assert!(!text.contains("400 of 400 samples"), "{text}");
    let whole = stdout(&campaign(&[]), 1);
    assert!(whole.contains("FAIL"), "{whole}");
}

#[test]
fn a_larger_budget_goes_on_to_the_bytes_of_a_campaign_that_had_it_from_the_start() {
    for method in ["importance", "subset"] {
        let place = folder();
        let [grown, whole] = ["grown", "whole"].map(|name| place.path().join(name));
        let run = |out: &Path, budget: u32, more: &str| {
            let out = out.display();
            rare(&format!("--design {method} --event collision --format json --seed 3 -n {budget} --out {out} {more}"))
        };
        code(&run(&grown, 4_000, ""));
        let refused = run(&grown, 3_000, "--resume");
        assert!(message(&refused).contains("budget: 4000 there, 3000 here"), "{}", message(&refused));
        let after = run(&grown, 60_000, "--resume");
        let at_once = run(&whole, 60_000, "");
        // The budget may end before an interval: both say so.
        assert_eq!(code(&after), code(&at_once), "{method}");
        assert_eq!(after.stdout, at_once.stdout, "{method}");
        for file in ["rare.json", "rare-journal.jsonl", "rare-manifest.json"] {
            let bytes = |folder: &Path| fs::read_to_string(folder.join(file)).unwrap();
            let plain = |text: String| text.lines().filter(|line| !is_command(line)).collect::<Vec<_>>().join("\n");
            assert!(plain(bytes(&grown)) == plain(bytes(&whole)), "{method}: {file}");
        }
    }
}

/// Returns true for the words of the command line in a manifest, which differ.
fn is_command(line: &str) -> bool {
    ["-n", "--out", "--resume", "4000", "60000", "grown", "whole"].iter().any(|word| line.contains(word))
}

#[test]
fn a_drawn_seed_is_stated_resumed_and_kept() {
    let place = folder();
    let out = place.path().join("out");
    let words = format!("--design importance --event collision -n 3000 --judge-seed secret --out {}", out.display());
    let text = stdout(&rare(&words), 0);
    let seed: u64 = text.split("--seed ").nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap();
    let result = json_file(&out.join("rare.json"));
    assert_eq!(result["seed"], seed);
    assert!(result["closecall_version"].is_string());
    let resumed = stdout(&rare(&format!("{words} --resume")), 0);
    assert!(resumed.contains(&format!("--seed {seed}")), "{resumed}");
    // With more runs, and with the number that was drawn: the folder says how it came about.
    let named = words.replace("--judge-seed secret", &format!("--seed {seed}")).replace("-n 3000", "-n 4000");
    let grown = stdout(&rare(&format!("{named} --resume")), 0);
    assert!(grown.contains(&format!("drawn for this campaign: --seed {seed}")), "{grown}");
    let manifest = fs::read_to_string(out.join("rare-manifest.json")).unwrap();
    assert!(manifest.contains("\"has_drawn_seed\": true"), "{manifest}");
}

#[test]
fn a_named_seed_of_weighted_runs_does_not_become_a_secret_one_by_resumption() {
    let place = folder();
    let out = place.path().join("out");
    let words = |seed: &str| format!("--design importance --event collision -n 3000 {seed} --out {}", out.display());
    stdout(&rare(&words("--seed 5")), 0);
    let refused = rare(&words("--judge-seed secret --resume"));
    assert_eq!(code(&refused), 2, "{}", stderr(&refused));
    assert!(message(&refused).contains("began with the seed 5, which was known beforehand"), "{}", message(&refused));
    let manifest = fs::read_to_string(out.join("rare-manifest.json")).unwrap();
    assert!(manifest.contains("\"has_drawn_seed\": false"), "{manifest}");
}

#[test]
fn a_rare_event_of_a_controller_from_outside_says_that_its_seed_was_known() {
    const REMARK: &str = "the seed was known before the run: a controller could recognise its samples";
    if !has_python() {
        return;
    }
    let path = fixture();
    let run = |controller: &str, words: &str| {
        let fixed =
            ["campaign", path.to_str().unwrap(), "--event", "collision", "-n", "20", "--controller", controller];
        let output = closecall(fixed.into_iter().chain(words.split_whitespace()));
        assert!([0, 1, 4].contains(&code(&output)), "{words}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let outside = "exec:python3 examples/acc_controller.py";
    let limit = "--controller-timeout-ms 60000";
    for design in ["importance --max-probability 0.5", "subset --max-probability 0.5", "search"] {
        let text = run(outside, &format!("--design {design} {limit} --seed 5"));
        assert!(text.contains(&format!("\n  {REMARK}; `--judge-seed secret` draws one\n")), "{design}: {text}");
        let text = run(outside, &format!("--design {design} {limit} --judge-seed secret"));
        assert!(!text.contains("the seed was known"), "{design}: {text}");
        let text = run("acc", &format!("--design {design} --seed 5"));
        assert!(!text.contains("the seed was known"), "{design}: {text}");
    }
    let measured = run(outside, &format!("--design importance {limit} --seed 5"));
    assert!(!measured.contains("the seed was known"), "{measured}");
    let text = run(outside, &format!("--design importance --max-probability 0.5 {limit} --format json"));
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(value["remarks"][0].as_str().unwrap().starts_with(REMARK), "{value}");
    let text = run("acc", "--design importance --max-probability 0.5 --format json");
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["remarks"].as_array().unwrap().len(), 0, "{value}");
}

#[test]
fn a_folder_of_weighted_runs_is_named_for_what_it_is() {
    let place = folder();
    let out = place.path().join("out");
    let path = out.to_str().unwrap();
    stdout(&rare(&format!("--design importance --event collision -n 3000 --seed 1 --out {path}")), 0);
    for words in
        [vec!["check", path], vec!["replay", path, "0"], vec!["compare", path, path], vec!["view", "--no-open", path]]
    {
        let refused = closecall(&words);
        assert_eq!(code(&refused), 2, "{words:?}: {}", stderr(&refused));
        let said = message(&refused);
        assert!(said.contains("samples a rare event") && said.contains("rare.json"), "{words:?}: {said}");
    }
    let plain = rare(&format!("-n 10 --no-gate --out {path}"));
    assert!(message(&plain).contains("samples a rare event"), "{}", message(&plain));
}

#[test]
fn a_search_finds_a_collision_that_is_rare_and_writes_its_smallest_case() {
    let place = folder();
    let [first, second] = ["found", "again"].map(|name| place.path().join(name));
    let run = |out: &Path, more: &str| {
        rare(&format!("--design search --event collision --seed 1 --out {} {more}", out.display()))
    };
    let text = stdout(&run(&first, "--jobs 1"), 1);
    assert!(text.contains("a search states no probability"), "{text}");
    let result = json_file(&first.join("rare.json"));
    let report = &result["scenarios"][0];
    assert_eq!(report["search"]["has_event"], true);
    assert!(report["runs"].as_u64().unwrap() < 2_000, "{report}");
    assert_eq!(report["estimates"].as_array().unwrap().len(), 0);
    let case = |name: &str| {
        let path = first.join(name);
        stdout(&closecall(["run", path.to_str().unwrap(), "--controller", "acc"]), 0)
    };
    assert!(case("known-rare-probability-found.toml").contains("COLLISION"));
    assert!(!case("known-rare-probability-found-passes.toml").contains("COLLISION"));
    // Cut off and resumed: the same journal.
    run(&second, "--jobs 2");
    let journal = |out: &Path| fs::read(out.join("rare-journal.jsonl")).unwrap();
    assert_eq!(journal(&first), journal(&second));
    let kept = journal(&second);
    fs::write(second.join("rare-journal.jsonl"), &kept[..kept.len() / 2]).unwrap();
    code(&run(&second, "--resume"));
    assert_eq!(journal(&second), kept);
}

#[test]
fn a_regression_is_found_in_a_case_in_which_the_earlier_controller_does_not_fail() {
    let place = folder();
    let out = place.path().join("out");
    let words =
        "campaign low-thw-overtake --arms acc,gap-1.6 --sensors object --design search --event induced --seed 7";
    let text = stdout(&closecall(words.split_whitespace().chain(["--out", out.to_str().unwrap()])), 1);
    assert!(text.contains("no vehicle collides in it with acc"), "{text}");
    let path = out.join("low-thw-overtake-found.toml");
    let run = |controller: &str| stdout(&closecall(["run", path.to_str().unwrap(), "--controller", controller]), 0);
    assert!(run("gap-1.6").contains("COLLISION"), "{text}");
    assert!(!run("acc").contains("COLLISION"), "{text}");
}

#[test]
fn a_search_that_finds_nothing_spends_its_budget_and_says_what_that_means() {
    let words = "campaign slow-approach --controller mis --sensors object --design search --event collision -n 300";
    let text = stdout(&closecall(words.split_whitespace()), 0);
    assert!(
        text.contains("300 runs") && text.contains("not found") && text.contains("bounds no probability"),
        "{text}"
    );
}
