//! No combination of options passes a campaign in which nothing was checked.

use std::path::{Path, PathBuf};

use crate::native_controllers::{compile, lib, with_fault};
use crate::support::{closecall, code, folder, json, library, message, program, stderr, stdout};

/// Options that gate, and options that do not, each with a value that everything meets.
const OPTIONS: [&[&str]; 20] = [
    &["--max-collisions", "1000"],
    &["--max-other-collisions", "1000"],
    &["--max-induced", "1000"],
    &["--min-prevented", "0.0001"],
    &["--max-harm", "1000"],
    &["--min-rear-thw", "0.0001"],
    &["--max-engagement-rate", "0.9999"],
    &["--max-speed-deficit-mps", "199"],
    &["--max-jerk", "39"],
    &["--max-probability", "0.999"],
    &["--max-probability", "0.999", "--until-certain"],
    &["--gate", "p99(min_ttc_rear_s) >= 0.0001"],
    &["--max-flip-rate", "1"],
    &["--check-at-most", "0"],
    &["--fail-fast"],
    &["--max-errors", "5"],
    &["--sensors", "object"],
    &["--preset", "pr"],
    &["--design", "sobol"],
    &["--time-budget", "1s"],
];

/// Writes a scenario of the library without gates, requirements, checks and expectations.
fn bare(folder: &Path, name: &str) -> PathBuf {
    let text = std::fs::read_to_string(library(name)).unwrap();
    let (before, rest) = text.split_once("[checks]").unwrap();
    let (_, after) = rest.split_once("\n[").unwrap();
    let is_kept = |line: &&str| !line.starts_with("requirements") && !line.starts_with("expects");
    let before: Vec<&str> = before.lines().filter(is_kept).collect();
    let path = folder.join("bare.toml");
    std::fs::write(&path, format!("{}\n[{after}", before.join("\n"))).unwrap();
    path
}

#[test]
fn two_seconds_in_which_nothing_happens_pass_no_gate() {
    for name in ["low-thw-overtake", "overtake-without-brake", "slow-approach", "rear-follower-stays"] {
        for options in OPTIONS {
            let path = library(name);
            let args = ["campaign", path.to_str().unwrap(), "-n", "4", "--paired", "--set", "duration-s=2"];
            let output = closecall(args.iter().chain(options));
            // Some options exclude each other; nothing else is accepted.
            assert!([2, 4, 7].contains(&code(&output)), "{name} {options:?}: {} {}", code(&output), stderr(&output));
        }
    }
}

