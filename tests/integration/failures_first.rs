//! `campaign --failures-first` runs the samples first that failed in an earlier campaign, and
//! changes no byte of the results.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use crate::support::{closecall, code, folder, json, json_file, message, records, stderr, stdout};

const SAMPLES: u64 = 60;

/// The files whose bytes depend on the results alone.
const REPORTS: [&str; 3] = ["journal.jsonl", "outcomes.parquet", "samples.xml"];

/// Runs a campaign in one thread, so that the samples are done in the order in which they start.
fn campaign(out: &Path, words: &str) -> std::process::Output {
    let samples = SAMPLES.to_string();
    let fixed = ["campaign", "low-thw-overtake", "-n", &samples, "--sensors", "ground-truth", "--seed", "3"];
    let kept = ["--jobs", "1", "--record", "failures:0", "--out", out.to_str().unwrap()];
    closecall(fixed.into_iter().chain(kept).chain(words.split_whitespace()))
}

/// An earlier campaign, with the samples that failed in it.
struct Earlier {
    folder: PathBuf,
    /// The file of `baseline save`.
    file: PathBuf,
    failing: Vec<u64>,
}

impl Earlier {
    fn run(place: &Path) -> Self {
        let (folder, file) = (place.join("earlier"), place.join("earlier.json"));
        stdout(&campaign(&folder, "--controller acc --no-gate"), 0);
        stdout(&closecall(["baseline", "save", folder.to_str().unwrap(), file.to_str().unwrap()]), 0);
        let baseline = json_file(&file);
        let failing = baseline["scenarios"]["low-thw-overtake"]["failing"].as_array().unwrap();
        let failing: Vec<u64> = failing.iter().map(|sample| sample.as_u64().unwrap()).collect();
        assert!(failing.len() > 6 && failing[5] > 5, "the plain order is another one: {failing:?}");
        Self { folder, file, failing }
    }

    fn option(&self) -> String {
        format!("--failures-first {}", self.folder.display())
    }
}

fn assert_same_bytes(one: &Path, other: &Path) {
    for file in REPORTS {
        let [one, other] = [one, other].map(|folder| fs::read(folder.join(file)).unwrap());
        assert!(!one.is_empty() && one == other, "{file} differs");
    }
}

#[test]
fn the_failures_of_an_earlier_campaign_end_a_gate_at_once_and_change_no_byte() {
    let place = folder();
    let earlier = Earlier::run(place.path());
    let out = place.path().join("later");
    let waiting = out.join("ahead.jsonl");
    for (round, sample) in earlier.failing.iter().take(6).enumerate() {
        let resume = if round == 0 { "" } else { "--resume" };
        let words = format!("--controller acc --no-gate --format json --fail-fast {} {resume}", earlier.option());
        let ended = json(&campaign(&out, &words), 1);
        assert_eq!(ended["samples"], round as u64 + 1, "{ended}");
        let reason = ended["ended_early"].as_str().unwrap();
        assert!(reason.starts_with(&format!("sample {sample} of low-thw-overtake")), "{reason}");
        assert_eq!(fs::read_to_string(&waiting).unwrap().lines().count(), round + 1);
    }
    // The samples that wait are read again, also by a campaign without the option. One of them is
    // damaged, and runs again.
    let text = fs::read(&waiting).unwrap();
    fs::write(&waiting, &text[..text.len() - 3]).unwrap();
    stdout(&campaign(&out, "--controller acc --no-gate --resume"), 0);
    assert!(!waiting.exists());
    assert_same_bytes(&earlier.folder, &out);
    stdout(&closecall(["check", out.to_str().unwrap()]), 0);
}

#[test]
fn a_sample_that_waits_with_an_error_is_flaky_if_it_succeeds_when_it_runs_again() {
    let place = folder();
    let earlier = Earlier::run(place.path());
    let (out, marker, script) = (place.path().join("out"), place.path().join("works"), place.path().join("own.sh"));
    let text = format!(
        "#!/bin/sh\n[ -e '{}' ] || exit 3\necho '{{\"type\":\"hello\",\"protocol\":1}}'\nread -r line\n\
         while read -r line; do echo '{{\"acceleration_mps2\":0.0,\"state\":\"following\"}}'; done\n",
        marker.display()
    );
    fs::write(&script, text).unwrap();
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
    let short = "--set duration-s=2 --set expects=[] --no-validity-checks";
    let fixed = format!("--controller exec:{} --no-gate {short}", script.display());
    assert_eq!(code(&campaign(&out, &format!("{fixed} --fail-fast {}", earlier.option()))), 5);
    assert_eq!(fs::read_to_string(out.join("ahead.jsonl")).unwrap().lines().count(), 1);
    fs::write(&marker, "").unwrap();
    stdout(&campaign(&out, &format!("{fixed} --resume --retry-errors")), 0);
    let flaky = records(&out).into_iter().filter(|record| record.arms[0].flaky.is_some());
    assert_eq!(flaky.map(|record| record.sample).collect::<Vec<_>>(), earlier.failing[..1]);
}

