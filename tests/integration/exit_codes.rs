//! The exit codes of the program.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{ROOT, closecall, code, folder, headline_with, json, library, message, program, stderr, stdout};

/// Writes a scenario file.
fn write(folder: &tempfile::TempDir, text: &str) -> PathBuf {
    let path = folder.path().join("scenario.toml");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_gate_fails_with_collisions_and_passes_without() {
    let headline = library("low-thw-overtake");
    let headline = headline.to_str().unwrap();
    let failed = closecall(["campaign", headline, "-n", "60", "--controller", "acc", "--max-collisions", "0"]);
    let text = stdout(&failed, 1);
    assert!(text.contains("FAIL"), "{text}");
    let harmless = library("overtake-without-brake");
    let passed = closecall(["campaign", harmless.to_str().unwrap(), "-n", "60", "--max-collisions", "0"]);
    assert!(stdout(&passed, 0).contains("PASS"));
}

#[test]
fn paired_gates_judge_the_arm_under_test() {
    let headline = library("low-thw-overtake-at-cut-out");
    let fixed = ["campaign", headline.to_str().unwrap(), "-n", "200", "--paired", "--sensors", "object"];
    let args = [&fixed[..], &["--format", "json", "--max-collisions"]].concat();
    let report = json(&closecall(args.iter().copied().chain(["199"])), 0);
    let collisions = |arm: &str| report["controllers"][arm]["collisions"].as_u64().unwrap();
    assert!(collisions("acc") > collisions("mis"));
    // The gate allows the collisions of the arm under test. The baseline has more, which does not
    // matter.
    let allowed = collisions("mis").to_string();
    stdout(&closecall(args.iter().copied().chain([allowed.as_str()])), 0);
}

#[test]
fn a_broken_scenario_names_file_line_and_key() {
    let folder = folder();
    let text = headline_with("friction = 0.9", "friction = -0.9");
    let line = text.lines().position(|line| line.contains("friction = -0.9")).unwrap() + 1;
    let path = write(&folder, &text);
    let output = closecall(["campaign", path.to_str().unwrap(), "-n", "10"]);
    assert_eq!(code(&output), 3);
    let message = message(&output);
    assert!(message.contains(&format!("scenario.toml:{line}")), "{message}");
    assert!(message.contains("environment.friction"), "{message}");
    assert!(message.contains("-0.9") && message.contains("0.1 to 1.2"), "{message}");
    assert!(output.stdout.is_empty());
}

#[cfg(unix)]
#[test]
fn an_argument_that_is_not_utf_8_names_a_file_like_any_other() {
    use std::ffi::OsString;
    use std::os::unix::ffi::OsStringExt;

    let folder = folder();
    let none = folder.path().join(OsString::from_vec(b"none\xff.toml".to_vec()));
    let output = closecall(["check".as_ref(), none.as_os_str()]);
    assert_eq!(code(&output), 6);
    let message = message(&output);
    assert!(message.contains("none\u{fffd}.toml") && !message.contains("panic"), "{message}");
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_before_the_first_sample() {
    let folder = folder();
    let file = folder.path().join("file");
    fs::write(&file, "in the way").unwrap();
    let out = file.join("out");
    let headline = library("low-thw-overtake");
    // The campaign would not end in any reasonable time.
    let args = ["campaign", headline.to_str().unwrap(), "-n", "100000000", "--out", out.to_str().unwrap()];
    let output = closecall(args);
    assert_eq!(code(&output), 6, "{}", stderr(&output));
}

#[test]
fn an_input_that_cannot_be_read_ends_with_one_code_in_every_command_and_an_empty_one_with_another() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scans = path("scans.pcd");
    let run = ["run", "low-thw-overtake", "--set", "duration-s=1", "--sensors", "full", "--scans", &scans];
    assert_eq!(code(&closecall(run)), 0);
    let full = ["run", "low-thw-overtake", "--sensors", "full"];
    let with = |option: &'static str, value: &'static str| full.into_iter().chain([option, value]).collect::<Vec<_>>();
    let recording = Path::new(ROOT).join("scenarios/fuzz/csv/three.csv").display().to_string();
    for (ending, words) in [
        ("toml", vec!["run", "FILE"]),
        ("toml", vec!["study", "frontier", "FILE"]),
        ("toml", with("--fitted", "FILE")),
        ("toml", vec!["study", "anchor", "-n", "1", "--ensemble", "FILE"]),
        ("so", with("--controller", "lib:FILE")),
        ("fmu", with("--controller", "fmu:FILE")),
        ("so", with("--set", "sensors.perception=\"lib:FILE\"")),
        ("so", with("--onnxruntime", "FILE")),
        ("onnx", with("--set", "sensors.rear-camera.model=FILE")),
        ("parquet", vec!["study", "perceive", "FILE"]),
        ("csv", vec!["study", "perceive", &scans, "--poses", "FILE"]),
        ("csv", vec!["study", "perceive", &scans, "--labels", "FILE"]),
        ("csv", vec!["traffic", "inspect", "FILE"]),
        ("csv", vec!["traffic", "lane-changes", &recording, "--reference", "FILE"]),
        ("csv", vec!["traffic", "calibrate", "FILE"]),
        ("csv", vec!["traffic", "drift", "low-thw-overtake", "FILE"]),
        ("json", vec!["campaign", "low-thw-overtake", "-n", "1", "--failures-first", "FILE"]),
        ("xosc", vec!["tool", "import", "FILE", "--out", "own.toml"]),
    ] {
        let (missing, empty, taken) =
            (path(&format!("missing.{ending}")), path(&format!("empty.{ending}")), path(&format!("folder.{ending}")));
        fs::write(&empty, "").unwrap();
        fs::create_dir_all(&taken).unwrap();
        for (file, expected) in [(&missing, 6), (&empty, 3), (&taken, 6)] {
            // A recording of scans and an ensemble may be folders, and an empty one has wrong content.
            if file == &taken && matches!(words[..], ["study", "perceive", "FILE"] | ["study", "anchor", ..]) {
                continue;
            }
            let output = closecall(words.iter().map(|word| word.replace("FILE", file)));
            assert_eq!(code(&output), expected, "{words:?} {file}: {}", stderr(&output));
            let name = file.rsplit('/').next().unwrap();
            assert!(message(&output).contains(name), "{words:?}: {}", stderr(&output));
        }
    }
}

/// The inputs are missing: a message about one of them would show that it was read first.
#[test]
fn an_output_that_cannot_be_written_is_refused_before_any_input_is_read() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (file, taken) = (path("file"), path("folder.csv"));
    fs::write(&file, "in the way").unwrap();
    fs::create_dir(&taken).unwrap();
    let into_folder: [&[&str]; 14] = [
        &["study", "sensitivity", "missing.toml", "--out"],
        &["study", "frontier", "missing.toml", "--out"],
        &["study", "boundary", "missing.toml", "--along", "a", "b", "-e", "min_thw_rear_s < 0.3", "--out"],
        &["study", "anchor", "--ensemble", "missing.toml", "--out"],
        &["study", "map", "--controller", "acc", "--out"],
        &["study", "sensors", "missing.toml", "--out"],
        &["traffic", "chain", "missing.csv", "--out"],
        &["traffic", "criticality", "missing.csv", "--plot"],
        &["traffic", "statistics", "missing.csv", "--plot"],
        &["traffic", "robustness", "missing.csv", "--plot"],
        &["traffic", "paper", "missing.csv", "--out"],
        &["traffic", "sample", "missing.csv", "--vary", "cc1", "--to", "0.3", "--out"],
        &["traffic", "aerial", "missing.csv", "--out"],
        &["tool", "render", "--out"],
    ];
    let into_file: [&[&str]; 6] = [
        &["traffic", "lane-changes", "missing.csv", "--openlabel"],
        &["traffic", "criticality", "missing.csv", "--openlabel"],
        &["traffic", "fit", "missing.csv", "--out"],
        &["traffic", "reenact", "missing.csv", "--out"],
        &["traffic", "calibrate", "missing.csv", "--out"],
        &["traffic", "record", "paper-figure", "-n", "100000", "--out"],
    ];
    let of_folder = into_folder.map(|words| (words, &file, "it is a file, and a folder is needed"));
    let of_file = into_file.map(|words| (words, &taken, "it is a folder, and a file is needed"));
    for (words, output, reason) in of_folder.into_iter().chain(of_file) {
        let ended = closecall(words.iter().copied().chain([output.as_str()]));
        assert_eq!(code(&ended), 6, "{words:?}: {}", stderr(&ended));
        assert!(
            message(&ended).contains(&format!("failed to write {output}: {reason}")),
            "{words:?}: {}",
            message(&ended)
        );
        assert!(ended.stdout.is_empty(), "{words:?}");
    }
    assert_eq!(fs::read_to_string(&file).unwrap(), "in the way");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count() + fs::read_dir(&taken).unwrap().count(), 2);
}

