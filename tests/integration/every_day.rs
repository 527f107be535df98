//! What a user meets every day: why samples failed, a campaign that grows, and inputs that are
//! refused before any sample runs.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use closecall_testing::has_python;
use serde_json::Value;

use crate::native_controllers::{compile, lib, with_fault};
use crate::support::{closecall, code, folder, headline_with, json, message, program, records, stderr, stdout};

/// A step of a controller in Python that answers with `answer`.
fn python(answer: &str) -> String {
    format!(
        "import json, os, sys, time\nsys.stdin.readline()\n\
         print(json.dumps({{'type': 'hello', 'protocol': 1, 'name': 'a', 'version': '1'}}), flush=True)\n\
         for line in sys.stdin:\n    {answer}\n"
    )
}

/// Twelve controllers that fail in twelve ways: the fault of each, and the message that tells its
/// author the repair.
fn twelve(folder: &Path) -> Vec<(String, Vec<&'static str>)> {
    let script = |name: &str, text: &str| {
        fs::write(folder.join(name), text).unwrap();
        format!("exec:python3 {name}")
    };
    let answer = |text: &str| format!("print({text}, flush=True)");
    let source = "tests/fixtures/controllers/faulty.c";
    let library = lib(&compile(source, &folder.join("faulty.so"), &[]));
    vec![
        ("exec:python3 nothere.py".to_owned(), vec!["nothere.py", "No such file"]),
        (script("syntax.py", "def step(:\n"), vec!["syntax.py", "SyntaxError"]),
        (script("silent.py", &python("pass")), vec!["hangs", "before its first answer"]),
        (script("words.py", "print('ready', flush=True)\n"), vec!["ready", "not JSON", "belongs on standard error"]),
        (
            script("version.py", "print('{\"type\":\"hello\",\"protocol\":9}', flush=True)\n"),
            vec!["version 9 of the protocol"],
        ),
        (script("raises.py", &python("speeds = {}; print(speeds['front'])")), vec!["raises.py", "KeyError: 'front'"]),
        (
            script("key.py", &python(&answer("json.dumps({'acceleration': 0, 'state': 'following'})"))),
            vec!["`acceleration_mps2` must be a number"],
        ),
        (
            script("nan.py", &python(&answer("'{\"acceleration_mps2\": NaN, \"state\": \"following\"}'"))),
            vec!["NaN", "not a finite number"],
        ),
        (
            script("state.py", &python(&answer("json.dumps({'acceleration_mps2': 0, 'state': 'driving'})"))),
            vec!["`state` must be one of following"],
        ),
        (script("exits.py", &python("sys.exit(0)")), vec!["the process ended (exit status: 0)"]),
        (format!("{library}#segfault"), vec!["SIGSEGV", "about to crash"]),
        (format!("{library}#error"), vec!["error 7: the map is missing"]),
    ]
}

/// Runs a campaign of few samples in a folder. What follows `#` names the fault of a library.
fn failing(folder: &Path, controller: &str, more: &[&str]) -> Output {
    let (controller, fault) =
        controller.split_once('#').map_or((controller, None), |(name, fault)| (name, Some(fault)));
    let mut command = program();
    command.current_dir(folder).env("FAULT_ALWAYS", "1");
    command.args(["campaign", "short.toml", "-n", "2", "--sensors", "object", "--no-gate", "--no-validity-checks"]);
    // Only a controller that hangs need not wait.
    let timeout_ms = if controller.contains("silent") { "400" } else { "20000" };
    command.args(["--controller", controller, "--controller-timeout-ms", timeout_ms]).args(more);
    with_fault(&mut command, fault)
}

fn short(folder: &Path) {
    fs::write(folder.join("short.toml"), headline_with("duration-s = 60.0", "duration-s = 20.0")).unwrap();
}

