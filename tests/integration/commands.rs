//! The commands around a scenario: `new`, `init`, `list`, `check`, `baseline`, `tool completions`,
//! `tool man`; and the common parts of all commands: their groups and their help, the sources of
//! scenarios, the statements about the origin of an output, and the answers to misspelt words.

use std::ffi::OsStr;
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::Stdio;

use clap::Command;

use crate::support::{ROOT, closecall, code, folder, json, library, message, program, stderr, stdout};

/// Runs the program in another folder.
fn run_in(folder: &Path, args: &[&str]) -> std::process::Output {
    program().current_dir(folder).args(args).output().unwrap()
}

#[test]
fn a_new_user_gets_from_an_empty_folder_to_a_campaign() {
    let folder = folder();
    let written = stderr(&run_in(folder.path(), &["init"]));
    let files = [".github/workflows/closecall.yml", ".gitlab-ci.yml", ".gitignore", "scenarios/late-overtake.toml"];
    for path in files.into_iter().chain(["closecall.toml", "scenario.schema.json"]) {
        assert!(written.contains(&format!("written: ./{path}")), "{written}");
        assert!(folder.path().join(path).is_file(), "{path}");
    }
    assert!(!std::fs::read_to_string(folder.path().join(".gitlab-ci.yml")).unwrap().contains('@'));
    assert!(written.contains("fill in: CLOSECALL_URL"), "{written}");
    let written = stderr(&run_in(folder.path(), &["new", "mine"]));
    assert!(written.starts_with("written: scenarios/mine.toml\n"), "{written}");
    for name in ["mine", "late-overtake"] {
        let text = std::fs::read_to_string(folder.path().join(format!("scenarios/{name}.toml"))).unwrap();
        assert!(text.starts_with("#:schema ../scenario.schema.json\n"), "{text}");
    }
    let args = ["campaign", "mine", "-n", "4", "--format", "json"];
    let output = run_in(folder.path(), &args);
    assert!([0, 1, 4].contains(&code(&output)), "{}", stderr(&output));
    let checked = json(&run_in(folder.path(), &["check", "scenarios", "--format", "json"]), 0);
    assert_eq!(checked["scenarios"].as_array().unwrap().len(), 2);
}

#[test]
fn init_asks_to_fill_in_only_what_a_job_lacks() {
    let folder = folder();
    let first =
        stderr(&run_in(folder.path(), &["init", "--url", "https://example.org/closecall.git", "--rev", "v0.1.0"]));
    assert!(!first.contains("fill in"), "{first}");
    let again = stderr(&run_in(folder.path(), &["init"]));
    assert!(again.contains("kept: ./.gitlab-ci.yml") && !again.contains("fill in"), "{again}");
    std::fs::remove_file(folder.path().join(".gitlab-ci.yml")).unwrap();
    let anew = stderr(&run_in(folder.path(), &["init"]));
    assert!(anew.contains("fill in: CLOSECALL_URL"), "{anew}");
}

#[test]
fn new_and_init_overwrite_nothing() {
    let folder = folder();
    std::fs::write(folder.path().join("mine.toml"), "own").unwrap();
    std::fs::write(folder.path().join(".gitlab-ci.yml"), "own").unwrap();
    assert!(message(&run_in(folder.path(), &["new", "mine"])).contains("is not overwritten"));
    assert_eq!(code(&run_in(folder.path(), &["new", "mine"])), 2);
    assert!(stderr(&run_in(folder.path(), &["init"])).contains("kept: ./.gitlab-ci.yml"));
    for name in ["mine.toml", ".gitlab-ci.yml"] {
        assert_eq!(std::fs::read_to_string(folder.path().join(name)).unwrap(), "own");
    }
    let copied = stderr(&run_in(folder.path(), &["new", "other", "--from", "paper-figure", "-o", "x/other.toml"]));
    assert!(copied.starts_with("written: x/other.toml"), "{copied}");
    stdout(&run_in(folder.path(), &["check", "x/other.toml"]), 0);
}

