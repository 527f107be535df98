//! Nothing is taken on trust: a journal is checked against its plan by every reader, a part of the
//! samples says nothing about all, and a report that cannot be written does not cost the verdict.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::native_controllers::{compile, lib, with_fault};
use crate::support::{closecall, code, folder, library, message, program, records, stderr, stdout};

const CAMPAIGN: [&str; 8] =
    ["campaign", "low-thw-overtake", "-n", "8", "--no-gate", "--sensors", "ground-truth", "--record=failures:0"];

/// Runs a campaign into a folder.
fn campaign(out: &Path, more: &[&str]) -> Output {
    program().args(CAMPAIGN).args(["--out", out.to_str().unwrap()]).args(more).output().unwrap()
}

fn lines(out: &Path) -> Vec<String> {
    fs::read_to_string(out.join("journal.jsonl")).unwrap().lines().map(str::to_owned).collect()
}

fn write_lines(out: &Path, lines: &[String]) {
    fs::write(out.join("journal.jsonl"), lines.join("\n") + "\n").unwrap();
}

/// Returns a line of a journal with its record changed, and with the checksum of the changed
/// record.
fn changed(line: &str, change: impl FnOnce(&mut Value)) -> String {
    let mut record: Value = serde_json::from_str(&line[17..]).unwrap();
    change(&mut record);
    let text = record.to_string();
    format!("{} {text}", &blake3::hash(text.as_bytes()).to_hex()[..16])
}

/// Asserts that each command refuses the journal, and says why.
fn assert_each_refuses(commands: &[&[&str]], expected: &str) {
    for command in commands {
        let output = closecall(*command);
        assert_eq!(code(&output), 3, "{command:?}: {}", stderr(&output));
        assert!(message(&output).contains(expected), "{command:?}: {}", stderr(&output));
    }
}

/// Asserts that every command that reads the journal refuses it, and says why.
fn assert_refused(folder: &Path, out: &Path, sound: &Path, expected: &str) {
    let (out, sound) = (out.to_str().unwrap(), sound.to_str().unwrap());
    let baseline = folder.join("refused.json");
    let commands: &[&[&str]] = &[
        &["baseline", "save", out, baseline.to_str().unwrap()],
        &["compare", sound, out],
        &["compare", out, sound],
        &["explain", out],
    ];
    assert_each_refuses(commands, expected);
    assert!(!baseline.exists());
}

#[test]
fn a_record_that_is_not_that_of_its_sample_is_refused_by_every_reader() {
    let folder = folder();
    let [out, sound] = ["out", "sound"].map(|name| folder.path().join(name));
    stdout(&campaign(&out, &[]), 0);
    stdout(&campaign(&sound, &[]), 0);
    let kept = lines(&out);
    let arms = |line: &str| serde_json::from_str::<Value>(&line[17..]).unwrap()["arms"].clone();
    let outcome = |record: &mut Value, key: &str, value: Value| record["arms"][0]["result"]["Ok"][key] = value;
    let wrong: [(String, &str); 6] = [
        // The results of two samples are swapped: each line is whole, and has its checksum.
        (changed(&kept[3], |record| record["arms"] = arms(&kept[4])), "sample 3 has the outcome of sample 4"),
        (
            changed(&kept[3], |record| outcome(record, "seed", 7.into())),
            "sample 3 has an outcome of the seed 7, and the campaign has the seed 0",
        ),
        (
            changed(&kept[3], |record| {
                outcome(record, "seed", 7.into());
                outcome(record, "sample", 4.into());
            }),
            "sample 3 has an outcome of sample 4 of the seed 7, and the campaign has the seed 0",
        ),
        (changed(&kept[3], |record| outcome(record, "scenario", "another".into())), "has an outcome of `another`"),
        (changed(&kept[3], |record| outcome(record, "controller", "acc".into())), "an outcome of the controller `acc`"),
        (
            changed(&kept[3], |record| record["arms"][0]["result"]["Ok"]["parameters"]["brake-mps2"] = 1.5.into()),
            "sample 3 has other values than the seed 0 draws",
        ),
    ];
    for (line, expected) in wrong {
        let mut swapped = kept.clone();
        swapped[3] = line;
        write_lines(&out, &swapped);
        let output = campaign(&out, &["--resume"]);
        assert_eq!(code(&output), 3, "{expected}: {}", stderr(&output));
        assert!(message(&output).contains(expected), "{expected}: {}", stderr(&output));
        assert!(lines(&out) == swapped, "the journal is unchanged");
        assert_refused(folder.path(), &out, &sound, expected);
        // What is next to it is wrong, too, and so is what stands before it.
        let [dir, figure, case] = [&out, &folder.path().join("a.svg"), &folder.path().join("case")];
        let [dir, figure, case] = [dir, figure, case].map(|path| path.to_str().unwrap());
        let commands: &[&[&str]] = &[
            &["replay", dir, "5"],
            &["replay", dir, "1"],
            &["minimize", dir, "1"],
            &["explain", dir, "1"],
            &["plot", dir, "1", "-o", figure],
            &["tool", "export", dir, "1", "-o", case],
        ];
        assert_each_refuses(commands, expected);
        assert!(!Path::new(figure).exists() && !Path::new(case).exists());
    }
}

