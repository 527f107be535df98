//! Every command that reads or writes a folder of results survives the failure of any of its calls
//! of the operating system.
//!
//! A preloaded library fails one call after the other: see `fixtures/programs/failing_calls.c`.
//! After each failure, the command has ended with its undisturbed exit code or with the code of an
//! I/O error, no file is half written, and the same command again gives the bytes of an undisturbed
//! one. `CLOSECALL_EVERY_CALL=1` fails each call in each way. Without it, one call in a few fails.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::{ROOT, code, folder, library, program, stderr};

/// The ways in which a call fails: see `failing_calls.c`.
const WAYS: [&str; 5] = ["once", "always", "short", "interrupt", "kill"];
/// One call in so many fails in the first way, and in each of the others, unless every call is to
/// fail.
const STRIDES: [usize; 2] = [7, 37];
/// Exit code of an I/O error.
const IO_ERROR: i32 = 6;
/// Ends of the names of files that hold times, or the process that writes.
const TIMED: [&str; 5] = ["lock", "wall-times.jsonl", "report.html", "timings.parquet", "junit.xml"];

/// A command that works in the folder `work`, and the folder before it runs.
struct Case {
    arguments: Vec<String>,
    /// The folder whose copy is `work` at the beginning.
    before: PathBuf,
    /// The working folder. All paths of the arguments are relative to it.
    root: PathBuf,
}

/// A command that has ended, and the files that it left in `work`.
struct Ended {
    output: Output,
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl Ended {
    fn is_killed(&self) -> bool {
        self.output.status.code().is_none()
    }
}

/// A call of the system as the library numbers it.
struct Failure<'a> {
    at: usize,
    way: &'a str,
}

impl Case {
    /// Prepares the working folder anew.
    fn prepare(&self) {
        let work = self.root.join("work");
        if work.exists() {
            fs::remove_dir_all(&work).unwrap();
        }
        copy(&self.before, &work);
    }

    fn command(&self) -> Command {
        let mut command = program();
        command.current_dir(&self.root).args(&self.arguments);
        command
    }

    fn end(&self, mut command: Command) -> Ended {
        let output = command.output().unwrap();
        Ended { output, files: files(&self.root.join("work")) }
    }

    /// Runs the command while a call fails. Returns `None` if it makes no such call.
    fn fail(&self, library: &Path, failure: &Failure) -> Option<Ended> {
        let log = self.root.join("calls.txt");
        let _ = fs::remove_file(&log);
        let mut command = self.command();
        command.env("LD_PRELOAD", library).env("FAIL_UNDER", &self.root).env("FAIL_LOG", &log);
        command.env("FAIL_AT", failure.at.to_string()).env("FAIL_KIND", failure.way);
        let ended = self.end(command);
        let calls = fs::read_to_string(&log).map_or(0, |log| log.lines().count());
        (ended.is_killed() || failure.at <= calls).then_some(ended)
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy(&from, &to);
        } else {
            fs::copy(&from, &to).unwrap();
        }
    }
}

