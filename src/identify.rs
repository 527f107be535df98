//! Names the sources that the program is built from: the commit, its date, and whether they differ
//! from it. Cargo runs it before it builds the package.

#![expect(clippy::print_stdout, reason = "Cargo reads what it prints")]

use std::process::Command;

/// The sources that determine the outcome of a sample.
const SOURCES: [&str; 10] = [
    "traffic",
    "recorded",
    "scenarios",
    "sensors",
    "controllers",
    "simulation",
    "campaign",
    "src",
    "Cargo.lock",
    "Cargo.toml",
];

fn main() {
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
    }
    // It grows with each commit and each change of the branch.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|log| std::path::Path::new(log).exists()) {
        println!("cargo::rerun-if-changed={log}");
    }
    // An archive of the sources may lie in a repository of another project.
    let is_repository = git(&["ls-files", "--error-unmatch", "src/identify.rs"]).is_some();
    let commit = git(&["rev-parse", "--short=12", "HEAD"]).filter(|_| is_repository).unwrap_or_default();
    let date = git(&["show", "--no-patch", "--format=%cs", "HEAD"]).filter(|_| is_repository).unwrap_or_default();
    let changes = git(&[&["status", "--porcelain", "--"], &SOURCES[..]].concat());
    let modified = if changes.is_none_or(|changes| !changes.is_empty()) { "modified" } else { "" };
    let sources = match (commit.as_str(), modified) {
        ("", _) => "unknown".to_owned(),
        (commit, "") => format!("{commit} of {date}"),
        (commit, _) => format!("{commit} of {date}, modified"),
    };
    let unmodified = if modified.is_empty() { commit.as_str() } else { "" };
    println!("cargo::rustc-env=CLOSECALL_COMMIT={unmodified}");
    println!("cargo::rustc-env=CLOSECALL_SOURCES={sources}");
    println!("cargo::rustc-env=CLOSECALL_TARGET={}", std::env::var("TARGET").unwrap_or_default());
}

/// Returns what Git prints in the folder of the repository, or `None` if it fails.
fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
