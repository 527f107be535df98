//! Damaged inputs of every kind end with a documented exit code and a message: never with a panic,
//! a hang or a demand for memory.
//!
//! Each target starts from valid files, damages one of them, and gives it to the program, which has
//! a limit of memory and of time. A damaged file whose result is new (another exit code, or other
//! words) joins the files that are damaged further. A night takes more rounds:
//!
//! ```sh
//! CLOSECALL_FUZZ_ROUNDS=20000 CLOSECALL_FUZZ_SEED=7 cargo test --release --workspace --test integration fuzz
//! ```
//!
//! A file that breaks the program is kept, and its path is printed.
#![cfg(unix)]

use std::collections::BTreeSet;
use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use closecall_testing::has_python;
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use crate::support::{ROOT, closecall, folder, library};

/// Damaged files of each target.
const ROUNDS: u64 = 60;
/// Limit of the address space (KiB). Threads reserve a part that they do not use.
const MEMORY_KIB: u64 = 6 << 20;
/// Limit of time for one file: many times the time of a valid one on a busy machine.
const LIMIT: Duration = Duration::from_secs(60);
/// Largest damaged file (bytes).
const MAX_BYTES: usize = 1 << 20;
/// The exit codes that are documented.
const CODES: std::ops::RangeInclusive<i32> = 0..=7;
/// What replaces a number.
const NUMBERS: [&str; 16] = [
    "0",
    "-1",
    "1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "1e-320",
    "9223372036854775808",
    "18446744073709551616",
    "1e400",
    "0.1e",
    "999999999",
    "null",
    "\"\"",
    "[]",
];
/// What is inserted anywhere.
const PIECES: [&[u8]; 10] = [
    b"\0",
    b"\xff\xfe",
    b"\"",
    b"[[[[[[[[[[[[[[[[",
    b"{{{{{{{{{{{{{{{{",
    b"\r\n",
    b"\xe2\x80\xae",
    b"]]>",
    b"&x;",
    b"\x1b[2J",
];

/// Returns how many files each target damages, and the seed.
fn rounds() -> (u64, u64) {
    let number = |name: &str, default| std::env::var(name).map_or(default, |text| text.parse().expect(name));
    (number("CLOSECALL_FUZZ_ROUNDS", ROUNDS), number("CLOSECALL_FUZZ_SEED", 1))
}

/// Returns damaged bytes.
fn damaged(bytes: &[u8], rng: &mut StdRng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..rng.random_range(1..4) {
        let length = bytes.len();
        let at = rng.random_range(0..=length);
        let end = (at + rng.random_range(0..200)).min(length);
        match rng.random_range(0..8) {
            0 if at < length => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes.truncate(at),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                let copies = if rng.random_bool(0.1) { 2000 } else { 1 };
                bytes.splice(at..at, piece.repeat(copies));
            }
            4 => drop(bytes.splice(at..at, PIECES[rng.random_range(0..PIECES.len())].iter().copied())),
            // The next number.
            _ => {
                let Some(first) = bytes[at..].iter().position(u8::is_ascii_digit) else { continue };
                let first = at + first;
                let is_of_number = |byte: &u8| byte.is_ascii_digit() || *byte == b'.';
                let count = bytes[first..].iter().take_while(|byte| is_of_number(byte)).count();
                let number = NUMBERS[rng.random_range(0..NUMBERS.len())];
                bytes.splice(first..first + count, number.bytes());
            }
        }
        bytes.truncate(MAX_BYTES);
    }
    bytes
}

