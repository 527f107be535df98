//! Controllers that are shared libraries. The examples in C and Rust have the outcomes of the
//! built-in controller, to the last bit. A library that misbehaves costs its own samples, with a
//! message that names the fault.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use closecall_campaign::record::Record;
use closecall_scenarios::outcome::Outcome;

use crate::exec_controller::left_behind;
use crate::support::{ROOT, code, folder, json, json_file, message, program, records, stderr, stdout};

/// Compiles a controller in C, and returns the library.
pub(crate) fn compile(source: &str, to: &Path, options: &[&str]) -> PathBuf {
    let output = Command::new("cc")
        .current_dir(ROOT)
        .args([
            "-std=c11",
            "-O2",
            "-fexceptions",
            "-ffp-contract=off",
            "-shared",
            "-fPIC",
            "-I",
            "controllers/include",
            "-o",
        ])
        .arg(to)
        .args(options)
        .args([source, "-lm"])
        .output()
        .expect("a C compiler");
    assert!(output.status.success(), "{source}: {}", stderr(&output));
    to.to_owned()
}

/// Returns the value of `--controller` for a library.
pub(crate) fn lib(path: &Path) -> String {
    format!("lib:{}", path.display())
}

/// Runs a command whose controller shows a fault of `faulty.c`.
pub(crate) fn with_fault(command: &mut Command, fault: Option<&str>) -> Output {
    match fault {
        Some(fault) => command.env("FAULT", fault),
        None => command,
    };
    command.output().unwrap()
}

/// Runs one sample with a controller that shows a fault in this sample.
fn run_with_fault(controller: &str, fault: &str) -> Output {
    let mut command = program();
    command.args(["run", "low-thw-overtake", "--sensors", "object", "--controller", controller]);
    with_fault(command.env("FAULT_ALWAYS", "1"), Some(fault))
}

const SAMPLES: &str = "24";

/// Runs a campaign of `low-thw-overtake` with a controller and its baseline.
pub(crate) fn campaign(controller: &str, out: &Path, jobs: &str, fault: Option<&str>, more: &[&str]) -> Output {
    campaign_of("low-thw-overtake", controller, out, jobs, fault, more)
}

pub(crate) fn campaign_of(
    scenario: &str,
    controller: &str,
    out: &Path,
    jobs: &str,
    fault: Option<&str>,
    more: &[&str],
) -> Output {
    let mut command = program();
    command
        .args(["campaign", scenario, "-n", SAMPLES, "--seed", "3", "--sensors", "object", "--no-gate"])
        .args(["--paired", "--record", "random:1", "--jobs", jobs, "--controller", controller])
        .args(["--out", out.to_str().unwrap()])
        .args(more);
    with_fault(&mut command, fault)
}

/// Returns an outcome with the name and the summary of the margin increase system of another: the
/// reference has neither, and they are not compared.
fn named_as(outcome: &Outcome, reference: &Outcome) -> Outcome {
    Outcome { controller: reference.controller.clone(), mis: reference.mis.clone(), ..outcome.clone() }
}

/// Returns true if the controller of a record has had the outcome of the baseline, to the last bit.
pub(crate) fn is_as_baseline(record: &Record) -> bool {
    let [baseline, tested] = [0, 1].map(|arm| record.arms[arm].result.as_ref());
    let (Ok(baseline), Ok(tested)) = (baseline, tested) else { return false };
    named_as(tested, baseline).has_same_bits(baseline)
}

/// Returns true if a record is of a sample in which `faulty.c` shows its fault: the ego is fast.
pub(crate) fn has_fast_ego(record: &Record) -> bool {
    let baseline = record.arms[0].result.as_ref().unwrap();
    serde_json::to_value(&baseline.parameters).unwrap()["cruise-mps"].as_f64().unwrap() >= 32.7
}

/// Asserts that a fault costs the samples with a fast ego, with the expected message, and no others.
pub(crate) fn assert_costs_fast_samples(records: &[Record], fault: &str, expected: &str) {
    let mut failed = 0;
    for record in records {
        let is_fast = has_fast_ego(record);
        match &record.arms[1].result {
            Ok(_) => assert!(!is_fast && is_as_baseline(record), "{fault}: sample {}", record.sample),
            Err(failure) => {
                assert!(is_fast && failure.message.contains(expected), "{fault}: {}", failure.message);
                failed += 1;
            }
        }
    }
    assert!(failed > 1, "{fault} shows in {failed} samples");
}

