//! Worker processes of campaigns: a crash is an outcome of the sample that it hits, an answer
//! belongs to its question, and a relative path leads to the same file wherever the process runs.

use std::io::Write;
use std::path::Path;
use std::process::{Output, Stdio};

use closecall_testing::has_python;
use serde_json::Value;

use crate::exec_controller::left_behind;
use crate::fmu_controllers::fmu;
use crate::native_controllers::{campaign_of, compile, has_fast_ego, is_as_baseline, lib, with_fault};
use crate::support::{ROOT, code, folder, json, program, records, stderr, stdout};

/// Faults that show from the second run of a process on: it crashes, or hangs. `wears-out` also
/// crashes in every sample in which the ego is fast.
const WEAR: [&str; 2] = ["wears-out", "tires"];

/// Writes a scenario of the library without the requirement MIS-9, whose check runs some samples
/// again in the same process. Returns its path.
fn without_mis_9(scenario: &str, folder: &Path) -> String {
    let library = Path::new(ROOT).join("scenarios/library").join(scenario).with_extension("toml");
    let text = std::fs::read_to_string(library).unwrap().replace(", \"MIS-9\"", "");
    let kept: Vec<&str> = text.lines().filter(|line| !line.starts_with("MIS-9")).collect();
    let path = folder.join(scenario).with_extension("toml");
    std::fs::write(&path, kept.join("\n")).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_crash_or_hang_is_an_outcome_of_the_sample_that_it_hits() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let scenario = without_mis_9("low-thw-overtake", folder.path());
    // The checks of validity repeat a run in the same process.
    let limits = ["--no-validity-checks", "--controller-timeout-ms", "500"];
    for fault in WEAR {
        let out = folder.path().join(fault);
        let output = campaign_of(&scenario, &library, &out, "1", Some(fault), &limits);
        assert_eq!(code(&output), 5, "{fault}: {}", stderr(&output));
        let records = records(&out);
        // Every second sample at the latest is the second of its process.
        assert!(records.windows(2).all(|two| two.iter().any(|record| record.arms[1].result.is_err())), "{fault}");
        assert!(records.iter().all(|record| record.arms[1].flaky.is_none()), "{fault}");
        let sound: Vec<_> = records.iter().filter(|record| record.arms[1].result.is_ok()).collect();
        assert!(sound.len() > 1 && sound.iter().all(|record| is_as_baseline(record)), "{fault}");
    }
}

#[test]
fn a_sample_that_succeeds_only_in_another_process_is_flaky() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let scenario = without_mis_9("low-thw-overtake", folder.path());
    let limits = ["--no-validity-checks", "--controller-timeout-ms", "500", "--retry-crashed", "1"];
    for fault in WEAR {
        let out = folder.path().join(fault);
        let output = campaign_of(&scenario, &library, &out, "1", Some(fault), &limits);
        assert_eq!(code(&output), if fault == "tires" { 0 } else { 5 }, "{fault}: {}", stderr(&output));
        let mut flaky = 0;
        for record in records(&out) {
            let is_fast = has_fast_ego(&record);
            match &record.arms[1].result {
                Ok(_) => assert!(is_as_baseline(&record), "{fault}: sample {}", record.sample),
                Err(failure) => {
                    let expected = "the controller ended its process (signal: 11 (SIGSEGV))";
                    assert!(is_fast && failure.message.starts_with(expected), "{fault}: {}", failure.message);
                    assert_eq!(fault, "wears-out");
                }
            }
            flaky += u64::from(record.arms[1].flaky.is_some());
        }
        assert!(flaky > 5, "{fault}: {flaky} are flaky");
    }
}

/// Runs a campaign whose library crashes in the fifth run of each process.
fn crashing_in_the_fifth_run(library: &str, out: &Path, more: &[&str]) -> Output {
    let scenario = without_mis_9("overtake-without-brake", out.parent().unwrap());
    let mut command = program();
    command
        .args(["campaign", &scenario, "-n", "24", "--sensors", "object", "--no-validity-checks"])
        .args(["--jobs", "1", "--record", "failures:0", "--controller", library, "--out", out.to_str().unwrap()])
        .args(more);
    with_fault(&mut command, Some("fifth"))
}

