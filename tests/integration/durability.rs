//! A campaign that is killed and resumed, stopped by a full disk, or split among machines gives the
//! same bytes as one that runs undisturbed.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{ROOT, closecall, code, folder, library, program, stderr, stdout};

const SAMPLES: usize = 200;

/// How long a test waits before it takes a campaign for hung.
const HUNG_AFTER: Duration = Duration::from_mins(10);

/// The pause between two looks at a journal.
const PAUSE: Duration = Duration::from_millis(1);

fn args(out: &Path, more: &[&str]) -> Vec<String> {
    let scenario = library("low-thw-overtake-at-cut-out");
    let all = ["campaign", scenario.to_str().unwrap(), "--seed", "11", "--paired", "--recordings", "1", "--no-gate"];
    let samples = SAMPLES.to_string();
    // The files are written in the same way with all sensors, and object-level ones are fast.
    let fixed = ["-n", &samples, "--sensors", "object", "--out", out.to_str().unwrap()];
    all.iter().chain(&fixed).chain(more).map(|arg| (*arg).to_owned()).collect()
}

fn bytes(folder: &Path, file: &str) -> Vec<u8> {
    let bytes = fs::read(folder.join(file)).unwrap();
    assert!(!bytes.is_empty(), "{file}");
    bytes
}

fn start(args: &[String]) -> Child {
    program().args(args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts")
}

/// Waits until a condition holds.
fn wait_until(mut holds: impl FnMut() -> bool) {
    let started = Instant::now();
    while !holds() {
        assert!(started.elapsed() < HUNG_AFTER, "the campaign hangs");
        std::thread::sleep(PAUSE);
    }
}

/// Returns the bytes of a journal up to the end of its first `lines` lines, or all of them if it
/// has fewer.
fn first_lines(journal: &[u8], lines: usize) -> &[u8] {
    let ends = journal.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(index, _)| index + 1);
    &journal[..ends.take(lines).last().unwrap_or(0)]
}

/// Runs a campaign until its journal has at least `lines` more lines, kills it, and tears the
/// journal: the last of these lines lacks its last `torn` bytes. Returns true if the campaign still
/// ran when it was killed.
///
/// Lines that the program wrote beyond these before the signal arrived are cut off: the rest of the
/// test is the same on any machine.
fn kill_after(args: &[String], out: &Path, lines: usize, torn: usize) -> bool {
    let journal = out.join("journal.jsonl");
    let read = || fs::read(&journal).unwrap_or_default();
    let count = || read().iter().filter(|byte| **byte == b'\n').count();
    let wanted = count() + lines;
    let mut child = start(args);
    wait_until(|| count() >= wanted || child.try_wait().unwrap().is_some());
    let was_running = child.try_wait().unwrap().is_none();
    child.kill().unwrap();
    child.wait().unwrap();
    let written = read();
    let kept = first_lines(&written, wanted);
    assert!(kept.len() > torn, "the campaign ended before it had written {wanted} lines");
    fs::write(&journal, &kept[..kept.len() - torn]).unwrap();
    was_running
}

/// Runs the campaign that the others are compared with. Returns its folder.
fn undisturbed(folder: &Path) -> std::path::PathBuf {
    let out = folder.join("undisturbed");
    stdout(&closecall(args(&out, &["--jobs", "2"])), 0);
    out
}

const REPORTS: [&str; 3] = ["journal.jsonl", "outcomes.parquet", "samples.xml"];

#[test]
fn a_campaign_that_is_killed_and_resumed_repeatedly_ends_in_the_same_bytes() {
    let folder = folder();
    let whole = undisturbed(folder.path());
    let out = folder.path().join("killed");
    // The first kill comes after one of 200 samples, so it does interrupt the campaign. On a slow
    // machine a later one may come after the end.
    for (index, (jobs, lines)) in [("1", 1), ("2", 29), ("1", 45), ("2", 3), ("2", 60)].into_iter().enumerate() {
        let was_running = kill_after(&args(&out, &["--jobs", jobs, "--resume"]), &out, lines, lines);
        assert!(was_running || index > 0, "the campaign ended before it was killed");
    }
    let resumed = closecall(args(&out, &["--jobs", "2", "--resume"]));
    stdout(&resumed, 0);
    assert!(stderr(&resumed).contains("the journal was torn"), "{}", stderr(&resumed));
    for file in REPORTS {
        assert!(bytes(&whole, file) == bytes(&out, file), "{file} differs");
    }
    // Nothing is left to run: another resume changes nothing.
    stdout(&closecall(args(&out, &["--resume"])), 0);
    for file in REPORTS {
        assert!(bytes(&whole, file) == bytes(&out, file), "{file} differs");
    }
}