/// The library of the example in Rust, which `cargo test` builds.
fn rust_example() -> PathBuf {
    let examples = Path::new(env!("CARGO_BIN_EXE_closecall")).with_file_name("examples");
    let file = format!("{}acc_library{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    examples.join(file)
}

#[test]
fn libraries_in_c_and_rust_have_the_outcomes_of_the_built_in_controller() {
    let folder = folder();
    let in_c = compile("examples/acc_controller.c", &folder.path().join("acc_controller.so"), &[]);
    for (number, library) in [in_c, rust_example()].iter().enumerate() {
        let outs = ["1", "3"].map(|jobs| {
            let out = folder.path().join(format!("{number}-{jobs}"));
            stdout(&campaign(&lib(library), &out, jobs, None, &[]), 0);
            out
        });
        let records = records(&outs[0]);
        assert_eq!(records.len(), 24);
        assert!(records.iter().all(is_as_baseline), "{}", library.display());
        assert!(records.iter().any(|record| record.arms[1].tally().collided == Some(true)), "nothing happens");
        // The number of jobs changes no byte.
        let [one_job, three_jobs] = outs.each_ref().map(|out| std::fs::read(out.join("outcomes.parquet")).unwrap());
        assert!(one_job == three_jobs);
        // A run outside of a campaign answers step by step, with the same bits.
        let run = |controller: &str| {
            let arguments = ["run", "low-thw-overtake", "--seed", "3", "--sample", "5", "--sensors", "object"];
            let output = program().args(arguments).args(["--format", "json", "--controller", controller]).output();
            let mut outcome = json(&output.unwrap(), 0);
            for key in ["controller", "mis", "mis_absent"] {
                outcome.as_object_mut().unwrap().remove(key);
            }
            outcome
        };
        assert_eq!(run(&lib(library)), run("acc"));
    }
}

/// The faults of `faulty.c`, each with a part of the message of its samples.
const FAULTS: [(&str, &str); 16] = [
    ("segfault", "the controller ended its process (signal: 11 (SIGSEGV)); it last wrote: about to crash"),
    ("child", "the controller ended its process (signal: 11 (SIGSEGV))"),
    (
        "throws",
        "SIGABRT)); it last wrote: the library threw a C++ exception out of closecall_controller_step: catch it",
    ),
    (
        "throws-cpp",
        "SIGABRT)); it last wrote: the library threw a C++ exception out of closecall_controller_step: catch it",
    ),
    ("abort", "the controller ended its process (signal: 6 (SIGABRT))"),
    ("frees", "the controller ended its process (signal: 6 (SIGABRT)); it last wrote: freed twice"),
    ("exit-0", "the controller ended its process (exit status: 0)"),
    ("exit-3", "the controller ended its process (exit status: 3)"),
    ("hang", "failed at 2.00 s: no answer within 500 ms"),
    ("nan", "asked for an acceleration of NaN m/s² at 2.00 s"),
    ("infinite", "asked for an acceleration of -inf m/s² at 2.00 s"),
    ("millimetres", "asked for an acceleration of -9810 m/s² at 2.00 s: it must be a number from -100 to 100"),
    ("state", "the library answered the state 9: the state must be 0 (following)"),
    ("error", "the library answered with the error 7: the map is missing"),
    ("leak", "holds more than the 256 MiB of memory allowed"),
    ("closes", "process"),
];

#[test]
fn a_fault_costs_its_samples_and_changes_no_other() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let mark = format!("native-{}", std::process::id());
    // A call that leaks must not be given up before it has leaked enough.
    let patience = |fault| if fault == "hang" { "500" } else { "60000" };
    for (fault, expected) in FAULTS {
        let limits = ["--controller-timeout-ms", patience(fault), "--controller-memory-mib", "256"];
        let results = ["1", "2"].map(|jobs| {
            let out = folder.path().join(format!("{fault}-{jobs}"));
            let output = campaign(&library, &out, jobs, Some(fault), &limits);
            assert_eq!(code(&output), 5, "{fault}: {}", stderr(&output));
            records(&out)
        });
        // Neither the outcomes nor the messages depend on the number of jobs.
        let shown = |records: &[Record]| -> Vec<_> {
            records.iter().map(|record| record.arms.iter().map(|arm| arm.result.clone()).collect::<Vec<_>>()).collect()
        };
        assert!(shown(&results[0]) == shown(&results[1]), "{fault}");
        assert_costs_fast_samples(&results[0], fault, expected);
    }
    let mut command = program();
    command.args([
        "campaign",
        "low-thw-overtake",
        "-n",
        "8",
        "--no-gate",
        "--no-out",
        "--sensors",
        "object",
        "--controller",
        &library,
    ]);
    let output =
        with_fault(command.args(["--controller-timeout-ms", "500"]).env("CLOSECALL_TEST_MARK", &mark), Some("hang"));
    assert!([0, 5].contains(&code(&output)), "{}", stderr(&output));
    assert_eq!(left_behind(&mark), Vec::<String>::new());
}