#[test]
fn a_library_that_crashes_in_each_fifth_run_of_its_process_is_never_repeated_silently() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let crash = "the controller ended its process (signal: 11 (SIGSEGV)); it last wrote: worn out";
    let plain = folder.path().join("plain");
    let output = crashing_in_the_fifth_run(&library, &plain, &["--no-gate"]);
    assert_eq!(code(&output), 5, "{}", stderr(&output));
    let failed: Vec<(u64, String)> = records(&plain)
        .iter()
        .filter_map(|record| Some((record.sample, record.arms[0].result.as_ref().err()?.message.clone())))
        .collect();
    assert_eq!(failed, [4, 9, 14, 19].map(|sample| (sample, crash.to_owned())));
    // Repeated on request, and shown in every report.
    let flaky = folder.path().join("flaky");
    let text = stdout(&crashing_in_the_fifth_run(&library, &flaky, &["--no-gate", "--retry-crashed", "1"]), 0);
    let listed = format!("first in sample 4: {crash}");
    assert!(text.contains("5 FLAKY") && text.contains(&listed), "{text}");
    for file in ["report.html", "summary.md", "junit.xml"] {
        let text = std::fs::read_to_string(flaky.join(file)).unwrap();
        assert!(text.contains("worn out") && text.to_lowercase().contains("flaky"), "{file}: {text}");
    }
    let mut first = true;
    for record in records(&flaky).iter().filter(|record| record.arms[0].flaky.is_some()) {
        assert_eq!(record.arms[0].flaky.as_ref().unwrap().first.message, crash);
        assert!(!std::mem::take(&mut first) || record.sample == 4);
    }
    // As a gate: on request, and with a preset.
    for (name, more) in [("gate", &["--max-collisions", "24", "--max-flaky", "4"][..]), ("preset", &["--preset", "pr"])]
    {
        let out = folder.path().join(name);
        let output = crashing_in_the_fifth_run(&library, &out, &[more, &["--retry-crashed", "1"]].concat());
        let text = stdout(&output, 1);
        assert!(text.contains("flaky samples: 5, at most"), "{name}: {text}");
        let junit = std::fs::read_to_string(out.join("junit.xml")).unwrap();
        assert!(junit.contains("<failure message=\"flaky samples: 5, at most"), "{name}: {junit}");
    }
    let more = ["--max-collisions", "24", "--max-flaky", "5", "--retry-crashed", "1", "--format", "json"];
    // 24 samples do not decide every requirement of the scenario.
    let report = json(&crashing_in_the_fifth_run(&library, &folder.path().join("allowed"), &more), 4);
    assert_eq!((&report["flaky"], &report["flaky_gate"]["max"]), (&5.into(), &5.into()));
    assert_eq!(report["flaky_samples"][0]["first_message"], crash);
}

#[test]
fn a_library_that_forks_files_no_outcome_under_another_sample() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let mark = format!("forks-{}", std::process::id());
    for jobs in ["1", "2"] {
        let out = folder.path().join(jobs);
        let mut command = program();
        command
            .args(["campaign", "low-thw-overtake", "-n", "40", "--sensors", "object", "--no-gate", "--jobs", jobs])
            .args(["--record", "failures:0", "--controller", &library, "--out", out.to_str().unwrap()])
            .env("CLOSECALL_TEST_MARK", &mark);
        let output = with_fault(&mut command, Some("forks"));
        assert_eq!(code(&output), 5, "{}", stderr(&output));
        // Reading the records checks that each belongs to its sample.
        let records = records(&out);
        assert_eq!(records.len(), 40);
        let messages: Vec<_> = records
            .iter()
            .filter_map(|record| record.arms[0].result.as_ref().err().map(|failure| failure.message.clone()))
            .collect();
        let named = |message: &String| {
            message.contains("does not belong to the sample: ") || message.contains("a line that nobody had asked for")
        };
        assert!(!messages.is_empty() && messages.iter().all(named), "{messages:?}");
    }
    assert_eq!(left_behind(&mark), Vec::<String>::new());
}

/// The last sample of a process has nothing behind it that would find a line too many.
#[test]
fn a_line_that_a_forked_copy_leaves_over_after_the_last_sample_is_no_success() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let run = |samples: &str, more: &[&str], out: &str| {
        let mut command = program();
        command
            .args(["campaign", "low-thw-overtake", "-n", samples, "--sensors", "object", "--no-gate", "--jobs", "1"])
            .args(["--record", "failures:0", "--controller", &library, "--out"])
            .arg(folder.path().join(out))
            .args(more);
        with_fault(&mut command, Some("forks-behind"))
    };
    let text = stdout(&run("1", &["--no-validity-checks"], "last"), 7);
    assert!(text.contains("INVALID: after its last sample, the process of `lib:faulty` failed"), "{text}");
    // A resumption knows it.
    stdout(&run("1", &["--no-validity-checks", "--resume"], "last"), 7);
    // The process of a sample that repeats in a new one ends before.
    stdout(&run("1", &[], "repeated"), 5);
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
    let version_line = stdout(&program().arg("--version").output().unwrap(), 0);
    let version = version_line.split_whitespace().nth(1).unwrap().split('+').next().unwrap();
    let message = failure["message"].as_str().unwrap();
    assert_eq!((failure["kind"].as_str(), answer["stage"].as_str()), (Some("refused"), Some("Last")));
    assert!(
        message.starts_with(&format!("Closecall has changed since the start: it was 0.0.1+1a2b, and is {version}")),
        "{message}"
    );
}

/// Runs a campaign in one folder with a controller that is named by a relative path, and repeats a
/// sample from another folder.
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