#[test]
fn the_library_is_listed_and_works_from_anywhere() {
    let folder = folder();
    let listed = json(&run_in(folder.path(), &["list", "--format", "json"]), 0);
    let scenarios = listed["scenarios"].as_array().unwrap();
    assert!(scenarios.len() >= 8);
    assert!(scenarios.iter().all(|scenario| !scenario["requirements"].as_array().unwrap().is_empty()));
    let text = stdout(&run_in(folder.path(), &["list"]), 0);
    let line = text.lines().find(|line| line.starts_with("paper-figure ")).expect("a line for each scenario");
    assert!(line.contains("  Does the MIS "), "{text}");
    assert!(text.lines().count() < 24 && text.contains("closecall list faults"), "{text}");
    assert!(text.contains("ramp-merges [-without-merge]"), "{text}");
    let faults = stdout(&run_in(folder.path(), &["list", "faults"]), 0);
    assert!(faults.contains("lidar-dead\n  What does the system do"), "{faults}");
    let listing = stdout(&run_in(folder.path(), &["list", "paper"]), 0);
    assert!(listing.starts_with("paper-figure\n  Does the margin increase system"), "{listing}");
    assert_eq!(stdout(&run_in(folder.path(), &["list", "PAPER"]), 0), listing);
    assert_eq!(stdout(&run_in(folder.path(), &["list", "Fault"]), 0), faults);
    let of_requirement = stdout(&run_in(folder.path(), &["list", "mis-2"]), 0);
    assert!(of_requirement.contains("requirements: ") && of_requirement.contains("MIS-2"), "{of_requirement}");
    assert!(of_requirement.lines().filter(|line| line.contains("requirements: ")).all(|line| line.contains("MIS-2")));
    let headline = stdout(&run_in(folder.path(), &["list", "headline"]), 0);
    for name in ["low-thw-overtake", "low-thw-overtake-as-recorded"] {
        assert!(headline.lines().any(|line| line == name), "{headline}");
    }
    assert!(!headline.contains("paper-figure"), "{headline}");
    assert!(
        message(&run_in(folder.path(), &["list", "no-such"]))
            .contains("no scenario has `no-such` in its name, as a tag or as a requirement")
    );
    let run = json(&run_in(folder.path(), &["run", "paper-figure", "--format", "json"]), 0);
    assert_eq!(run["scenario"], "paper-figure");
    assert!(message(&run_in(folder.path(), &["run", "paper-figur"])).contains("did you mean `paper-figure`"));
}

#[test]
fn a_scenario_is_read_from_standard_input() {
    let mut child = program()
        .args(["check", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let text = std::fs::read(library("paper-figure")).unwrap();
    child.stdin.take().unwrap().write_all(&text).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(stdout(&output, 0).contains("valid, paper-figure"));
}

#[test]
fn check_states_each_error_as_json() {
    let folder = folder();
    std::fs::write(folder.path().join("bad.toml"), "schema-version = 1\nnme = 'a'\n").unwrap();
    let check = json(&run_in(folder.path(), &["check", "bad.toml", "paper-figure", "--format", "json"]), 3);
    assert_eq!((&check["valid"], &check["schema_version"]), (&false.into(), &1.into()));
    assert_eq!(check["scenarios"][0]["line"], 2);
    assert!(check["scenarios"][0]["message"].as_str().unwrap().ends_with("did you mean `name`?"));
    assert_eq!(check["scenarios"][1]["valid"], true);
}

#[test]
fn each_json_output_states_how_it_was_made() {
    let scenario = library("paper-figure");
    let args = ["campaign", scenario.to_str().unwrap(), "-n", "3", "--seed", "7", "--set", "duration-s=20"];
    let output = closecall(args.into_iter().chain(["--format", "json"]));
    let output_json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&output_json["schema_version"], &output_json["seed"]), (&1.into(), &7.into()));
    assert_eq!(output_json["settings"], serde_json::json!(["duration-s=20"]));
    assert!(output_json["closecall_version"].as_str().unwrap().starts_with(env!("CARGO_PKG_VERSION")));
}

#[test]
fn settings_stand_in_every_report() {
    let folder = folder();
    let out = folder.path().join("out");
    let args = ["campaign", "paper-figure", "--set", "duration-s=20", "--no-gate", "--out", out.to_str().unwrap()];
    stdout(&closecall(args), 0);
    for name in ["report.html", "summary.md", "junit.xml", "manifest.json"] {
        let text = std::fs::read_to_string(out.join(name)).unwrap();
        // The command line alone, which a merge replaces, would not do.
        let settings = text.replace("--set duration-s=20 --no-gate", "");
        assert!(settings.contains("duration-s=20"), "{name}");
    }
}

