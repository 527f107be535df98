//! A controller that was edited between two parts of a campaign is noticed, and the changed file is
//! named.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::support::{closecall, code, folder, library, message, program, stderr, stdout};

/// A controller that never brakes, and states a version.
const STEADY: &str = r#"#!/bin/sh
echo '{"type":"hello","protocol":1,"name":"steady","version":"1"}'
read -r line
while read -r line; do echo '{"acceleration_mps2":0.0,"state":"following"}'; done
"#;

/// The command that runs the campaign, in the folder of the controller.
fn campaign(folder: &Path, more: &[&str]) -> Output {
    let scenario = library("low-thw-overtake");
    let fixed =
        ["campaign", scenario.to_str().unwrap(), "-n", "6", "--no-gate", "--out", "out", "--record", "failures:0"];
    let controller = ["--controller", "exec:sh steady.sh", "--controller-timeout-ms", "60000"];
    program().current_dir(folder).args(fixed).args(controller).args(more).output().unwrap()
}

#[test]
fn an_edited_controller_is_refused_on_resuming_and_named_by_replay() {
    let folder = folder();
    let script = folder.path().join("steady.sh");
    fs::write(&script, STEADY).unwrap();
    let first = campaign(folder.path(), &[]);
    assert!(folder.path().join("out/journal.jsonl").exists(), "{}", stderr(&first));
    assert_eq!(code(&campaign(folder.path(), &["--resume"])), code(&first));

    fs::write(&script, STEADY.replace("0.0", "-2.0").replace("\"1\"", "\"2\"")).unwrap();
    let refused = campaign(folder.path(), &["--resume"]);
    assert_eq!(code(&refused), 2, "{}", stderr(&refused));
    for named in ["the controller's file steady.sh has changed", "states another version: `1` there, `2` here"] {
        assert!(message(&refused).contains(named), "{}", stderr(&refused));
    }
    let replayed = closecall(["replay", folder.path().join("out").to_str().unwrap(), "0"]);
    assert_eq!(code(&replayed), 7, "{}", stderr(&replayed));
    assert!(
        message(&replayed).contains("differs from the campaign's journal: the controller's file steady.sh has changed"),
        "{}",
        stderr(&replayed)
    );
    // What another run draws or writes is not taken for the campaign's.
    let out = folder.path().join("out");
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (words, place) in [(&["plot"][..], at("picture.svg")), (&["tool", "export"], at("case"))] {
        let output = closecall(words.iter().copied().chain([out.to_str().unwrap(), "0", "--out", &place]));
        assert_eq!(code(&output), 7, "{words:?}: {}", stderr(&output));
        assert!(message(&output).contains("differs from the campaign's journal"), "{words:?}: {}", stderr(&output));
    }
    fs::write(&script, STEADY).unwrap();
    stdout(&closecall(["plot", out.to_str().unwrap(), "0", "--out", &at("same.svg")]), 0);
}

#[test]
fn a_replay_runs_the_controller_in_the_folder_of_the_campaign() {
    let folder = folder();
    fs::write(folder.path().join("steady.sh"), STEADY).unwrap();
    campaign(folder.path(), &[]);
    // Relative to the campaign's folder and to this one, there is no `steady.sh`.
    let replayed = program().current_dir(folder.path().join("out")).args(["replay", ".", "1"]).output().unwrap();
    stdout(&replayed, 0);
}

#[test]
fn a_replay_does_not_say_that_nothing_has_changed_if_a_file_that_the_controller_imports_has() {
    let folder = folder();
    let imported = folder.path().join("pace.sh");
    let script = STEADY.replace("read -r line\nwhile", ". ./pace.sh\nread -r line\nwhile");
    let script = script.replace("'{\"acceleration_mps2\":0.0,", "'{\"acceleration_mps2\":'$pace',");
    assert!(script.contains("$pace") && script.contains("pace.sh"), "{script}");
    fs::write(folder.path().join("steady.sh"), script).unwrap();
    fs::write(&imported, "pace=0.0\n").unwrap();
    campaign(folder.path(), &[]);
    let replay = || closecall(["replay", folder.path().join("out").to_str().unwrap(), "0"]);
    stdout(&replay(), 0);

    fs::write(&imported, "pace=-2.0\n").unwrap();
    let replayed = replay();
    assert_eq!(code(&replayed), 7, "{}", stderr(&replayed));
    let told = message(&replayed);
    assert!(told.contains("nor have the files that the commands name"), "{told}");
    assert!(told.contains("files that a controller imports are not checked"), "{told}");
}

#[test]
fn a_campaign_whose_controller_changed_is_no_baseline_and_is_not_compared() {
    let folder = folder();
    let script = folder.path().join("own.sh");
    let run = |out: &str, expected: i32| {
        let words = "campaign overtake-without-brake -n 6 --sensors ground-truth --no-gate --record failures:0 --jobs 1 \
                     --set duration-s=2 --set expects=[] --no-validity-checks --controller-timeout-ms 60000 --out";
        let mut command = program();
        command.current_dir(folder.path()).args(words.split(' ')).args([out, "--controller", "exec:sh own.sh"]);
        stdout(&command.output().unwrap(), expected)
    };
    let closecall = |words: &str| program().current_dir(folder.path()).args(words.split(' ')).output().unwrap();
    fs::write(&script, STEADY).unwrap();
    run("good", 0);
    stdout(&closecall("baseline save good good.json"), 0);
    // Some run of the campaign changes it.
    let changes = "n=$(cat count 2>/dev/null || echo 0)\necho $((n + 1)) > count\n\
                   [ $n -ge 4 ] && [ ! -e edited ] && { : > edited; echo '# more' >> own.sh; }\n";
    fs::write(&script, format!("{changes}{STEADY}")).unwrap();
    run("bad", 7);
    for words in [
        "baseline save bad bad.json",
        "baseline compare bad good.json",
        "compare good bad",
        "compare bad good",
        "study exposure --campaign bad",
        "study fidelity good bad",
    ] {
        let output = closecall(words);
        assert_eq!(code(&output), 7, "{words}: {}", stderr(&output));
        assert!(message(&output).contains("the controller changed during the campaign"), "{}", stderr(&output));
    }
    assert!(!folder.path().join("bad.json").exists());
}

#[test]
fn a_controller_that_changes_while_a_rare_event_is_sampled_makes_the_estimate_invalid() {
    let folder = folder();
    let script = folder.path().join("own.sh");
    // Some run of the campaign changes it.
    let changes = "n=$(cat count 2>/dev/null || echo 0)\necho $((n + 1)) > count\n\
                   [ $n -ge 6 ] && [ ! -e edited ] && { : > edited; echo '# more' >> own.sh; }\n";
    fs::write(&script, format!("{changes}{STEADY}")).unwrap();
    let run = |more: &[&str]| {
        let words = "campaign low-thw-overtake --design importance --event collision --max-probability 0.9 -n 60 \
                     --sensors ground-truth --set duration-s=5 --controller-timeout-ms 60000 --out out --controller";
        let output =
            program().current_dir(folder.path()).args(words.split(' ')).arg("exec:sh own.sh").args(more).output();
        stdout(&output.unwrap(), 7)
    };
    let text = run(&[]);
    assert!(text.contains("INVALID: ") && text.contains("the controller changed during the campaign"), "{text}");
    // The file is as it was, and the runs are not.
    fs::write(&script, format!("{changes}{STEADY}")).unwrap();
    assert!(run(&["--resume"]).contains("the controller changed during the campaign"));
}