#[test]
fn a_campaign_without_gates_and_checks_is_not_judged() {
    let folder = folder();
    let path = bare(folder.path(), "overtake-without-brake"); // no vehicle collides
    let run = |more: &[&str]| closecall(["campaign", path.to_str().unwrap(), "-n", "4"].iter().chain(more));
    for options in OPTIONS.iter().filter(|options| !options[0].starts_with("--max-") && options[0] != "--gate") {
        let output = run(options);
        let gates = ["--min-prevented", "--min-rear-thw"].contains(&options[0]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(gates || code(&output) == 4, "{options:?}: {} {text} {}", code(&output), stderr(&output));
        assert!(gates || options[0] == "--preset" || text.contains("NOT JUDGED"), "{options:?}: {text}");
    }
    stdout(&run(&["--no-gate"]), 0);
    // One gate is enough, if it says something.
    let enough = ["campaign", path.to_str().unwrap(), "-n", "20", "--max-collisions", "4"];
    assert!(stdout(&closecall(enough), 0).contains("PASS"));
    assert!(stdout(&run(&["--max-collisions", "4"]), 4).contains("too few samples"));
    let any = stdout(&closecall(["campaign", enough[1], "-n", "20", "--max-collisions", "20"]), 4);
    assert!(any.contains("it holds whatever happens in these samples"), "{any}");
    for (limit, expected) in [
        (["--max-flaky", "19"], 0),
        (["--max-flaky", "20"], 4),
        (["--max-flip-rate", "0.4"], 0),
        (["--max-flip-rate", "1"], 4),
    ] {
        let text = stdout(&closecall(enough.iter().chain(&limit)), expected);
        assert_eq!(text.contains("which holds whatever happens"), expected == 4, "{limit:?}: {text}");
    }
}

#[test]
fn a_controller_without_a_result_of_its_validity_checks_does_not_pass() {
    let folder = folder();
    let path = bare(folder.path(), "overtake-without-brake");
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let run = |fault: Option<&str>| {
        let mut command = program();
        command
            .args(["campaign", path.to_str().unwrap(), "-n", "20", "--sensors", "object", "--paired", "--no-out"])
            .args(["--max-collisions", "4", "--controller-timeout-ms", "300", "--controller", &library]);
        with_fault(&mut command, fault)
    };
    assert!(stdout(&run(None), 0).contains("PASS"));
    // It does not answer in the mirrored world. The baseline does.
    let text = stdout(&run(Some("mirror")), 4);
    assert!(
        text.contains("INCONCLUSIVE: not checked: ") && text.contains(": most of overtake-without-brake with "),
        "{text}"
    );
}

#[test]
fn a_scenario_whose_expectation_no_sample_can_miss_is_refused() {
    let folder = folder();
    let path = folder.path().join("any.toml");
    let text = std::fs::read_to_string(library("overtake-without-brake")).unwrap();
    std::fs::write(&path, text.replacen("\nexpects = ", "\nexpects-share = 0.0\nexpects = ", 1)).unwrap();
    let refused = closecall(["check", path.to_str().unwrap()]);
    assert_eq!(code(&refused), 3, "{}", stderr(&refused));
    assert!(message(&refused).contains("expects-share"), "{}", stderr(&refused));
}

#[test]
fn a_gate_on_what_no_sample_has_does_not_pass() {
    let path = library("slow-approach");
    // The margin increase system never engages there, and the baseline never collides.
    for gate in ["mean(thw_gain_s) >= 0", "share(prevented | baseline.ego_collided) >= 0.1"] {
        let path = path.to_str().unwrap();
        let args = ["campaign", path, "-n", "4", "--paired", "--max-collisions", "4", "--gate", gate];
        assert!(stdout(&closecall(args), 4).contains("no sample has this value"), "{gate}");
    }
    // A gate of the file that compares with a baseline says nothing of a campaign without one.
    let folder = folder();
    let text = std::fs::read_to_string(&path).unwrap();
    let gated = folder.path().join("gated.toml");
    std::fs::write(&gated, text.replacen("[checks]", "[gate]\nrequire = [\"count(induced) <= 0\"]\n\n[checks]", 1))
        .unwrap();
    let text = stdout(&closecall(["campaign", gated.to_str().unwrap(), "-n", "4", "--max-collisions", "4"]), 4);
    assert!(text.contains("count(induced) has no value in any scenario"), "{text}");
}

#[test]
fn the_sentence_for_programs_says_what_is_not_checked() {
    let args =
        ["campaign", "low-thw-overtake", "-n", "200", "--seed", "5", "--sensors", "object", "--max-collisions", "100"];
    let told = json(&closecall(args.iter().chain(&["--format", "json"])), 0);
    assert_eq!(told["verdict"], "PASS");
    assert_eq!(told["sentence"], "PASS: 5 of 8 gates are met, 3 not checked");
    assert!(stdout(&closecall(args), 0).contains(told["sentence"].as_str().unwrap()));
}

#[test]
fn copies_of_one_sample_are_one_sample() {
    let args = ["campaign", "paper-figure", "-n", "1000", "--paired", "--max-probability", "0.3", "--format", "json"];
    let report = json(&closecall(args), 4);
    assert_eq!(report["samples"], 1);
    assert!(report["probabilities"].as_object().unwrap().is_empty(), "no bound is claimed: {report}");
    // A grid repeats the values of a label; each vector of parameters counts once.
    let folder = folder();
    let text = std::fs::read_to_string(library("paper-figure")).unwrap();
    let path = folder.path().join("coin.toml");
    let coin = "[parameters]\nrear-class = { choice = { car = 1, truck = 1 }, assumed = \"either\" }\n\n[[actor]]";
    let text = text.replacen("[[actor]]", coin, 1);
    let (before, rear) = text.split_once("id = \"rear\"").unwrap();
    let rear = rear.replacen("class = \"car\"", "class = \"$rear-class\"", 1);
    std::fs::write(&path, format!("{before}id = \"rear\"{rear}")).unwrap();
    let args = ["campaign", path.to_str().unwrap(), "-n", "64", "--max-probability", "0.3", "--format", "json"];
    let report = json(&closecall(args), 4);
    let reasons = report["reasons"].to_string();
    assert!(reasons.contains("62 samples have the parameters or the outcome of an earlier one"), "{reasons}");
    assert_eq!(report["samples"], 2, "{report}");
    assert_eq!(report["controllers"]["mis"]["interval_95"][1].as_f64().map(|high| high > 0.8), Some(true), "{report}");
}

#[test]
fn a_system_that_was_not_there_to_be_tested_is_not_judged() {
    let folder = folder();
    let path = folder.path().join("own.toml");
    let judged = |text: &str, controller: &str, expected: i32| {
        std::fs::write(&path, text).unwrap();
        let args = ["-n", "40", "--seed", "46", "--paired", "--sensors", "object", "--controller", controller];
        stdout(&closecall(["campaign", path.to_str().unwrap()].iter().chain(&args)), expected)
    };
    // It may induce whatever it likes, but its sensors fail in each sample.
    let dead = std::fs::read_to_string(library("faults/object-dead")).unwrap();
    let (before, rest) = dead.split_once("[checks]").unwrap();
    let (_, after) = rest.split_once("\n\n").unwrap();
    let text = judged(&format!("{before}[checks]\nMIS-2 = [\"upper(induced) <= 0.9\"]\n\n{after}"), "mis", 4);
    assert!(text.contains("NOT JUDGED") && text.contains("was not available, because sensors had failed"), "{text}");
    // A longer gap prevents collisions, and never acts on what comes from behind.
    let headline = std::fs::read_to_string(library("low-thw-overtake")).unwrap();
    let (before, rest) = headline.split_once("[checks]").unwrap();
    let (_, after) = rest.split_once("\n\n").unwrap();
    let checks = "MIS-1 = [\"lower(prevented | baseline.ego_collided) >= 0.05\"]";
    let text = format!("{before}[checks]\n{checks}\n\n{after}");
    let refused = judged(&text, "gap-1.6", 4);
    assert!(refused.contains("NOT JUDGED") && refused.contains("never slowed the ego"), "{refused}");
    assert!(judged(&text, "mis", 0).contains("PASS"));
}

#[test]
fn a_gate_that_no_sample_can_miss_is_refused_wherever_it_stands() {
    let folder = folder();
    for (gate, part) in [
        ("count(ego_collided) >= 0", "no sample can miss it: a count is 0 or more"),
        ("share(ego_collided) <= 1", "no sample can miss it: a share is a number from 0 to 1"),
        ("max(max_jerk_mps3) <= 40", "no sample can miss it: `max_jerk_mps3` is a number from 0 to 40"),
        ("min(min_thw_rear_s) >= 0", "no sample can miss it: `min_thw_rear_s` is a number from 0"),
        ("min(min_gap_rear_m) >= 0", "no sample can miss it: `min_gap_rear_m` is a number from 0"),
        ("count(harm < -1) <= 0", "`harm < -1` holds in no sample"),
        ("count(induced | baseline.ego_collided) <= 0", "holds in no sample in which `baseline.ego_collided` holds"),
        ("share(ego_collided) <= -0.1", "no samples can meet it: a share is a number from 0 to 1"),
        ("upper(induced) <= 0", "no samples can meet it"),
    ] {
        let name = "overtake-without-brake";
        let on_command_line = closecall(["campaign", name, "-n", "24", "--paired", "--gate", gate]);
        assert_eq!(code(&on_command_line), 2, "{gate}");
        assert!(message(&on_command_line).contains(part), "{gate}: {}", message(&on_command_line));
        let project = folder.path().join("closecall.toml");
        std::fs::write(&project, format!("[gate]\nrequire = ['{gate}']\n")).unwrap();
        let of_project = program().args(["campaign", name, "--no-out"]).current_dir(folder.path()).output().unwrap();
        assert_eq!(code(&of_project), 3, "{gate}: {}", stderr(&of_project));
        assert!(message(&of_project).contains(part), "{gate}: {}", message(&of_project));
        let path = without_checks(folder.path(), &format!("[gate]\nrequire = ['{gate}']\n\n"));
        let of_file = closecall(["campaign", path.to_str().unwrap()]);
        assert_eq!(code(&of_file), 3, "{gate}: {}", stderr(&of_file));
        assert!(message(&of_file).contains(part), "{gate}: {}", message(&of_file));
    }
}

/// Writes a scenario of the library without checks and requirements, under another name.
fn without_checks(folder: &Path, more: &str) -> PathBuf {
    let text = std::fs::read_to_string(library("overtake-without-brake")).unwrap();
    let (before, rest) = text.split_once("[checks]").unwrap();
    let (_, after) = rest.split_once("\n\n").unwrap();
    let (head, tail) = before.split_once("requirements = [").unwrap();
    let (_, tail) = tail.split_once("\n").unwrap();
    let head = head.replace("name = \"overtake-without-brake\"", "name = \"unchecked\"");
    let path = folder.join("unchecked.toml");
    std::fs::write(&path, format!("{head}{tail}{more}{after}")).unwrap();
    path
}

#[test]
fn a_scenario_that_nothing_judges_does_not_pass_beside_one_that_passes() {
    let folder = folder();
    let unchecked = without_checks(folder.path(), "");
    let checked = library("overtake-without-brake");
    let [unchecked, checked] = [&unchecked, &checked].map(|path| path.to_str().unwrap());
    let fixed = ["-n", "60", "--sensors", "ground-truth", "--paired"];
    let run =
        |words: &[&str], expected: i32| stdout(&closecall(["campaign"].iter().chain(words).chain(&fixed)), expected);
    assert!(run(&[checked], 0).contains("PASS"));
    let text = run(&[checked, unchecked], 4);
    assert!(text.contains("NOT JUDGED") && text.contains("unchecked: no gate and no check"), "{text}");
    // What the baseline does says nothing of the system under test.
    for gate in ["count(baseline.ego_collided) <= 0", "share(baseline.max_jerk_mps3 > 30) <= 0.5"] {
        let text = run(&[unchecked, "--gate", gate], 4);
        assert!(text.contains("NOT JUDGED") && text.contains("the system under test there"), "{text}");
    }
    let both = ["--gate", "count(ego_collided) <= 0"];
    assert!(run(&[&[checked, unchecked][..], &both].concat(), 0).contains("PASS"));
}

#[test]
fn a_gate_that_demands_less_than_the_gate_of_a_file_is_overridden() {
    let folder = folder();
    let gate = "[gate]\nrequire = [\"count(ego_collided) <= 0\"]\n\n";
    let path = without_checks(folder.path(), gate);
    let run = |more: &[&str], within: &Path| {
        let mut command = program();
        let fixed = ["campaign", path.to_str().unwrap(), "-n", "24", "--sensors", "ground-truth", "--no-out"];
        command.args(fixed).args(more).current_dir(within);
        command.output().unwrap()
    };
    let elsewhere = folder.path().join("elsewhere");
    std::fs::create_dir(&elsewhere).unwrap();
    assert!(stdout(&run(&[], &elsewhere), 0).contains("PASS"));
    let text = stdout(&run(&["--max-collisions", "9"], &elsewhere), 4);
    assert!(text.contains("OVERRIDDEN") && text.contains("gate count(ego_collided) <= 0, replaced by"), "{text}");
    // The project file stands above the scenario file, and the command line above both.
    let project = |bound: u64| {
        std::fs::write(
            elsewhere.join("closecall.toml"),
            format!("[gate]\nrequire = ['count(ego_collided) <= {bound}']\n"),
        )
        .unwrap();
    };
    project(9);
    assert!(stdout(&run(&[], &elsewhere), 4).contains("OVERRIDDEN"));
    project(0);
    assert!(stdout(&run(&[], &elsewhere), 0).contains("PASS"));
    std::fs::write(elsewhere.join("closecall.toml"), "[gate]\nrequire = ['max(max_jerk_mps3) <= 1']\n").unwrap();
    let text = stdout(&run(&["--max-jerk", "30"], &elsewhere), 4);
    assert!(text.contains("gate max(max_jerk_mps3) <= 1, replaced by max(max_jerk_mps3) <= 30"), "{text}");
}

#[test]
fn a_rare_event_that_no_run_or_every_run_has_and_one_of_the_baseline_are_no_gate() {
    let path = library("overtake-without-brake");
    let fixed = ["campaign", path.to_str().unwrap(), "--sensors", "ground-truth", "--design", "importance", "--paired"];
    for (event, part) in [
        ("harm < 0", "it happens in no sample: `harm` is a number from 0"),
        ("min_ttc_rear_s < -5", "it happens in no sample: `min_ttc_rear_s` is a number from 0"),
        ("min_gap_rear_m >= 0", "it happens in every sample"),
        ("baseline.ego_collided", "an event of the baseline alone"),
    ] {
        let more = ["--event", event, "--guide", "min_gap_rear_m", "--max-probability", "0.5", "-n", "100"];
        let output = closecall(fixed.iter().chain(&more));
        assert_eq!(code(&output), 2, "{event}: {}", stderr(&output));
        assert!(message(&output).contains(part), "{event}: {}", stderr(&output));
    }
    // A search that hardly ran has not looked.
    let words = ["campaign", path.to_str().unwrap(), "--sensors", "ground-truth", "--design", "search", "-n", "1"];
    stdout(&closecall(words.iter().chain(&["--event", "collision"])), 4);
}

#[test]
fn a_file_with_the_name_of_the_library_says_that_it_is_another_one_and_what_it_does_not_check() {
    let folder = folder();
    let text = std::fs::read_to_string(library("low-thw-overtake")).unwrap();
    let (before, rest) = text.split_once("[checks]").unwrap();
    let (_, after) = rest.split_once("\n\n").unwrap();
    let path = folder.path().join("low-thw-overtake.toml");
    std::fs::write(&path, format!("{before}[checks]\nMIS-2 = [\"upper(induced) <= 0.5\"]\n\n{after}")).unwrap();
    let out = folder.path().join("out");
    let (path, out_word) = (path.to_str().unwrap(), out.to_str().unwrap());
    let args = ["campaign", path, "-n", "60", "--seed", "7", "--sensors", "object", "--paired", "--out", out_word];
    let text = stdout(&closecall(args), 0);
    // Who writes a file of one's own may demand what one likes. Nobody may take it for the library's.
    assert!(text.contains("PASS: 1 of 1 gates are met, 5 requirements without criteria"), "{text}");
    let told = "low-thw-overtake differs from the library's scenario of this name in checks";
    assert!(text.contains(told), "{text}");
    for report in ["junit.xml", "report.html", "summary.md"] {
        let text = std::fs::read_to_string(out.join(report)).unwrap().replace("&#39;", "'").replace("&apos;", "'");
        assert!(text.contains(told), "{report}");
    }
    let library = stdout(
        &closecall(["campaign", "overtake-without-brake", "-n", "60", "--sensors", "ground-truth", "--paired"]),
        0,
    );
    assert!(!library.contains("differs from the library"), "{library}");
}
