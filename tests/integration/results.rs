//! A campaign that names no folder leaves its results in `closecall-results`, and replaces nothing
//! but earlier results.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::support::{
    code, folder, journal, json, json_file, library, message, program, stderr, stdout, wait_for_results,
};

const RESULTS: &str = "closecall-results";
const PREVIOUS: &str = "closecall-results.previous";
/// A campaign with collisions of each kind.
const CAMPAIGN: [&str; 8] =
    ["campaign", "low-thw-overtake", "-n", "60", "--paired", "--no-gate", "--sensors", "object"];

fn run(folder: &Path, args: &[&str]) -> Output {
    program().current_dir(folder).env_remove("GITHUB_STEP_SUMMARY").args(args).output().unwrap()
}

/// Runs a small campaign in a folder.
fn campaign(folder: &Path, more: &[&str]) -> Output {
    sized(folder, "4", more)
}

/// Runs a campaign of so many samples in a folder.
fn sized(folder: &Path, samples: &str, more: &[&str]) -> Output {
    let fixed = ["campaign", "low-thw-overtake", "-n", samples, "--no-gate", "--sensors", "ground-truth"];
    run(folder, &[&fixed, more].concat())
}

/// Everything below a folder, with the content of files and the targets of links.
fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, kind) = (entry.path(), entry.file_type().unwrap());
        let name = path.display().to_string();
        if kind.is_symlink() {
            all.push((name, fs::read_link(&path).unwrap().display().to_string().into_bytes()));
        } else if kind.is_dir() {
            all.push((name, Vec::new()));
            all.extend(content(&path));
        } else {
            all.push((name, fs::read(&path).unwrap()));
        }
    }
    all.sort();
    all
}

/// The number of samples that the manifest of a folder states.
fn samples(folder: &Path) -> u64 {
    json_file(&folder.join("manifest.json"))["sampling"]["samples"].as_u64().unwrap()
}

#[test]
fn a_campaign_leaves_a_report_and_the_worst_of_each_kind_and_says_how_to_open_them() {
    let folder = folder();
    let output = run(folder.path(), &[&CAMPAIGN[..], &["--seed", "1"]].concat());
    let text = stdout(&output, 0);
    assert!(!text.contains(RESULTS), "where the results are stands on standard error: {text}");
    let results = folder.path().join(RESULTS);
    for name in ["report.html", "junit.xml", "outcomes.parquet", "journal.jsonl", "manifest.json"] {
        assert!(results.join(name).is_file(), "{name}");
    }
    let messages = stderr(&output);
    let look: Vec<&str> = messages.lines().filter_map(|line| line.strip_prefix("look: ")).collect();
    assert_eq!(messages.lines().rev().take(look.len()).filter(|line| line.starts_with("look: ")).count(), look.len());
    assert!(look[0].ends_with(" closecall-results/report.html"), "{messages}");
    let kinds = ["worst prevented collision", "worst induced collision", "worst collision in both arms"];
    let pairs: Vec<&str> = text.lines().find(|line| line.contains("pairs:")).unwrap().split_whitespace().collect();
    let expected: Vec<&str> =
        kinds.into_iter().zip([1, 3, 5]).filter(|(_, word)| pairs[*word] != "0").map(|(kind, _)| kind).collect();
    assert!(expected.len() > 1, "{text}");
    assert_eq!(look.len(), 1 + expected.len(), "{messages}");
    for (line, kind) in look[1..].iter().zip(expected) {
        let (command, why) = line.split_once("  # ").unwrap();
        let file = command.strip_prefix("closecall view ").unwrap();
        assert!(why.starts_with(kind) && folder.path().join(file).is_file(), "{line}");
    }
    assert!(!folder.path().join(PREVIOUS).exists());
}