#[test]
fn the_console_alone_tells_the_author_of_each_of_twelve_controllers_what_to_mend() {
    let folder = folder();
    short(folder.path());
    for (controller, expected) in twelve(folder.path()) {
        let text = stdout(&failing(folder.path(), &controller, &["--no-out"]), 5);
        let line = text
            .lines()
            .find(|line| line.contains("first in sample 0"))
            .unwrap_or_else(|| panic!("{controller}: {text}"));
        assert!(line.contains("2 × ") && line.contains("low-thw-overtake: "), "{controller}: {line}");
        for words in expected {
            assert!(line.contains(words), "{controller}: no `{words}` in: {line}");
        }
    }
}

#[test]
fn every_report_says_why_samples_failed_and_which_to_replay() {
    let folder = folder();
    short(folder.path());
    let controller = "exec:python3 nothere.py";
    let output = failing(folder.path(), controller, &["--out", "out", "--format", "json"]);
    let report: Value = json(&output, 5);
    let failure = &report["failures"][0];
    assert_eq!((&failure["scenario"], &failure["samples"]), (&"low-thw-overtake".into(), &2.into()), "{failure}");
    assert_eq!((&failure["first_sample"], &failure["controller"]), (&0.into(), &"exec".into()), "{failure}");
    assert!(failure["first_message"].as_str().unwrap().contains("nothere.py"), "{failure}");
    for name in ["junit.xml", "summary.md", "report.html"] {
        let text = fs::read_to_string(folder.path().join("out").join(name)).unwrap();
        assert!(text.contains("No such file") && text.contains("nothere.py"), "{name}: {text}");
    }
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("closecall replay . 0 --scenario low-thw-overtake --controller exec"));
    // Nothing was measured.
    let text = stdout(&failing(folder.path(), controller, &["--no-out"]), 5);
    assert!(!text.contains("m/s slower than the lead vehicle"), "{text}");
    // A campaign that ends early says it, too.
    let text = stdout(&failing(folder.path(), controller, &["--no-out", "--fail-fast", "--jobs", "1"]), 5);
    assert!(text.contains("nothere.py") && text.contains("ENDED EARLY"), "{text}");
}

#[test]
fn samples_that_ended_in_an_error_are_not_said_to_pass() {
    let folder = folder();
    short(folder.path());
    let out = folder.path().join("out");
    let campaign = failing(folder.path(), "exec:python3 nothere.py", &["--out", "out"]);
    assert_eq!(code(&campaign), 5, "{}", stderr(&campaign));
    let errors = "2 of 2 samples ended in an error, and may fail or not; first sample 0 of low-thw-overtake: ";
    let explained = closecall(["explain", out.to_str().unwrap()]);
    assert_eq!(stdout(&explained, 5), "no sample of the campaign that has an outcome fails\n");
    let warned = stderr(&explained);
    assert!(warned.contains(&format!("warning: {errors}")) && warned.contains("nothere.py"), "{warned}");
    let nearest = closecall(["minimize", out.to_str().unwrap(), "--nearest"]);
    assert_eq!(code(&nearest), 5, "{}", stderr(&nearest));
    let text = message(&nearest);
    assert!(text.contains("that has an outcome fails with `exec`; ") && text.contains(errors), "{text}");
}

/// Runs a program in a terminal with as many rows as the first argument says, and 40 columns.
const IN_TERMINAL: &str = r#"
import fcntl, os, pty, struct, sys, termios
pid, terminal = pty.fork()
if pid == 0:
    fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", int(sys.argv[1]), 40, 0, 0))
    os.execv(sys.argv[2], sys.argv[2:])
text = b""
try:
    while part := os.read(terminal, 65536):
        text += part
except OSError:
    pass
os.waitpid(pid, 0)
sys.stdout.buffer.write(text)
"#;