#[test]
fn a_library_whose_answers_depend_on_its_process_makes_the_campaign_invalid() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let out = folder.path().join("out");
    let output = campaign(&library, &out, "1", Some("process-number"), &[]);
    assert_eq!(code(&output), 7, "{}", stderr(&output));
    let expected = "the same run gave another outcome when repeated: 2 of ";
    assert!(String::from_utf8_lossy(&output.stdout).contains(expected), "{output:?}");
    let out = folder.path().join("sound");
    stdout(&campaign(&library, &out, "1", Some("none"), &[]), 0);
}

#[test]
fn a_library_that_one_process_at_a_time_may_use_is_checked() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let out = folder.path().join("out");
    let mut command = program();
    command
        .args(["campaign", "low-thw-overtake", "-n", "4", "--sensors", "object", "--no-gate", "--jobs", "1"])
        .args(["--controller", &library, "--out", out.to_str().unwrap()])
        .env("LICENCE", folder.path().join("licence"));
    let printed = stdout(&with_fault(&mut command, None), 0);
    assert!(printed.contains("checked: 2 runs, 0 flipped") && !printed.contains("no licence"), "{printed}");
}

#[test]
fn a_run_and_a_campaign_say_the_same_about_a_library_that_ends_its_process() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    for (fault, expected) in FAULTS.iter().filter(|(fault, _)| ["segfault", "exit-3"].contains(fault)) {
        let mut command = program();
        command.args(["run", "low-thw-overtake", "--sensors", "object", "--controller", &library]);
        let output = with_fault(command.env("FAULT_ALWAYS", "1"), Some(*fault));
        assert_eq!(code(&output), 5, "{fault}: {}", stderr(&output));
        let text = message(&output);
        assert!(text.contains(*expected) && !text.contains("before its first answer"), "{fault}: {text}");
    }
}

#[test]
fn the_header_and_the_examples_in_c_compile_without_warnings() {
    let check = |compiler: &str, arguments: &[&str]| {
        let strict = ["-Wall", "-Wextra", "-pedantic", "-Werror", "-O2", "-fsyntax-only", "-I", "controllers/include"];
        Command::new(compiler).current_dir(ROOT).args(strict).args(arguments).output()
    };
    let sources: [&[&str]; 6] = [
        &["-std=c11", "examples/acc_controller.c"],
        &["-std=c11", "examples/groups_perception.c"],
        &["-std=c11", "-DFMI=2", "examples/fmu/acc.c"],
        &["-std=c11", "-DFMI=3", "examples/fmu/acc.c"],
        &["-std=c99", "-x", "c", "controllers/include/closecall_controller.h"],
        &["-std=c99", "-x", "c", "controllers/include/closecall_perception.h"],
    ];
    for source in sources {
        let output = check("cc", source).unwrap();
        assert!(output.status.success(), "{source:?}: {}", stderr(&output));
    }
    // The headers are for C++, too. Not every machine has a compiler for it.
    for name in ["controller", "perception"] {
        let header = format!("controllers/include/closecall_{name}.h");
        if let Ok(output) = check("c++", &["-std=c++11", "-x", "c++", &header]) {
            assert!(output.status.success(), "{}", stderr(&output));
        }
    }
}

#[test]
fn the_rounding_mode_of_a_library_is_not_that_of_the_simulation() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let out = folder.path().join("out");
    stdout(&campaign(&library, &out, "2", Some("rounds"), &[]), 0);
    let records = records(&out);
    assert!(records.len() == 24 && records.iter().all(is_as_baseline));
}