#[test]
fn the_recorded_samples_are_those_with_the_largest_harm_of_their_kind() {
    let folder = folder();
    run(folder.path(), &[&CAMPAIGN[..], &["--seed", "1"]].concat());
    // The harm of both arms, from the journal itself.
    let harm = |arm: &serde_json::Value| -> f64 {
        let mut worst = std::collections::BTreeMap::<String, f64>::new();
        for collision in arm["collisions"].as_array().unwrap() {
            for side in 0..2 {
                let worst_mps = worst.entry(collision["between"][side].as_str().unwrap().to_owned()).or_default();
                *worst_mps = worst_mps.max(collision["delta_v_mps"][side].as_f64().unwrap());
            }
        }
        worst.values().map(|delta_v_mps| (delta_v_mps / 31.739_84).powi(4)).sum()
    };
    let ego = |arm: &serde_json::Value| {
        let collisions = arm["collisions"].as_array().unwrap().iter();
        collisions.flat_map(|actor| actor["between"].as_array().unwrap()).any(|actor| actor == "ego")
    };
    let mut worst = [(0.0, None); 2];
    for record in journal(&folder.path().join(RESULTS)) {
        let [acc, mis] = [0, 1].map(|arm| &record["arms"][arm]["result"]["Ok"]);
        let sample = record["sample"].as_u64();
        let no_collision = mis["collisions"].as_array().unwrap().is_empty();
        let kind = match (ego(acc), no_collision) {
            (true, true) => Some((0, harm(acc))),
            (true, false) => Some((1, harm(mis))),
            _ => None,
        };
        if let Some((kind, harm)) = kind.filter(|(kind, harm)| *harm > worst[*kind].0) {
            worst[kind] = (harm, sample);
        }
    }
    for sample in worst.iter().filter_map(|(_, sample)| *sample) {
        let file = folder.path().join(RESULTS).join(format!("recordings/low-thw-overtake-{sample}.rrd"));
        assert!(file.is_file(), "sample {sample}");
    }
    assert!(worst[0].1.is_some());
}

#[test]
fn a_campaign_without_pairs_or_without_a_collision_leaves_its_worst_sample() {
    let folder = folder();
    let output = campaign(folder.path(), &[]);
    stdout(&output, 0);
    assert!(stderr(&output).contains("  # worst sample: sample "), "{}", stderr(&output));
    // Several scenarios leave no more recordings than one.
    let two = ["campaign", "low-thw-overtake", "low-thw-overtake-at-cut-out", "-n", "40", "--paired", "--no-gate"];
    let output = run(folder.path(), &[&two[..], &["--sensors", "ground-truth"]].concat());
    stdout(&output, 0);
    let recordings = fs::read_dir(folder.path().join(RESULTS).join("recordings")).unwrap();
    let count = recordings.filter(|entry| entry.as_ref().unwrap().path().extension().unwrap() == "rrd").count();
    assert!((1..=3).contains(&count), "{count}");
}

#[test]
fn recordings_that_the_environment_switches_off_are_no_error_unless_they_are_asked_for() {
    let folder = folder();
    let small = ["campaign", "low-thw-overtake", "-n", "4", "--no-gate", "--sensors", "ground-truth"];
    let off = |more: &[&str]| {
        program().current_dir(folder.path()).env("RERUN", "off").args(small).args(more).output().unwrap()
    };
    stdout(&off(&[]), 0);
    assert!(!folder.path().join(RESULTS).join("recordings").exists());
    let asked = off(&["--record", "worst:1"]);
    stdout(&asked, 0);
    assert!(message(&asked).contains("warning: the recording of sample "), "{}", stderr(&asked));
    assert_eq!(code(&off(&["--record", "worst:1", "--strict-artifacts"])), 6);
}

#[test]
fn out_and_no_out_leave_the_default_folder_alone() {
    let folder = folder();
    stdout(&campaign(folder.path(), &["--no-out"]), 0);
    assert_eq!(content(folder.path()), []);
    stdout(&campaign(folder.path(), &["--out", "elsewhere"]), 0);
    assert!(!folder.path().join(RESULTS).exists());
    // `run` and the parts of a campaign keep nothing, either.
    stdout(&run(folder.path(), &["run", "low-thw-overtake"]), 0);
    assert_eq!(code(&campaign(folder.path(), &["--partition", "1/2"])), 2);
    for both in [["--no-out", "--out", "x"].as_slice(), &["--no-out", "--resume"]] {
        assert_eq!(code(&campaign(folder.path(), both)), 2, "{both:?}");
    }
    assert!(!folder.path().join(RESULTS).exists());
}

