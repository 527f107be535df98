//! A campaign that is killed, cut short by a full disk, or shared out gives the same bytes as one that is left alone.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{closecall, code, folder, library, stderr, stdout};

const SAMPLES: usize = 400;

fn args(out: &Path, more: &[&str]) -> Vec<String> {
    let scenario = library("low-thw-overtake");
    let all = ["campaign", scenario.to_str().unwrap(), "--seed", "11", "--paired", "--recordings", "1"];
    let samples = SAMPLES.to_string();
    let fixed = ["-n", &samples, "--out", out.to_str().unwrap()];
    all.iter().chain(&fixed).chain(more).map(|arg| (*arg).to_owned()).collect()
}

fn bytes(folder: &Path, file: &str) -> Vec<u8> {
    let bytes = fs::read(folder.join(file)).unwrap();
    assert!(!bytes.is_empty(), "{file}");
    bytes
}

fn start(args: &[String]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_closecall"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(args)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}

/// Lets a campaign run until its journal has grown by some lines, and kills it. Answers whether it was killed.
fn kill_after(args: &[String], out: &Path, lines: usize) -> bool {
    let journal = out.join("journal.jsonl");
    let count = || fs::read(&journal).map_or(0, |text| text.iter().filter(|&&byte| byte == b'\n').count());
    let before = count();
    let mut child = start(args);
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() && count() < before + lines {
        assert!(started.elapsed() < Duration::from_mins(2), "it does not get on");
    }
    let was_running = child.try_wait().unwrap().is_none();
    child.kill().unwrap();
    child.wait().unwrap();
    was_running
}

/// The folder of the campaign that was left alone, which the others are held against.
fn undisturbed(folder: &Path) -> std::path::PathBuf {
    let out = folder.join("undisturbed");
    stdout(&closecall(args(&out, &["--jobs", "2"])), 0);
    out
}

const REPORTS: [&str; 3] = ["journal.jsonl", "outcomes.parquet", "junit.xml"];

#[test]
fn a_campaign_killed_again_and_again_ends_in_the_same_bytes() {
    let folder = folder();
    let whole = undisturbed(folder.path());
    let out = folder.path().join("killed");
    for (jobs, lines) in [("1", 1), ("2", 57), ("1", 90), ("2", 3), ("2", 120)] {
        assert!(kill_after(&args(&out, &["--jobs", jobs, "--resume"]), &out, lines), "killed too late");
        // What a line is torn to by a crash is cut off, wherever it ends.
        let journal = out.join("journal.jsonl");
        let text = fs::read(&journal).unwrap();
        fs::write(&journal, &text[..text.len() - lines.min(text.len())]).unwrap();
    }
    let resumed = closecall(args(&out, &["--jobs", "2", "--resume"]));
    stdout(&resumed, 0);
    assert!(stderr(&resumed).contains("the journal was torn"), "{}", stderr(&resumed));
    for file in REPORTS {
        assert!(bytes(&whole, file) == bytes(&out, file), "{file} differs");
    }
    // Nothing is left to run: the same once more.
    stdout(&closecall(args(&out, &["--resume"])), 0);
    for file in REPORTS {
        assert!(bytes(&whole, file) == bytes(&out, file), "{file} differs");
    }
}

#[test]
fn a_folder_with_a_campaign_is_not_overwritten() {
    let folder = folder();
    let out = folder.path().join("out");
    stdout(&closecall(args(&out, &[])), 0);
    let before = bytes(&out, "journal.jsonl");
    let again = closecall(args(&out, &[]));
    assert_eq!(code(&again), 2);
    assert!(stderr(&again).contains("--resume"), "{}", stderr(&again));
    let other = closecall(args(&out, &["--resume", "--set", "brake-mps2=6", "--sensors", "ground-truth"]));
    assert_eq!(code(&other), 2);
    for named in ["scenarios.low-thw-overtake.text", "sensors: null there, \"ground-truth\" here"] {
        assert!(stderr(&other).contains(named), "{}", stderr(&other));
    }
    let seed = closecall(args(&out, &["--resume", "--partition", "1/2"]));
    assert_eq!(code(&seed), 2);
    assert!(stderr(&seed).contains("partition: null there, \"1/2\" here"), "{}", stderr(&seed));
    assert!(bytes(&out, "journal.jsonl") == before);
}

#[test]
fn a_damaged_journal_is_run_again_from_the_damage_on() {
    let folder = folder();
    let whole = undisturbed(folder.path());
    let mut damaged = bytes(&whole, "journal.jsonl");
    let good = damaged.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    fs::write(whole.join("journal.jsonl"), damaged).unwrap();
    let resumed = closecall(args(&whole, &["--resume"]));
    stdout(&resumed, 0);
    assert!(stderr(&resumed).contains("checksum"), "{}", stderr(&resumed));
    assert!(bytes(&whole, "journal.jsonl") == good);
}

#[test]
fn two_campaigns_do_not_share_a_folder() {
    let folder = folder();
    let out = folder.path().join("out");
    let mut more = args(&out, &[]);
    let place = more.iter().position(|arg| arg == "-n").unwrap() + 1;
    // More than any test waits for.
    more[place] = "10000000".to_owned();
    let mut first = start(&more);
    let started = Instant::now();
    while !out.join("journal.jsonl").exists() {
        assert!(started.elapsed() < Duration::from_mins(2));
    }
    more.push("--resume".to_owned());
    let second = closecall(&more);
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(code(&second), 6, "{}", stderr(&second));
    assert!(stderr(&second).contains(&format!("process {}", first.id())), "{}", stderr(&second));
}

#[test]
#[cfg(unix)]
fn a_full_disk_is_an_i_o_error_and_loses_nothing() {
    let folder = folder();
    let whole = undisturbed(folder.path());
    let out = folder.path().join("full");
    // No file may grow beyond 200 blocks of 512 or 1,024 bytes, by the shell; the signal that says so is ignored, so
    // that the write fails as on a full disk.
    let script = "ulimit -f 200; trap '' XFSZ; exec \"$@\"";
    let limited = Command::new("sh")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["-c", script, "sh", env!("CARGO_BIN_EXE_closecall")])
        .args(args(&out, &[]))
        .output()
        .unwrap();
    assert_eq!(code(&limited), 6, "{}", stderr(&limited));
    let message = stderr(&limited);
    assert!(message.contains("journal.jsonl") && message.contains("--resume"), "{message}");
    assert!(bytes(&out, "journal.jsonl").len() > 50_000, "what was written before is kept");
    assert!(!out.join("outcomes.parquet").exists());
    stdout(&closecall(args(&out, &["--resume"])), 0);
    for file in REPORTS {
        assert!(bytes(&whole, file) == bytes(&out, file), "{file} differs");
    }
}