#[test]
fn a_part_of_the_samples_is_no_baseline_and_no_proof() {
    let folder = folder();
    let [out, sound] = ["out", "sound"].map(|name| folder.path().join(name));
    // A scenario in which no sample fails: all of them show that, and a part does not.
    for out in [&out, &sound] {
        let words = CAMPAIGN.map(|word| if word == "low-thw-overtake" { "overtake-without-brake" } else { word });
        stdout(&program().args(words).args(["--out", out.to_str().unwrap()]).output().unwrap(), 0);
    }
    let kept = lines(&out);
    write_lines(&out, &kept[..5]);
    assert_refused(folder.path(), &out, &sound, "it has 5 of the 8 samples of its campaign");
    // A replay without a result to compare with does not say that it agrees.
    let replay = closecall(["replay", out.to_str().unwrap(), "6"]);
    assert_eq!(code(&replay), 4, "{}", stderr(&replay));
    assert!(message(&replay).contains("not compared: the campaign's journal has no result of 1 of the 1 runs"));
    fs::remove_file(out.join("journal.jsonl")).unwrap();
    assert_eq!(code(&closecall(["replay", out.to_str().unwrap(), "2"])), 4);
    assert_eq!(code(&closecall(["replay", sound.to_str().unwrap(), "2"])), 0);
}

#[test]
fn a_line_that_is_there_twice_is_refused_and_does_not_block_a_resumption() {
    let folder = folder();
    let [out, sound] = ["out", "sound"].map(|name| folder.path().join(name));
    stdout(&campaign(&out, &[]), 0);
    stdout(&campaign(&sound, &[]), 0);
    let kept = lines(&out);
    for at in [1, 4, 8] {
        let mut doubled = kept.clone();
        doubled.insert(at, kept[at - 1].clone());
        doubled.insert(at, kept[at - 1].clone());
        write_lines(&out, &doubled);
        assert_refused(folder.path(), &out, &sound, "is there twice");
        let output = campaign(&out, &["--resume"]);
        stdout(&output, 0);
        assert!(message(&output).contains("2 lines of the journal that repeated another line were removed"));
        assert!(lines(&out) == kept, "{at}");
    }
}

#[test]
fn a_copy_of_a_line_anywhere_is_removed_and_another_line_in_a_wrong_place_is_not() {
    let folder = folder();
    let out = folder.path().join("out");
    stdout(&campaign(&out, &[]), 0);
    let kept = lines(&out);
    for (line, at) in [(2, 8), (0, 5), (6, 1)] {
        let mut doubled = kept.clone();
        doubled.insert(at, kept[line].clone());
        write_lines(&out, &doubled);
        let copy = at + 1;
        let listed = problems(&out, 3);
        assert!(listed.contains(&format!("journal.jsonl:{copy}: it repeats another line")), "{listed}");
        assert!(listed.contains("repair: resume the campaign: "), "{listed}");
        stdout(&campaign(&out, &["--resume"]), 0);
        assert!(lines(&out) == kept, "{line} at {at}");
        assert!(problems(&out, 0).contains("sound"));
    }
    // The records of two samples in each other's place are no copies.
    let mut exchanged = kept.clone();
    exchanged.swap(2, 5);
    write_lines(&out, &exchanged);
    let output = campaign(&out, &["--resume"]);
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(lines(&out) == exchanged);
}