#[test]
fn the_last_results_become_the_previous_ones_and_only_these_are_removed() {
    let folder = folder();
    let (results, previous) = (folder.path().join(RESULTS), folder.path().join(PREVIOUS));
    for (count, moved) in [("4", None), ("5", Some(4)), ("6", Some(5))] {
        let output = sized(folder.path(), count, &["--format", "json"]);
        json(&output, 0);
        assert_eq!(samples(&results).to_string(), count);
        assert_eq!(previous.exists().then(|| samples(&previous)), moved);
        let says = message(&output).contains("the last results are now in closecall-results.previous");
        assert_eq!(says, moved.is_some(), "{}", stderr(&output));
    }
    assert!(message(&campaign(folder.path(), &[])).contains("in place of older ones"));
    // What `explain` adds belongs to the results.
    let explained = run(folder.path(), &["explain", RESULTS]);
    assert!([0, 2, 4].contains(&code(&explained)), "{}", stderr(&explained));
    stdout(&campaign(folder.path(), &[]), 0);
    stdout(&campaign(folder.path(), &[]), 0);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    stdout(&run(folder.path(), &["compare", PREVIOUS, RESULTS]), 0);
}

/// Asserts that a campaign runs nothing, changes nothing, and names the obstacle and the remedy.
fn assert_refused(folder: &Path, reason: &str) {
    let before = content(folder);
    // The campaign would not end in any reasonable time.
    let output = sized(folder, "100000000", &[]);
    assert_eq!(code(&output), 2, "{reason}: {}", stderr(&output));
    assert!(output.stdout.is_empty());
    for said in [reason, "--out", "--no-out", "nothing is overwritten"] {
        assert!(message(&output).contains(said), "{said}: {}", stderr(&output));
    }
    assert!(content(folder) == before, "{reason}");
}

#[test]
fn what_no_campaign_has_written_is_neither_overwritten_nor_moved() {
    for place in [RESULTS, PREVIOUS] {
        let folder = folder();
        let path = folder.path().join(place);
        if place == PREVIOUS {
            // Without results to be moved, nothing is needed there.
            stdout(&campaign(folder.path(), &[]), 0);
        }
        let clear = || {
            if path.is_dir() && !path.is_symlink() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) }
                .unwrap();
        };
        fs::write(&path, "notes").unwrap();
        assert_refused(folder.path(), "it is not a folder");
        clear();
        fs::create_dir(&path).unwrap();
        fs::write(path.join("thesis.tex"), "do not lose this").unwrap();
        assert_refused(folder.path(), "no results of a campaign");
        fs::write(path.join("manifest.json"), "{\"name\": \"My app\", \"manifest_version\": 3}").unwrap();
        assert_refused(folder.path(), "its manifest does not belong to a campaign");
        clear();
        // The folder of a campaign that the user has put there.
        stdout(&campaign(folder.path(), &["--out", "own"]), 0);
        fs::rename(folder.path().join("own"), &path).unwrap();
        assert_refused(folder.path(), "whose command line named its folder");
        clear();
        #[cfg(unix)]
        {
            let elsewhere = folder.path().join("elsewhere");
            fs::create_dir(&elsewhere).unwrap();
            std::os::unix::fs::symlink(&elsewhere, &path).unwrap();
            assert_refused(folder.path(), "it is a symbolic link");
            clear();
            std::os::unix::fs::symlink("nowhere", &path).unwrap();
            assert_refused(folder.path(), "it is a symbolic link");
        }
    }
}

