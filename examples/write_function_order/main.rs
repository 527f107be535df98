//! Writes `function-order.txt`: the functions that campaigns call, which the linker places side by side (`build.rs`).
//!
//! ```sh
//! cargo run --release --example write_function_order
//! ```
//!
//! A campaign calls some 20,000 functions of 8 MB, which would otherwise be scattered over 50 MB of code. The kernel maps 64 KB around each
//! page that is used, so that most of the code would count as memory of the process. The program runs campaigns with each depth of the sensor
//! simulation under Callgrind (Debian's package `valgrind`), which sees every function that is called. Linux only, some minutes.
//!
//! The names are those that the compiler gives to functions: they end in a hash of what the function is, not of what it does. They are the
//! same in every folder, and a change inside a function leaves them as they are. Another version of the compiler, of a dependency, or other
//! features of it rename what depends on it. The linker ignores a name that no function has, and a function without a
//! name in the file stays where it would be anyway: an old file costs memory, nothing else. `validate_memory -- modes` says how much.

#![expect(clippy::print_stdout, reason = "a program on the command line")]

mod callgrind;
mod names;

use std::collections::BTreeSet;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The written file.
const FILE: &str = "function-order.txt";
/// Arguments of Cargo that build the program with symbols. Those of the compiler act on the program alone, so that nothing else is built anew.
const WITH_SYMBOLS: [&str; 7] = ["rustc", "--release", "--bin", "closecall", "--", "-C", "strip=none"];
/// Arguments of Cargo that build the program as it is meant to be.
const AS_RELEASED: [&str; 4] = ["build", "--release", "--bin", "closecall"];
/// Scenario of the campaigns.
const SCENARIO: &str = "scenarios/library/low-thw-overtake.toml";
/// The campaigns: their arguments, and whether they have a folder. They are short, as a second call of a function says nothing new.
const CAMPAIGNS: [(&[&str], bool); 6] = [
    (&["-n", "20", "--paired", "--jobs", "2", "--sensors", "ground-truth"], true),
    (&["-n", "20", "--paired", "--jobs", "2", "--sensors", "object"], true),
    (&["-n", "2", "--paired", "--jobs", "2", "--sensors", "full"], true),
    (&["-n", "1", "--paired", "--jobs", "1", "--sensors", "full", "--record", "random:1"], true),
    (&["-n", "4", "--sensors", "object"], false),
    (
        &["-n", "1", "--sensors", "full", "--set", "environment.rain-mm-per-h=5", "--set", "road.guard-rails=true"],
        false,
    ),
];
/// Exit codes of a campaign that has run: a verdict, and an encounter that did not happen.
const HAS_RUN: [i32; 4] = [0, 1, 4, 7];

/// Runs Cargo in the root of the repository.
fn cargo(arguments: &[&str]) -> Result<(), Box<dyn Error>> {
    let cargo = option_env!("CARGO").unwrap_or("cargo");
    let status = Command::new(cargo).args(arguments).current_dir(at_root(".")).status()?;
    if status.success() { Ok(()) } else { Err(format!("`cargo {}` ended with {status}", arguments.join(" ")).into()) }
}

/// Returns the names of the functions that a campaign calls.
fn called(arguments: &[&str], has_folder: bool) -> Result<BTreeSet<String>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let profile = folder.path().join("profile");
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--demangle=no"]);
    command.arg(format!("--callgrind-out-file={}", profile.display()));
    command.arg(at_root("target/release/closecall")).arg("campaign").arg(at_root(SCENARIO)).args(["--seed", "5"]);
    command.args(arguments);
    if has_folder {
        command.arg("--out").arg(folder.path().join("out"));
    } else {
        command.arg("--no-out");
    }
    let output = command.output().map_err(|error| format!("failed to start valgrind: {error}"))?;
    if !output.status.code().is_some_and(|code| HAS_RUN.contains(&code)) {
        return Err(format!("{}: {}", output.status, String::from_utf8_lossy(&output.stderr)).into());
    }
    Ok(callgrind::functions(&std::fs::read_to_string(profile)?))
}

fn at_root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn main() -> Result<(), Box<dyn Error>> {
    cargo(&WITH_SYMBOLS)?;
    let mut all = BTreeSet::new();
    for (arguments, has_folder) in CAMPAIGNS {
        let functions = called(arguments, has_folder)?;
        println!("{} functions: campaign {}", functions.len(), arguments.join(" "));
        all.extend(functions);
    }
    std::fs::write(at_root(FILE), names::written(&all))?;
    println!("written: {FILE}, {} functions", all.len());
    cargo(&AS_RELEASED)
}