/// Pictures of two data sets in one folder are told apart by nobody.
#[test]
fn images_are_rendered_into_an_empty_folder_only() {
    let folder = folder();
    let images = folder.path().join("images");
    let render = |more: &[&str]| {
        let words = ["tool", "render", "-n", "1", "--out", images.to_str().unwrap()];
        closecall(words.iter().chain(more))
    };
    assert!(stdout(&render(&[]), 0).starts_with("1 image of 1 scene\n"));
    let files = || fs::read_dir(&images).unwrap().count();
    let before = files();
    let contents: [&[&str]; 3] = [&[], &["--aerial"], &["--crops"]];
    for more in contents {
        let again = render(more);
        assert_eq!(code(&again), 2, "{}", stderr(&again));
        assert!(message(&again).contains("images holds files already: name a new or an empty folder"));
        assert_eq!(files(), before);
    }
}

/// A reader that has gone, such as `head -1`, does not change what the exit code means.
#[test]
fn a_message_that_nobody_reads_keeps_its_exit_code() {
    for words in [&["compare"][..], &["fly"], &["run", "nothing-of-this-name"]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let status = program().args(words).stderr(writer).status().unwrap();
        assert_eq!(status.code(), Some(2), "{words:?}");
    }
}

#[test]
fn a_program_without_python_says_how_to_run_on_ray() {
    let folder = folder();
    let out = folder.path().join("out");
    let headline = library("low-thw-overtake");
    let args = ["campaign", headline.to_str().unwrap(), "--ray", "auto", "--out", out.to_str().unwrap()];
    let output = closecall(args);
    assert_eq!(code(&output), 3);
    assert!(stderr(&output).contains("pip install \"closecall[ray]\""), "{}", stderr(&output));
    assert!(!out.exists());
    assert_eq!(code(&closecall(args.into_iter().chain(["--jobs", "2"]))), 2);
}