#[test]
fn a_library_that_is_replaced_during_a_campaign_ends_it() {
    let folder = folder();
    let (library, next) = (folder.path().join("own.so"), folder.path().join("next.so"));
    compile("tests/fixtures/controllers/faulty.c", &library, &[]);
    compile("tests/fixtures/controllers/faulty.c", &next, &["-DVERSION=\"2\""]);
    let out = folder.path().join("out");
    let mut command = program();
    command
        .args(["campaign", "low-thw-overtake", "-n", "4", "--sensors", "object", "--no-gate", "--jobs", "1"])
        .args(["--controller", &lib(&library), "--out", out.to_str().unwrap()])
        .envs([("FAULT_ALWAYS", "1".as_ref()), ("OWN", library.as_os_str()), ("NEXT", next.as_os_str())]);
    let output = with_fault(&mut command, Some("replaces"));
    assert_eq!(code(&output), 7, "{}", stderr(&output));
    assert!(stderr(&output).contains("own.so has changed since the start"), "{}", stderr(&output));
    // The sample of the library that was named is kept.
    assert_eq!(std::fs::read_to_string(out.join("journal.jsonl")).unwrap().lines().count(), 1);
}

#[test]
fn a_bare_name_is_the_file_in_the_working_folder() {
    let folder = folder();
    compile("examples/acc_controller.c", &folder.path().join("own.so"), &[]);
    // Another library of that name in the search path of the loader.
    let other = folder.path().join("other");
    std::fs::create_dir(&other).unwrap();
    compile("tests/fixtures/controllers/faulty.c", &other.join("own.so"), &[]);
    let mut command = program();
    command
        .current_dir(folder.path())
        .args([
            "campaign",
            "low-thw-overtake",
            "-n",
            "2",
            "--sensors",
            "object",
            "--no-gate",
            "--controller",
            "lib:own.so",
        ])
        .env("LD_LIBRARY_PATH", &other)
        .env("FAULT_ALWAYS", "1");
    stdout(&with_fault(&mut command, Some("error")), 0);
}

#[test]
fn an_error_stays_one_until_it_is_tried_again() {
    let folder = folder();
    let library = compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]);
    let out = folder.path().join("out");
    let controller = lib(&library);
    assert_eq!(code(&campaign(&controller, &out, "2", Some("segfault"), &[])), 5);
    let failed = |out: &Path| records(out).iter().filter(|record| record.arms[1].result.is_err()).count();
    let before = failed(&out);
    assert!(before > 0);
    // Without the fault: a resumed campaign keeps the errors, and runs them again only if asked to.
    assert_eq!(code(&campaign(&controller, &out, "2", None, &["--resume"])), 5);
    assert_eq!(failed(&out), before);
    stdout(&campaign(&controller, &out, "2", None, &["--resume", "--retry-errors"]), 0);
    assert_eq!(failed(&out), 0);
    assert!(records(&out).iter().all(is_as_baseline));
    // Another build of the library is another controller.
    compile("tests/fixtures/controllers/faulty.c", &library, &["-DVERSION=\"2\""]);
    let output = campaign(&controller, &out, "2", None, &["--resume"]);
    assert_eq!(code(&output), 2, "{}", stderr(&output));
    assert!(
        message(&output).contains("the controller states another version: `1` there, `2` here"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_crash_in_a_single_run_is_an_error_and_what_a_library_prints_is_no_answer() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let run = |fault| run_with_fault(&library, fault);
    let output = run("segfault");
    assert_eq!(code(&output), 5, "{}", stderr(&output));
    assert!(message(&output).contains("signal: 11 (SIGSEGV)"), "{}", stderr(&output));
    assert!(message(&output).contains("about to crash"), "{}", stderr(&output));
    let output = run("error");
    assert_eq!(code(&output), 5, "{}", stderr(&output));
    assert!(
        message(&output).contains("the library answered with the error 7: the map is missing"),
        "{}",
        stderr(&output)
    );
    let output = run("prints");
    assert_eq!(stdout(&output, 0), stdout(&run("none"), 0));
    // What a library prints is quoted only if its process ends: see docs/reference/controllers.md.
    assert!(!stderr(&output).contains("acceleration_mps2"), "{}", stderr(&output));
}

#[test]
fn a_crash_while_a_controller_is_freed_is_an_error_of_its_run_and_one_while_its_library_is_unloaded_a_warning() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let run = |fault| run_with_fault(&library, fault);
    for (fault, expected) in [
        ("frees", "the controller ended its process (signal: 6 (SIGABRT)); it last wrote: freed twice"),
        ("frees-never", "the process hangs: no answer in twice the 1000 ms allowed"),
    ] {
        let output = run(fault);
        assert_eq!(code(&output), 5, "{fault}: {}", stderr(&output));
        assert!(message(&output).contains(expected), "{fault}: {}", stderr(&output));
    }
    // A worker process of a campaign unloads the library after all its samples: no sample is
    // concerned, whatever the number of jobs, and the console says so once.
    let sound = run("none");
    assert!(!stderr(&sound).contains("warning"), "{}", stderr(&sound));
    let crashed = "warning: the process of `lib:faulty` ended with signal: 6 (SIGABRT) after its last sample, as it unloaded \
                   its library; no sample is concerned; it last wrote: the map file is closed twice\n";
    let left = "warning: the process of `lib:faulty` ended with exit status: 9 after its last sample";
    for (fault, expected) in [("unloads", crashed), ("unloads-9", left)] {
        let output = run(fault);
        assert_eq!(stdout(&output, 0), stdout(&sound, 0));
        assert_eq!(stderr(&output).matches(expected).count(), 1, "{fault}: {}", stderr(&output));
        for jobs in ["1", "3"] {
            let output = campaign(&library, &folder.path().join(format!("{fault}-{jobs}")), jobs, Some(fault), &[]);
            stdout(&output, 0);
            assert_eq!(stderr(&output).matches(expected).count(), 1, "{fault}, {jobs}: {}", stderr(&output));
        }
    }
}