#[cfg(unix)]
#[test]
fn a_pipe_in_place_of_a_file_is_not_sound_and_its_removal_is_the_repair() {
    let folder = folder();
    let out = folder.path().join("out");
    for name in ["lock", "wall-times.jsonl", "journal.jsonl"] {
        stdout(&campaign(&out, &[]), 0);
        let path = out.join(name);
        fs::remove_file(&path).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        let listed = problems(&out, 3);
        assert!(listed.contains(&format!("{name}: it is a named pipe, a socket or a device, not a file")), "{listed}");
        assert!(listed.contains("repair: remove it, then resume the campaign: "), "{listed}");
        assert_eq!(code(&campaign(&out, &["--resume"])), 6);
        fs::remove_file(&path).unwrap();
        stdout(&campaign(&out, &["--resume"]), 0);
        assert!(problems(&out, 0).contains("sound"), "{name}");
        fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn the_repair_of_a_copied_folder_names_the_copy_and_the_failures_of_a_part_are_not_explained() {
    let folder = folder();
    let [out, copy] = ["out", "copy"].map(|name| folder.path().join(name));
    stdout(&campaign(&out, &[]), 0);
    fs::create_dir(&copy).unwrap();
    for entry in fs::read_dir(&out).unwrap().map(Result::unwrap).filter(|entry| entry.path().is_file()) {
        fs::copy(entry.path(), copy.join(entry.file_name())).unwrap();
    }
    let kept = lines(&out);
    write_lines(&copy, &kept[..6]);
    let listed = problems(&copy, 3);
    assert!(listed.contains(&format!("--out {} --resume", copy.display())), "{listed}");
    assert!(!listed.contains(&format!("{} ", out.display())), "{listed}");
    let output = closecall(["explain", copy.to_str().unwrap()]);
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(message(&output).contains("it has 6 of the 8 samples"), "{}", stderr(&output));
    let figure = folder.path().join("figure.svg");
    for (sample, is_compared) in [("5", true), ("6", false)] {
        let output = closecall(["plot", copy.to_str().unwrap(), sample, "-o", figure.to_str().unwrap()]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert_eq!(!message(&output).contains("not compared: the campaign's journal has no result of"), is_compared);
    }
}

#[test]
fn a_repair_works_in_another_folder_than_the_campaign_ran_in() {
    let folder = folder();
    let [there, elsewhere] = ["one folder", "another"].map(|name| folder.path().join(name));
    for path in [&there, &elsewhere] {
        fs::create_dir(path).unwrap();
    }
    fs::copy(library("low-thw-overtake"), there.join("own scenario.toml")).unwrap();
    let words = "campaign|own scenario.toml|-n|4|--sensors|ground-truth|--no-gate|--record=failures:0|--out|o ut";
    stdout(&program().args(words.split('|')).current_dir(&there).output().unwrap(), 0);
    let out = there.join("o ut");
    let whole = lines(&out);
    write_lines(&out, &whole[..2]);
    let repair = |from: &Path, path: &str| {
        let text = stdout(&program().args(["check", path]).current_dir(from).output().unwrap(), 3);
        text.lines().find_map(|line| line.split_once("repair: resume the campaign: ")).unwrap().1.to_owned()
    };
    assert!(repair(&there, "o ut").contains(" --out 'o ut' "), "the paths are relative to the folder of the user");
    let command = repair(&elsewhere, "../one folder/o ut");
    assert!(command.starts_with("cd '") && command.contains(" 'own scenario.toml' "), "{command}");
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", &command]).current_dir(&elsewhere).env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    let shell = shell.output().unwrap();
    assert_eq!(code(&shell), 0, "{command}: {}", stderr(&shell));
    assert!(lines(&out) == whole);
    assert!(fs::read_dir(&elsewhere).unwrap().next().is_none(), "the repair writes nothing there");
}

#[test]
fn a_summary_that_cannot_be_written_does_not_cost_the_verdict() {
    let folder = folder();
    let run = |out: &str, more: &[&str]| {
        program()
            .args(["campaign", "overtake-without-brake", "-n", "80", "--sensors", "ground-truth"])
            .args(["--record", "failures:0", "--out", folder.path().join(out).to_str().unwrap()])
            .args(more)
            .env("GITHUB_STEP_SUMMARY", folder.path().join("no/such/folder"))
            .output()
            .unwrap()
    };
    let cases = [
        ("pass", &["--max-collisions", "0"][..], 0, "PASS"),
        ("fail", &["--gate", "count(engaged) <= 0", "--gate", "min(min_thw_front_s) >= 100"], 1, "FAIL"),
        ("strict", &["--max-collisions", "0", "--strict-artifacts"], 6, "PASS"),
    ];
    for (out, more, expected, verdict) in cases {
        let output = run(out, more);
        assert!(stdout(&output, expected).contains(verdict), "{}", stderr(&output));
        let warning = "warning: the summary for the CI server (GITHUB_STEP_SUMMARY) is missing: ";
        assert!(message(&output).contains(warning), "{}", stderr(&output));
        for file in ["junit.xml", "outcomes.parquet", "report.html", "summary.md", "samples.xml"] {
            assert!(folder.path().join(out).join(file).is_file(), "{out}: {file}");
        }
    }
    let output = run("unused", &["--max-collisions", "0", "--no-out"]);
    assert_eq!(code(&output), 2);
}

#[test]
fn a_controller_that_fails_only_while_it_is_recorded_does_not_cost_the_verdict() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    for (name, more, expected) in [("out", &[][..], 0), ("strict", &["--strict-artifacts"][..], 5)] {
        let out = folder.path().join(name);
        let mut command = program();
        command
            .args(["campaign", "slow-approach", "-n", "80", "--sensors", "object", "--max-collisions", "4"])
            .args(["--record", "random:2", "--controller", &library, "--out", out.to_str().unwrap()])
            .args(more);
        let output = with_fault(&mut command, Some("recorded"));
        assert!(stdout(&output, expected).contains("PASS"), "{}", stderr(&output));
        let warnings = message(&output).matches("warning: the recording of sample ").count();
        assert_eq!(warnings, 2, "{}", stderr(&output));
        for file in ["junit.xml", "outcomes.parquet", "report.html", "summary.md", "samples.xml"] {
            assert!(out.join(file).is_file(), "{file}");
        }
    }
}

#[test]
fn a_recorded_run_that_is_not_the_run_of_the_campaign_makes_it_invalid() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let out = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |name: &str, more: &[&str]| {
        let mut command = program();
        command
            .args(["campaign", "slow-approach", "-n", "80", "--sensors", "object", "--max-collisions", "4"])
            .args(["--controller", &library, "--out", &out(name)])
            .args(more);
        with_fault(&mut command, Some("recorded-otherwise"))
    };
    let is_told = |output: &std::process::Output, name: &str| {
        assert!(stdout(output, 7).contains("PASS"), "{}", stderr(output));
        let told = message(output).matches("INVALID: sample ").count();
        assert!(told == 2 && message(output).contains("differs from the campaign's journal"), "{}", stderr(output));
        for file in ["junit.xml", "report.html", "summary.md"] {
            let text = fs::read_to_string(folder.path().join(name).join(file)).unwrap();
            assert!(text.contains("INVALID") && text.contains("differs from the campaign"), "{file}: {text}");
        }
    };
    is_told(&run("whole", &["--record", "random:2"]), "whole");
    for part in ["1/2", "2/2"] {
        // The samples of a part do not decide every requirement.
        stdout(&run(&part.replace('/', "-"), &["--record", "failures:0", "--partition", part]), 4);
    }
    let mut command = program();
    command.args(["tool", "merge", &out("1-2"), &out("2-2"), "--out", &out("merged"), "--record", "random:2"]);
    is_told(&with_fault(command.args(["--max-collisions", "4"]), Some("recorded-otherwise")), "merged");
}

#[test]
fn a_collision_that_happens_otherwise_when_it_runs_again_is_neither_explained_nor_minimized() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let [out, case] = ["out", "case.toml"].map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let words = "campaign low-thw-overtake -n 5 --seed 1 --sensors ground-truth --no-gate --record failures:0 --out";
    let campaign = closecall(words.split(' ').chain([out.as_str(), "--controller", &library]));
    stdout(&campaign, 0);
    for words in [&["explain", &out, "4"][..], &["explain", &out], &["minimize", &out, "4", "--out", &case]] {
        let output = with_fault(program().args(words), Some("slower"));
        assert_eq!(code(&output), 7, "{words:?}: {}", stderr(&output));
        assert!(
            message(&output).contains("sample 4 with `lib:faulty` differs from the campaign's journal"),
            "{words:?}"
        );
    }
    assert!(!folder.path().join("case.toml").exists() && !folder.path().join("out/causes.json").exists());
    stdout(&closecall(["explain", &out, "4"]), 0);
}