#[test]
fn a_file_that_somebody_has_put_among_the_results_is_not_lost() {
    let folder = folder();
    let results = folder.path().join(RESULTS);
    stdout(&campaign(folder.path(), &[]), 0);
    for name in ["notes.txt", "recordings/mine.rrd", "recordings/low-thw-overtake-best.rrd"] {
        fs::write(results.join(name), "do not lose this").unwrap();
        assert_refused(folder.path(), &format!("it holds {name}"));
        fs::remove_file(results.join(name)).unwrap();
    }
    fs::create_dir(results.join("pictures")).unwrap();
    assert_refused(folder.path(), "it holds pictures");
    fs::remove_dir(results.join("pictures")).unwrap();
    #[cfg(unix)]
    {
        // A link with the name of a report.
        fs::rename(results.join("summary.md"), folder.path().join("kept.md")).unwrap();
        std::os::unix::fs::symlink("../kept.md", results.join("summary.md")).unwrap();
        assert_refused(folder.path(), "it holds summary.md");
        fs::remove_file(results.join("summary.md")).unwrap();
    }
    // Among the previous results, too.
    stdout(&campaign(folder.path(), &[]), 0);
    fs::write(folder.path().join(PREVIOUS).join("notes.txt"), "do not lose this").unwrap();
    assert_refused(folder.path(), "closecall-results.previous: beside the results of a campaign it holds notes.txt");
}

#[test]
fn results_with_fast_samples_become_the_previous_ones_and_are_removed() {
    let folder = folder();
    let [results, previous] = [RESULTS, PREVIOUS].map(|name| folder.path().join(name));
    let fast = ["--fidelity", "ground-truth:2", "--sensors", "object"];
    let with_fast_samples = [&["campaign", "low-thw-overtake", "-n", "4", "--no-gate"][..], &fast].concat();
    stdout(&run(folder.path(), &with_fast_samples), 0);
    assert!(results.join("fidelity/journal.jsonl").is_file() && results.join("fidelity.json").is_file());
    stdout(&campaign(folder.path(), &[]), 0);
    assert!(!results.join("fidelity").exists() && previous.join("fidelity/manifest.json").is_file());
    stdout(&campaign(folder.path(), &[]), 0);
    assert!(!previous.join("fidelity").exists() && !previous.join("fidelity.json").exists());
    // A file of the user among the fast samples stays.
    stdout(&run(folder.path(), &with_fast_samples), 0);
    fs::write(results.join("fidelity/notes.txt"), "do not lose this").unwrap();
    assert_refused(folder.path(), "beside the results of a campaign it holds fidelity/notes.txt");
}

#[test]
fn an_input_among_the_results_is_not_overwritten() {
    let folder = folder();
    stdout(&campaign(folder.path(), &[]), 0);
    let results = folder.path().join(RESULTS);
    // Under the name of a report, nothing but its use tells the scenario apart.
    fs::copy(library("low-thw-overtake"), results.join("summary.md")).unwrap();
    let before = content(folder.path());
    for input in ["closecall-results/summary.md", "./closecall-results/../closecall-results/summary.md"] {
        let output = run(folder.path(), &["campaign", input, "-n", "100000000", "--no-gate"]);
        assert_eq!(code(&output), 2, "{}", stderr(&output));
        assert!(message(&output).contains("it holds an input of the campaign"), "{}", stderr(&output));
        assert!(content(folder.path()) == before);
    }
    fs::write(results.join("mine.toml"), "").unwrap();
    assert_refused(folder.path(), "it holds mine.toml");
}

/// Starts an endless campaign, and waits until it has written results.
fn start(folder: &Path, more: &[&str]) -> std::process::Child {
    let endless = ["campaign", "low-thw-overtake", "-n", "10000000", "--no-gate", "--sensors", "ground-truth"];
    let mut command = program();
    command.current_dir(folder).args(endless).args(more);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_results(&mut child, &folder.join(RESULTS).join("journal.jsonl"));
    child
}

