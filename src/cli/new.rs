//! `closecall new` and `closecall init`: write a scenario, or the files of a repository of scenarios.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use closecall_scenarios::atomic::WriteError;
use closecall_simulation::scenario::ScenarioFile;
use closecall_traffic::ActorId;
use closecall_traffic::suggest::nearest;

use super::CliError;
use super::library;
use super::output::outln;
use super::source::{REPOSITORY_SETTINGS, SCENARIOS};
use crate::exit_code::ExitCode;

const SCENARIO: &str = include_str!("templates/scenario.toml");
const SETTINGS: &str = include_str!("templates/closecall.toml");
const GITHUB: &str = include_str!("../../docs/ci/github.yml");
const GITLAB: &str = include_str!("../../docs/ci/gitlab.yml");

/// Lines of a template that begin with this are not written.
const NOT_WRITTEN: &str = "#GATE#";
/// The name of the scenario in the template.
const TEMPLATE_NAME: &str = "NAME";
/// The name of the first scenario of a repository.
const FIRST_SCENARIO: &str = "late-overtake";

/// Arguments of `closecall new`.
#[derive(Debug, Args)]
pub(super) struct NewArgs {
    /// Name of the scenario: lower-case letters, digits and hyphens
    #[arg(value_parser = scenario_name)]
    name: String,
    /// Start from a scenario of the library, which `closecall list` names, instead of the commented template
    #[arg(long, value_name = "LIBRARY_NAME")]
    from: Option<String>,
    /// File to write [default: NAME.toml; in a repository with closecall.toml, scenarios/NAME.toml]
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
}

/// Arguments of `closecall init`.
#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// Folder of the repository
    #[arg(default_value = ".")]
    dir: PathBuf,
    /// Git URL from which the CI job installs Closecall
    #[arg(long, value_name = "URL", default_value = "https://example.org/closecall.git")]
    url: String,
    /// Commit or tag that the CI job installs
    #[arg(long, value_name = "REV", default_value = concat!("v", env!("CARGO_PKG_VERSION")))]
    rev: String,
}

/// Parses the name of a scenario.
fn scenario_name(text: &str) -> Result<String, String> {
    match ActorId::new(text) {
        Ok(_) => Ok(text.to_owned()),
        Err(_) => Err(format!(
            "`{text}` is not a scenario's name: lower-case letters, digits and hyphens, starting with a letter"
        )),
    }
}

pub(super) fn new(args: &NewArgs) -> Result<ExitCode, CliError> {
    let text = match &args.from {
        None => template(&args.name),
        Some(from) => copy_of(from, &args.name)?,
    };
    let path = args.output.clone().unwrap_or_else(|| default_path(&args.name));
    // A copy or a template that `check` refuses would be a defect of the program.
    ScenarioFile::parse(&path, &text, &[])?.check()?;
    if !create(&path, &text)? {
        let message = format!("{} exists, and is not overwritten: name another file with --output", path.display());
        return Err(CliError::Usage { message });
    }
    let shown = path.display();
    outln!("written: {shown}");
    outln!("next: closecall watch {shown}, closecall campaign {shown} -n 200 --paired");
    Ok(ExitCode::Pass)
}

fn default_path(name: &str) -> PathBuf {
    let file = PathBuf::from(format!("{name}.toml"));
    let is_repository = Path::new(REPOSITORY_SETTINGS).is_file() && Path::new(SCENARIOS).is_dir();
    if is_repository { Path::new(SCENARIOS).join(file) } else { file }
}

/// Returns the commented template under another name.
fn template(name: &str) -> String {
    written(SCENARIO).replace(&format!("name = \"{TEMPLATE_NAME}\""), &format!("name = \"{name}\""))
}

/// Returns the lines of a template that are written.
fn written(template: &str) -> String {
    template.lines().filter(|line| !line.starts_with(NOT_WRITTEN)).flat_map(|line| [line, "\n"]).collect()
}

/// Returns a scenario of the library under another name.
fn copy_of(from: &str, name: &str) -> Result<String, CliError> {
    let text = library::text(from).ok_or_else(|| {
        let suggestion = nearest(from, library::names()).map(|known| format!("; did you mean `{known}`?"));
        let known = library::names().collect::<Vec<_>>().join(", ");
        let message = format!("the library has no scenario `{from}`, only {known}{}", suggestion.unwrap_or_default());
        CliError::Usage { message }
    })?;
    Ok(text.replace(&format!("name = \"{from}\""), &format!("name = \"{name}\"")))
}

/// Writes a file that does not exist yet. Returns false if it exists.
fn create(path: &Path, text: &str) -> Result<bool, WriteError> {
    let fail = |source| WriteError::new(path, source);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(fail)?;
    }
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(mut file) => file.write_all(text.as_bytes()).map(|()| true).map_err(fail),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(fail(error)),
    }
}

pub(super) fn init(args: &InitArgs) -> Result<ExitCode, CliError> {
    let with_source = |text: &str| text.replace("@URL@", &args.url).replace("@REV@", &args.rev);
    let scenarios = args.dir.join(SCENARIOS);
    let mut files = vec![
        (args.dir.join(REPOSITORY_SETTINGS), written(SETTINGS)),
        (args.dir.join(".github/workflows/closecall.yml"), with_source(GITHUB)),
        (args.dir.join(".gitlab-ci.yml"), with_source(GITLAB)),
    ];
    if !has_scenario(&scenarios) {
        files.push((scenarios.join(format!("{FIRST_SCENARIO}.toml")), template(FIRST_SCENARIO)));
    }
    for (path, text) in files {
        let is_new = create(&path, &text)?;
        outln!("{}: {}", if is_new { "written" } else { "kept" }, path.display());
    }
    outln!("next: closecall check {0}, closecall campaign {0} -n 200 --paired", scenarios.display());
    Ok(ExitCode::Pass)
}

fn has_scenario(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| entry.path().extension().is_some_and(|extension| extension == "toml"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_and_every_copy_of_the_library_are_valid() {
        let texts = library::names().map(|name| copy_of(name, "mine").unwrap());
        for text in texts.chain([template("mine")]) {
            let file = ScenarioFile::parse(Path::new("mine.toml"), &text, &[]).unwrap();
            file.check().unwrap();
            assert_eq!(file.config().name, "mine");
            assert!(file.unused_parameters().is_empty());
        }
        assert!(!template("mine").contains(NOT_WRITTEN));
        assert!(copy_of("paper-figur", "mine").unwrap_err().to_string().contains("did you mean `paper-figure`?"));
    }

    #[test]
    fn an_existing_file_is_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b.toml");
        assert!(create(&path, "first").unwrap());
        assert!(!create(&path, "second").unwrap());
        assert_eq!(std::fs::read_to_string(path).unwrap(), "first");
    }
}
