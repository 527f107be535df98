//! Controllers that run as processes. The shipped example behaves like the built-in controller. A
//! process that misbehaves causes an error in its own samples only, with a message that names the
//! fault, and leaves no process behind.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Output;
use std::time::Duration;

use closecall_campaign::record::Record;
use closecall_testing::has_python;
use serde_json::Value;

use crate::support::{closecall, code, folder, library, message, program, records, stderr, stdout};

/// The time that a controller has for an answer (ms): much longer than any of these controllers
/// needs.
const TIMEOUT_MS: &str = "2000";

/// The faults of `bad.sh`: its arguments, and a part of the error message.
const FAULTS: [(&str, &str); 23] = [
    ("dies", "the process ended (exit status: 3) after 1 answer; it last wrote: out of cheese"),
    ("killed", "the process ended (signal: 9 (SIGKILL)) after 1 answer"),
    ("closes", "the process closed its standard output after 1 answer"),
    ("hangs", "the process hangs: no answer in twice the 2000 ms allowed, after 1 answer"),
    ("deaf", "no answer in twice the 2000 ms allowed, after 2 answers; it has closed its standard input"),
    ("buffers", "before its first answer; an answer is one line, which ends with a line feed and is flushed"),
    ("late 3", "the process answered later than the 2000 ms allowed, after 1 answer"),
    ("garbage", "the process answered \"what?\", which is not JSON"),
    ("nan", "asked for an acceleration of nan m/s², which is not a finite number"),
    ("infinite", "asked for an acceleration of 1e999 m/s², which is not a finite number"),
    ("millimetres", "asked for an acceleration of -9810 m/s² at 0.04 s: it must be a number from -100 to 100"),
    ("doubled", "`acceleration_mps2` must be there once, it is there twice"),
    ("real-time", "`time_ns` must be a whole number, the `time_ns` of the step, it is 40000000.0"),
    ("missing", "`acceleration_mps2` must be a number, it is absent"),
    ("state", "`state` must be one of following, increasing"),
    ("huge", "answered with a line of more than 1048576 bytes"),
    ("twice", "wrote a line that nobody had asked for"),
    ("ahead", "wrote a line that nobody had asked for"),
    ("chatter", "the process answered \"this is not an answer\", which is not JSON"),
    ("other-step", "for the control step at 80000000 ns, and was asked for the one at 40000000 ns"),
    ("farewell", "wrote a line that nobody had asked for"),
    (
        "aborts-last",
        "the process crashed (signal: 6 (SIGABRT)) after its last answer, when its input was closed; it last wrote: \
         terminate called after throwing an instance of 'std::runtime_error' | what(): lost the",
    ),
    ("version", "speaks version 2 of the protocol, this is version 1"),
];

/// Runs one sample with a controller. The environment of its processes holds `mark`.
fn run_with(controller: &str, mark: &str) -> Output {
    program()
        .args(["run", library("low-thw-overtake").to_str().unwrap(), "--controller-timeout-ms", TIMEOUT_MS])
        .args(["--controller-memory-mib", "128", "--controller", controller])
        .env("CLOSECALL_TEST_MARK", mark)
        .output()
        .unwrap()
}

/// Returns the processes with `mark` in their environment that do not end.
///
/// The program kills its processes when it ends, and the kernel removes them some time later. This
/// function waits for that, at most a minute.
pub(crate) fn left_behind(mark: &str) -> Vec<String> {
    const LOOKS: usize = 600;
    const PAUSE: Duration = Duration::from_millis(100);
    let mut running = marked(mark);
    for _ in 0..LOOKS {
        if running.is_empty() {
            break;
        }
        std::thread::sleep(PAUSE);
        running = marked(mark);
    }
    running
}

/// Returns the processes with `mark` in their environment.
fn marked(mark: &str) -> Vec<String> {
    let wanted = format!("CLOSECALL_TEST_MARK={mark}");
    let processes = std::fs::read_dir("/proc").unwrap().filter_map(|entry| Some(entry.ok()?.path()));
    processes
        .filter(|path| {
            let environment = std::fs::read(path.join("environ")).unwrap_or_default();
            environment.split(|byte| *byte == 0).any(|entry| entry == wanted.as_bytes())
        })
        .map(|path| path.display().to_string())
        .collect()
}

#[test]
fn each_fault_has_an_error_message_of_its_own_and_leaves_no_process_behind() {
    for (fault, expected) in FAULTS {
        let mark = format!("{}-{}", std::process::id(), fault.replace(' ', "-"));
        let output = run_with(&format!("exec:sh tests/fixtures/controllers/bad.sh {fault}"), &mark);
        assert_eq!(code(&output), 5, "{fault}: {}", stderr(&output));
        assert!(message(&output).contains(expected), "{fault}: {}", stderr(&output));
        assert!(!stderr(&output).contains('\u{1b}'), "{fault}: what a process writes controls no terminal");
        assert_eq!(left_behind(&mark), Vec::<String>::new(), "{fault}");
    }
}

