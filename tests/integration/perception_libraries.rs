//! A perception of the user's own as a shared library: the example in C drives the headline, and
//! whatever a library does wrong costs its sample with a message that names the fault.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::exec_controller::left_behind;
use crate::native_controllers::{compile, lib, with_fault};
use crate::outside_perception::{SECOND_CAMERA, assert_drives};
use crate::support::{code, folder, json, json_file, message, program, stderr, stdout};

const EXAMPLE: &str = "examples/groups_perception.c";
const FAULTY: &str = "tests/fixtures/perceptions/faulty.c";
const SHORT: [&str; 4] = ["--set", "duration-s=2", "--set", "sensors.rear-camera.pipeline=off"];

fn setting(library: &Path) -> String {
    format!("sensors.perception=\"{}\"", lib(library))
}

/// Runs two seconds of the headline with a library that shows a fault.
fn run(library: &Path, fault: Option<&str>, more: &[&str]) -> Output {
    let mut command = program();
    command.args(["run", "low-thw-overtake", "--sensors", "full", "--set", &setting(library)]).args(SHORT).args(more);
    with_fault(&mut command, fault)
}

/// Compiles the library with faults for tracks and for detections.
fn faulty(folder: &Path) -> [PathBuf; 2] {
    [("tracks.so", &[][..]), ("detections.so", &["-DDETECTIONS"][..])]
        .map(|(name, options)| compile(FAULTY, &folder.join(name), options))
}

#[test]
fn the_example_in_c_and_a_library_of_detections_drive_the_headline() {
    let folder = folder();
    let [_, detections] = faulty(folder.path());
    let example = compile(EXAMPLE, &folder.path().join("groups.so"), &[]);
    for library in [example, detections] {
        let off = ["--set", "sensors.rear-camera.pipeline=off", "--set", "duration-s=12"];
        assert_drives(&lib(&library), 5.0, &off);
    }
}

#[test]
fn a_library_gets_images_and_radar_scans_and_has_the_same_bits_again() {
    let folder = folder();
    // The library checks sizes, rates and values itself.
    let images = ["--set", "sensors.perception-image-hz=5", "--set", "sensors.perception-image-step=8"];
    let radars = ["--set", "sensors.rear-radar={ range-m = 300 }"];
    for library in faulty(folder.path()) {
        stdout(&run(&library, None, &images), 0);
        stdout(&run(&library, None, &[&images[..], &["--set", SECOND_CAMERA]].concat()), 0);
        stdout(&run(&library, Some("needs-radars"), &radars), 0);
        let output = run(&library, Some("needs-radars"), &[]);
        assert_eq!(code(&output), 5, "{}", stderr(&output));
        assert!(message(&output).contains("the library answered with the error 8: no radars"), "{}", message(&output));
        let outcome = || json(&run(&library, None, &["--seed", "1", "--format", "json"]), 0);
        assert_eq!(outcome(), outcome());
        // What a library prints is no answer.
        assert_eq!(stdout(&run(&library, Some("prints"), &[]), 0), stdout(&run(&library, None, &[]), 0));
    }
}

/// The faults of both libraries, each with a part of the message of its sample.
const FAULTS: [(&str, &str); 8] = [
    ("segfault", "the perception ended its process (signal: 11 (SIGSEGV)); it last wrote: about to crash"),
    ("abort", "the perception ended its process (signal: 6 (SIGABRT))"),
    ("exit-0", "the perception ended its process (exit status: 0)"),
    ("exit-3", "the perception ended its process (exit status: 3)"),
    ("closes", "its process"),
    ("error", "the library answered with the error 7: the map is missing"),
    ("no-licence", "closecall_perception_create answered null: the library created no perception: no licence"),
    ("hang", "hangs: no answer in twice the 500 ms allowed"),
];

