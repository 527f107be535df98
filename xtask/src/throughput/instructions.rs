//! Counts the instructions of a simulated second with Callgrind, and compares them with the counts
//! of the repository.
//!
//! A count does not depend on the speed of the machine or on other programs. The count of a mode is
//! the difference between a process that runs several samples and a process that runs fewer. It
//! thus excludes the start of the process and of the network. Counts of the same sources differ
//! between compilers and, by the functions that the C library chooses, between processors.
//!
//! The check fails if a mode needs more than 5 % more than `instructions.json` states. If that is
//! intended, a line in the unreleased section of `CHANGELOG.md` raises the limit, and says why:
//!
//! ```text
//! - Instructions of `object`: 1.35 million per simulated second, since drivers also look into their mirrors.
//! ```
//!
//! It fails as well if sixty vehicles cost more than 32 times as much per simulated second as
//! three.
//!
//! `instructions write` writes the counts to the file, for a change that saves instructions and
//! before a release.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

use rayon::prelude::*;

use super::modes::{Mode, modes};

/// First argument of a process that runs samples of one mode.
pub(crate) const RUN: &str = "run";
/// The modes that are counted. Callgrind runs them 50 times slower: bad weather, and the full
/// sensors in traffic, are cut short, and the loading of the network counts there.
const COUNTED: [Counted; 14] = [
    Counted::whole("ground-truth", [1, 7]),
    Counted::whole("object", [1, 7]),
    Counted::whole("object, 30 vehicles", [1, 2]),
    Counted::whole("full", [1, 2]),
    Counted::cut("full, guard rails", 2.0),
    Counted::cut("full, wet road", 2.0),
    Counted::cut("full, fog", 1.0),
    Counted::cut("full, busy-overtake", 1.0),
    Counted::whole("ground-truth, 3 vehicles", [1, 7]),
    Counted::whole("ground-truth, 60 vehicles", [1, 2]),
    Counted::whole("object, 3 vehicles", [1, 7]),
    Counted::whole("object, 60 vehicles", [1, 2]),
    Counted::cut("full, 3 vehicles", 1.0),
    Counted::cut("full, 60 vehicles", 1.0),
];
/// The depths of the sensor simulation whose cost may not grow faster than traffic.
const SCALED: [&str; 3] = ["ground-truth", "object", "full"];
/// The numbers of vehicles that are compared, and the largest ratio of their costs per simulated
/// second (-): the traffic grows twentyfold, and six tenths more are left for the neighbours that
/// each vehicle has in dense traffic (assumption). Of three vehicles hardly any driver has a second
/// leader to perceive, of sixty nearly each. A search of all pairs would cost 400 times as much.
const FEW_MANY: [u32; 2] = [3, 60];
const LARGEST_RATIO: f64 = 32.0;
/// Growth above which the check fails (-).
const ALLOWED_GROWTH: f64 = 0.05;
/// Beginning of a line of the change log that raises a limit.
const RAISED: &str = "- Instructions of `";
/// Beginning of the section of the change log that counts, and of each section.
const UNRELEASED: &str = "## Unreleased";

/// A mode that is counted.
#[derive(Clone, Copy)]
struct Counted {
    mode: &'static str,
    /// Numbers of samples of the two processes.
    samples: [u64; 2],
    /// Duration of the runs (s), if they are cut short.
    duration_s: Option<f64>,
}

impl Counted {
    const fn whole(mode: &'static str, samples: [u64; 2]) -> Self {
        Self { mode, samples, duration_s: None }
    }

    const fn cut(mode: &'static str, duration_s: f64) -> Self {
        Self { mode, samples: [0, 1], duration_s: Some(duration_s) }
    }
}

/// Runs the first `samples` samples of a mode, cut to `duration_s` (s) if it is given, and prints
/// their simulated time (s).
pub(crate) fn run(mode: &str, samples: u64, duration_s: Option<f64>) -> Result<(), Box<dyn Error>> {
    let mode = modes(|name| name == mode)?.pop().ok_or("no such mode")?;
    let mode = duration_s.into_iter().try_fold(mode, Mode::cut)?;
    // A mode with one sample repeats it.
    let scenarios = mode.scenarios(mode.samples)?;
    let mut simulated_s = 0.0;
    for (sample, scenario) in (0..samples).zip(scenarios.iter().cycle()) {
        simulated_s += mode.run(scenario, sample % mode.samples)?;
    }
    println!("{simulated_s}");
    Ok(())
}

