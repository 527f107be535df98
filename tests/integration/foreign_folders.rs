//! A folder that another machine or another user has written runs nothing unasked, and leads to no
//! other file.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use crate::native_controllers::{compile, lib};
use crate::support::{closecall, code, folder, message, program, stderr, stdout};

/// A controller that says that it runs, in a file beside it.
pub(crate) const TELLING: &str = r#"#!/bin/sh
echo ran >> "$(dirname "$0")/ran"
echo '{"type":"hello","protocol":1,"name":"telling","version":"1"}'
read -r line
while read -r line; do echo '{"acceleration_mps2":0.0,"state":"following"}'; done
"#;

/// A scan pattern of a LiDAR.
const PATTERN: &str = r#"
name = "beside"
source = "none"
layers-deg = [-4.0, -3.0, -2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0]
layer-spacing-deg = 0.5
half-field-deg = 60.0
azimuth-step-deg = 0.2
beam-width-deg = 0.1
beam-height-deg = 0.5
rate-hz = 10.0
range-m = 80.0
range-reflectivity = 0.1
range-probability = 0.9
range-sd-m = 0.02
range-sd-at-threshold-m = 0.06
"#;

/// The program of a user with the state folder `home`.
fn of_user(home: &Path, folder: &Path) -> Command {
    let mut command = program();
    command.current_dir(folder).env("XDG_STATE_HOME", home);
    command
}

fn run(command: &mut Command, words: &[&str]) -> Output {
    command.args(words).output().unwrap()
}

#[test]
fn commands_of_a_foreign_folder_run_only_if_it_is_trusted_and_are_printed_first() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    fs::write(at("telling.sh"), TELLING).unwrap();
    let ran = at("ran");
    let controller = "exec:sh telling.sh";
    let campaign = ["campaign", "low-thw-overtake", "-n", "3", "--sensors", "object", "--no-gate", "--paired"];
    let limits = ["--controller", controller, "--controller-timeout-ms", "60000"];
    let [user_folder, foreign] = ["own", "foreign"].map(at);
    let user = |home: &Path| of_user(home, place.path());
    stdout(&run(user(&user_folder).args(campaign).args(limits), &["--out", "out", "--record", "failures:0"]), 0);
    fs::remove_file(&ran).unwrap();

    let commands: [&[&str]; 5] = [
        &["replay", "out", "1"],
        &["replay", "out", "1", "--paired"],
        &["plot", "out", "1", "-o", "figure.svg"],
        &["explain", "out", "1"],
        &["minimize", "out", "1"],
    ];
    for words in commands {
        let output = run(&mut user(&foreign), words);
        assert_eq!(code(&output), 2, "{words:?}: {}", stderr(&output));
        for named in ["telling.sh", "--trust-folder", place.path().to_str().unwrap()] {
            assert!(message(&output).contains(named), "{words:?}: {}", stderr(&output));
        }
        assert!(!ran.exists(), "{words:?}");
    }
    // A repair does not name the command of another author.
    let journal = fs::read_to_string(at("out/journal.jsonl")).unwrap();
    fs::write(at("out/journal.jsonl"), journal.lines().take(2).map(|line| format!("{line}\n")).collect::<String>())
        .unwrap();
    let listed = stdout(&run(&mut user(&foreign), &["check", "out"]), 3);
    assert!(listed.contains("--out out --resume") && listed.contains("another user or another machine"), "{listed}");
    assert!(!listed.contains("telling.sh"), "{listed}");
    assert!(stdout(&run(&mut user(&user_folder), &["check", "out"]), 3).contains("telling.sh"));
    fs::write(at("out/journal.jsonl"), journal).unwrap();
    // The baseline of the program needs nothing of the folder.
    stdout(&run(&mut user(&foreign), &["replay", "out", "1", "--controller", "acc"]), 0);
    assert!(!ran.exists());
    // A command that the user writes is the user's own.
    let words = ["replay", "out", "1", "--controller", controller];
    stdout(&run(&mut user(&foreign), &words), 0);
    assert!(ran.exists());
    let trusted = run(&mut user(&foreign), &["replay", "out", "1", "--trust-folder"]);
    stdout(&trusted, 0);
    assert!(message(&trusted).contains("trusting out, which names: exec:sh telling.sh"), "{}", stderr(&trusted));
    // The user who has run the campaign is not asked, nor after the folder was moved.
    fs::rename(at("out"), at("moved")).unwrap();
    stdout(&run(&mut user(&user_folder), &["replay", "moved", "1"]), 0);
    // An edited manifest is not the one that was written.
    let manifest = at("moved/manifest.json");
    let edited = fs::read_to_string(&manifest).unwrap().replace("sh telling.sh", "sh  telling.sh");
    fs::write(&manifest, edited).unwrap();
    assert_eq!(code(&run(&mut user(&user_folder), &["replay", "moved", "1"])), 2);
}

