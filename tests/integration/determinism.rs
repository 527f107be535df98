//! The same binary, scenario and seed give the same bits: with any number of jobs, in every
//! repetition, alone or in a campaign.

use std::collections::BTreeMap;
use std::path::Path;

use closecall_campaign::record::Record;
use closecall_campaign::saved::SavedCampaign;
use closecall_simulation::{NoObserver, simulate};
use serde_json::Value;

use crate::support::{closecall, folder, json, library, records, stdout};

/// Runs a paired campaign of 60 samples, or of another number, with seed 7.
fn campaign(out: &Path, more: &[&str]) {
    let scenario = library("low-thw-overtake");
    let args = [
        "campaign",
        scenario.to_str().unwrap(),
        "--seed",
        "7",
        "--paired",
        "--no-gate",
        "--out",
        out.to_str().unwrap(),
    ];
    let size: &[&str] = if more.contains(&"-n") { &[] } else { &["-n", "60"] };
    stdout(&closecall(args.iter().chain(size).chain(more)), 0);
}

/// Files of a campaign's folder that differ between two runs: they hold wall times or a process
/// number, or come from the Rerun SDK.
fn varies(path: &str) -> bool {
    ["timings.parquet", "report.html", "wall-times.jsonl", "junit.xml", "lock"].contains(&path)
        || path.ends_with(".rrd")
}

/// Returns the content of each file below `folder` by its path. A file that varies has no content
/// here. The manifest lacks the command, which names the folder and the number of jobs.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        for entry in std::fs::read_dir(&current).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
            let mut bytes = std::fs::read(&path).unwrap();
            if name == "manifest.json" {
                let mut manifest: Value = serde_json::from_slice(&bytes).unwrap();
                manifest.as_object_mut().unwrap().remove("command").unwrap();
                bytes = manifest.to_string().into_bytes();
            }
            if name == "recordings/index.html" {
                // The page shows the commands that run the samples again, and these name the
                // folder.
                let page = String::from_utf8(bytes).unwrap();
                bytes = page.replace(folder.to_str().unwrap(), "FOLDER").into_bytes();
            }
            files.insert(name.clone(), if varies(&name) { Vec::new() } else { bytes });
        }
    }
    files
}

#[test]
fn a_campaign_writes_the_same_bytes_with_any_number_of_jobs_and_in_every_repetition() {
    let folder = folder();
    let [one_job, two_jobs, repetition] =
        [("one-job", "1"), ("two-jobs", "2"), ("repetition", "2")].map(|(name, jobs)| {
            let out = folder.path().join(name);
            campaign(&out, &["--jobs", jobs, "--record", "worst:1"]);
            files(&out)
        });
    for name in
        ["manifest.json", "journal.jsonl", "outcomes.parquet", "samples.xml", "summary.md", "recordings/index.html"]
    {
        assert!(!one_job[name].is_empty(), "{name} is empty");
    }
    for (other, variant) in [(&two_jobs, "two jobs"), (&repetition, "a repetition")] {
        assert_eq!(one_job.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>(), "files of {variant}");
        for (name, bytes) in &one_job {
            assert!(*bytes == other[name], "{name} differs between one job and {variant}");
        }
    }
}

#[test]
fn a_replay_gives_the_outcome_of_the_journal_to_the_last_bit() {
    let folder = folder();
    let out = folder.path().join("out");
    campaign(&out, &["--jobs", "2"]);
    let saved = SavedCampaign::open(&out).unwrap();
    let records = records(&out);
    for sample in [0, 17, 59] {
        let (scenario, key) = saved.sample(None, sample).unwrap();
        for arm in &records[usize::try_from(sample).unwrap()].arms {
            let again = simulate(&scenario, key, &saved.arm(Some(&arm.controller)).unwrap(), &mut NoObserver).unwrap();
            // Numbers are written so that they read back exactly: equal text means equal bits.
            let [replayed, kept] =
                [&again, arm.result.as_ref().unwrap()].map(|outcome| serde_json::to_string(outcome).unwrap());
            assert_eq!(replayed, kept, "sample {sample} with {}", arm.controller);
        }
    }
}

/// Runs one sample with a trace, and returns the printed JSON and the trace.
fn traced(folder: &Path, args: &[&str]) -> (Value, Vec<u8>) {
    let trace = folder.join("trace.csv");
    let more = ["--format", "json", "--trace", trace.to_str().unwrap()];
    let mut printed = json(&closecall(args.iter().chain(&more)), 0);
    // A replay takes its settings from the manifest's scenario, and prints none.
    printed.as_object_mut().unwrap().remove("settings");
    (printed, std::fs::read(&trace).unwrap())
}

#[test]
fn a_single_run_prints_and_traces_the_same_as_a_replay_of_the_campaign_s_sample() {
    let folder = folder();
    let out = folder.path().join("out");
    campaign(&out, &["--jobs", "2"]);
    let scenario = library("low-thw-overtake");
    for sample in ["5", "17"] {
        for controller in ["acc", "mis"] {
            let replay = ["replay", out.to_str().unwrap(), sample, "--controller", controller];
            let run =
                ["run", scenario.to_str().unwrap(), "--seed", "7", "--sample", sample, "--controller", controller];
            let [(replayed, replayed_trace), (alone, trace)] =
                [&replay[..], &run[..]].map(|args| traced(folder.path(), args));
            assert_eq!(replayed, alone, "sample {sample} with {controller}");
            assert!(trace.len() > 10_000 && trace == replayed_trace, "the traces of sample {sample} with {controller}");
        }
    }
}

#[test]
fn a_sample_does_not_depend_on_the_number_of_samples() {
    let folder = folder();
    let [short, long] = ["6", "20"].map(|samples| {
        let out = folder.path().join(samples);
        campaign(&out, &["-n", samples]);
        records(&out)
    });
    assert_eq!((short.len(), long.len()), (6, 20));
    let text = |records: &[Record]| serde_json::to_string(records).unwrap();
    assert_eq!(text(&short), text(&long[..6]));
}

#[test]
fn zero_is_a_seed_like_any_other() {
    let scenario = library("low-thw-overtake");
    let run = |seed: &str| {
        let args = ["run", scenario.to_str().unwrap(), "--seed", seed, "--sample", "3", "--format", "json"];
        json(&closecall(args), 0)
    };
    assert_eq!(run("0"), run("0"));
    assert_ne!(run("0")["parameters"], run("1")["parameters"]);
}