#[test]
fn a_folder_with_other_files_is_not_used() {
    let folder = folder();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("thesis.tex"), "do not lose this").unwrap();
    let headline = library("low-thw-overtake");
    let run = |out: &str| closecall(["campaign", headline.to_str().unwrap(), "-n", "2", "--no-gate", "--out", out]);
    assert_eq!(code(&run(out.to_str().unwrap())), 2);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 1);
    let other = folder.path().join("other");
    stdout(&run(other.to_str().unwrap()), 0);
    let manifest = fs::read(other.join("manifest.json")).unwrap();
    let again =
        closecall(["campaign", headline.to_str().unwrap(), "-n", "3", "--no-gate", "--out", other.to_str().unwrap()]);
    assert_eq!(code(&again), 2, "{}", stderr(&again));
    assert_eq!(fs::read(other.join("manifest.json")).unwrap(), manifest);
}

#[test]
fn wrong_usage_ends_with_2() {
    let headline = library("low-thw-overtake");
    let headline = headline.to_str().unwrap();
    for args in [
        vec!["campaign"],
        vec!["campaign", headline, "-n", "0"],
        vec!["campaign", headline, "-n", "-3"],
        vec!["campaign", headline, "--jobs", "0"],
        vec!["campaign", headline, "--design", "latin"],
        vec!["campaign", headline, "--max-induced", "1"],
        vec!["campaign", headline, headline],
        vec!["campaign", headline, "--paired", "--controller", "acc"],
        vec!["run", headline, "--controller", "hope"],
        vec!["run", headline, "--set", "nonsense"],
        vec!["run", headline, "--set", "actor.nobody.id=x"],
        vec!["run", headline, "--set", "actor.rear=3"],
        vec!["run", headline, "--set", "no-such-parameter=3"],
        vec!["run", headline, "--set", "actor[3].id=x"],
        vec!["run", headline, "--set", "fault.rear-lidar[0].dead=true"],
        vec!["run", headline, "--set", "actor=[{id=me}]"],
        vec!["run", headline, "--sensors", "object", "--scans", "scans.parquet"],
        vec!["run", headline, "--sensors", "ground-truth", "--clusters", "clusters.parquet"],
        vec!["minimize", "closecall-results", "3", "--out", "scenario.txt"],
        vec!["run", headline, "--trace", "trace.txt"],
        vec!["run", headline, "--scans", "scans.csv"],
        vec!["run", headline, "--tracks", "tracks.csv"],
        vec!["run", headline, "--clusters", "clusters"],
        vec!["study", "perceive", "scans.parquet", "--tracks", "tracks.csv"],
        vec!["tool", "import", "case.xosc", "--out", "scenario.txt"],
        vec!["run", headline, "--trace", "same.csv", "--record", "same.csv"],
        vec!["fly"],
    ] {
        let output = closecall(&args);
        assert_eq!(code(&output), 2, "{args:?}: {}", stderr(&output));
        assert!(!stderr(&output).is_empty());
    }
}