#[test]
fn the_paths_of_written_files_are_printed() {
    let folder = folder();
    let out = folder.path().join("out");
    let args = ["campaign", "paper-figure", "-n", "2", "--out", out.to_str().unwrap()];
    let output = closecall(args);
    for name in ["report.html", "junit.xml", "outcomes.parquet"] {
        assert!(stderr(&output).contains(&format!("written: {}", out.join(name).display())), "{}", stderr(&output));
    }
    let trace = folder.path().join("trace.csv");
    let output = closecall(["run", "paper-figure", "--trace", trace.to_str().unwrap()]);
    assert!(stderr(&output).contains(&format!("written: {}", trace.display())), "{}", stderr(&output));
}

#[test]
fn results_are_on_standard_output_and_the_paths_of_files_on_standard_error() {
    let folder = folder();
    let campaign =
        ["campaign", "paper-figure", "-n", "2", "--sensors", "ground-truth", "--no-gate", "--out", "results"];
    assert_eq!(code(&run_in(folder.path(), &campaign)), 0);
    let recorded =
        ["traffic", "record", "overtake-without-brake", "-n", "12", "--sensors", "ground-truth", "-o", "traffic.csv"];
    let sampled = "traffic sample traffic.csv --vary cc1 --from 1.5 --to 0.3 --steps 2 -o sampled";
    let sampled: Vec<&str> = sampled.split(' ').collect();
    for (words, file) in [
        (&["new", "mine"][..], "mine.toml"),
        (&["init", "repository"], "repository/closecall.toml"),
        (&["plot", "paper-figure", "-o", "figure.svg"], "figure.svg"),
        (&["baseline", "save", "results", "baseline.json"], "baseline.json"),
        (&["tool", "man", "--out", "pages"], "pages"),
        (&["tool", "export", "paper-figure", "-o", "case"], "case"),
        (&recorded, "traffic.csv"),
        (&["traffic", "fit", "traffic.csv", "-o", "fitted.toml"], "fitted.toml"),
        (&["traffic", "reenact", "traffic.csv", "-o", "encounter.toml"], "encounter.toml"),
        (&["traffic", "reenact", "traffic.csv", "--tracks", "tracks.parquet"], "tracks.parquet"),
        (&sampled[..], "step-2.toml"),
    ] {
        let output = run_in(folder.path(), words);
        let printed = stdout(&output, 0);
        assert!(!printed.contains("written"), "{words:?}: {printed}");
        let told = stderr(&output);
        let names = |line: &str| line.starts_with("written: ") && line.contains(file);
        assert!(told.lines().any(names), "{words:?}: {told}");
    }
}