/// The text of the scenario in a foreign manifest can be one that is a scenario in that folder
/// only, or for some samples only. Its program needs the same trust.
#[test]
fn a_program_that_a_foreign_scenario_hides_does_not_run() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    let [user_folder, foreign] = ["own", "foreign"].map(at);
    let user = |home: &Path| of_user(home, place.path());
    let campaign =
        ["campaign", "low-thw-overtake", "-n", "2", "--no-gate", "--no-validity-checks", "--controller", "acc"];
    let more = ["--set", "sensors.rear-lidar.mount-height-m=0.7", "--out", "out", "--record", "failures:0"];
    stdout(&run(user(&user_folder).args(campaign), &more), 0);
    let manifest = at("out/manifest.json");
    let kept: serde_json::Value = serde_json::from_str(&fs::read_to_string(&manifest).unwrap()).unwrap();
    let text = kept["scenarios"][0]["text"].as_str().unwrap();
    let ran = at("ran");
    let lidar = "rear-lidar = { mount-height-m = 0.7 }";
    let program = format!("[sensors]\nperception = \"exec:touch {}\"\n", ran.display());
    let plain = text.replacen("[sensors]\n", &program, 1);
    // Nothing is in the place from which the manifest says that the scenario was read.
    fs::write(at("out/beside.toml"), PATTERN).unwrap();
    let beside = plain.replacen(lidar, "rear-lidar = { pattern-file = \"beside.toml\" }", 1);
    // The typical height is too low, and the height of half the samples is not.
    let sampled = plain.replacen(lidar, "rear-lidar = { mount-height-m = \"$hidden-m\" }", 1);
    let sampled =
        sampled.replacen("[parameters]", "[parameters]\nhidden-m = { uniform = { min = -0.9, max = 1.1 } } #", 1);
    assert!(![&beside, &sampled].contains(&&plain) && sampled.contains("hidden-m = {"), "{plain}");
    let hidden = [plain, beside, sampled];
    fs::remove_file(at("out/journal.jsonl")).unwrap();
    for (index, text) in hidden.iter().enumerate() {
        assert!(text.contains("exec:touch"), "{text}");
        let mut edited = kept.clone();
        edited["scenarios"][0]["path"] = at("nowhere/scenario.toml").to_str().unwrap().into();
        edited["scenarios"][0]["text"] = text.as_str().into();
        edited["scenarios"][0]["blake3"] = blake3::hash(text.as_bytes()).to_string().into();
        fs::write(&manifest, edited.to_string()).unwrap();
        let commands: [&[&str]; 4] = [
            &["replay", "out", "0"],
            &["replay", "out", "1"],
            &["replay", "out", "1", "--controller", "acc"],
            &["plot", "out", "1", "-o", "figure.svg"],
        ];
        for words in commands {
            let output = run(&mut user(&foreign), words);
            assert_eq!(code(&output), 2, "{index} {words:?}: {}", stderr(&output));
            for named in ["exec:touch", "--trust-folder"] {
                assert!(message(&output).contains(named), "{index} {words:?}: {}", stderr(&output));
            }
            assert!(!ran.exists(), "{index} {words:?}");
        }
    }
}

