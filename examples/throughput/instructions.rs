//! Counts the instructions of a simulated second with Callgrind, and compares them with the counts of the repository.
//!
//! A count does not depend on the speed of the machine or on other programs. That of a mode is the difference between a process
//! that runs several samples and one that runs fewer, so that the start of the process and of the network is not in it. Counts
//! of the same sources differ between compilers and, by the functions that the C library chooses, between processors.
//!
//! The check fails if a mode needs more than 5 % more than `instructions.json` states. If that is intended, a line in the
//! unreleased section of `CHANGELOG.md` raises the limit, and says why:
//!
//! ```text
//! - Instructions of `object`: 1.35 million per simulated second, since drivers also look into their mirrors.
//! ```
//!
//! `instructions write` writes the counts to the file, for a change that saves instructions and before a release.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::modes::modes;

/// First argument of a process that runs samples of one mode.
pub(crate) const RUN: &str = "run";
/// The modes that are counted, with the numbers of samples of the two processes.
const COUNTED: [(&str, [u64; 2]); 4] =
    [("ground-truth", [1, 7]), ("object", [1, 7]), ("object, 30 vehicles", [1, 2]), ("full", [1, 2])];
/// Growth above which the check fails (-).
const ALLOWED_GROWTH: f64 = 0.05;
/// Beginning of a line of the change log that raises a limit.
const RAISED: &str = "- Instructions of `";
/// Beginning of the section of the change log that counts, and of each section.
const UNRELEASED: &str = "## Unreleased";

/// Runs the first `samples` samples of a mode and prints their simulated time (s).
pub(crate) fn run(mode: &str, samples: u64) -> Result<(), Box<dyn Error>> {
    let modes = modes()?;
    let mode = modes.iter().find(|known| known.name == mode).ok_or("no such mode")?;
    // A mode with one sample repeats it.
    let scenarios = mode.scenarios(mode.samples)?;
    let mut simulated_s = 0.0;
    for (sample, scenario) in (0..samples).zip(scenarios.iter().cycle()) {
        simulated_s += mode.run(scenario, sample % mode.samples)?;
    }
    println!("{simulated_s}");
    Ok(())
}

/// Compares the counts of all modes with those of the repository.
pub(crate) fn check() -> Result<(), Box<dyn Error>> {
    let stated: BTreeMap<String, f64> = serde_json::from_str(&std::fs::read_to_string(file())?)?;
    let raised = raised(&std::fs::read_to_string(at_root("CHANGELOG.md"))?);
    let mut grown = Vec::new();
    for (mode, samples) in COUNTED {
        let now = millions_per_s(mode, samples)?;
        let stated = *stated.get(mode).ok_or_else(|| format!("{} has no count of `{mode}`", file().display()))?;
        let limit = (1.0 + ALLOWED_GROWTH) * raised.get(mode).map_or(stated, |raised| raised.max(stated));
        println!("{mode}: {now:.3} million instructions per simulated second ({stated:.3} stated, {limit:.3} allowed)");
        if now > limit {
            grown.push(format!(
                "`{mode}` needs {now:.3} million instructions per simulated second; {limit:.3} are allowed"
            ));
        }
    }
    if grown.is_empty() {
        return Ok(());
    }
    let remedy = "a line `- Instructions of `MODE`: N million per simulated second, REASON` in the unreleased section of CHANGELOG.md \
                  raises the limit";
    Err(format!("{}; {remedy}", grown.join("; ")).into())
}

/// Writes the counts of all modes.
pub(crate) fn write() -> Result<(), Box<dyn Error>> {
    let mut counts = BTreeMap::new();
    for (mode, samples) in COUNTED {
        let now = millions_per_s(mode, samples)?;
        println!("{mode}: {now:.3} million instructions per simulated second");
        counts.insert(mode, (now * 1e3).round() / 1e3);
    }
    std::fs::write(file(), serde_json::to_string_pretty(&counts)? + "\n")?;
    Ok(())
}

/// Returns the number of instructions of a mode per simulated second, in millions.
fn millions_per_s(mode: &str, samples: [u64; 2]) -> Result<f64, Box<dyn Error>> {
    let [few, many] = [count(mode, samples[0])?, count(mode, samples[1])?];
    Ok(1e-6 * (many.instructions - few.instructions) / (many.simulated_s - few.simulated_s))
}

/// The count of one process.
struct Count {
    instructions: f64,
    simulated_s: f64,
}

/// Counts the instructions of a process that runs samples of a mode.
fn count(mode: &str, samples: u64) -> Result<Count, Box<dyn Error>> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args([RUN, mode, &samples.to_string()])
        .output()
        .map_err(|error| format!("failed to start valgrind: {error}"))?;
    let (printed, report) = (String::from_utf8(output.stdout)?, String::from_utf8(output.stderr)?);
    let collected = report.lines().find_map(|line| line.split_once("Collected :"));
    match (output.status.success(), collected) {
        (true, Some((_, instructions))) => {
            Ok(Count { instructions: instructions.trim().parse()?, simulated_s: printed.trim().parse()? })
        }
        _ => Err(format!("failed to count the instructions of `{mode}`: {report}").into()),
    }
}

/// Returns the limits that lines of the unreleased section of the change log raise, by mode.
fn raised(change_log: &str) -> BTreeMap<String, f64> {
    let section = change_log.lines().skip_while(|line| !line.starts_with(UNRELEASED)).skip(1);
    let section = section.take_while(|line| !line.starts_with("## "));
    let limit = |line: &str| {
        let (mode, rest) = line.strip_prefix(RAISED)?.split_once("`: ")?;
        Some((mode.to_owned(), rest.split_whitespace().next()?.parse().ok()?))
    };
    section.filter_map(limit).collect()
}

/// Returns the file with the counts.
fn file() -> PathBuf {
    at_root("examples/throughput/instructions.json")
}

fn at_root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}