#[test]
fn a_process_that_leaves_late_or_with_any_status_after_its_last_answer_has_its_outcome() {
    for end in ["outlives", "exits-last"] {
        let mark = format!("{}-{end}", std::process::id());
        let output = run_with(&format!("exec:sh tests/fixtures/controllers/bad.sh {end}"), &mark);
        assert!(stdout(&output, 0).contains("ended at"), "{end}");
        assert_eq!(left_behind(&mark), Vec::<String>::new());
    }
}

#[test]
fn a_controller_that_writes_much_to_standard_error_is_not_blocked() {
    let output = run_with("exec:sh tests/fixtures/controllers/bad.sh loud", "loud");
    assert!(stdout(&output, 0).contains("ended at"));
}

#[test]
fn a_controller_that_uses_too_much_memory_is_stopped() {
    if !has_python() {
        return;
    }
    // The memory of a process in the background is the controller's, although its parent has ended.
    // A peak between two looks counts, too.
    for words in ["", " background", " peak"] {
        let mark = format!("{}-hungry{}", std::process::id(), words.trim());
        let output = run_with(&format!("exec:python3 tests/fixtures/controllers/hungry.py{words}"), &mark);
        assert_eq!(code(&output), 5, "{words}: {}", stderr(&output));
        let expected = "holds more than the 128 MiB of memory allowed";
        assert!(message(&output).contains(expected), "{words}: {}", stderr(&output));
        assert_eq!(left_behind(&mark), Vec::<String>::new(), "{words}");
    }
}

#[test]
fn a_command_that_cannot_be_started_or_parsed_is_an_error() {
    let output = run_with("exec:no-such-program --fast", "none");
    assert_eq!(code(&output), 3);
    let expected = "failed to use the controller `exec:no-such-program --fast`: `no-such-program` could not be started: No such file";
    assert!(message(&output).contains(expected), "{}", stderr(&output));
    let headline = library("low-thw-overtake");
    for arguments in [
        vec!["--controller", "exec:"],
        vec!["--controller", "exec:'open"],
        vec!["--controller", "exec"],
        vec!["--controller", "mis", "--controller-timeout-ms", "100"],
        vec!["--controller-timeout-ms", "0", "--controller", "exec:true"],
    ] {
        let output = closecall(["run", headline.to_str().unwrap()].into_iter().chain(arguments.iter().copied()));
        assert_eq!(code(&output), 2, "{arguments:?}: {}", stderr(&output));
    }
}