#[test]
fn a_library_that_stops_its_process_costs_its_sample_and_the_message_names_the_limit() {
    let folder = folder();
    let library = lib(&compile("tests/fixtures/controllers/faulty.c", &folder.path().join("faulty.so"), &[]));
    let mark = format!("stops-{}", std::process::id());
    let mut command = program();
    command.args(["campaign", "low-thw-overtake", "-n", "1", "--sensors", "object", "--no-gate", "--no-out"]);
    command.args(["--controller", &library, "--controller-timeout-ms", "500", "--sample-timeout-s", "3"]);
    command.env("FAULT_ALWAYS", "1").env("CLOSECALL_TEST_MARK", &mark);
    let text = stdout(&with_fault(&mut command, Some("stops")), 5);
    assert!(text.contains("first in sample 0: no outcome within 3 s of wall time\n"), "{text}");
    assert_eq!(left_behind(&mark), Vec::<String>::new());
}

#[test]
fn a_library_can_create_no_controller() {
    let folder = folder();
    let text = "#include \"closecall_controller.h\"\n#include <stddef.h>\n\
        uint32_t closecall_controller_abi(void) { return CLOSECALL_CONTROLLER_ABI; }\n\
        void *closecall_controller_create(const closecall_setup *setup) { (void)setup; return NULL; }\n\
        int32_t closecall_controller_step(void *c, const closecall_input *i, closecall_command *o) { return 0; }\n\
        void closecall_controller_destroy(void *c) {}\n\
        const char *closecall_controller_error(void *c) { return \"no licence\"; }\n";
    let source = folder.path().join("none.c");
    std::fs::write(&source, text).unwrap();
    let library = compile(source.to_str().unwrap(), &folder.path().join("none.so"), &[]);
    let out = folder.path().join("out");
    assert_eq!(code(&campaign(&lib(&library), &out, "1", None, &[])), 5);
    for record in records(&out) {
        let failure = record.arms[1].result.clone().unwrap_err();
        let expected = "closecall_controller_create answered null: the library created no controller: no licence";
        assert!(failure.message.contains(expected), "{}", failure.message);
    }
    // A library that says nothing is told where a text belongs.
    let silent = text.lines().filter(|line| !line.contains("_error(")).collect::<Vec<_>>().join("\n");
    std::fs::write(&source, silent).unwrap();
    let library = compile(source.to_str().unwrap(), &folder.path().join("silent.so"), &[]);
    let output = campaign(&lib(&library), &folder.path().join("silent"), "1", None, &[]);
    let expected = "the library created no controller; a text of `closecall_controller_error` would say why";
    assert!(stdout(&output, 5).contains(expected), "{}", stderr(&output));
}

#[test]
fn a_replay_needs_only_the_folder() {
    let folder = folder();
    let library = compile("examples/acc_controller.c", &folder.path().join("acc.so"), &[]);
    let out = folder.path().join("out");
    stdout(&campaign(&lib(&library), &out, "2", None, &[]), 0);
    let manifest = json_file(&out.join("manifest.json"));
    assert_eq!(manifest["arms"][1]["native"]["path"], library.to_str().unwrap());
    assert_eq!(manifest["controllers"][0]["identity"]["name"], "acc in C");
    let replay = program().args(["replay", out.to_str().unwrap(), "3"]).output().unwrap();
    stdout(&replay, 0);
    assert!(stderr(&replay).contains("acc.so"), "{}", stderr(&replay));
}