#[test]
fn parts_of_others_are_merged_without_running_their_commands() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    fs::write(at("telling.sh"), TELLING).unwrap();
    let ran = at("ran");
    let controller = "exec:sh telling.sh";
    let [user_folder, foreign] = ["own", "foreign"].map(at);
    let user = |home: &Path| of_user(home, place.path());
    for part in ["1/2", "2/2"] {
        let out = format!("part-{}", &part[..1]);
        let words = ["campaign", "low-thw-overtake", "-n", "4", "--sensors", "object", "--no-gate", "--out", &out];
        let more = [
            "--partition",
            part,
            "--controller",
            controller,
            "--controller-timeout-ms",
            "60000",
            "--record",
            "failures:0",
        ];
        stdout(&run(user(&user_folder).args(words), &more), 0);
    }
    fs::remove_file(&ran).unwrap();
    let merge = ["tool", "merge", "part-1", "part-2", "--no-gate", "--out", "merged"];
    let output = run(&mut user(&foreign), &merge);
    stdout(&output, 0);
    assert!(
        message(&output).contains("no sample is recorded: parts were written by another user"),
        "{}",
        stderr(&output)
    );
    assert!(!ran.exists());
    // Merging makes nobody's commands one's own.
    assert_eq!(code(&run(&mut user(&foreign), &["replay", "merged", "1"])), 2);
    let recorded = ["tool", "merge", "part-1", "part-2", "--no-gate", "--out", "third", "--record", "worst:1"];
    assert_eq!(code(&run(&mut user(&foreign), &recorded)), 2);
    stdout(&run(&mut user(&user_folder), &["tool", "merge", "part-1", "part-2", "--no-gate", "--out", "again"]), 0);
    stdout(&run(&mut user(&user_folder), &["replay", "again", "1"]), 0);
}

/// Runs a command, and fails if it takes longer than a minute.
fn within_a_minute(command: &mut Command) -> Output {
    let mut child = command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(started.elapsed() < Duration::from_mins(1), "it hangs: {command:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().unwrap()
}

#[cfg(unix)]
#[test]
fn neither_a_link_nor_a_named_pipe_is_taken_for_a_file_of_a_folder() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    let campaign = || {
        let mut command = program();
        command.current_dir(place.path()).args([
            "campaign",
            "low-thw-overtake",
            "-n",
            "2",
            "--sensors",
            "ground-truth",
        ]);
        command.args(["--no-gate", "--record", "failures:0", "--out", "out", "--resume"]);
        command
    };
    for name in ["lock", "journal.jsonl", "wall-times.jsonl"] {
        for is_pipe in [false, true] {
            drop(fs::remove_dir_all(at("out")));
            stdout(&campaign().output().unwrap(), 0);
            let victim = at("victim");
            fs::write(&victim, "kept").unwrap();
            fs::remove_file(at("out").join(name)).unwrap();
            if is_pipe {
                assert!(Command::new("mkfifo").arg(at("out").join(name)).status().unwrap().success());
            } else {
                std::os::unix::fs::symlink(&victim, at("out").join(name)).unwrap();
            }
            let output = within_a_minute(&mut campaign());
            assert_eq!(code(&output), 6, "{name}: {}", stderr(&output));
            let refusal = if is_pipe { "it is a named pipe, not a file" } else { "it is a symbolic link, not a file" };
            assert!(
                message(&output).contains(name) && message(&output).contains(refusal),
                "{name}: {}",
                stderr(&output)
            );
            assert_eq!(fs::read_to_string(&victim).unwrap(), "kept", "{name}");
        }
    }
}

