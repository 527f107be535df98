//! Runs the program and reads its output.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};

use closecall_campaign::folder::Folder;
use closecall_campaign::record::Record;
use serde_json::Value;

/// The folder of the repository.
pub(crate) const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Returns the path of a scenario of the library.
pub(crate) fn library(name: &str) -> PathBuf {
    library_folder().join(format!("{name}.toml"))
}

/// Returns the paths of all scenarios of the library, in alphabetical order.
pub(crate) fn all_of_library() -> Vec<PathBuf> {
    scenarios_in(&library_folder())
}

/// Returns the scenarios of the library that have surrounding traffic.
pub(crate) fn traffic_of_library() -> Vec<PathBuf> {
    scenarios_in(&library_folder().join("traffic"))
}

/// Returns the scenarios of the library in separate folders, folder by folder: emergency braking,
/// cruise control, the headline as recorded, emergency braking beside a human driver, and ramps.
pub(crate) fn families_of_library() -> [Vec<PathBuf>; 5] {
    ["aeb", "acc", "as-recorded", "anchor", "ramp"].map(|name| scenarios_in(&library_folder().join(name)))
}

fn scenarios_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the scenario library");
    let paths = entries.map(|entry| entry.expect("an entry of the scenario library").path());
    let mut files: Vec<PathBuf> = paths.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    files.sort();
    files
}

fn library_folder() -> PathBuf {
    Path::new(ROOT).join("scenarios/library")
}

/// Returns the program, ready to run in the folder of the repository.
pub(crate) fn program() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_closecall"));
    // What the tests run is not remembered among the user's own campaigns.
    program.current_dir(ROOT).env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    program
}

/// Runs the program in the folder of the repository. A campaign that names no folder keeps no
/// results: they would lie there. One that names no recordings keeps none: they take longer than
/// small campaigns do.
pub(crate) fn closecall<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    let mut args: Vec<OsString> = args.into_iter().map(|arg| arg.as_ref().to_owned()).collect();
    let names = |option: &str| args.iter().any(|arg| arg.to_str().is_some_and(|arg| arg.starts_with(option)));
    if args.first().is_some_and(|command| command == "campaign") {
        let added = match names("--out") {
            false => &["--no-out"][..],
            // Weighted runs have no recordings.
            true if names("--record") || names("--event") => &[],
            true => &["--record", "failures:0"],
        };
        args.splice(1..1, added.iter().map(OsString::from));
    }
    program().args(args).output().expect("the program starts")
}

/// Returns the exit code of a run of the program.
pub(crate) fn code(output: &Output) -> i32 {
    output.status.code().expect("no signal ended the program")
}

/// Returns the standard output of the program. Fails if the program ended with another exit code
/// than `expected`.
pub(crate) fn stdout(output: &Output, expected: i32) -> String {
    assert_eq!(code(output), expected, "{}", stderr(output));
    String::from_utf8(output.stdout.clone()).expect("the output is text")
}

/// Returns the standard error of the program.
pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Returns the standard error of the program in one line: without the frames and line breaks of its
/// error reports.
pub(crate) fn message(output: &Output) -> String {
    stderr(output).replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the words of a gate in a line of a verdict. The page has its scenario, its words and its
/// criterion in separate cells.
pub(crate) fn words_of_gate(line: &str) -> &str {
    const STANDINGS: [&str; 4] = ["NOT MET: ", "open: ", "met: ", "not checked: "];
    let Some(of_scenario) = STANDINGS.iter().find_map(|standing| line.strip_prefix(standing)) else { return line };
    let words = of_scenario.split_once(" [").map_or(of_scenario, |(words, _)| words);
    let words = words.split_once(": ").map_or(words, |(_, rest)| rest);
    match words.split_once(": ") {
        Some((mark, rest)) if mark.starts_with("MIS-") => rest,
        _ => words,
    }
}

/// Returns the JSON value that the program printed. Fails if the program ended with another exit
/// code than `expected`.
pub(crate) fn json(output: &Output, expected: i32) -> Value {
    serde_json::from_str(&stdout(output, expected)).expect("the output is JSON")
}

/// Returns the JSON value of a file.
pub(crate) fn json_file(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("the file is JSON")
}

/// Returns the records of a campaign's journal as JSON. A line is a checksum and a record.
pub(crate) fn journal(out: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(out.join("journal.jsonl")).expect("a journal");
    let record = |line: &str| serde_json::from_str(line.split_once(' ').expect("a checksum").1).expect("a record");
    text.lines().map(record).collect()
}

/// Waits until a running campaign has written results to its journal.
pub(crate) fn wait_for_results(campaign: &mut Child, journal: &Path) {
    const BYTES: u64 = 10_000;
    let started = Instant::now();
    while std::fs::metadata(journal).map_or(0, |journal| journal.len()) < BYTES {
        assert!(campaign.try_wait().unwrap().is_none(), "the campaign ended too early");
        assert!(started.elapsed() < Duration::from_secs(300), "the campaign hangs");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Returns the records of a campaign's journal in the order of the samples.
pub(crate) fn records(out: &Path) -> Vec<Record> {
    Folder::open(out).records().expect("a journal").map(|record| record.expect("a record")).collect()
}

/// Creates a folder that is removed at the end of the test.
pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Creates a folder that several tests share. It stays in the folder of the build: a static value has
/// no end.
pub(crate) fn shared_folder() -> PathBuf {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a temporary folder").keep()
}

/// Returns the text of the scenario `low-thw-overtake` with the first `from` replaced by `to`.
pub(crate) fn headline_with(from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(library("low-thw-overtake")).expect("the scenario low-thw-overtake");
    assert!(text.contains(from), "low-thw-overtake has no `{from}`");
    text.replacen(from, to, 1)
}