#[test]
fn texts_of_studies_and_errors_are_wrapped_to_a_terminal_also_if_it_states_no_rows() {
    if !has_python() {
        return;
    }
    for arguments in [&["study", "exposure", "--counted", "20/5000"][..], &["run", "paper-figur"]] {
        for rows in ["0", "24"] {
            let mut command = Command::new("python3");
            command.args(["-c", IN_TERMINAL, rows]).arg(program().get_program()).args(arguments);
            let output = command.env("NO_COLOR", "1").env("TERM", "xterm").output().unwrap();
            let text = stdout(&output, 0).replace('\r', "");
            assert!(text.lines().count() > 2, "{arguments:?}: {text}");
            for line in text.lines() {
                let is_one_word = line.split_whitespace().filter(|word| word.chars().count() > 1).count() < 2;
                let is_whole = is_one_word || line.contains("closecall ");
                assert!(line.chars().count() <= 40 || is_whole, "{arguments:?}, {rows} rows: {line}");
            }
        }
    }
}

#[test]
fn control_characters_of_a_controller_reach_no_reader() {
    let folder = folder();
    short(folder.path());
    // Escape, backspace, NUL, and a character that turns the direction of text.
    let text = "import sys\nsys.stderr.write('\\x1b[2Jred\\x08\\x00\\u202egreen\\x9b<img src=x> **b** &lt;i> @user #12 \\ufeff\\U000e0041')\n";
    fs::write(folder.path().join("odd.py"), text).unwrap();
    let controller = "exec:env PYTHONIOENCODING=utf-8 python3 odd.py";
    let output = failing(folder.path(), controller, &["--out", "out"]);
    let console = [stdout(&output, 5), stderr(&output)].concat();
    assert!(console.contains("\\u001b[2Jred\\u0008\\u0000\\u202egreen\\u009b"), "{console}");
    let is_hidden = |c: char| {
        (c.is_control() && !matches!(c, '\n' | '\t' | '\r'))
            || matches!(c, '\u{202a}'..='\u{202e}' | '\u{feff}' | '\u{e0041}')
    };
    assert!(!console.contains(is_hidden));
    for name in ["junit.xml", "samples.xml", "summary.md", "report.html"] {
        let text = fs::read_to_string(folder.path().join("out").join(name)).unwrap();
        assert!(text.contains("\\u001b[2Jred") && !text.contains(is_hidden), "{name}");
        assert!(!text.contains("<img src=x>"), "{name}");
    }
    // Markdown marks, links and mentions nothing.
    let summary = fs::read_to_string(folder.path().join("out/summary.md")).unwrap();
    let expected = r"\*\*b\*\* &amp;lt;i> <span>@</span>user <span>#</span>12 \ufeff\udb40\udc41";
    assert!(summary.contains(expected), "{summary}");
    // So do the names that a user gives.
    let output = closecall(["check", "\u{1b}[31mnone.toml"]);
    assert!(code(&output) != 0 && !stderr(&output).contains('\u{1b}') && stderr(&output).contains("\\u001b"));
    let output = closecall(["check", "--\u{1b}[31m"]);
    assert!(code(&output) == 2 && !stderr(&output).contains('\u{1b}'), "{}", stderr(&output));
}

#[test]
fn a_byte_order_mark_of_a_controller_is_no_error() {
    let folder = folder();
    short(folder.path());
    let text = python(
        "sys.stdout.write('\\ufeff' + json.dumps({'acceleration_mps2': 0, 'state': 'following'}) + '\\n'); sys.stdout.flush()",
    );
    fs::write(folder.path().join("mark.py"), text.replace("print(json", "print('\\ufeff' + json")).unwrap();
    let controller = "exec:env PYTHONIOENCODING=utf-8 python3 mark.py";
    let mut command = program();
    command.current_dir(folder.path()).args(["run", "short.toml", "--sensors", "object", "--controller", controller]);
    stdout(&command.args(["--controller-timeout-ms", "60000"]).output().unwrap(), 0);
}

const FILES: [&str; 5] = ["journal.jsonl", "outcomes.parquet", "arm_pairs.parquet", "samples.xml", "recordings"];