#[cfg(unix)]
#[test]
fn no_input_that_is_a_named_pipe_hangs() {
    let place = folder();
    let pipes = ["waits.toml", "waits.rrd", "waits.parquet", "waits.mcap"].map(|name| place.path().join(name));
    assert!(Command::new("mkfifo").args(&pipes).status().unwrap().success());
    let [pipe, recording, table, bag] = pipes.each_ref().map(|path| path.to_str().unwrap());
    let commands: [&[&str]; 10] = [
        &["check", pipe],
        &["run", pipe],
        &["campaign", pipe, "-n", "2", "--no-out"],
        &["campaign", "low-thw-overtake", "--ensemble", pipe, "-n", "2", "--no-out"],
        &["traffic", "inspect", pipe],
        &["traffic", "calibrate", pipe],
        &["run", "low-thw-overtake", "--controller", &format!("fmu:{pipe}")],
        &["view", recording, "--no-open"],
        &["study", "perceive", table],
        &["study", "perceive", bag],
    ];
    for words in commands {
        let output = within_a_minute(program().args(words));
        assert_ne!(code(&output), 0, "{words:?}");
        assert!(message(&output).contains("it is a named pipe"), "{words:?}: {}", stderr(&output));
    }
}

#[cfg(unix)]
#[test]
fn a_step_summary_that_is_a_named_pipe_costs_a_warning_and_no_time() {
    let place = folder();
    let pipe = place.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let out = place.path().join("out");
    let small = ["campaign", "overtake-without-brake", "-n", "2", "--no-gate", "--sensors", "ground-truth"];
    let run = |more: &[&str]| {
        within_a_minute(program().args(small).args(more).env("GITHUB_STEP_SUMMARY", &pipe).env("RERUN", "off"))
    };
    let kept = ["--out", out.to_str().unwrap()];
    let runs = [
        (&["--no-out"][..], 0),
        (&["--no-out", "--strict-artifacts"], 6),
        (&kept[..], 0),
        (&["--resume", "--strict-artifacts", kept[0], kept[1]], 6),
    ];
    for has_reader in [false, true] {
        drop(fs::remove_dir_all(&out));
        for (more, expected) in runs {
            // A pipe that somebody reads could be opened, and may be read at any pace.
            let reader =
                has_reader.then(|| Command::new("cat").arg(&pipe).stdout(std::process::Stdio::null()).spawn().unwrap());
            let output = run(more);
            assert!(stdout(&output, expected).contains("measured, not judged"), "{more:?}: {}", stderr(&output));
            let warning = "warning: the summary for the CI server (GITHUB_STEP_SUMMARY) is missing: failed to write";
            assert!(message(&output).contains(warning), "{more:?}: {}", stderr(&output));
            assert!(message(&output).contains("it is a named pipe, not a file"), "{more:?}: {}", stderr(&output));
            if let Some(mut reader) = reader {
                let _ = reader.kill();
                reader.wait().unwrap();
            }
        }
        for file in ["summary.md", "junit.xml", "report.html"] {
            assert!(out.join(file).is_file(), "{file}");
        }
    }
}

