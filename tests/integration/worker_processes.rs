//! Worker processes of campaigns: what one sample does to its process is no matter of the next, and a relative path leads to the
//! same file wherever the process runs.

use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use closecall_testing::has_python;
use serde_json::Value;

use crate::fmu_controllers::fmu;
use crate::native_controllers::{campaign, compile, is_as_baseline, lib, records};
use crate::support::{code, folder, program, stderr, stdout};

/// Faults that show from the second run of a process on: it crashes, or hangs. `wears-out` also crashes in every sample in which the ego is fast.
const WEAR: [&str; 2] = ["wears-out", "tires"];

#[test]
fn a_sample_that_fails_in_a_used_process_runs_again_in_a_new_one() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    // The checks of validity repeat a run in the same process.
    let limits = ["--no-validity-checks", "--controller-timeout-ms", "500"];
    for fault in WEAR {
        let journals = ["1", "2"].map(|jobs| {
            let out = folder.path().join(format!("{fault}-{jobs}"));
            let output = campaign(&library, &out, jobs, Some(fault), &limits);
            assert_eq!(code(&output), if fault == "tires" { 0 } else { 5 }, "{fault}: {}", stderr(&output));
            std::fs::read_to_string(out.join("journal.jsonl")).unwrap()
        });
        assert_eq!(journals[0], journals[1]);
        let mut failed = 0;
        for record in records(&folder.path().join(format!("{fault}-1"))) {
            let values = serde_json::to_value(&record.arms[0].result.as_ref().unwrap().parameters).unwrap();
            let is_fast = values["cruise-mps"].as_f64().unwrap() >= 32.7;
            match &record.arms[1].result {
                Ok(_) => assert!(is_as_baseline(&record), "{fault}: sample {}", record.sample),
                Err(failure) => {
                    // The message is that of the new process, which has had no earlier run.
                    let expected = "the controller ended its process (signal: 11 (SIGSEGV))";
                    assert_eq!((is_fast, failure.message.as_str()), (true, expected), "{fault}");
                    failed += 1;
                }
            }
        }
        assert_eq!(failed > 1, fault == "wears-out", "{fault} shows in {failed} samples");
    }
}

#[test]
fn a_worker_process_of_another_version_refuses_its_task_and_names_both() {
    let mut process = program()
        .args(["host", "samples"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A task of another version may have any form but for this key.
    let task = "{\"version\":\"0.0.1+1a2b\",\"work\":[1,2]}\n7\n";
    process.stdin.take().unwrap().write_all(task.as_bytes()).unwrap();
    let output = process.wait_with_output().unwrap();
    let answer: Value = serde_json::from_str(&stdout(&output, 0)).unwrap();
    let failure = &answer["record"]["result"]["Err"];
    let own = stdout(&program().arg("--version").output().unwrap(), 0);
    let version = own.split_whitespace().nth(1).unwrap().split('+').next().unwrap();
    let message = failure["message"].as_str().unwrap();
    assert_eq!((failure["kind"].as_str(), answer["is_last"].as_bool()), (Some("refused"), Some(true)));
    assert!(
        message.starts_with(&format!("Closecall has changed since the start: it was 0.0.1+1a2b, and is {version}")),
        "{message}"
    );
}

/// Runs a campaign in one folder with a controller that is named by a relative path, and repeats a sample from another folder.
fn replay_elsewhere(folder: &Path, controller: &str) {
    let words =
        ["campaign", "low-thw-overtake", "-n", "4", "--seed", "3", "--sensors", "object", "--no-gate", "--out", "out"];
    let run = program().current_dir(folder).args(words).args(["--controller", controller]).output();
    stdout(&run.unwrap(), 0);
    let out = folder.join("out");
    let replay = || program().args(["replay", out.to_str().unwrap(), "3"]).output().unwrap();
    let output = replay();
    stdout(&output, 0);
    assert!(stderr(&output).contains(controller.split('/').next_back().unwrap()), "{}", stderr(&output));
    // The file is needed: there is none of its name in the folder of the replay.
    let (_, file) = controller.split_once(':').unwrap();
    std::fs::rename(folder.join(file), folder.join("elsewhere")).unwrap();
    assert_ne!(code(&replay()), 0);
    std::fs::remove_dir_all(&out).unwrap();
}

#[test]
fn a_relative_path_leads_to_the_folder_of_the_campaign() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("own")).unwrap();
    compile("examples/acc_controller.c", &folder.path().join("own/first.so"), &[]);
    replay_elsewhere(folder.path(), "lib:own/first.so");
    if has_python() {
        fmu("3", &folder.path().join("own/first.fmu"), &[]);
        replay_elsewhere(folder.path(), "fmu:./own/first.fmu");
    }
}