#[test]
fn a_misspelt_or_negative_value_is_explained() {
    for (args, expected) in [
        (["run", "paper-figure", "--controller", "miss"], "did you mean `mis`?"),
        (["run", "paper-figure", "--set", "duration=3"], "did you mean `duration-s`?"),
        (["campaign", "paper-figure", "-n", "-5"], "`-5` is negative: a whole number of 1 or more is needed"),
        (["campaign", "paper-figure", "--samples", "1e3"], "is not a whole number"),
        (["campaign", "paper-figure", "--max-collisions", "-1"], "'-1': '--max-collisions' takes no number below 0"),
        (["run", "paper-figure", "--sample", "-25"], "unexpected argument '-25': '--sample' takes no number below 0"),
        (["study", "map", "--closing-kmh", "-10,20"], "'-10,20': '--closing-kmh' takes no number below 0"),
        (["study", "map", "--speed-mps", "-.5"], "'-.5': '--speed-mps' takes no number below 0"),
        (["explain", "results", "-17", "--quiet"], "unexpected argument '-17': this command takes no number below 0"),
        (["campaign", "paper-figure", "--max-collisions", "many"], "expected a whole number, 0 or more"),
        (
            ["run", "paper-figure", "--sample", "1.5"],
            "'1.5' for '--sample <SAMPLE>': expected a whole number, 0 or more",
        ),
        (
            ["run", "paper-figure", "--sample", "99999999999999999999999"],
            "for '--sample <SAMPLE>': expected a whole number from 0 to 18446744073709551615",
        ),
        (
            ["traffic", "robustness", "traffic.csv", "--repetitions=0"],
            "'0' for '--repetitions <REPETITIONS>': `0` is not a whole number from 1 to 10000",
        ),
        (
            ["study", "sensitivity", "paper-figure", "--rows=9999999"],
            "'9999999' for '--rows <N>': `9999999` is not a whole number from 1 to 2097152",
        ),
        (["study", "boundary", "paper-figure", "--runs=x"], "`x` is not a whole number from 30 to 200"),
        (["view", "results", "--port", "65536"], "`65536` is not a whole number from 0 to 65535"),
        (["study", "perceive", "scans.pcd", "--intensity-scale=1e300"], "a number above 0 and up to 3.4028235e38"),
        (["campaign", "paper-figure", "--check-share", "2"], "`2` is not a number above 0 and up to 1"),
        (["campaign", "paper-figure", "--check-share", "0"], "`0` is not a number above 0 and up to 1"),
        (["campaign", "paper-figure", "--max-jerk", "1e400"], "`1e400` is not a finite number above 0"),
        (
            ["run", "paper-figur", "--seed", "1"],
            "there is no scenario `paper-figur`: no file and no scenario of the library",
        ),
    ] {
        let output = closecall(args);
        assert_eq!(code(&output), 2, "{args:?}");
        let text = message(&output);
        assert!(text.contains(expected) && !text.contains("-- -1") && !text.contains("digit"), "{text}");
    }
}

#[test]
fn a_wrong_path_is_named_with_what_it_is() {
    let folder = folder();
    let path = folder.path().to_str().unwrap();
    let file = folder.path().join("results");
    std::fs::write(&file, "text").unwrap();
    let watched = closecall(["check", path, "--watch", "--rounds", "1"]);
    assert_eq!(code(&watched), 2);
    assert!(message(&watched).contains(&format!("{path} is a folder: --watch is for one scenario file")));
    let written = closecall(["campaign", "paper-figure", "-n", "1", "--no-gate", "--out", file.to_str().unwrap()]);
    assert_eq!(code(&written), 6);
    assert!(message(&written).contains("results: it is a file, and a folder is needed"), "{}", message(&written));
    let below = closecall(["init", file.to_str().unwrap()]);
    assert_eq!(code(&below), 6);
    assert!(message(&below).contains("results: it is a file, and a folder is needed"), "{}", message(&below));
    let twice = closecall(["campaign", "paper-figure", "paper-figure", "-n", "1", "--no-gate"]);
    assert_eq!(code(&twice), 2);
    assert!(message(&twice).contains("paper-figure.toml is named twice"), "{}", message(&twice));
    let odd = closecall([OsStr::new("run"), OsStr::from_bytes(b"nope\xff")]);
    assert_eq!(code(&odd), 2);
    assert!(message(&odd).contains("there is no scenario `nope\u{fffd}`"), "{}", message(&odd));
    let none = stderr(&closecall(["tool", "render", "-n", "0", "--out", path]));
    assert!(none.contains("`0` is too small: a whole number of 1 or more is needed"), "{none}");
}