#[test]
fn each_fault_of_a_library_costs_its_sample_and_leaves_no_process() {
    let folder = folder();
    let [tracks, detections] = faulty(folder.path());
    let of_tracks = [
        ("nan-variance", "the library answered: `tracks[0].covariance[1][1]` must be a variance"),
        ("nan-covariance", "`tracks[0].covariance[0][1]` must be a number, it is NaN"),
        ("infinite", "`tracks[0].vx_mps` must be a number from -150 to 150, it is inf"),
        ("negative-variance", "`tracks[0].covariance[1][1]` must be a variance"),
        ("status", "`tracks[0].status` must be \"tentative\", \"confirmed\" or \"coasting\", it is 9"),
        ("class", "`tracks[0].class.car` must be a number from 0 to 1, it is 3"),
        ("twice", "`tracks[1].id` must be a number that no other track of the answer has"),
        ("unset", "`tracks[0].covariance[0][0]` must be a variance"),
        ("many", "the library answered 257 tracks; there is room for 256"),
    ];
    let of_detections = [
        ("nan-variance", "`detections[0].covariance[1][1]` must be a variance"),
        ("seen", "`detections[0].width_is_seen` must be true or false, it is 2"),
        ("unset", "`detections[0].x_m` must be a number from -500 to 500, it is NaN"),
        ("many", "the library answered 257 detections; there is room for 256"),
    ];
    for (library, own) in [(&tracks, &of_tracks[..]), (&detections, &of_detections[..])] {
        for (fault, expected) in FAULTS.iter().chain(own) {
            let patience = if *fault == "hang" { "500" } else { "60000" };
            let limit = format!("sensors.perception-timeout-ms={patience}");
            let output = run(library, Some(*fault), &["--set", &limit]);
            assert_eq!(code(&output), 5, "{fault}: {}", stderr(&output));
            let text = message(&output);
            assert!(text.contains(*expected), "{fault}: {text}");
            assert!(
                text.contains(&format!("failed to perceive at {}", if *fault == "no-licence" { "-1" } else { "0.16" }))
            );
            assert!(text.contains(&format!("`{}`", lib(library))), "{fault}: {text}");
        }
    }
    let limits = ["--set", "sensors.perception-memory-mib=256", "--set", "sensors.perception-timeout-ms=60000"];
    let text = message(&run(&tracks, Some("leak"), &limits));
    assert!(text.contains("holds more than the 256 MiB of memory allowed"), "{text}");
    // The copy of the process answers, too.
    let text = message(&run(&tracks, Some("forks"), &[]));
    let says = ["a line that nobody had asked for", "was asked for the one at", "which is not JSON"];
    assert!(says.iter().any(|part| text.contains(part)), "{text}");
    let mark = format!("perception-{}", std::process::id());
    let mut command = program();
    command.args(["run", "low-thw-overtake", "--sensors", "full", "--set", &setting(&tracks)]).args(SHORT);
    command.args(["--set", "sensors.perception-timeout-ms=500"]).env("CLOSECALL_TEST_MARK", &mark);
    assert_eq!(code(&with_fault(&mut command, Some("hang"))), 5);
    assert_eq!(left_behind(&mark), Vec::<String>::new());
}

#[test]
fn a_crash_while_a_perception_is_freed_is_an_error_of_its_run_and_one_while_its_library_is_unloaded_is_none() {
    let folder = folder();
    let [tracks, _] = faulty(folder.path());
    let output = run(&tracks, Some("frees"), &[]);
    assert_eq!(code(&output), 5, "{}", stderr(&output));
    let expected = "the perception ended its process (signal: 6 (SIGABRT)); it last wrote: freed twice";
    assert!(message(&output).contains(expected), "{}", stderr(&output));
    assert_eq!(stdout(&run(&tracks, Some("unloads"), &[]), 0), stdout(&run(&tracks, None, &[]), 0));
}