/// Returns the bytes of the files that do not depend on how a campaign came about.
fn bytes(out: &Path) -> Vec<(String, Vec<u8>)> {
    let mut contents = Vec::new();
    for path in FILES.map(|name| out.join(name)) {
        let files: Vec<_> = match path.is_dir() {
            true => fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()).collect(),
            false => vec![path],
        };
        for file in files {
            // A recording has its own times: only the set of recordings must be the same.
            let is_recording = file.extension().is_some_and(|end| end == "rrd" || end == "html");
            let content = if is_recording { Vec::new() } else { fs::read(&file).unwrap_or_default() };
            contents.push((file.file_name().unwrap().to_string_lossy().into_owned(), content));
        }
    }
    contents.sort();
    contents
}

#[test]
fn a_campaign_that_grows_has_the_bytes_of_one_that_ran_at_once() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let campaign = |out: &str, samples: &str, more: &[&str]| {
        let scenarios = ["low-thw-overtake", "overtake-without-brake"];
        let mut command = program();
        command.arg("campaign").args(scenarios).args(["-n", samples, "--paired", "--sensors", "object", "--no-gate"]);
        command.args(["--record", "worst:1", "--out", at(out).to_str().unwrap()]).args(more).output().unwrap()
    };
    for (part, more) in [("whole", &[][..]), ("half", &["--partition", "2/2"][..])] {
        let [once, grown] = ["once", "grown"].map(|name| format!("{name}-{part}"));
        stdout(&campaign(&once, "14", more), 0);
        stdout(&campaign(&grown, "6", more), 0);
        // Without --resume nothing is touched, and fewer samples are another campaign.
        assert_eq!(code(&campaign(&grown, "14", more)), 2);
        let resume = [more, &["--resume"]].concat();
        assert_eq!(code(&campaign(&grown, "5", &resume)), 2);
        stdout(&campaign(&grown, "14", &resume), 0);
        for ((name, content), (_, other)) in bytes(&at(&once)).iter().zip(bytes(&at(&grown))) {
            assert!(*content == other, "{part}: {name}");
        }
        assert_eq!(bytes(&at(&once)).len(), bytes(&at(&grown)).len());
        stdout(&closecall(["check", at(&grown).to_str().unwrap()]), 0);
    }
}

#[test]
fn a_sobol_sequence_goes_on_and_a_grid_says_why_it_does_not() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let campaign = |out: &str, design: &str, samples: &str, more: &[&str]| {
        let mut command = program();
        command.args(["campaign", "low-thw-overtake", "-n", samples, "--design", design, "--sensors", "ground-truth"]);
        command
            .args(["--no-gate", "--record", "worst:1", "--out", at(out).to_str().unwrap()])
            .args(more)
            .output()
            .unwrap()
    };
    stdout(&campaign("once", "sobol", "12", &[]), 0);
    stdout(&campaign("grown", "sobol", "5", &[]), 0);
    let untouched = campaign("grown", "sobol", "12", &[]);
    assert!(
        code(&untouched) == 2 && stderr(&untouched).contains("already holds this campaign"),
        "{}",
        stderr(&untouched)
    );
    stdout(&campaign("grown", "sobol", "12", &["--resume"]), 0);
    for ((name, content), (_, other)) in bytes(&at("once")).iter().zip(bytes(&at("grown"))) {
        assert!(*content == other, "{name}");
    }
    stdout(&campaign("grid", "grid", "4", &[]), 0);
    let refused = campaign("grid", "grid", "8", &["--resume"]);
    assert_eq!(code(&refused), 2);
    let told = message(&refused);
    assert!(told.contains("4 there, 8 here (a grid does not grow: its points depend on their number)"), "{told}");
}