/// Returns the bytes of all files of a folder, by their paths in it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    fn collect(folder: &Path, top: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(&path, top, files);
            } else {
                files.insert(path.strip_prefix(top).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    let mut all = BTreeMap::new();
    if folder.exists() {
        collect(folder, folder, &mut all);
    }
    all
}

/// Returns the violations of a command that ended while one of its calls failed.
fn judge(disturbed: &Ended, undisturbed: &Ended, way: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    let message = stderr(&disturbed.output);
    if message.contains("panicked") {
        wrong.push("it panics".to_owned());
    }
    if disturbed.is_killed() {
        return if way == "kill" { wrong } else { vec!["a signal ended it".to_owned()] };
    }
    let (ended_with, expected) = (code(&disturbed.output), code(&undisturbed.output));
    if ended_with != expected && ended_with != IO_ERROR {
        wrong.push(format!("exit code {ended_with}"));
    }
    if ended_with != expected && matches!(way, "short" | "interrupt") {
        wrong.push("a call that has to be made again is not".to_owned());
    }
    if ended_with == IO_ERROR && !message.contains(['/', '.']) {
        wrong.push("the message names no file".to_owned());
    }
    for path in disturbed.files.keys().filter(|path| !undisturbed.files.contains_key(*path)) {
        wrong.push(format!("it leaves {}", path.display()));
    }
    if ended_with == expected {
        wrong.extend(judge_files(disturbed, undisturbed, &message));
        // The printed list of written files may lack one of them.
        if undisturbed.files.is_empty() && disturbed.output.stdout != undisturbed.output.stdout {
            wrong.push("it prints something else".to_owned());
        }
    }
    wrong
}

/// Returns the violations in the files of a command that has ended as if nothing had failed.
fn judge_files(disturbed: &Ended, undisturbed: &Ended, message: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    let is_warned = message.contains("the verdict stands");
    for (path, bytes) in &undisturbed.files {
        let is_timed = TIMED.iter().any(|name| path.ends_with(name));
        match disturbed.files.get(path) {
            None if !is_warned => wrong.push(format!("{} is missing without a word", path.display())),
            Some(left) if left != bytes && !is_timed => wrong.push(format!("{} differs", path.display())),
            _ => (),
        }
    }
    wrong
}

/// Returns the violations after the same command has run again, undisturbed.
fn judge_again(again: &Ended, undisturbed: &Ended) -> Vec<String> {
    let mut wrong = judge_files(again, undisturbed, "");
    if code(&again.output) != code(&undisturbed.output) {
        wrong.push(format!("again: exit code {}: {}", code(&again.output), stderr(&again.output)));
    }
    let left = again.files.keys().filter(|path| !undisturbed.files.contains_key(*path));
    wrong.extend(left.map(|path| format!("again: it leaves {}", path.display())));
    wrong
}

/// Fails the calls of a command one after the other. Returns the number of calls, and the
/// violations.
fn attack(case: &Case) -> (usize, Vec<String>) {
    let library = compile(&case.root);
    case.prepare();
    let undisturbed = case.end(case.command());
    let every_call = std::env::var_os("CLOSECALL_EVERY_CALL").is_some();
    let (mut most_calls, mut wrong) = (0, Vec::new());
    for (index, way) in WAYS.into_iter().enumerate() {
        let stride = if every_call { 1 } else { STRIDES[index.min(1)] };
        for at in (1 + index % stride..).step_by(stride) {
            case.prepare();
            let Some(disturbed) = case.fail(&library, &Failure { at, way }) else { break };
            if disturbed.is_killed() && way != "kill" {
                wrong.push(format!("{way} {at}: a signal ended it"));
                break;
            }
            most_calls = most_calls.max(at);
            let mut of_call = judge(&disturbed, &undisturbed, way);
            if disturbed.output.status.code() != undisturbed.output.status.code() {
                of_call.extend(judge_again(&case.end(case.command()), &undisturbed));
            }
            wrong.extend(
                of_call.into_iter().map(|violation| format!("{way} {at}: {violation} ({})", stderr(&disturbed.output))),
            );
        }
    }
    (most_calls, wrong)
}

/// Attacks a command that makes at least so many calls, and fails if anything is wrong.
fn must_survive(case: &Case, fewest_calls: usize) {
    let (calls, wrong) = attack(case);
    assert!(calls >= fewest_calls, "the library sees {calls} calls only");
    assert!(wrong.is_empty(), "{} of {calls} calls:\n{}", wrong.len(), wrong.join("\n"));
}

/// Compiles the library that fails calls.
fn compile(folder: &Path) -> PathBuf {
    let library = folder.join("failing_calls.so");
    let source = Path::new(ROOT).join("tests/fixtures/programs/failing_calls.c");
    let output = Command::new("cc")
        .args(["-std=gnu11", "-O1", "-shared", "-fPIC", "-Wno-nonnull-compare", "-o"])
        .args([&library, &source])
        .output()
        .expect("a C compiler");
    assert!(output.status.success(), "{}", stderr(&output));
    library
}

/// Returns the arguments of a small campaign.
fn campaign(more: &[&str]) -> Vec<String> {
    let scenario = library("low-thw-overtake");
    let fixed =
        ["campaign", scenario.to_str().unwrap(), "--sensors", "object", "-n", "4", "--seed", "1", "--jobs", "1"];
    let fixed = fixed.iter().chain(&["--no-gate", "--no-validity-checks", "--recordings", "0"]);
    fixed.chain(more).map(|argument| (*argument).to_owned()).collect()
}

fn words(arguments: &[&str]) -> Vec<String> {
    arguments.iter().map(|argument| (*argument).to_owned()).collect()
}

/// Returns a case in a folder in which these commands have run.
fn case(root: &Path, prepared: &[Vec<String>], arguments: Vec<String>) -> Case {
    let before = root.join("before");
    fs::create_dir_all(&before).unwrap();
    for arguments in prepared {
        let output = program().current_dir(root).args(arguments).output().unwrap();
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    }
    Case { arguments, before, root: root.to_owned() }
}

#[test]
fn a_campaign_survives_the_failure_of_each_of_its_calls() {
    let folder = folder();
    must_survive(&case(folder.path(), &[], campaign(&["--out", "work/results", "--resume"])), 150);
}

#[test]
fn a_resumed_campaign_survives_the_failure_of_each_of_its_calls() {
    let folder = folder();
    let case = case(
        folder.path(),
        &[campaign(&["--out", "before/results", "--resume"])],
        campaign(&["--out", "work/results", "--resume"]),
    );
    // The campaign was killed while it wrote the third record.
    let results = case.before.join("results");
    let journal = fs::read(results.join("journal.jsonl")).unwrap();
    let second_ends_at = journal.iter().enumerate().filter(|(_, byte)| **byte == b'\n').nth(1).unwrap().0;
    fs::write(results.join("journal.jsonl"), &journal[..second_ends_at + 40]).unwrap();
    for name in ["outcomes.parquet", "report.html", "junit.xml"] {
        fs::remove_file(results.join(name)).unwrap();
    }
    must_survive(&case, 150);
}

#[test]
fn a_merge_survives_the_failure_of_each_of_its_calls() {
    let folder = folder();
    let part = |part: &str, out: &str| campaign(&["--partition", part, "--out", out]);
    let parts = [part("1/2", "one"), part("2/2", "two")];
    must_survive(
        &case(
            folder.path(),
            &parts,
            words(&[
                "tool",
                "merge",
                "one",
                "two",
                "--out",
                "work/merged",
                "--resume",
                "--no-gate",
                "--recordings",
                "0",
            ]),
        ),
        100,
    );
}

#[test]
fn a_baseline_survives_the_failure_of_each_of_its_calls() {
    let folder = folder();
    let prepared = [campaign(&["--out", "results"]), words(&["baseline", "save", "results", "before/baseline.json"])];
    must_survive(&case(folder.path(), &prepared, words(&["baseline", "save", "results", "work/new.json"])), 15);
    must_survive(&case(folder.path(), &[], words(&["baseline", "compare", "results", "before/baseline.json"])), 15);
}

#[test]
fn a_comparison_survives_the_failure_of_each_of_its_calls() {
    let folder = folder();
    let prepared = [campaign(&["--out", "one"]), campaign(&["--out", "two"])];
    must_survive(&case(folder.path(), &prepared, words(&["compare", "one", "two"])), 15);
}

#[test]
fn a_command_that_loses_a_file_without_a_word_is_caught() {
    use std::os::unix::process::ExitStatusExt;
    let ended = |raw: i32, files: &[(&str, &str)]| Ended {
        output: Output { status: std::process::ExitStatus::from_raw(raw), stdout: Vec::new(), stderr: Vec::new() },
        files: files.iter().map(|(path, text)| (PathBuf::from(path), text.as_bytes().to_vec())).collect(),
    };
    let undisturbed = ended(0, &[("outcomes.parquet", "all")]);
    let io_error = IO_ERROR << 8;
    let none = Vec::<String>::new();
    assert_eq!(judge(&ended(0, &[("outcomes.parquet", "all")]), &undisturbed, "once"), none);
    assert_eq!(judge(&ended(0, &[]), &undisturbed, "once"), ["outcomes.parquet is missing without a word"]);
    assert_eq!(judge(&ended(0, &[("outcomes.parquet", "al")]), &undisturbed, "once"), ["outcomes.parquet differs"]);
    assert_eq!(judge(&ended(io_error, &[]), &undisturbed, "once"), ["the message names no file"]);
    assert_eq!(judge(&ended(101 << 8, &[]), &undisturbed, "once"), ["exit code 101"]);
    assert_eq!(judge(&ended(9, &[]), &undisturbed, "once"), ["a signal ended it"]);
    assert_eq!(judge(&ended(9, &[]), &undisturbed, "kill"), none);
    assert_eq!(judge_again(&ended(0, &[("outcomes.parquet", "al")]), &undisturbed), ["outcomes.parquet differs"]);
}