#[test]
fn a_mirrored_run_that_takes_too_long_is_not_checked_and_no_defect_of_the_simulator() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let out = folder.path().join("out");
    let run = |fault: Option<&str>, more: &[&str]| {
        let mut command = program();
        command
            .args(["campaign", "low-thw-overtake", "-n", "4", "--sensors", "object", "--no-gate", "--jobs", "1"])
            .args(["--controller-timeout-ms", "300", "--record", "failures:0", "--controller", &library])
            .args(["--out", out.to_str().unwrap()])
            .args(more);
        with_fault(&mut command, fault)
    };
    let text = stdout(&run(Some("mirror"), &[]), 0);
    assert!(text.contains("not checked: 2 runs") && !text.contains("mirror image"), "{text}");
    for record in &records(&out)[..2] {
        let checks = record.arms[0].checks.as_ref().unwrap();
        assert!(checks.broken.is_empty() && checks.not_checked.as_ref().unwrap().contains("no answer within 300 ms"));
    }
    // A resumption keeps that, and runs them again on request: to the same outcomes.
    assert!(stdout(&run(None, &["--resume"]), 0).contains("not checked: 2 runs"));
    let kept = fs::read(out.join("journal.jsonl")).unwrap();
    let text = stdout(&run(Some("slower"), &["--resume", "--retry-errors"]), 7);
    assert!(text.contains("the same run gave another outcome when repeated: 2 of 2 checked"), "{text}");
    fs::write(out.join("journal.jsonl"), kept).unwrap();
    let text = stdout(&run(None, &["--resume", "--retry-errors"]), 0);
    assert!(text.contains("checked: 2 runs") && !text.contains("not checked: 2"), "{text}");
    // Each call is in time, and the checks as a whole are not: the sample keeps its outcome.
    fs::remove_dir_all(&out).unwrap();
    let text = stdout(&run(Some("slow-mirror"), &["--sample-timeout-s", "3"]), 0);
    assert!(text.contains("not checked: 2 runs"), "{text}");
    for record in &records(&out)[..2] {
        let not_checked = record.arms[0].checks.as_ref().unwrap().not_checked.as_ref().unwrap();
        assert!(not_checked.contains("no outcome within 3 s"), "{not_checked}");
    }
}