fn partition(folder: &Path, part: &str, more: &[&str]) -> std::path::PathBuf {
    let out = folder.join(format!("part-{}", part.replace('/', "-of-")));
    let more: Vec<&str> = ["--partition", part].iter().chain(more).copied().collect();
    stdout(&closecall(args(&out, &more)), 0);
    out
}

fn merge(parts: &[&Path], out: &Path) -> std::process::Output {
    let mut args: Vec<&str> = vec!["merge"];
    args.extend(parts.iter().map(|part| part.to_str().unwrap()));
    args.extend(["--out", out.to_str().unwrap(), "--recordings", "1"]);
    closecall(args)
}

#[test]
fn parts_that_are_merged_are_the_campaign_of_one_machine() {
    let folder = folder();
    for design in ["random", "sobol", "grid"] {
        let place = folder.path().join(design);
        let whole = place.join("whole");
        stdout(&closecall(args(&whole, &["--design", design])), 0);
        let parts = ["1/3", "2/3", "3/3"].map(|part| partition(&place, part, &["--design", design]));
        let out = place.join("merged");
        // Their order does not matter.
        stdout(&merge(&[&parts[2], &parts[0], &parts[1]], &out), 0);
        for file in REPORTS {
            assert!(bytes(&whole, file) == bytes(&out, file), "{design}: {file} differs");
        }
    }
}

#[test]
fn parts_that_make_no_campaign_are_refused_by_name() {
    let folder = folder();
    let [one, two, three] = ["1/3", "2/3", "3/3"].map(|part| partition(folder.path(), part, &[]));
    let other_seed = folder.path().join("other-seed");
    let mut of_other_seed = args(&other_seed, &["--partition", "3/3"]);
    let seed = of_other_seed.iter().position(|arg| arg == "--seed").unwrap() + 1;
    of_other_seed[seed] = "12".to_owned();
    stdout(&closecall(of_other_seed), 0);
    let whole = undisturbed(folder.path());
    let halves = partition(&folder.path().join("halves"), "2/2", &[]);
    let out = folder.path().join("out");
    let cases: [(&[&Path], &str); 6] = [
        (&[&one, &three], "2/3"),
        (&[&one], "2/3, 3/3"),
        (&[&one, &two, &two], "both hold part 2/3"),
        (&[&one, &two, &other_seed], "sampling.seed: 11 there, 12 here"),
        (&[&one, &two, &whole], "holds a whole campaign"),
        (&[&one, &halves], "partition: 1/3 there, 2/2 here"),
    ];
    for (parts, named) in cases {
        let refused = merge(parts, &out);
        assert_eq!(code(&refused), 2, "{named}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(named), "{named}: {}", stderr(&refused));
        assert!(!out.exists(), "{named}");
    }
    // A part that was killed before its end.
    let journal = two.join("journal.jsonl");
    let text = fs::read(&journal).unwrap();
    fs::write(&journal, &text[..text.len() - 10]).unwrap();
    let refused = merge(&[&one, &two, &three], &out);
    assert_eq!(code(&refused), 2);
    assert!(stderr(&refused).contains("part-2-of-3") && stderr(&refused).contains("--resume"), "{}", stderr(&refused));
    let resumed = args(&two, &["--partition", "2/3", "--resume"]);
    stdout(&closecall(resumed), 0);
    stdout(&merge(&[&one, &two, &three], &out), 0);
    assert!(bytes(&whole, "outcomes.parquet") == bytes(&out, "outcomes.parquet"));
    // The merged folder is a campaign like any other.
    let replayed = closecall(["replay", out.to_str().unwrap(), "5"]);
    stdout(&replayed, 0);
    let again = merge(&[&one, &two, &three], &out);
    assert_eq!(code(&again), 2, "nothing is overwritten");
}