/// Runs the program with limits of memory and time. `None` if it took too long.
fn limited(words: &[String], within: &Path) -> Option<Output> {
    let program = env!("CARGO_BIN_EXE_closecall");
    let mut child = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MEMORY_KIB}; exec \"$@\""), "sh", program])
        .args(words)
        .current_dir(within)
        .env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"))
        .stdin(Stdio::null())
        .stdout(fs::File::create(within.join("stdout")).unwrap())
        .stderr(fs::File::create(within.join("stderr")).unwrap())
        .spawn()
        .unwrap();
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            let read = |name: &str| fs::read(within.join(name)).unwrap();
            return Some(Output { status, stdout: read("stdout"), stderr: read("stderr") });
        }
        if started.elapsed() > LIMIT {
            child.kill().unwrap();
            child.wait().unwrap();
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The features that tell two results apart: the exit code, and the first words of the program's
/// complaint.
fn kind(output: &Output) -> (Option<i32>, String) {
    let text = String::from_utf8_lossy(&output.stderr) + String::from_utf8_lossy(&output.stdout);
    let words: String = text.chars().filter(|c| c.is_alphabetic() || *c == ' ').take(80).collect();
    (output.status.code(), words)
}

/// Damages the file `place` within a folder again and again, starting from `seeds`, and runs the
/// program with `words` each time.
fn fuzz(target: &str, seeds: &[Vec<u8>], within: &Path, place: &str, words: &[&str]) {
    fuzz_within(target, seeds, within, place, words, &|bytes| bytes.to_vec());
}

/// The same for bytes that lie within a file, which `wrapped` makes of them.
fn fuzz_within(
    target: &str,
    seeds: &[Vec<u8>],
    within: &Path,
    place: &str,
    words: &[&str],
    wrapped: &dyn Fn(&[u8]) -> Vec<u8>,
) {
    let words: Vec<String> = words.iter().map(|&word| word.to_owned()).collect();
    let (rounds, seed) = rounds();
    let mut rng = StdRng::seed_from_u64(seed);
    let mut corpus = seeds.to_vec();
    let mut kinds = BTreeSet::new();
    for seed in seeds {
        fs::write(within.join(place), wrapped(seed)).unwrap();
        let output = limited(&words, within).expect("a valid file in time");
        assert!(matches!(output.status.code(), Some(0 | 1 | 4)), "{target}: a valid file is refused: {output:?}");
    }
    for round in 0..rounds {
        let bytes = damaged(&corpus[rng.random_range(0..corpus.len())], &mut rng);
        fs::write(within.join(place), wrapped(&bytes)).unwrap();
        let output = limited(&words, within);
        let is_documented = |output: &Output| {
            let complaint = String::from_utf8_lossy(&output.stderr);
            let is_said = output.status.success() || !output.stderr.is_empty() || !output.stdout.is_empty();
            output.status.code().is_some_and(|code| CODES.contains(&code)) && !complaint.contains("panicked") && is_said
        };
        if !output.as_ref().is_some_and(is_documented) {
            let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{target}-{round}"));
            fs::write(&kept, &bytes).unwrap();
            panic!("{target}: {} breaks the program: {words:?} {output:?}", kept.display());
        }
        let output = output.unwrap();
        assert!(!output.stderr.contains(&0x1b), "{target}: a control character reaches the terminal: {output:?}");
        if kinds.insert(kind(&output)) {
            corpus.push(bytes);
        }
    }
    assert!(!kinds.is_empty(), "{target}: nothing was run");
}

fn read(path: &str) -> Vec<u8> {
    fs::read(Path::new(ROOT).join(path)).unwrap()
}

#[test]
fn damaged_scenarios_are_refused() {
    let seeds = ["low-thw-overtake", "paper-figure", "traffic/busy-overtake", "faults/lidar-dead"]
        .map(|name| fs::read(library(name)).unwrap());
    let folder = folder();
    // Files that a scenario names lie beside it.
    let copied =
        Command::new("cp").arg("-r").arg(Path::new(ROOT).join("scenarios/library/fleets")).arg(folder.path()).status();
    assert!(copied.unwrap().success());
    fs::create_dir(folder.path().join("traffic")).unwrap();
    fuzz("scenario", &seeds[..2], folder.path(), "own.toml", &["check", "own.toml"]);
    fuzz("base", &seeds[3..], folder.path(), "own.toml", &["check", "own.toml"]);
    fuzz("surroundings", &seeds[2..3], folder.path(), "traffic/own.toml", &["check", "traffic/own.toml"]);
}

#[test]
fn damaged_fits_and_settings_are_refused() {
    let folder = folder();
    let fitted = String::from_utf8(read("scenarios/library/fitted/us101.toml")).unwrap();
    let is_kept =
        |line: &&str| line.starts_with('[') || line.starts_with("front-thw-s") || line.starts_with("cut-out-thw-s");
    let fitted: String = fitted.lines().filter(is_kept).map(|line| format!("{line}\n")).collect();
    fuzz(
        "fitted",
        &[fitted.into_bytes()],
        folder.path(),
        "fit.toml",
        &["check", "low-thw-overtake", "--fitted", "fit.toml"],
    );
    let settings = closecall(["init", folder.path().join("repository").to_str().unwrap()]);
    assert!(settings.status.success());
    let within = folder.path().join("repository");
    let written = fs::read(within.join("closecall.toml")).unwrap();
    fuzz("settings", &[written], &within, "closecall.toml", &["check", "scenarios"]);
}

#[test]
fn damaged_recordings_of_traffic_are_refused() {
    let folder = folder();
    for (name, file) in [("csv", "csv/three.csv"), ("commonroad", "commonroad/two.xml"), ("ngsim", "ngsim/export.csv")]
    {
        let seed = read(&format!("scenarios/fuzz/{file}"));
        let place = Path::new(file).file_name().unwrap().to_str().unwrap();
        fuzz(name, &[seed], folder.path(), place, &["traffic", "inspect", place]);
    }
    let mut pairs =
        "pair_id,time_s,follower_front_y_m,follower_speed_mps,leader_front_y_m,leader_length_m,leader_speed_mps\n"
            .to_owned();
    for (pair, step) in (0..3).flat_map(|pair| (0..250).map(move |step| (pair, step))) {
        let time_s = 0.1 * f64::from(step);
        pairs += &format!("p{pair},{time_s:.1},{},10.0,{},4.5,10.0\n", 10.0 * time_s, 10.0 * time_s + 20.0);
    }
    fuzz("pairs", &[pairs.into_bytes()], folder.path(), "pairs.csv", &["traffic", "calibrate", "pairs.csv"]);
}

/// Runs a campaign whose folder is damaged, and returns the folder.
fn campaign(within: &Path) -> PathBuf {
    let out = within.join("out");
    let words = ["campaign", "low-thw-overtake", "-n", "3", "--sensors", "object", "--paired", "--no-gate", "--out"];
    let ran = closecall(words.iter().copied().chain([out.to_str().unwrap()]));
    assert!(ran.status.success(), "{ran:?}");
    out
}

#[test]
fn damaged_results_are_refused() {
    let folder = folder();
    let out = campaign(folder.path());
    for file in ["journal.jsonl", "manifest.json", "wall-times.jsonl"] {
        let whole = fs::read(out.join(file)).unwrap();
        fuzz(file, std::slice::from_ref(&whole), folder.path(), &format!("out/{file}"), &["check", "out"]);
        fs::write(out.join(file), &whole).unwrap();
    }
    let saved =
        closecall(["baseline", "save", out.to_str().unwrap(), folder.path().join("base.json").to_str().unwrap()]);
    assert!(saved.status.success(), "{saved:?}");
    let baseline = fs::read(folder.path().join("base.json")).unwrap();
    fuzz("baseline", &[baseline], folder.path(), "base.json", &["baseline", "compare", "out", "base.json"]);
}

#[test]
fn damaged_networks_are_refused() {
    let Some(onnxruntime) = closecall_testing::onnxruntime() else { return };
    let folder = folder();
    let network = read("sensors/tests/mask_rcnn_layouts/torchvision.onnx");
    let mut words =
        vec!["run", "low-thw-overtake", "--onnxruntime", onnxruntime.to_str().unwrap(), "--sensors", "full"];
    let settings = [
        "duration-s=0.2",
        "sensors.rear-camera.pipeline=mask-rcnn",
        "sensors.rear-camera.mask-rcnn.model=network.onnx",
        "sensors.rear-camera.mask-rcnn.labels=\"3=car 4=motorcycle 8=truck\"",
    ];
    settings.iter().for_each(|setting| words.extend(["--set", setting]));
    fuzz("network", &[network], folder.path(), "network.onnx", &words);
}

/// Returns an FMU with another description.
fn with_description(fmu: &[u8], xml: &[u8]) -> Vec<u8> {
    let mut archive = zip::ZipArchive::new(Cursor::new(fmu)).unwrap();
    let mut written = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for index in 0..archive.len() {
        let mut file = archive.by_index(index).unwrap();
        let name = file.name().unwrap().into_owned();
        written.start_file(&name, zip::write::SimpleFileOptions::default()).unwrap();
        if name == "modelDescription.xml" {
            written.write_all(xml).unwrap();
        } else {
            std::io::copy(&mut file, &mut written).unwrap();
        }
    }
    written.finish().unwrap().into_inner()
}

#[test]
fn damaged_fmus_are_refused() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let built = crate::fmu_controllers::fmu("2", &folder.path().join("own.fmu"), &[]);
    assert!(built.starts_with("fmu:"));
    let whole = fs::read(folder.path().join("own.fmu")).unwrap();
    let words = ["run", "low-thw-overtake", "--sensors", "ground-truth", "--set", "duration-s=1", "--controller"];
    let words = [&words[..], &["fmu:own.fmu"]].concat();
    fuzz_within("fmu", std::slice::from_ref(&whole), folder.path(), "own.fmu", &words, &|bytes| bytes.to_vec());
    let description = read("examples/fmu/modelDescription-fmi2.xml");
    fuzz_within("fmu-description", &[description], folder.path(), "own.fmu", &words, &|xml| {
        with_description(&whole, xml)
    });
}

#[test]
fn damaged_answers_of_a_controller_are_errors() {
    let folder = folder();
    // It greets with the first line of a file, and answers each step with the second one.
    let script = "answer() { printf '%s\\n' \"$(sed -n \"$1p\" answers)\"; }\n\
        read -r hello; answer 1; while read -r step; do answer 2; done\n";
    fs::write(folder.path().join("controller.sh"), script).unwrap();
    let answers = b"{\"type\":\"hello\",\"protocol\":1,\"name\":\"fuzzed\"}\n{\"acceleration_mps2\":0.1,\"state\":\"following\"}\n".to_vec();
    let words = ["run", "low-thw-overtake", "--sensors", "ground-truth", "--set", "duration-s=1", "--controller"];
    fuzz("answers", &[answers], folder.path(), "answers", &[&words[..], &["exec:sh controller.sh"]].concat());
}