#[test]
fn the_option_for_onnx_runtime_belongs_to_the_commands_that_may_run_the_network() {
    let has_option = |words: &[&str]| stdout(&closecall(words.iter().chain(&["--help"])), 0).contains("--onnxruntime");
    for words in [&["run"][..], &["campaign"], &["replay"], &["explain"], &["study", "sensors"], &["tool", "merge"]] {
        assert!(has_option(words), "{words:?}");
    }
    for words in [&["list"][..], &["new"], &["init"], &["baseline", "save"], &["traffic", "fit"], &["tool", "schema"]] {
        assert!(!has_option(words), "{words:?}");
    }
    let words = "compare, traffic record, traffic reenact, study frontier, tool export";
    for words in words.split(", ").map(|words| words.split(' ').collect::<Vec<_>>()) {
        assert!(has_option(&words), "{words:?}");
    }
    let words = "traffic calibrate, traffic paper, traffic sample, traffic robustness, study map, study perceive, \
                 study exposure, study fidelity, tool import, tool render";
    for words in words.split(", ").map(|words| words.split(' ').collect::<Vec<_>>()) {
        assert!(!has_option(&words), "{words:?}");
    }
    for words in [&["list"][..], &["traffic", "calibrate", "pairs.csv"], &["traffic", "paper", "a.csv", "-o", "out"]] {
        let refused = closecall(words.iter().chain(&["--onnxruntime", "libonnxruntime.so"]));
        assert!(code(&refused) == 2 && message(&refused).contains("--onnxruntime"), "{}", message(&refused));
    }
    for (words, expected) in [
        (&["check", "paper-figure"][..], "--onnxruntime needs --watch"),
        (&["compare", "before", "after"], "--onnxruntime needs --search"),
    ] {
        let refused = closecall(words.iter().chain(&["--onnxruntime", "libonnxruntime.so"]));
        assert!(code(&refused) == 2 && message(&refused).contains(expected), "{}", message(&refused));
    }
    // The variable is for all commands.
    let checked = program().args(["check", "paper-figure"]).env("ORT_DYLIB_PATH", "libonnxruntime.so").output();
    stdout(&checked.unwrap(), 0);
}

#[test]
fn the_place_of_an_output_has_the_same_option_in_every_command() {
    for (words, command) in commands() {
        for option in command.get_opts().filter(|option| ["out", "output"].contains(&option.get_id().as_str())) {
            assert_eq!((option.get_short(), option.get_long()), (Some('o'), Some("out")), "{words}");
        }
    }
}

#[test]
fn set_does_not_stand_under_the_gates_in_the_help() {
    let help = stdout(&closecall(["campaign", "--help"]), 0);
    let is_heading = |line: &&str| line.ends_with(':') && !line.starts_with(' ');
    let under = |heading: &str| {
        let lines = help.lines().skip_while(|line| line.strip_suffix(':') != Some(heading)).skip(1);
        lines.take_while(|line| !is_heading(line)).collect::<Vec<_>>().join("\n")
    };
    for (heading, option) in
        [("Scenario", "--set <KEY=VALUE>"), ("Output", "--format <FORMAT>"), ("Gates", "--max-collisions <K>")]
    {
        for other in ["Scenario", "Output", "Gates"] {
            assert_eq!(under(other).contains(option), other == heading, "{option} under {other}");
        }
    }
}

/// Returns the commands of the program that its help shows, with the groups, each with its words.
fn commands() -> Vec<(String, Command)> {
    let mut all = vec![("closecall".to_owned(), closecall::cli::command())];
    let mut next = 0;
    while let Some((words, command)) = all.get(next).cloned() {
        let shown = command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set());
        all.extend(shown.map(|subcommand| (format!("{words} {}", subcommand.get_name()), subcommand.clone())));
        next += 1;
    }
    all
}

/// Returns the names of the commands of the groups, each with its group.
fn grouped() -> Vec<(String, String)> {
    let of_group = |group: &str| {
        let program = closecall::cli::command();
        let command = program.find_subcommand(group).unwrap();
        command
            .get_subcommands()
            .map(|subcommand| (subcommand.get_name().to_owned(), group.to_owned()))
            .collect::<Vec<_>>()
    };
    ["traffic", "study", "tool"].into_iter().flat_map(of_group).collect()
}

#[test]
fn the_program_has_at_most_sixteen_commands_and_groups() {
    let count = closecall::cli::command().get_subcommands().filter(|subcommand| !subcommand.is_hide_set()).count();
    assert!(count <= 16, "{count}");
    assert!(grouped().len() >= 25, "{:?}", grouped());
}

#[test]
fn each_option_stands_under_a_heading_that_names_its_purpose() {
    for (words, command) in commands() {
        for option in command.get_opts() {
            assert!(option.get_help_heading().is_some(), "{words}: {option}");
        }
    }
}