#[test]
fn wherever_letters_name_vehicles_a_line_says_which() {
    const KEY: &str = "E is the ego, F the lead vehicle, R the rear vehicle";
    let folder = folder();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let plan = ["-n", "20", "--seed", "1", "--sensors", "object", "--controller", "acc", "--no-gate"];
    stdout(&closecall(["campaign", "low-thw-overtake", "--out", out, "--record", "each-kind"].iter().chain(&plan)), 0);
    let sample = records(Path::new(out))
        .into_iter()
        .find(|record| record.arms[0].result.as_ref().is_ok_and(|outcome| outcome.ego_collided()));
    let sample = sample.expect("the baseline collides in a fifth of the samples").sample.to_string();
    let times = |text: &str| text.matches(KEY).count();
    for file in ["report.html", "summary.md", "recordings/index.html"] {
        assert_eq!(times(&fs::read_to_string(Path::new(out).join(file)).unwrap()), 1, "{file}");
    }
    for args in [["replay", out, sample.as_str()], ["explain", out, sample.as_str()]] {
        let text = stdout(&closecall(args), 0);
        assert!(text.contains("R struck E") || text.contains("E struck F"), "{text}");
        assert_eq!(times(&text), 1, "{text}");
    }
    let run = ["run", "low-thw-overtake", "--sensors", "object"];
    assert_eq!(times(&stdout(&closecall(run.iter().chain(&["--paired"])), 0)), 1);
    assert_eq!(times(&stdout(&closecall(run.iter().chain(&["--format", "json"])), 0)), 0);
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (picture, traffic) = (at("a.svg"), at("traffic.csv"));
    let plot = ["plot", "low-thw-overtake", "--sensors", "object", "-o", &picture];
    assert_eq!(times(&stdout(&closecall(plot), 0)), 1);
    let record = ["traffic", "record", "low-thw-overtake", "-n", "3", "--sensors", "object", "-o", &traffic];
    stdout(&closecall(record), 0);
    let reenacted = stdout(&closecall(["traffic", "reenact", &traffic, "--sensors", "object"]), 0);
    assert!(reenacted.contains("R crosses the marking") && times(&reenacted) == 1, "{reenacted}");
}