/// Compares the counts of all modes with the counts in the repository.
pub(crate) fn check() -> Result<(), Box<dyn Error>> {
    let stated: BTreeMap<String, f64> = serde_json::from_str(&std::fs::read_to_string(file())?)?;
    let raised = raised(&std::fs::read_to_string(at_root("CHANGELOG.md"))?);
    let mut grown = Vec::new();
    let counts = count_all()?;
    for (mode, now) in &counts {
        let (mode, now) = (mode.as_str(), *now);
        let stated = *stated.get(mode).ok_or_else(|| format!("{} has no count of `{mode}`", file().display()))?;
        let limit = (1.0 + ALLOWED_GROWTH) * raised.get(mode).map_or(stated, |raised| raised.max(stated));
        println!("{mode}: {now:.3} million instructions per simulated second ({stated:.3} stated, {limit:.3} allowed)");
        if now > limit {
            grown.push(format!(
                "`{mode}` needs {now:.3} million instructions per simulated second; {limit:.3} are allowed"
            ));
        }
    }
    let steep = steep(&counts);
    if let ([], [_, ..]) = (&grown[..], &steep[..]) {
        return Err(steep.join("; ").into());
    }
    if grown.is_empty() {
        return Ok(());
    }
    grown.extend(steep);
    let remedy = "a line `- Instructions of `MODE`: N million per simulated second, REASON` in the unreleased section of CHANGELOG.md \
                  raises the limit";
    Err(format!("{}; {remedy}", grown.join("; ")).into())
}

/// Writes the counts of all modes.
pub(crate) fn write() -> Result<(), Box<dyn Error>> {
    let mut counts = count_all()?;
    for (mode, count) in &mut counts {
        println!("{mode}: {count:.3} million instructions per simulated second");
        *count = (*count * 1e3).round() / 1e3;
    }
    std::fs::write(file(), serde_json::to_string_pretty(&counts)? + "\n")?;
    Ok(())
}

/// Returns the number of instructions of each mode per simulated second, in millions. As many modes
/// are counted at a time as there are cores.
pub(crate) fn count_all() -> Result<BTreeMap<String, f64>, Box<dyn Error>> {
    let count = |counted: &Counted| Ok((counted.mode.to_owned(), millions_per_s(counted)?));
    let counts: Result<_, String> = COUNTED.par_iter().with_max_len(1).map(count).collect();
    Ok(counts?)
}

/// Returns the modes whose costs grow too fast with the traffic.
fn steep(counts: &BTreeMap<String, f64>) -> Vec<String> {
    let [few, many] = FEW_MANY;
    let instructions = |sensors: &str, vehicles: u32| counts.get(&format!("{sensors}, {vehicles} vehicles"));
    let ratio = |sensors: &str| Some(instructions(sensors, many)? / instructions(sensors, few)?);
    let wrong = |sensors: &&str| {
        // A count that is missing is as wrong as one that is too large.
        let ratio = ratio(sensors).unwrap_or(f64::NAN);
        println!("{sensors}: {many} vehicles cost {ratio:.1} times as much as {few} ({LARGEST_RATIO} allowed)");
        let text = format!(
            "{many} vehicles cost {ratio:.1} times as much as {few} in `{sensors}`; {LARGEST_RATIO} are allowed"
        );
        (!(ratio <= LARGEST_RATIO)).then_some(text)
    };
    SCALED.iter().filter_map(wrong).collect()
}

/// Returns the number of instructions of a mode per simulated second, in millions.
fn millions_per_s(counted: &Counted) -> Result<f64, String> {
    let instructions = |samples| count(counted, samples).map_err(|error| error.to_string());
    let [few, many] = [instructions(counted.samples[0])?, instructions(counted.samples[1])?];
    Ok(1e-6 * (many.instructions - few.instructions) / (many.simulated_s - few.simulated_s))
}

/// The count of one process.
struct Count {
    instructions: f64,
    simulated_s: f64,
}

/// Counts the instructions of a process that runs samples of a mode.
fn count(counted: &Counted, samples: u64) -> Result<Count, Box<dyn Error>> {
    let mode = counted.mode;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(std::env::current_exe()?)
        .args(["throughput", RUN, mode, &samples.to_string()])
        .args(counted.duration_s.map(|duration_s| duration_s.to_string()))
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
    at_root("xtask/src/throughput/instructions.json")
}

fn at_root(path: &str) -> PathBuf {
    Path::new(crate::ROOT).join(path)
}