#[test]
fn the_table_of_outcomes_does_not_depend_on_the_working_folder() {
    let folder = folder();
    let tables = ["one", "other"].map(|name| {
        let working_folder: PathBuf = folder.path().join(name);
        fs::create_dir(&working_folder).unwrap();
        let output = program().current_dir(&working_folder).args(CAMPAIGN).args(["--out", "out"]).output().unwrap();
        stdout(&output, 0);
        fs::read(working_folder.join("out/outcomes.parquet")).unwrap()
    });
    assert!(tables[0] == tables[1]);
}

/// Returns the problems that `closecall check` finds in a folder.
fn problems(out: &Path, expected: i32) -> String {
    stdout(&closecall(["check", out.to_str().unwrap()]), expected)
}

#[test]
fn a_check_of_a_folder_names_each_problem_and_its_repair() {
    let folder = folder();
    let out = folder.path().join("out");
    stdout(&campaign(&out, &[]), 0);
    assert!(problems(&out, 0).ends_with("out: sound, 8 samples\n"));
    let kept = lines(&out);
    let resumed = || {
        let listed = problems(&out, 3);
        let command = listed.lines().find_map(|line| line.split_once("repair: resume the campaign: ")).unwrap().1;
        assert!(command.contains(out.to_str().unwrap()) && command.ends_with("--resume"), "{listed}");
        stdout(&campaign(&out, &["--resume"]), 0);
        assert!(lines(&out) == kept);
        assert!(problems(&out, 0).contains("sound"));
        listed
    };
    write_lines(&out, &kept[..6]);
    assert!(resumed().contains("journal.jsonl: it has 6 of the 8 samples"));
    write_lines(&out, &[&kept[..2], &kept[1..]].concat());
    assert!(resumed().contains("journal.jsonl:3: it repeats another line"));
    let mut damaged = kept.clone();
    damaged[4] = damaged[4].replace("\"seed\"", "\"sead\"");
    write_lines(&out, &damaged);
    assert!(resumed().contains("journal.jsonl:5: the line does not agree with its checksum"));
    fs::remove_file(out.join("summary.md")).unwrap();
    assert!(resumed().contains("summary.md: it is missing"));
    // A table of other samples.
    let other = folder.path().join("other");
    stdout(&campaign(&other, &["--seed", "1"]), 0);
    fs::copy(other.join("outcomes.parquet"), out.join("outcomes.parquet")).unwrap();
    assert!(problems(&out, 3).contains("outcomes.parquet: it is not the table of this journal"));
    stdout(&campaign(&out, &["--resume"]), 0);
    // What --resume cannot repair.
    let mut exchanged = kept.clone();
    exchanged.swap(2, 5);
    write_lines(&out, &exchanged);
    let listed = problems(&out, 3);
    assert!(listed.contains("journal.jsonl:3: sample 5 of `low-thw-overtake` is not the next sample"), "{listed}");
    assert!(listed.contains("run the campaign into a new folder"), "{listed}");
    fs::write(out.join("manifest.json"), "{}").unwrap();
    assert!(problems(&out, 3).contains("there is no `manifest_version`"));
}