#[test]
fn the_help_of_each_command_ends_with_three_examples_that_parse() {
    for (words, command) in commands() {
        let end = command.get_after_help().unwrap_or_else(|| panic!("{words}: no examples")).to_string();
        let (_, examples) = end.split_once("Examples:\n").unwrap_or_else(|| panic!("{words}: no examples"));
        let examples: Vec<&str> = examples.lines().collect();
        assert_eq!(examples.len(), 3, "{words}");
        for example in examples {
            assert!(example.starts_with(&format!("  {words}")), "{words}: {example}");
            // Longer lines are wrapped, and are no commands.
            assert!(example.len() <= 100, "{example}");
            let line = shlex::split(example).unwrap();
            let arguments = line.into_iter().take_while(|word| ![">", "|"].contains(&word.as_str()));
            let parsed = closecall::cli::command().try_get_matches_from(arguments);
            assert!(parsed.is_ok(), "{example}: {}", parsed.unwrap_err());
        }
    }
}

/// A sample of the default campaign of the headline that fails with the system under test: the
/// examples of the help name it.
const FAILING: &str = "closecall-results 34";

#[test]
fn the_examples_of_the_help_work_on_the_results_of_a_first_campaign() {
    let folder = folder();
    let words = ["campaign", "low-thw-overtake", "-n", "36", "--paired", "--no-gate", "--record", "failures:0"];
    stdout(&run_in(folder.path(), &words), 0);
    let mut run = Vec::new();
    for (_, command) in commands() {
        let help = command.get_after_help().unwrap().to_string();
        for example in help.lines().filter(|line| line.trim_start().starts_with("closecall ")) {
            let names_sample = example
                .split_once("closecall-results ")
                .is_some_and(|(_, rest)| rest.split(' ').next().is_some_and(|word| word.parse::<u64>().is_ok()));
            assert_eq!(names_sample, example.contains(FAILING), "another sample may not fail: {example}");
            if names_sample {
                let words = shlex::split(example).unwrap();
                let output = program().current_dir(folder.path()).args(&words[1..]).output().unwrap();
                assert_eq!(code(&output), 0, "{example}: {}", stderr(&output));
                run.push(words[1].clone());
            }
        }
    }
    run.sort();
    run.dedup();
    assert_eq!(run, ["explain", "minimize", "plot", "replay", "tool"]);
}

#[test]
fn no_example_of_a_command_writes_what_another_one_has_written() {
    // A folder of results is not overwritten by another campaign, and a scenario not by a new one.
    for name in ["closecall traffic chain", "closecall tool merge", "closecall new"] {
        let (_, command) = commands().into_iter().find(|(words, _)| words == name).unwrap();
        let help = command.get_after_help().unwrap().to_string();
        let written: Vec<String> = help
            .lines()
            .filter(|line| line.trim_start().starts_with("closecall "))
            .map(|example| {
                let words = shlex::split(example).unwrap();
                let option = words.iter().position(|word| ["-o", "--out"].contains(&word.as_str()));
                option.map_or_else(|| format!("{}.toml", words[2]), |at| words[at + 1].clone())
            })
            .collect();
        let distinct: std::collections::BTreeSet<&String> = written.iter().collect();
        assert_eq!((written.len(), distinct.len()), (3, 3), "{name}: {written:?}");
    }
}

#[test]
fn the_name_of_a_grouped_command_alone_is_answered_with_its_whole_name() {
    let whole = grouped().into_iter().map(|(name, group)| (format!("{group} {name}"), name));
    for (whole, name) in whole.chain([("check --watch".to_owned(), "watch".to_owned())]) {
        let output = closecall([name.as_str(), "file.csv", "--format", "json"]);
        assert_eq!(code(&output), 2, "{name}");
        let said = stderr(&output);
        assert!(said.starts_with(&format!("error: the command is `closecall {whole}`\n")), "{said}");
    }
    let elsewhere = stderr(&closecall(["traffic", "merge", "a", "b"]));
    assert!(elsewhere.contains("`closecall tool merge`"), "{elsewhere}");
    let unknown = stderr(&closecall(["lanechanges"]));
    assert!(unknown.contains("unrecognized subcommand 'lanechanges'"), "{unknown}");
}

/// Returns true if a line names one of these commands behind the name of the program. The import of
/// Python names none.
fn names_one_of(line: &str, names: &[String]) -> bool {
    let line = line.replace("from closecall import", "");
    let word = |rest: &str| rest.split(|c: char| !c.is_alphanumeric() && c != '-').next().map(str::to_owned);
    line.split("closecall ").skip(1).filter_map(word).any(|word| names.contains(&word))
}