#[test]
fn a_script_that_is_there_but_cannot_be_started_is_told_why() {
    use std::os::unix::fs::PermissionsExt;

    let folder = folder();
    for (name, text, expected) in [
        (
            "crlf",
            "#!/bin/sh\r\nexit 0\r\n",
            "its line 1 names the interpreter `/bin/sh\\r`, which is not there: its lines end with CR LF",
        ),
        (
            "moved",
            "#! /opt/no-such/python3 -u\n",
            "its line 1 names the interpreter `/opt/no-such/python3`, which is not there",
        ),
        ("escape", "#!/no/\u{1b}[31m\n", "names the interpreter `/no/\\u{1b}[31m`, which is not there"),
        ("plain", "exit 0\n", "nor a script whose first line names its interpreter, such as `#!/bin/sh`"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        let output = run_with(&format!("exec:{}", path.display()), name);
        assert_eq!(code(&output), 3, "{name}: {}", stderr(&output));
        // The frame may break a path.
        let squeezed = |text: &str| text.replace(' ', "");
        let shown = squeezed(&message(&output));
        assert!(shown.contains(&squeezed(expected)), "{name}: {}", stderr(&output));
        assert!(!shown.contains("Nosuchfile") && !shown.contains("Execformat"), "{name}: {}", stderr(&output));
    }
    let path = folder.path().join("no-right");
    std::fs::write(&path, "#!/bin/sh\n").unwrap();
    for (path, expected) in [(path.as_path(), "`chmod +x` gives it"), (folder.path(), "it is a folder")] {
        let output = run_with(&format!("exec:{}", path.display()), "no-right");
        assert_eq!(code(&output), 3, "{}", stderr(&output));
        assert!(message(&output).contains(expected), "{}", stderr(&output));
    }
}

/// Returns the results of a campaign by sample: the outcome without the keys that name the
/// controller, or the error message.
fn results(out: &Path) -> BTreeMap<u64, Result<Value, String>> {
    let result = |record: Record| {
        let result = record.arms.last().unwrap().result.clone();
        let comparable = result.map_err(|failure| failure.message).map(|outcome| {
            let mut outcome = serde_json::to_value(outcome).unwrap();
            for key in ["controller", "mis"] {
                outcome.as_object_mut().unwrap().remove(key);
            }
            outcome
        });
        (record.sample, comparable)
    };
    records(out).into_iter().map(result).collect()
}

/// Runs a campaign of samples of `low-thw-overtake` with a controller.
fn campaign(controller: &str, out: &Path, samples: &str, more: &[&str]) -> Output {
    let headline = library("low-thw-overtake");
    let scenario = ["campaign", headline.to_str().unwrap(), "-n", samples, "--seed", "1", "--jobs", "3", "--no-gate"];
    let output = ["--recordings", "1", "--controller", controller, "--out", out.to_str().unwrap()];
    closecall(scenario.iter().chain(&output).chain(more))
}

/// Returns true if two values are equal, with a tolerance of 1e-9 for numbers.
fn agree(first: &Value, second: &Value) -> bool {
    match (first, second) {
        (Value::Number(first), Value::Number(second)) => {
            (first.as_f64().unwrap() - second.as_f64().unwrap()).abs() <= 1e-9
        }
        (Value::Array(first), Value::Array(second)) => {
            first.len() == second.len() && first.iter().zip(second).all(|(first, second)| agree(first, second))
        }
        (Value::Object(first), Value::Object(second)) => {
            first.len() == second.len()
                && first.iter().all(|(key, value)| second.get(key).is_some_and(|second| agree(value, second)))
        }
        (first, second) => first == second,
    }
}

#[test]
fn the_python_example_behaves_like_the_built_in_cruise_control() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let (built_in, process) = (folder.path().join("acc"), folder.path().join("exec"));
    stdout(&campaign("acc", &built_in, "16", &[]), 0);
    let patient = ["--controller-timeout-ms", "60000"];
    stdout(&campaign("exec:python3 examples/acc_controller.py", &process, "16", &patient), 0);
    let (built_in, by_process) = (results(&built_in), results(&process));
    assert!(built_in.values().flatten().any(|outcome| !outcome["collisions"].as_array().unwrap().is_empty()));
    for (sample, outcome) in &built_in {
        let [built_in, by_python] = [outcome, &by_process[sample]].map(|outcome| outcome.as_ref().unwrap());
        assert!(agree(built_in, by_python), "sample {sample}: {built_in} {by_python}");
    }
    // The manifest holds the command, so a replay needs only the folder.
    let output = closecall(["replay", process.to_str().unwrap(), "3"]);
    stdout(&output, 0);
    assert!(stderr(&output).contains("examples/acc_controller.py"), "{}", stderr(&output));
}

/// The error messages of the five faults of `sometimes_bad.py`.
const SOMETIMES_BAD: [&str; 5] = [
    "the process ended (exit status: 3) before its first answer; it last wrote: cannot go on",
    "the process hangs: no answer in twice the 2000 ms allowed",
    "the process answered \"garbage\", which is not JSON",
    "the process asked for an acceleration of NaN m/s², which is not a finite number",
    "the process answered later than the 2000 ms allowed",
];

#[test]
fn faults_in_some_samples_leave_the_other_samples_unchanged() {
    if !has_python() {
        return;
    }
    let folder = folder();
    let (built_in, process) = (folder.path().join("acc"), folder.path().join("exec"));
    stdout(&campaign("acc", &built_in, "24", &[]), 0);
    let controller = "exec:python3 tests/fixtures/controllers/sometimes_bad.py 3";
    let output = campaign(controller, &process, "24", &["--controller-timeout-ms", TIMEOUT_MS]);
    assert_eq!(code(&output), 5, "{}", stderr(&output));
    let (built_in, process) = (results(&built_in), results(&process));
    let mut counts = [0; SOMETIMES_BAD.len()];
    for (sample, expected) in &built_in {
        let expected = expected.as_ref().unwrap();
        let cruise_mps = expected["parameters"]["cruise-mps"].as_f64().unwrap();
        // The controller computes its fault from the ego's first speed in the same way.
        let kind = (cruise_mps * 1000.0).floor() as usize % 8;
        match (&process[sample], SOMETIMES_BAD.get(kind)) {
            (Ok(outcome), None) => assert!(agree(outcome, expected), "sample {sample}"),
            (Err(message), Some(expected)) => {
                assert!(message.contains(expected), "sample {sample}: {message}");
                counts[kind] += 1;
            }
            (result, _) => panic!("sample {sample}, kind {kind}: {result:?}"),
        }
    }
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
}
