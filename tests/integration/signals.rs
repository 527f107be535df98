//! A signal ends a campaign with its finished samples, and no process of a controller is left: not
//! after SIGINT and SIGTERM, nor after SIGKILL, which the program cannot catch. The resumed
//! campaign ends in the same bytes.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::support::{closecall, code, folder, library, message, program, stderr, stdout};

/// A controller that starts a process in a separate session, which would run for an hour, and then
/// never brakes.
const STRAYING: &str = r#"#!/bin/sh
setsid sleep 3600 >/dev/null 2>&1 </dev/null &
(setsid sh -c 'sleep 3600; :' >/dev/null 2>&1 </dev/null &)
echo '{"type":"hello","protocol":1}'
read -r line
while read -r line; do echo '{"acceleration_mps2":0.0,"state":"following"}'; done
"#;

/// Returns the processes with `mark` in their environment, once there is none or a minute has
/// passed.
fn left_behind(mark: &str) -> Vec<String> {
    let started = Instant::now();
    loop {
        let running = marked(mark);
        if running.is_empty() || started.elapsed() > Duration::from_secs(60) {
            return running;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn marked(mark: &str) -> Vec<String> {
    let wanted = format!("CLOSECALL_TEST_MARK={mark}");
    let processes = fs::read_dir("/proc").unwrap().filter_map(|entry| Some(entry.ok()?.path()));
    let has_mark = |path: &std::path::PathBuf| {
        let environment = fs::read(path.join("environ")).unwrap_or_default();
        environment.split(|byte| *byte == 0).any(|entry| entry == wanted.as_bytes())
    };
    let name = |path: std::path::PathBuf| {
        let command = fs::read(path.join("cmdline")).unwrap_or_default();
        format!("{}: {}", path.display(), String::from_utf8_lossy(&command).replace('\0', " "))
    };
    processes.filter(has_mark).map(name).collect()
}

fn args(out: &Path, controller: Option<&Path>, samples: u64, more: &[&str]) -> Vec<String> {
    let scenario = library("low-thw-overtake");
    let samples = samples.to_string();
    let mut all = vec!["campaign", scenario.to_str().unwrap(), "-n", &samples, "--record", "failures:0", "--out"];
    all.push(out.to_str().unwrap());
    let controller = controller.map(|path| format!("exec:sh {}", path.display()));
    if let Some(controller) = &controller {
        all.extend(["--controller", controller, "--controller-timeout-ms", "60000"]);
    }
    all.extend(more);
    all.into_iter().map(str::to_owned).collect()
}

fn start(command: &mut Command) -> Child {
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until the journal has some lines, and sends a signal. Returns the program's reaction.
fn interrupted(mut child: Child, out: &Path, signal: Signal) -> Output {
    let journal = out.join("journal.jsonl");
    let started = Instant::now();
    while fs::read(&journal).unwrap_or_default().iter().filter(|byte| **byte == b'\n').count() < 3 {
        assert!(child.try_wait().unwrap().is_none(), "the campaign ended too early");
        assert!(started.elapsed() < Duration::from_secs(300), "the campaign hangs");
        std::thread::sleep(Duration::from_millis(1));
    }
    kill_process(Pid::from_child(&child), signal).unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn a_signal_ends_a_campaign_with_what_is_done_and_leaves_no_process() {
    let folder = folder();
    let script = folder.path().join("straying.sh");
    fs::write(&script, STRAYING).unwrap();
    for (signal, expected) in [(Signal::INT, Some(130)), (Signal::TERM, Some(143)), (Signal::KILL, None)] {
        let mark = format!("signals-{}-{signal:?}", std::process::id());
        let out = folder.path().join(&mark);
        let child =
            start(program().args(args(&out, Some(&script), 2_000, &["--jobs", "2"])).env("CLOSECALL_TEST_MARK", &mark));
        let output = interrupted(child, &out, signal);
        assert_eq!(output.status.code(), expected, "{}", stderr(&output));
        assert_eq!(left_behind(&mark), Vec::<String>::new(), "{signal:?}");
        if expected.is_some() {
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(text.contains("ENDED EARLY") && text.contains("of 2000 samples are done"), "{text}");
            let resume = text.lines().find_map(|line| line.strip_prefix("resume: ")).unwrap();
            assert!(resume.contains("--resume") && resume.contains(out.to_str().unwrap()), "{resume}");
            assert!(!out.join("junit.xml").exists() && !text.contains("PASS"), "{text}");
        }
    }
}

#[test]
fn a_controller_that_leaves_its_process_group_ends_with_its_sample() {
    let folder = folder();
    let script = folder.path().join("straying.sh");
    fs::write(&script, STRAYING).unwrap();
    let mark = format!("straying-{}", std::process::id());
    let controller = format!("exec:sh {}", script.display());
    let run = program()
        .args(["run", library("low-thw-overtake").to_str().unwrap(), "--controller", &controller])
        .args(["--controller-timeout-ms", "60000"])
        .env("CLOSECALL_TEST_MARK", &mark)
        .output()
        .unwrap();
    stdout(&run, 0);
    assert_eq!(left_behind(&mark), Vec::<String>::new());
}

#[test]
fn an_interrupted_campaign_is_resumed_by_the_printed_command_to_the_same_bytes() {
    let folder = folder();
    let (whole, out) = (folder.path().join("whole"), folder.path().join("in two parts"));
    let more = ["--seed", "5", "--jobs", "2", "--paired", "--sensors", "object"];
    let same = args(&whole, None, 600, &more);
    let whole_output = closecall(&same);
    let output = interrupted(start(program().args(args(&out, None, 600, &more))), &out, Signal::INT);
    assert_eq!(code(&output), 130, "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let resume = text.lines().find_map(|line| line.strip_prefix("resume: ")).unwrap();
    let resumed = Command::new("sh").args(["-c", resume]).current_dir(crate::support::ROOT).output().unwrap();
    assert_eq!(code(&resumed), code(&whole_output), "{}", stderr(&resumed));
    for file in ["journal.jsonl", "outcomes.parquet"] {
        assert!(fs::read(whole.join(file)).unwrap() == fs::read(out.join(file)).unwrap(), "{file} differs");
    }
}

#[test]
fn a_campaign_ends_at_the_first_failure_or_at_too_many_errors_without_a_verdict() {
    let folder = folder();
    let out = folder.path().join("fast");
    let scenario = library("low-thw-overtake");
    let fixed = ["campaign", scenario.to_str().unwrap(), "-n", "200", "--controller", "acc", "--fail-fast"];
    let output = closecall(fixed.into_iter().chain(["--out", out.to_str().unwrap()]));
    let text = stdout(&output, 1);
    assert!(text.contains("ENDED EARLY") && text.contains("has a collision of the ego"), "{text}");
    assert!(text.contains("closecall replay") && !text.contains("PASS"), "{text}");
    let errors = folder.path().join("errors");
    let controller = ["--controller", "exec:false", "--max-errors", "2", "--jobs", "1"];
    let more = ["--out", errors.to_str().unwrap()];
    let fixed = ["campaign", scenario.to_str().unwrap(), "-n", "50"];
    let output = closecall(fixed.into_iter().chain(controller).chain(more));
    assert_eq!(code(&output), 5, "{}", message(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("3 samples ended in an error; 3 of 50 samples are done"), "{text}");
    assert!(text.contains("--retry-errors"), "{text}");
}