#[test]
fn a_resumption_that_fails_fast_ends_at_the_next_failing_sample_and_blames_no_journal() {
    let folder = folder();
    let out = folder.path().join("out");
    let campaign = |more: &[&str]| {
        let mut command = program();
        command.args(["campaign", "low-thw-overtake", "-n", "60", "--sensors", "ground-truth", "--controller", "acc"]);
        command.args(["--no-gate", "--jobs", "1", "--record", "failures:0", "--out", out.to_str().unwrap()]);
        command.args(more).output().unwrap()
    };
    let samples = || fs::read_to_string(out.join("journal.jsonl")).unwrap().lines().count();
    assert_eq!(code(&campaign(&["--fail-fast"])), 1);
    let first = samples();
    let output = campaign(&["--fail-fast", "--resume"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    assert!(samples() > first && samples() < 60, "{} after {first}", samples());
    stdout(&campaign(&["--resume"]), 0);
    assert_eq!(samples(), 60);
    stdout(&campaign(&["--resume", "--fail-fast"]), 0);
}

#[test]
#[cfg(unix)]
fn the_sizes_in_the_examples_of_the_help_decide() {
    let mut examples = 0;
    for help in [&["--help"][..], &["campaign", "--help"]] {
        let text = stdout(&closecall(help), 0);
        for line in text.lines().filter_map(|line| line.trim().strip_prefix("closecall campaign low-thw-overtake ")) {
            let words = Command::new("sh").args(["-c", &format!("printf '%s\\n' {line}")]).output().unwrap();
            let words = String::from_utf8(words.stdout).unwrap();
            let more = ["--sensors", "object", "--no-validity-checks", "--seed", "0", "--no-out"];
            let mut command = program();
            command.args(["campaign", "low-thw-overtake"]).args(words.lines()).args(more);
            let output = command.output().unwrap();
            assert!([0, 1].contains(&code(&output)), "{line}: {output:?}");
            examples += 1;
        }
    }
    assert_eq!(examples, 3, "one of the program, two of the command");
}

#[test]
fn an_inconclusive_gate_says_how_many_samples_would_decide() {
    let gate = |samples: &str| {
        let args = ["campaign", "overtake-without-brake", "-n", samples, "--sensors", "ground-truth", "--gate"];
        closecall(args.into_iter().chain(["upper(ego_collided) <= 0.05"]))
    };
    let text = stdout(&gate("30"), 4);
    // 1 - 0.05^(1/59) is 0.0495: 59 samples without a collision.
    assert!(text.contains("too few samples to decide, some 59 would if they are like these"), "{text}");
    assert!(text.contains("no gate that was set is decided") && !text.contains("no gate was set"), "{text}");
    stdout(&gate("59"), 0);
    stdout(&gate("58"), 4);
}

#[test]
fn a_number_of_samples_without_end_does_not_delay_the_first_one() {
    let folder = folder();
    let out = folder.path().join("out");
    let plan = ["campaign", "low-thw-overtake", "--sensors", "ground-truth", "--time-budget", "2s", "--no-gate", "-n"];
    let more = ["--no-validity-checks", "--record", "failures:0", "--out", out.to_str().unwrap()];
    let text = stdout(&closecall(plan.iter().chain(&["18446744073709551615"]).chain(&more)), 0);
    let samples: u64 = text.split_once(": ").unwrap().1.split_once(' ').unwrap().0.parse().unwrap();
    assert!(samples > 0, "{text}");
    // The samples that the clock has left out are not counted one by one, either.
    stdout(&closecall(["check", out.to_str().unwrap()]), 0);
}

#[test]
fn what_cannot_end_well_is_refused_before_any_sample_runs() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let endless = |command: &mut std::process::Command| {
        command.args(["campaign", "low-thw-overtake", "-n", "1000000"]).output().unwrap()
    };
    // A stack that no thread can have, or that every run overflows.
    for bytes in ["1", "1000000000000000"] {
        let output = endless(program().env("RUST_MIN_STACK", bytes));
        assert_eq!(code(&output), 2, "{}", stderr(&output));
        assert!(message(&output).contains(&format!("RUST_MIN_STACK={bytes}: expected 1048576 to 1073741824 bytes")));
    }
    stdout(&program().env("RUST_MIN_STACK", "4194304").arg("list").output().unwrap(), 0);
    // A limit of the size of files: of nothing, and of what a smaller campaign needs.
    let out = at("limited");
    let limited = |blocks: &str, words: &[&str]| {
        let script = format!("ulimit -f {blocks}; exec \"$@\"");
        let mut command = std::process::Command::new("bash");
        command.current_dir(folder.path()).env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
        command.args(["-c", &script, "bash", env!("CARGO_BIN_EXE_closecall")]).args(words).output().unwrap()
    };
    let campaign = ["campaign", "low-thw-overtake", "--no-gate", "--sensors", "ground-truth", "-n"];
    for (blocks, bytes) in [("0", "0"), ("20000", "20480000")] {
        for place in [&["--out", out.to_str().unwrap()][..], &[]] {
            let output = limited(blocks, &[&campaign[..], &["1000000", "--arms", "acc,mis"], place].concat());
            assert_eq!(code(&output), 6, "{}", stderr(&output));
            let expected = [
                format!("no file may have more than {bytes} bytes (`ulimit -f`)"),
                "the journal of 1000000 samples with 2 controllers needs at least 2400000000".to_owned(),
            ];
            assert!(expected.iter().all(|said| message(&output).contains(said.as_str())), "{}", stderr(&output));
        }
    }
    assert!(!out.exists() && !at("closecall-results").exists(), "nothing was begun");
    // What fits runs, and so does what writes nothing.
    stdout(&limited("20000", &[&campaign[..], &["2"]].concat()), 0);
    stdout(&limited("0", &[&campaign[..], &["2", "--no-out"]].concat()), 0);
    // The recordings have no place.
    let output = closecall(["campaign", "low-thw-overtake", "-n", "1000000", "--no-out", "--record", "worst:1"]);
    assert_eq!(code(&output), 2, "{}", stderr(&output));
    // A name that no file can have.
    let long = at("long.toml");
    fs::write(&long, headline_with("name = \"low-thw-overtake\"", &format!("name = \"{}\"", "a".repeat(200)))).unwrap();
    let output = closecall(["campaign", long.to_str().unwrap(), "-n", "1000000"]);
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(message(&output).contains("at most 120 characters"), "{}", stderr(&output));
    // More encounters than there could be.
    let output = closecall(["study", "exposure", "--counted", "5000/20"]);
    assert_eq!(code(&output), 2);
    assert!(message(&output).contains("more than 10 per km"), "{}", stderr(&output));
}

#[cfg(unix)]
#[test]
fn a_campaign_whose_names_are_no_text_is_refused() {
    use std::ffi::OsString;
    use std::os::unix::ffi::OsStringExt as _;

    let folder = folder();
    let out = folder.path().join(OsString::from_vec(b"out\xff".to_vec()));
    let output = program().args(["campaign", "low-thw-overtake", "-n", "1000000", "--out"]).arg(&out).output().unwrap();
    assert_eq!(code(&output), 2, "{}", stderr(&output));
    assert!(message(&output).contains("the name is not text (UTF-8)"), "{}", stderr(&output));
    assert!(!out.exists());
}

#[test]
fn ten_thousand_parameters_are_refused_by_their_number() {
    let folder = folder();
    let path = folder.path().join("many.toml");
    let many: String = (0..10_000).map(|n| format!("p{n} = {{ uniform = {{ min = 0.0, max = 1.0 }} }}\n")).collect();
    fs::write(&path, headline_with("[parameters]", &format!("[parameters]\n{many}"))).unwrap();
    let output = closecall(["check", path.to_str().unwrap()]);
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(message(&output).contains("a number of parameters from 0 to 1000"), "{}", stderr(&output));
}

#[test]
fn an_explanation_does_not_need_to_write_into_the_folder() {
    let folder = folder();
    let out = folder.path().join("out");
    let words = ["campaign", "low-thw-overtake", "-n", "30", "--sensors", "object", "--controller", "acc", "--no-gate"];
    stdout(&closecall(words.into_iter().chain(["--record", "failures:0", "--out", out.to_str().unwrap()])), 0);
    // A folder in the place of the file: nobody can write it, not even root.
    drop(fs::remove_file(out.join("causes.json")));
    fs::create_dir(out.join("causes.json")).unwrap();
    let output = closecall(["explain", out.to_str().unwrap(), "--most", "1"]);
    assert!(!stdout(&output, 0).is_empty());
    assert!(message(&output).contains("warning: the explanation is not kept"), "{}", stderr(&output));
}

#[test]
fn a_slow_start_that_a_campaign_allows_is_allowed_everywhere() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let source = at("slow.c");
    let text = "#include <unistd.h>\n#define closecall_controller_create acc_create\n#include \"../../../examples/acc_controller.c\"\n\
        #undef closecall_controller_create\nvoid *closecall_controller_create(const closecall_setup *setup) { sleep(3); return acc_create(setup); }\n";
    let example = Path::new(crate::support::ROOT).join("examples/acc_controller.c");
    fs::write(&source, text.replace("../../../examples/acc_controller.c", example.to_str().unwrap())).unwrap();
    let library = lib(&compile(source.to_str().unwrap(), &at("slow.so"), &[]));
    let out = at("out");
    let words = ["low-thw-overtake", "--sensors", "object", "--controller", &library];
    stdout(&program().arg("run").args(words).output().unwrap(), 0);
    let campaign =
        ["-n", "1", "--no-gate", "--no-validity-checks", "--record", "failures:0", "--out", out.to_str().unwrap()];
    stdout(&program().arg("campaign").args(words).args(campaign).output().unwrap(), 0);
    let replay = ["replay", out.to_str().unwrap(), "0"];
    stdout(&program().args(replay).output().unwrap(), 0);
    stdout(
        &program()
            .args(replay)
            .args(["--controller-timeout-ms", "5000", "--controller-memory-mib", "2048"])
            .output()
            .unwrap(),
        0,
    );
}