#[test]
fn two_campaigns_in_one_working_folder_do_not_destroy_each_other() {
    let folder = folder();
    let mut first = start(folder.path(), &[]);
    let second = campaign(folder.path(), &[]);
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(code(&second), 6, "{}", stderr(&second));
    for said in [format!("process {}", first.id()).as_str(), "--out", "--no-out"] {
        assert!(message(&second).contains(said), "{}", stderr(&second));
    }
    assert_eq!(samples(&folder.path().join(RESULTS)), 10_000_000);
    assert!(!folder.path().join(PREVIOUS).exists());
}

#[test]
fn campaigns_that_start_at_the_same_time_end_with_whole_results() {
    let folder = folder();
    stdout(&campaign(folder.path(), &[]), 0);
    let start = |count: u64| {
        let count = count.to_string();
        let mut command = program();
        command.current_dir(folder.path()).args([
            "campaign",
            "low-thw-overtake",
            "-n",
            &count,
            "--no-gate",
            "--jobs",
            "1",
        ]);
        command.args(["--sensors", "ground-truth"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let all: Vec<_> = (20..26).map(start).collect();
    let all: Vec<_> = all.into_iter().map(|child| child.wait_with_output().unwrap()).collect();
    for output in &all {
        assert!([0, 6].contains(&code(output)), "{}", stderr(output));
    }
    assert!(all.iter().any(|output| code(output) == 0));
    for place in [RESULTS, PREVIOUS] {
        let place = folder.path().join(place);
        let records = fs::read_to_string(place.join("journal.jsonl")).unwrap().lines().count() as u64;
        assert!(records == samples(&place) && place.join("report.html").is_file(), "{}: {records}", place.display());
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn an_interrupted_campaign_is_resumed_or_becomes_the_previous_results_and_says_so() {
    let folder = folder();
    let child = start(folder.path(), &[]);
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(code(&output), 130, "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let resume = text.lines().find_map(|line| line.strip_prefix("resume: ")).unwrap().to_owned();
    assert!(resume.ends_with(" --resume") && !resume.contains("--out"), "{resume}");
    // Another campaign cannot be resumed there, and changes nothing.
    let kept = fs::read(folder.path().join(RESULTS).join("journal.jsonl")).unwrap();
    let other = campaign(folder.path(), &["--resume"]);
    assert_eq!(code(&other), 2, "{}", stderr(&other));
    assert!(message(&other).contains("sampling.samples: 10000000 there, 4 here"), "{}", stderr(&other));
    assert!(fs::read(folder.path().join(RESULTS).join("journal.jsonl")).unwrap() == kept);
    let output = campaign(folder.path(), &[]);
    stdout(&output, 0);
    let messages = stderr(&output);
    let resume = messages.lines().find_map(|line| line.split_once("it is resumed by: ")).unwrap().1;
    assert!(resume.ends_with("--out closecall-results.previous --resume"), "{messages}");
    assert!(fs::read(folder.path().join(PREVIOUS).join("journal.jsonl")).unwrap() == kept);
}

#[test]
fn an_unfinished_campaign_does_not_displace_finished_results() {
    let folder = folder();
    let (results, previous) = (folder.path().join(RESULTS), folder.path().join(PREVIOUS));
    stdout(&sized(folder.path(), "4", &[]), 0);
    stdout(&sized(folder.path(), "5", &[]), 0);
    // It displaces nothing when it starts: the results that it moves are finished.
    let mut child = start(folder.path(), &[]);
    let started = Instant::now();
    let has_begun =
        || fs::read_to_string(results.join("manifest.json")).is_ok_and(|manifest| manifest.contains("10000000"));
    while !has_begun() {
        assert!(started.elapsed() < Duration::from_secs(300), "the campaign hangs");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!((samples(&results), samples(&previous)), (10_000_000, 5));
    let kept = content(&previous);
    let output = sized(folder.path(), "6", &["--record", "worst:1"]);
    stdout(&output, 0);
    let said = "the campaign in closecall-results is unfinished: it is replaced, and \
                closecall-results.previous keeps the last finished results";
    assert!(message(&output).contains(said), "{}", stderr(&output));
    assert!(!message(&output).contains("the last results are now in"), "{}", stderr(&output));
    assert_eq!(samples(&results), 6);
    assert!(content(&previous) == kept, "the finished results are as they were");
    // Its recordings are removed with it.
    fs::remove_file(results.join("report.html")).unwrap();
    stdout(&sized(folder.path(), "7", &[]), 0);
    assert_eq!((samples(&results), samples(&previous)), (7, 5));
    // An unfinished one is kept as long as there is nothing better, and makes way for a finished
    // one.
    fs::remove_file(results.join("report.html")).unwrap();
    fs::remove_file(previous.join("report.html")).unwrap();
    let output = sized(folder.path(), "8", &[]);
    stdout(&output, 0);
    assert!(message(&output).contains("in place of older ones"), "{}", stderr(&output));
    assert_eq!((samples(&results), samples(&previous)), (8, 7));
    stdout(&sized(folder.path(), "9", &[]), 0);
    assert_eq!((samples(&results), samples(&previous)), (9, 8));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn a_resumed_campaign_ends_in_the_bytes_of_an_undisturbed_one() {
    let folder = folder();
    let whole = ["campaign", "low-thw-overtake", "-n", "300", "--no-gate", "--sensors", "ground-truth"];
    // Without --out, --resume begins a campaign if there is none, as with --out.
    stdout(&run(folder.path(), &[&whole[..], &["--resume"]].concat()), 0);
    let results = folder.path().join(RESULTS);
    let journal = fs::read(results.join("journal.jsonl")).unwrap();
    let table = fs::read(results.join("outcomes.parquet")).unwrap();
    fs::write(results.join("journal.jsonl"), &journal[..journal.len() / 2]).unwrap();
    stdout(&run(folder.path(), &[&whole[..], &["--resume"]].concat()), 0);
    assert!(fs::read(results.join("journal.jsonl")).unwrap() == journal);
    assert!(fs::read(results.join("outcomes.parquet")).unwrap() == table);
    assert!(!folder.path().join(PREVIOUS).exists());
    // A folder that the command line names has the same bytes.
    stdout(&run(folder.path(), &[&whole[..], &["--out", "named"]].concat()), 0);
    assert!(fs::read(folder.path().join("named/outcomes.parquet")).unwrap() == table);
    // A file among the results is not removed by a resumption, which writes recordings anew.
    fs::write(results.join("recordings/mine.rrd"), "do not lose this").unwrap();
    let refused = run(folder.path(), &[&whole[..], &["--resume"]].concat());
    assert_eq!(code(&refused), 2, "{}", stderr(&refused));
    assert!(results.join("recordings/mine.rrd").is_file());
}

#[test]
fn an_early_end_leaves_a_folder_to_look_at_and_to_resume() {
    let folder = folder();
    let args = ["campaign", "low-thw-overtake", "-n", "200", "--controller", "acc", "--fail-fast"];
    let output = run(folder.path(), &args);
    let text = stdout(&output, 1);
    assert!(text.contains("look:   closecall replay closecall-results "), "{text}");
    let resume = text.lines().find_map(|line| line.strip_prefix("resume: ")).unwrap();
    assert!(resume.ends_with("--resume") && !resume.contains("--fail-fast"), "{resume}");
    let nothing = stdout(&run(folder.path(), &[&args[..], &["--no-out"]].concat()), 1);
    assert!(nothing.contains("nothing was kept"), "{nothing}");
}

/// Runs a campaign in a folder whose mount has these options. Returns `None` if this machine mounts
/// nothing.
fn campaign_on(options: &str, prepare: &str, more: &[&str]) -> Option<Output> {
    let folder = folder();
    let script = format!("mount -t tmpfs -o {options} none \"$0\" && cd \"$0\" && {prepare} && exec \"$@\"");
    let unshared = Command::new("unshare").args(["--mount", "true"]).output();
    if !unshared.is_ok_and(|output| output.status.success()) {
        return None;
    }
    let output = Command::new("unshare")
        .args(["--mount", "sh", "-c", &script])
        .arg(folder.path())
        .arg(env!("CARGO_BIN_EXE_closecall"))
        .args(more)
        .output()
        .unwrap();
    Some(output)
}

/// Asserts that the verdict is printed, and that the error names the remedy.
fn assert_verdict_without_results(output: &Output, named: &str) {
    let text = stdout(output, 6);
    assert!(text.contains("overtake-without-brake: 60 samples") && text.contains("PASS"), "{text}");
    for said in [named, "--out DIR", "--no-out"] {
        assert!(message(output).contains(said), "{said}: {}", stderr(output));
    }
    assert!(!stderr(output).contains("look: "), "{}", stderr(output));
}

const JUDGED: [&str; 8] =
    ["campaign", "overtake-without-brake", "-n", "60", "--max-collisions", "0", "--sensors", "ground-truth"];

#[test]
fn a_read_only_working_folder_costs_the_results_and_not_the_verdict() {
    let read_only = "mount -o remount,ro none .";
    let Some(output) = campaign_on("size=1m", read_only, &JUDGED) else { return };
    assert_verdict_without_results(&output, "closecall-results");
    let Some(output) = campaign_on("size=1m", read_only, &[&JUDGED[..], &["--no-out"]].concat()) else { return };
    stdout(&output, 0);
}

#[test]
fn a_full_disk_costs_the_results_and_not_the_verdict() {
    // Full at the start, during the samples, and at the reports, which are no part of the results
    // unless they are asked for.
    let strict = &["--record", "worst:2", "--strict-artifacts"];
    for (size, more) in [("8k", &[][..]), ("60k", &[]), ("260k", strict)] {
        let Some(output) = campaign_on(&format!("size={size}"), "true", &[&JUDGED[..], more].concat()) else { return };
        assert_verdict_without_results(&output, "No space left on device");
        assert!(message(&output).contains("closecall-results"), "{size}: {}", stderr(&output));
    }
}

#[test]
fn view_without_arguments_names_the_last_report_and_what_is_missing() {
    let folder = folder();
    let view = |more: &[&str]| run(folder.path(), &[&["view", "--no-open"], more].concat());
    let none = view(&[]);
    assert_eq!(code(&none), 2);
    assert!(message(&none).contains("there are no results here"), "{}", stderr(&none));
    stdout(&campaign(folder.path(), &["--record", "failures:0"]), 0);
    assert_eq!(stdout(&view(&[]), 0), "closecall-results/report.html\n");
    stdout(&campaign(folder.path(), &[]), 0);
    let files = stdout(&view(&[]), 0);
    let (report, recordings) = files.split_once('\n').unwrap();
    assert_eq!(report, "closecall-results/report.html");
    assert!(!recordings.is_empty() && recordings.lines().all(|file| folder.path().join(file).is_file()), "{files}");
    fs::remove_file(folder.path().join(RESULTS).join("report.html")).unwrap();
    assert!(message(&view(&[])).contains("its campaign is unfinished"), "{}", stderr(&view(&[])));
}

#[test]
fn init_tells_git_to_leave_the_results_alone() {
    let folder = folder();
    stdout(&run(folder.path(), &["init"]), 0);
    let ignored = fs::read_to_string(folder.path().join(".gitignore")).unwrap();
    assert!(
        ignored.contains("/closecall-results/\n") && ignored.contains("/closecall-results.previous/\n"),
        "{ignored}"
    );
    fs::write(folder.path().join(".gitignore"), "target\n").unwrap();
    let kept = stderr(&run(folder.path(), &["init"]));
    assert!(kept.contains("kept: ./.gitignore (add the line /closecall-results/"), "{kept}");
    assert_eq!(fs::read_to_string(folder.path().join(".gitignore")).unwrap(), "target\n");
}