#[test]
fn a_replay_of_a_missing_sample_or_campaign_is_an_error() {
    let folder = folder();
    let out = folder.path().join("out");
    let headline = library("low-thw-overtake");
    stdout(
        &closecall(["campaign", headline.to_str().unwrap(), "-n", "4", "--no-gate", "--out", out.to_str().unwrap()]),
        0,
    );
    assert_eq!(code(&closecall(["replay", out.to_str().unwrap(), "4"])), 2);
    let refused = |args: &[&str], stated: &str| {
        let output = closecall(args);
        assert_eq!(code(&output), 6, "{args:?}");
        assert!(stderr(&output).contains(stated), "{args:?}: {}", stderr(&output));
    };
    let (here, there) = (folder.path().to_str().unwrap(), out.to_str().unwrap());
    refused(&["replay", here, "0"], "the folder holds no results of a campaign: it has no manifest.json");
    refused(&["compare", there, here], "the folder holds no results of a campaign");
    refused(&["explain", headline.to_str().unwrap(), "0"], "it is a file, and the folder of a campaign is needed");
    refused(&["replay", "no-such-folder", "0"], "failed to read no-such-folder: ");
    refused(&["baseline", "compare", "baseline.json", there], "it is a folder, and the file of a baseline is needed");
    fs::write(out.join("manifest.json"), "{\"manifest_version\": 1").unwrap();
    let output = closecall(["replay", out.to_str().unwrap(), "0"]);
    assert_eq!(code(&output), 3);
    assert!(stderr(&output).contains("manifest.json"));
}

#[test]
fn a_setting_of_an_element_of_a_list_is_applied_and_overrides_a_check_as_a_whole_list_does() {
    let folder = folder();
    let run = |settings: &[&str]| {
        let mut args = vec!["campaign", "overtake-without-brake", "-n", "80", "--sensors", "object", "--paired"];
        settings.iter().for_each(|setting| args.extend(["--set", setting]));
        closecall(&args)
    };
    let text = stdout(&run(&["checks.MIS-6[0]=max(max_speed_deficit_mps) <= 100"]), 4);
    assert!(text.contains("OVERRIDDEN") && text.contains("MIS-6: max(max_speed_deficit_mps) <= 10"), "{text}");
    stdout(&run(&["sensors.additional-rear-cameras=[{name='left',yaw-deg=40}]"]), 0);
    // A folder keeps the whole list, and a replay gives the same bits.
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let cut_in = ["campaign", "low-thw-overtake", "-n", "2", "--no-gate", "--record", "worst:0", "--out", out];
    let fault = [
        "--set",
        "fault.rear-object=[{dropout=0.5}]",
        "--set",
        "fault.rear-object[0].from-s=1",
        "--set",
        "sensors.mode=object",
    ];
    stdout(&closecall([&cut_in[..], &fault[..]].concat()), 0);
    let text = stdout(&closecall(["replay", out, "1"]), 0);
    assert!(text.contains("50 % of the measurements lost from 1.0 s on"), "{text}");
    let wrong = closecall(["run", "low-thw-overtake", "--set", "fault.rear-object=[{drop-out=0.5}]"]);
    assert_eq!(code(&wrong), 3);
    assert!(
        stderr(&wrong).contains("`fault.rear-object=[{drop-out=0.5}]`: `drop-out`: unknown field"),
        "{}",
        stderr(&wrong)
    );
}