#[test]
fn no_text_names_a_grouped_command_without_its_group() {
    let names: Vec<String> = grouped().into_iter().map(|(name, _)| name).collect();
    for name in &names {
        assert!(names_one_of(&format!("See `closecall {name}`."), &names), "{name}");
        assert!(!names_one_of(&format!("See `closecall group {name}`."), &names), "{name}");
    }
    let mut folders = vec![Path::new(ROOT).to_owned()];
    let mut wrong = Vec::new();
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.file_name().unwrap().to_str().unwrap();
            if path.is_dir() {
                let is_source = name != "target" && (!name.starts_with('.') || [".github", ".ci"].contains(&name));
                folders.extend(is_source.then_some(path));
                continue;
            }
            // The change log names the commands as they were.
            let is_text = ["md", "rs", "py", "toml", "yml", "yaml"]
                .iter()
                .any(|&end| path.extension().is_some_and(|extension| extension == end));
            if !is_text || name == "CHANGELOG.md" {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap_or_default();
            let named = text.lines().filter(|line| names_one_of(line, &names));
            wrong.extend(named.map(|line| format!("{}: {line}", path.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_baseline_names_what_newly_fails() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for controller in ["acc", "mis"] {
        let out = at(controller);
        let args =
            ["campaign", "low-thw-overtake", "-n", "30", "--seed", "1", "--controller", controller, "--out", &out];
        assert!([0, 1, 4].contains(&code(&closecall(args))));
    }
    let file = at("baseline.json");
    stdout(&closecall(["baseline", "save", &at("mis"), &file]), 0);
    assert!(std::fs::metadata(&file).unwrap().len() < 10_000);
    assert!(stdout(&closecall(["baseline", "compare", &at("mis"), &file]), 0).ends_with("NO REGRESSION\n"));
    let comparison = json(&closecall(["baseline", "compare", &at("acc"), &file, "--format", "json"]), 1);
    assert!(!comparison["scenarios"][0]["newly_failing"].as_array().unwrap().is_empty());
    // A file that is not a baseline is not replaced.
    let other_file = at("own.json");
    std::fs::write(&other_file, "{}").unwrap();
    assert_eq!(code(&closecall(["baseline", "save", &at("mis"), &other_file])), 3);
    assert_eq!(std::fs::read_to_string(&other_file).unwrap(), "{}");
}

#[test]
fn a_watched_check_runs_a_few_samples_of_the_file() {
    let folder = folder();
    stdout(&run_in(folder.path(), &["new", "mine"]), 0);
    let text = stdout(&run_in(folder.path(), &["check", "mine", "--watch", "-n", "2", "--rounds", "1"]), 0);
    assert!(text.starts_with("mine.toml: valid, mine with 5 parameters\n  sample 0  mis"), "{text}");
    assert_eq!(text.lines().count(), 3);
    for refused in [
        &["check", "absent", "--watch", "--rounds", "1"][..],
        &["check", "mine", "mine", "--watch", "--rounds", "1"],
        &["check", "mine", "--watch", "--format", "json"],
        // No round would check nothing.
        &["check", "mine", "--watch", "--rounds", "0"],
        // A check without --watch runs no sample.
        &["check", "mine", "-n", "2"],
        &["check", "mine", "--controller", "acc"],
    ] {
        assert_eq!(code(&run_in(folder.path(), refused)), 2, "{refused:?}");
    }
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(stdout(&closecall(["tool", "completions", shell]), 0).contains("lane-changes"), "{shell}");
    }
    assert!(stdout(&closecall(["tool", "man"]), 0).starts_with(".ie \\n(.g"));
    let folder = folder();
    let pages = folder.path().join("man");
    stdout(&closecall(["tool", "man", "--out", pages.to_str().unwrap()]), 0);
    assert!(std::fs::read_to_string(pages.join("closecall-campaign.1")).unwrap().contains("max\\-collisions"));
}

#[test]
fn the_schema_states_the_ranges_of_the_check() {
    let schema = json(&closecall(["tool", "schema"]), 0);
    let duration = &schema["properties"]["duration-s"];
    assert_eq!((&duration["minimum"], &duration["maximum"]), (&0.1.into(), &3600.0.into()));
    assert_eq!(schema["additionalProperties"], false);
}
