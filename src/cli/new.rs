//! `closecall new` and `closecall init`: write a scenario, or the files of a repository of
//! scenarios.

use std::path::{Path, PathBuf};

use clap::Args;
use closecall_campaign::arguments::scenario_name;
use closecall_campaign::repository::{Installation, create, repository_files, scenario_path, scenario_template};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::library::copy_of;
use closecall_scenarios::source::SCENARIOS;

use super::CliError;
use super::help::{examples, heading};
use super::output::{print_error, print_written};
use super::version::commit;
use crate::exit_code::ExitCode;

/// Arguments of `closecall new`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall new late-braking",
    "closecall new close-overtake --from low-thw-overtake",
    "closecall new late-braking -o scenarios/late-braking.toml",
]))]
pub(super) struct NewArgs {
    /// Name of the scenario: lower-case letters, digits and hyphens
    #[arg(value_parser = scenario_name)]
    name: String,
    /// Start from a scenario of the library, which `closecall list` names, instead of the commented
    /// template
    #[arg(long, value_name = "LIBRARY_NAME", help_heading = heading::SCENARIO)]
    from: Option<String>,
    /// File to write [default: NAME.toml; in a repository with closecall.toml, scenarios/NAME.toml]
    #[arg(short, long = "out", alias = "output", value_name = "FILE.toml", value_parser = scenario_file, help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
}

/// Arguments of `closecall init`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall init",
    "closecall init my-scenarios",
    "closecall init --url https://example.org/closecall.git --rev v0.1.0",
]))]
pub(super) struct InitArgs {
    /// Folder of the repository
    #[arg(default_value = ".")]
    dir: PathBuf,
    /// Git URL from which the CI job installs Closecall [default: to be filled in]
    #[arg(long, value_name = "URL", value_parser = git_url, help_heading = heading::CI)]
    url: Option<String>,
    /// Commit or tag that the CI job installs [default: the commit of this program; to be filled in if it has none]
    #[arg(long, value_name = "REV", value_parser = git_revision, help_heading = heading::CI)]
    rev: Option<String>,
}

/// Reads the name of a file that folders of scenarios find.
pub(super) fn scenario_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.extension().is_some_and(|end| end == "toml") {
        Ok(path)
    } else {
        Err("the name of a scenario file ends with .toml".to_owned())
    }
}

/// Reads an address from which `cargo install --git` installs. It stands in shell commands of CI jobs.
fn git_url(text: &str) -> Result<String, String> {
    let schemes = ["https://", "ssh://", "http://", "git://", "file://"];
    let is_address = schemes.iter().any(|scheme| text.strip_prefix(scheme).is_some_and(|rest| !rest.is_empty()));
    if is_address && text.chars().all(|letter| letter.is_ascii_graphic() && !"'\"`$\\".contains(letter)) {
        Ok(text.to_owned())
    } else {
        Err("an address such as https://example.org/closecall.git or ssh://git@example.org/closecall.git is needed"
            .to_owned())
    }
}

/// Reads a commit or tag: a branch would install another program each time.
fn git_revision(text: &str) -> Result<String, String> {
    let is_name = |letter: char| letter.is_ascii_alphanumeric() || "._/-+".contains(letter);
    if !text.is_empty() && !text.starts_with('-') && !text.contains("..") && text.chars().all(is_name) {
        Ok(text.to_owned())
    } else {
        Err("the name of a commit or tag is needed, such as v0.1.0".to_owned())
    }
}

pub(super) fn new(args: &NewArgs) -> Result<ExitCode, CliError> {
    let text = match &args.from {
        // Where `scenario_path` puts it, the schema lies in the folder above.
        None => scenario_template(&args.name, args.output.is_none().then_some(Path::new("."))),
        Some(from) => copy_of(from, &args.name)?,
    };
    let path = args.output.clone().unwrap_or_else(|| scenario_path(&args.name));
    // A copy or a template that `check` refuses would be a defect of the program.
    ScenarioFile::parse(&path, &text, &[])?.check()?;
    if !create(&path, &text)? {
        let message = format!("{} exists, and is not overwritten: name another file with --out", path.display());
        return Err(CliError::Usage { message });
    }
    print_written(&path);
    let shown = path.display();
    print_error(format_args!("next: closecall check {shown} --watch, closecall campaign {shown} -n 1000 --paired\n"));
    Ok(ExitCode::Pass)
}

/// The placeholder in a CI job for an unknown value.
const TO_FILL_IN: &str = "FILL-IN";
/// The CI jobs, in the folder of the repository.
const JOBS: [&str; 2] = [".github/workflows/closecall.yml", ".gitlab-ci.yml"];

pub(super) fn init(args: &InitArgs) -> Result<ExitCode, CliError> {
    let url = args.url.as_deref().unwrap_or(TO_FILL_IN);
    let rev = args.rev.as_deref().or(commit()).unwrap_or(TO_FILL_IN);
    for (path, text) in repository_files(&args.dir, Installation { url, rev }) {
        let is_new = create(&path, &text)?;
        let advice = if is_new { String::new() } else { advice(&path, &text) };
        print_error(format_args!("{}: {}{advice}\n", if is_new { "written" } else { "kept" }, path.display()));
    }
    // A job that was there already may have its values.
    let jobs = JOBS.map(|job| std::fs::read_to_string(args.dir.join(job)).unwrap_or_default());
    let is_missing = |name: &&str| jobs.iter().any(|job| job.contains(&format!("{name}: \"{TO_FILL_IN}\"")));
    let missing: Vec<&str> = ["CLOSECALL_URL", "CLOSECALL_REV"].into_iter().filter(is_missing).collect();
    if !missing.is_empty() {
        print_error(format_args!("fill in: {} in {}\n", missing.join(" and "), JOBS.join(" and ")));
    }
    let scenarios = args.dir.join(SCENARIOS);
    print_error(format_args!(
        "next: closecall check {0}, closecall campaign {0} -n 1000 --paired\n",
        scenarios.display()
    ));
    Ok(ExitCode::Pass)
}

/// Returns the lines that an existing list of files ignored by Git lacks; nothing for any other
/// file.
fn advice(path: &Path, text: &str) -> String {
    if !path.ends_with(".gitignore") {
        return String::new();
    }
    let there = std::fs::read_to_string(path).unwrap_or_default();
    let lacks = |line: &&str| !there.lines().any(|known_line| known_line.trim_matches('/') == line.trim_matches('/'));
    let missing: Vec<&str> = text.lines().filter(lacks).collect();
    if missing.is_empty() { String::new() } else { format!(" (add the line {})", missing.join(", and ")) }
}