#[test]
fn a_library_that_cannot_perceive_is_refused_before_the_first_sample() {
    let folder = folder();
    let source = |name: &str, text: &str| {
        let path = folder.path().join(format!("{name}.c"));
        std::fs::write(&path, text).unwrap();
        compile(path.to_str().unwrap(), &folder.path().join(format!("{name}.so")), &[])
    };
    let complete = |abi: &str, answers: &str| {
        format!(
            "#include <stdint.h>\n#include <stddef.h>\nuint32_t closecall_perception_abi(void) {{ return {abi}; }}\n\
             int32_t closecall_perception_answers(void) {{ return {answers}; }}\n\
             void *closecall_perception_create(const void *s) {{ return NULL; }}\n\
             int32_t closecall_perception_step(void *p, const void *i, void *a) {{ return 0; }}\n\
             void closecall_perception_destroy(void *p) {{}}\n"
        )
    };
    let text = folder.path().join("text.so");
    std::fs::write(&text, "not a library\n").unwrap();
    let controller = compile("examples/acc_controller.c", &folder.path().join("acc.so"), &[]);
    let [faulty, _] = faulty(folder.path());
    let cases = [
        (folder.path().join("absent.so"), None, 6, "failed to read"),
        (text, None, 3, "text.so is not a shared library"),
        (source("abi", &complete("7", "1")), None, 3, "has version 7 of the interface, this is version 1"),
        (
            source("answers", &complete("1", "5")),
            None,
            3,
            "`closecall_perception_answers` returned 5; expected 0 (detections) or 1 (tracks)",
        ),
        (
            source("symbol", "int closecall_perception_abi(void) { return 1; }"),
            None,
            3,
            "does not export `closecall_perception_answers`, `closecall_perception_create`, `closecall_perception_step`",
        ),
        (controller, None, 3, "does not export `closecall_perception_abi`"),
        (faulty.clone(), Some("boxes"), 3, "`closecall_perception_answers` returned 5"),
        (faulty.clone(), Some("loads-not"), 3, "the perception ended its process (signal: 6 (SIGABRT))"),
        (faulty, Some("loads-never"), 3, "it is not loaded within 10 s: its constructor may wait or loop"),
    ];
    for (library, fault, expected, part) in cases {
        let out = folder.path().join("out");
        let mut command = program();
        command.args(["campaign", "low-thw-overtake", "-n", "1", "--sensors", "full", "--no-gate"]);
        command.args(["--set", &setting(&library), "--out", out.to_str().unwrap()]);
        for output in [with_fault(&mut command, fault), run(&library, fault, &[])] {
            assert_eq!(code(&output), expected, "{part}: {}", stderr(&output));
            let text = message(&output);
            assert!(text.contains(part) && text.contains(&lib(&library)), "{part}: {text}");
        }
        assert!(!out.exists(), "{part}");
    }
}

#[test]
fn a_campaign_knows_its_library_and_is_not_resumed_with_another_one() {
    let folder = folder();
    let library = compile(FAULTY, &folder.path().join("own.so"), &[]);
    let out = folder.path().join("out");
    let campaign = |more: &[&str]| {
        let mut command = program();
        command.current_dir(folder.path());
        command.args(["campaign", "low-thw-overtake", "-n", "2", "--sensors", "full", "--no-gate", "--jobs", "2"]);
        command.args(["--no-validity-checks", "--set", "expects=[]", "--set", "sensors.perception=\"lib:own.so\""]);
        command.args(SHORT).args(["--out", out.to_str().unwrap()]).args(more).output().unwrap()
    };
    // A bare name is the file in the working folder.
    stdout(&campaign(&[]), 0);
    let manifest = json_file(&out.join("manifest.json"));
    let stated = &manifest["controllers"][0];
    assert_eq!(stated["command"], "sensors.perception=lib:own.so", "{manifest}");
    assert_eq!((&stated["identity"]["name"], &stated["identity"]["version"]), (&"groups in C".into(), &"1".into()));
    assert_eq!(stated["files"].as_array().map(Vec::len), Some(1), "{stated}");
    // A replay runs it in the folder of its campaign.
    stdout(&program().args(["replay", out.to_str().unwrap(), "1"]).output().unwrap(), 0);
    // No output may take the place of the library.
    let run = ["run", "low-thw-overtake", "--set", &setting(&library), "--trace", library.to_str().unwrap()];
    let before = std::fs::read(&library).unwrap();
    assert_eq!(code(&program().args(run).output().unwrap()), 2);
    assert!(std::fs::read(&library).unwrap() == before);
    compile(FAULTY, &library, &["-DVERSION=\"2\""]);
    let output = campaign(&["--resume"]);
    assert_eq!(code(&output), 2, "{}", stderr(&output));
    let text = message(&output);
    assert!(text.contains("the perception program's file own.so has changed"), "{text}");
    assert!(text.contains("the perception program states another version: `1` there, `2` here"), "{text}");
}