#[test]
fn the_folder_of_a_campaign_is_not_overwritten() {
    let folder = folder();
    let out = folder.path().join("out");
    stdout(&closecall(args(&out, &[])), 0);
    let before = bytes(&out, "journal.jsonl");
    let again = closecall(args(&out, &[]));
    assert_eq!(code(&again), 2);
    assert!(stderr(&again).contains("--resume"), "{}", stderr(&again));
    let mut with_others = args(&out, &["--resume", "--set", "brake-mps2=6"]);
    let sensors = with_others.iter().position(|arg| arg == "object").unwrap();
    with_others[sensors] = "ground-truth".to_owned();
    let other = closecall(with_others);
    assert_eq!(code(&other), 2);
    for named in ["scenarios.low-thw-overtake-at-cut-out.text", "sensors: \"object\" there, \"ground-truth\" here"] {
        assert!(stderr(&other).contains(named), "{}", stderr(&other));
    }
    let part = closecall(args(&out, &["--resume", "--partition", "1/2"]));
    assert_eq!(code(&part), 2);
    assert!(stderr(&part).contains("partition: null there, \"1/2\" here"), "{}", stderr(&part));
    assert!(bytes(&out, "journal.jsonl") == before);
}

#[test]
fn samples_after_a_damaged_journal_record_are_run_again() {
    let folder = folder();
    let whole = undisturbed(folder.path());
    let mut damaged = bytes(&whole, "journal.jsonl");
    let intact = damaged.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    fs::write(whole.join("journal.jsonl"), damaged).unwrap();
    let resumed = closecall(args(&whole, &["--resume"]));
    stdout(&resumed, 0);
    assert!(stderr(&resumed).contains("checksum"), "{}", stderr(&resumed));
    assert!(bytes(&whole, "journal.jsonl") == intact);
}

#[test]
fn a_damaged_journal_record_costs_only_its_own_sample() {
    let folder = folder();
    let whole = undisturbed(folder.path());
    let intact = bytes(&whole, "journal.jsonl");
    let table = bytes(&whole, "outcomes.parquet");
    let ends: Vec<usize> = (0..intact.len()).filter(|index| intact[*index] == b'\n').collect();
    // A byte of a line, the line feed that ends one, and a line feed inside one.
    for (index, byte) in [(ends[50] - 30, b'#'), (ends[100], b'#'), (ends[150] - 30, b'\n')] {
        let mut damaged = intact.clone();
        damaged[index] = byte;
        // The line before the damaged one ends here: from there to the end, no other line may be
        // run again.
        fs::write(whole.join("journal.jsonl"), &damaged).unwrap();
        let times = fs::read_to_string(whole.join("wall-times.jsonl")).unwrap();
        let resumed = closecall(args(&whole, &["--resume"]));
        stdout(&resumed, 0);
        assert!(stderr(&resumed).contains("its sample was run again"), "{}", stderr(&resumed));
        assert!(bytes(&whole, "journal.jsonl") == intact, "byte {index}");
        assert!(bytes(&whole, "outcomes.parquet") == table, "byte {index}");
        // The wall time of a sample that is run again differs.
        let now = fs::read_to_string(whole.join("wall-times.jsonl")).unwrap();
        let changed = times.lines().zip(now.lines()).filter(|(before, after)| before != after).count();
        assert!(times.lines().count() == SAMPLES && now.lines().count() == SAMPLES && changed <= 2, "{changed}");
    }
}

#[test]
fn samples_that_ended_in_an_error_are_run_again_on_request() {
    let folder = folder();
    let out = folder.path().join("out");
    let (marker, script) = (folder.path().join("works"), folder.path().join("ctl.sh"));
    let text = format!(
        "[ -e '{}' ] || exit 3\necho '{{\"type\":\"hello\",\"protocol\":1}}'\nread -r line\n\
         while read -r line; do echo '{{\"acceleration_mps2\":0.0,\"state\":\"following\"}}'; done\n",
        marker.display()
    );
    fs::write(&script, text).unwrap();
    let controller = format!("exec:sh {}", script.display());
    let scenario = library("low-thw-overtake");
    let campaign = |more: &[&str]| {
        let fixed = ["campaign", scenario.to_str().unwrap(), "-n", "4", "--out", out.to_str().unwrap()];
        let fixed = fixed.iter().chain(&["--set", "duration-s=2", "--set", "expects=[]"]);
        let controller = ["--record", "failures:0", "--controller", &controller, "--controller-timeout-ms", "60000"];
        closecall(fixed.chain(&controller).chain(more))
    };
    assert_eq!(code(&campaign(&["--no-gate"])), 5);
    fs::write(&marker, "").unwrap();
    assert_eq!(code(&campaign(&["--no-gate", "--resume"])), 5, "errors are kept");
    let retried = campaign(&["--no-gate", "--resume", "--retry-errors"]);
    let text = stdout(&retried, 0);
    assert!(stderr(&retried).contains("4 samples that had ended in an error were run again"), "{}", stderr(&retried));
    assert_eq!(code(&campaign(&["--no-gate", "--retry-errors"])), 2, "only with --resume");
    // The record, every report and a gate say so.
    assert!(text.contains("4 FLAKY") && text.contains("run again after a failure, first in sample 0: "), "{text}");
    for record in crate::support::records(&out) {
        assert_eq!(record.arms[0].flaky.as_ref().map(|flaky| flaky.crashes), Some(1));
    }
    for file in ["report.html", "summary.md", "junit.xml"] {
        let text = fs::read_to_string(out.join(file)).unwrap();
        assert!(text.to_lowercase().contains("flaky"), "{file}: {text}");
    }
    let text = stdout(&campaign(&["--resume", "--max-flaky", "0"]), 1);
    assert!(text.contains("flaky samples: 4, at most 0 allowed"), "{text}");
}