#[test]
fn a_controller_that_changes_during_the_campaign_makes_it_invalid() {
    let place = folder();
    let at = |name: &str| place.path().join(name);
    // The controller edits a file in its first run: itself, or a file that it reads.
    let script = |edited: &str| {
        format!(
            "#!/bin/sh\n. ./helper.sh\nun=un\n[ -e edited ] || {{ : > edited; echo '# more' >> {edited}; }}\n\
             echo '{{\"type\":\"hello\",\"protocol\":1,\"name\":\"a\",\"version\":\"1\"}}'\nread -r line\n\
             while read -r line; do echo '{{\"acceleration_mps2\":0.0,\"state\":\"following\"}}'; done\n"
        )
    };
    for (edited, is_noticed) in [("own.sh", true), ("helper.sh", true), ("unused.sh", false)] {
        for name in ["out", "edited"] {
            drop(fs::remove_dir_all(at(name)));
            drop(fs::remove_file(at(name)));
        }
        fs::write(at("helper.sh"), "true\n").unwrap();
        fs::write(at("unused.sh"), "true\n").unwrap();
        // A name in the text would count as the name of a part.
        fs::write(at("own.sh"), script(&edited.replace("unused", "${un}used"))).unwrap();
        // The greeting before the campaign is no part of it.
        fs::write(at("edited"), "").unwrap();
        let mut command = program();
        command.current_dir(place.path());
        let fixed = ["campaign", "low-thw-overtake", "-n", "3", "--sensors", "object", "--no-gate", "--out", "out"];
        let more = ["--controller", "exec:sh own.sh", "--controller-timeout-ms", "60000", "--record", "failures:0"];
        let words = [&fixed[..], &more, &["--partition", "1/1"]].concat();
        command.args(&words);
        command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
        let child = command.spawn().unwrap();
        let started = Instant::now();
        while !at("out/journal.jsonl").exists() {
            assert!(started.elapsed() < Duration::from_mins(1), "the campaign does not begin");
            std::thread::sleep(Duration::from_millis(2));
        }
        drop(fs::remove_file(at("edited")));
        let output = child.wait_with_output().unwrap();
        let expected = if is_noticed { 7 } else { 0 };
        let text = stdout(&output, expected);
        let says = text.contains(&format!("the controller changed during the campaign: {edited}"))
            || text.contains(&format!("/{edited} is not what it was at the start"));
        assert_eq!(says, is_noticed, "{edited}: {text}");
        // The files are as they were, and the samples are not.
        fs::write(at("helper.sh"), "true\n").unwrap();
        fs::write(at("own.sh"), script(&edited.replace("unused", "${un}used"))).unwrap();
        let resumed = program().current_dir(place.path()).args(&words).arg("--resume").output().unwrap();
        assert_eq!(code(&resumed), expected, "{edited}: {}", stderr(&resumed));
        drop(fs::remove_dir_all(at("merged")));
        let (out, merged) = (at("out"), at("merged"));
        let words = ["tool", "merge", out.to_str().unwrap(), "--no-gate", "--out", merged.to_str().unwrap()];
        assert_eq!(code(&closecall(words)), expected, "{edited}");
    }
}

#[test]
fn a_library_whose_constructor_loops_or_ends_the_process_is_refused() {
    let place = folder();
    let source = place.path().join("odd.c");
    for (body, expected) in
        [("for (;;) ;", "is not loaded within 10 s"), ("exit(0);", "the controller ended its process (exit status: 0)")]
    {
        let text = format!(
            "#include <stdlib.h>\n__attribute__((constructor)) static void begin(void) {{ {body} }}\n\
             unsigned closecall_controller_abi(void) {{ return 1; }}\nvoid *closecall_controller_create(const void *s) {{ return 0; }}\n\
             int closecall_controller_step(void *c, const void *i, void *o) {{ return 0; }}\nvoid closecall_controller_destroy(void *c) {{}}\n"
        );
        fs::write(&source, text).unwrap();
        let library = lib(&compile(source.to_str().unwrap(), &place.path().join("odd.so"), &[]));
        let output = within_a_minute(program().args(["run", "low-thw-overtake", "--controller", &library]));
        assert_eq!(code(&output), 3, "{}", stderr(&output));
        assert!(message(&output).contains(expected), "{}", stderr(&output));
        // The inference backend is such a library, too.
        let library = place.path().join("odd.so");
        let words = ["run", "low-thw-overtake", "--sensors", "full", "--onnxruntime", library.to_str().unwrap()];
        let expected = if body == "exit(0);" { "exit status: 0" } else { expected };
        let output = within_a_minute(program().args(words));
        assert_eq!(code(&output), 3, "{}", stderr(&output));
        assert!(message(&output).contains(expected), "{}", stderr(&output));
    }
}