#[test]
fn a_whole_campaign_with_the_failures_first_has_the_bytes_of_the_plain_order() {
    let place = folder();
    let earlier = Earlier::run(place.path());
    let failing = earlier.failing.len();
    for (name, path) in [("by-folder", &earlier.folder), ("by-file", &earlier.file)] {
        let out = place.path().join(name);
        let run = campaign(&out, &format!("--controller acc --no-gate --failures-first {}", path.display()));
        stdout(&run, 0);
        assert!(message(&run).contains(&format!("{failing} samples that failed in")), "{}", stderr(&run));
        assert!(!out.join("ahead.jsonl").exists());
        assert_same_bytes(&earlier.folder, &out);
    }
}

#[test]
fn a_campaign_that_failures_have_ended_before_its_first_sample_resumes_with_the_option() {
    let place = folder();
    let earlier = Earlier::run(place.path());
    let out = place.path().join("ended");
    campaign(&out, &format!("--controller acc --no-gate --fail-fast {}", earlier.option()));
    assert_eq!(fs::read(out.join("journal.jsonl")).unwrap(), b"");
    stdout(&campaign(&out, &format!("--controller acc --no-gate --resume {}", earlier.option())), 0);
    assert_same_bytes(&earlier.folder, &out);
}

#[test]
fn parts_that_run_the_failures_first_merge_to_the_same_bytes() {
    let place = folder();
    let earlier = Earlier::run(place.path());
    let parts = ["1/2", "2/2"].map(|part| {
        let out = place.path().join(part.replace('/', "-"));
        let words = format!("--controller acc --no-gate --partition {part} {}", earlier.option());
        stdout(&campaign(&out, &words), 0);
        out
    });
    let merged = place.path().join("merged");
    let words = ["tool", "merge", parts[0].to_str().unwrap(), parts[1].to_str().unwrap(), "--no-gate"];
    // The test cases name the recordings.
    let kept = ["--record", "failures:0", "--out", merged.to_str().unwrap()];
    stdout(&closecall(words.into_iter().chain(kept)), 0);
    assert_same_bytes(&earlier.folder, &merged);
}

#[test]
fn a_gate_that_can_only_fail_counts_the_samples_that_ran_first() {
    let place = folder();
    let earlier = Earlier::run(place.path());
    // The gap to the vehicle behind is below 1 km in every sample that is done.
    let gate = "--gate min(min_gap_rear_m)>=1000 --controller mis-extended --fail-fast --format json";
    let run = campaign(&place.path().join("out"), &format!("{gate} {}", earlier.option()));
    let ended = json(&run, 1);
    assert_eq!(ended["samples"], 1, "{ended}");
    let (reason, first) = (ended["ended_early"].as_str().unwrap(), earlier.failing[0]);
    let collided = format!("sample {first} of low-thw-overtake has a collision");
    assert!(reason.contains("can only fail") || reason.starts_with(&collided), "{reason}");
}

#[test]
fn failures_whose_numbers_name_other_samples_are_refused() {
    let place = folder();
    let earlier = Earlier::run(place.path());
    let option = earlier.option();
    let refused = |words: &str| {
        let words = format!("campaign {words} -n 20 --sensors ground-truth {option}");
        let output = closecall(words.split_whitespace());
        assert_eq!(code(&output), 2, "{words}: {}", stderr(&output));
        message(&output)
    };
    let other = refused("low-thw-overtake --seed 4");
    assert!(other.contains("the seed is 3 there and 4 here"), "{other}");
    let other = refused("low-thw-overtake --seed 3 --design sobol");
    assert!(other.contains("the sampling design is random there and sobol here"), "{other}");
    let other = refused("overtake-without-brake --seed 3");
    assert!(other.contains("it has no scenario of this campaign"), "{other}");
    let drawn = refused("low-thw-overtake --judge-seed secret");
    assert!(drawn.contains("draws its own") && drawn.contains("--seed"), "{drawn}");
    refused("low-thw-overtake --seed 3 --time-budget 9s");
    let rare = refused("low-thw-overtake --seed 3 --design importance --event collision");
    assert!(rare.contains("cannot be combined with --failures-first"), "{rare}");
}