#[test]
fn two_campaigns_cannot_use_a_folder_at_the_same_time() {
    let folder = folder();
    let out = folder.path().join("out");
    let mut args = args(&out, &[]);
    let count = args.iter().position(|arg| arg == "-n").unwrap() + 1;
    // So many samples that the first campaign does not end before the second one starts.
    args[count] = "10000000".to_owned();
    let mut first = start(&args);
    wait_until(|| out.join("journal.jsonl").exists());
    args.push("--resume".to_owned());
    let second = closecall(&args);
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
    // The shell limits files, in blocks of 1,024 bytes, to nine tenths of the journal. That is more
    // than the campaign expects before its first sample. Its signal does not end the program, and
    // the write fails as on a full disk.
    let blocks = bytes(&whole, "journal.jsonl").len() * 9 / 10 / 1024;
    let script = format!("ulimit -f {blocks}; exec \"$@\"");
    let limited = Command::new("bash")
        .current_dir(ROOT)
        .args(["-c", &script, "bash", env!("CARGO_BIN_EXE_closecall")])
        .args(args(&out, &[]))
        .output()
        .unwrap();
    assert_eq!(code(&limited), 6, "{}", stderr(&limited));
    let message = stderr(&limited);
    assert!(message.contains("journal.jsonl") && message.contains("--resume"), "{message}");
    assert!(bytes(&out, "journal.jsonl").len() > 50_000, "the records before the full disk are kept");
    assert!(!out.join("outcomes.parquet").exists());
    stdout(&closecall(args(&out, &["--resume"])), 0);
    for file in REPORTS {
        assert!(bytes(&whole, file) == bytes(&out, file), "{file} differs");
    }
}

#[test]
#[cfg(unix)]
fn a_gigabyte_of_zeros_behind_a_journal_is_cut_off_and_not_kept_in_memory() {
    let folder = folder();
    let whole = undisturbed(folder.path());
    let out = folder.path().join("zeros");
    stdout(&closecall(args(&out, &[])), 0);
    let journal = fs::OpenOptions::new().write(true).open(out.join("journal.jsonl")).unwrap();
    journal.set_len(journal.metadata().unwrap().len() + (1 << 30)).unwrap();
    // The shell limits the address space to less than the zeros take. Two worker threads and the
    // network fit.
    let limited = |arguments: &[String]| {
        let script = "ulimit -v 900000; exec \"$@\"";
        let mut command = Command::new("sh");
        command.current_dir(ROOT).args(["-c", script, "sh", env!("CARGO_BIN_EXE_closecall")]).args(arguments);
        command.output().unwrap()
    };
    let checked = limited(&["check".to_owned(), out.to_str().unwrap().to_owned()]);
    assert_eq!(code(&checked), 3, "{}", stderr(&checked));
    assert!(stdout(&checked, 3).contains(&format!("journal.jsonl:{}", SAMPLES + 1)), "{}", stdout(&checked, 3));
    stdout(&limited(&args(&out, &["--resume"])), 0);
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
    let mut args: Vec<&str> = vec!["tool", "merge"];
    args.extend(parts.iter().map(|part| part.to_str().unwrap()));
    args.extend(["--out", out.to_str().unwrap(), "--recordings", "1", "--no-gate"]);
    closecall(args)
}

#[test]
fn merged_parts_equal_the_campaign_of_one_machine() {
    let folder = folder();
    for design in ["random", "sobol", "grid"] {
        let folder = folder.path().join(design);
        let whole = folder.join("whole");
        stdout(&closecall(args(&whole, &["--design", design])), 0);
        let parts = ["1/3", "2/3", "3/3"].map(|part| partition(&folder, part, &["--design", design]));
        let out = folder.join("merged");
        // The order of the parts does not matter.
        stdout(&merge(&[&parts[2], &parts[0], &parts[1]], &out), 0);
        for file in REPORTS {
            assert!(bytes(&whole, file) == bytes(&out, file), "{design}: {file} differs");
        }
    }
}

#[test]
fn parts_that_do_not_make_a_campaign_are_refused_by_name() {
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
    // The merged folder can be replayed like the folder of any campaign.
    let replayed = closecall(["replay", out.to_str().unwrap(), "5"]);
    stdout(&replayed, 0);
    let again = merge(&[&one, &two, &three], &out);
    assert_eq!(code(&again), 2, "the merged folder is overwritten");
}
