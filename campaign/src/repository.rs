//! The files of a repository of scenarios: a commented scenario, its schema for editors, the
//! project file, CI jobs for GitHub and GitLab, and the list of what Git leaves alone.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use closecall_scenarios::source::{PROJECT_FILE, SCENARIOS};
use closecall_scenarios::strict_schema;
use closecall_traffic::atomic::{WriteError, create_folder};

const SCENARIO: &str = include_str!("repository/scenario.toml");
const PROJECT: &str = include_str!("repository/closecall.toml");
const GITHUB: &str = include_str!("../../docs/how-to/ci/github.yml");
const GITLAB: &str = include_str!("../../docs/how-to/ci/gitlab.yml");
/// The files that Git ignores: the results of campaigns.
const IGNORED: &str = "/closecall-results/\n/closecall-results.previous/\n";

/// The schema of scenario files in a repository.
const SCHEMA: &str = "scenario.schema.json";

/// The name of the scenario in the template.
const TEMPLATE_NAME: &str = "NAME";
/// The name of the first scenario of a repository.
const FIRST_SCENARIO: &str = "late-overtake";

/// The source of Closecall for a CI job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Installation<'a> {
    /// The Git URL.
    pub url: &'a str,
    /// The commit or tag.
    pub rev: &'a str,
}

/// Returns the commented template of a scenario, with the name `name`. Below a `repository` that
/// has a schema, it begins with the line by which editors (Taplo, Even Better TOML in VS Code) find
/// the schema.
pub fn scenario_template(name: &str, repository: Option<&Path>) -> String {
    let text = SCENARIO.replace(&format!("name = \"{TEMPLATE_NAME}\""), &format!("name = \"{name}\""));
    let has_schema = repository.is_some_and(|folder| folder.join(SCHEMA).is_file());
    if has_schema { format!("{}{text}", schema_line()) } else { text }
}

/// The first line of a scenario of a repository.
fn schema_line() -> String {
    format!("#:schema ../{SCHEMA}\n\n")
}

/// Returns the file of a new scenario: in the folder of scenarios if the working folder is a
/// repository, else in the working folder itself.
pub fn scenario_path(name: &str) -> PathBuf {
    let file = PathBuf::from(format!("{name}.toml"));
    let is_repository = Path::new(PROJECT_FILE).is_file() && Path::new(SCENARIOS).is_dir();
    if is_repository { Path::new(SCENARIOS).join(file) } else { file }
}

/// Returns the files of a repository in `folder`, each with its text. A scenario is among them only
/// if the folder has none yet.
pub fn repository_files(folder: &Path, installation: Installation<'_>) -> Vec<(PathBuf, String)> {
    let installed = |text: &str| text.replace("@URL@", installation.url).replace("@REV@", installation.rev);
    let scenarios = folder.join(SCENARIOS);
    let mut files = vec![
        (folder.join(PROJECT_FILE), PROJECT.to_owned()),
        (folder.join(".github/workflows/closecall.yml"), installed(GITHUB)),
        (folder.join(".gitlab-ci.yml"), installed(GITLAB)),
        (folder.join(".gitignore"), IGNORED.to_owned()),
        (folder.join(SCHEMA), format!("{:#}\n", strict_schema())),
    ];
    if !has_scenario(&scenarios) {
        let text = schema_line() + &scenario_template(FIRST_SCENARIO, None);
        files.push((scenarios.join(format!("{FIRST_SCENARIO}.toml")), text));
    }
    files
}

fn has_scenario(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| entry.path().extension().is_some_and(|extension| extension == "toml"))
}

/// Writes a file that does not exist yet, and its folder. Returns false if the file exists: it is
/// then unchanged.
///
/// # Errors
/// [`WriteError`] if the folder or the file cannot be written.
pub fn create(path: &Path, text: &str) -> Result<bool, WriteError> {
    let fail = |source| WriteError::new(path, source);
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        create_folder(folder)?;
    }
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(mut file) => file.write_all(text.as_bytes()).map(|()| true).map_err(|error| {
            // Half a file would be taken for one of the user's own.
            drop(std::fs::remove_file(path));
            fail(error)
        }),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(error) => Err(fail(error)),
    }
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::ScenarioFile;

    use super::*;

    #[test]
    fn the_template_is_valid() {
        let file = ScenarioFile::parse(Path::new("mine.toml"), &scenario_template("mine", None), &[]).unwrap();
        file.check().unwrap();
        assert_eq!(file.config().name, "mine");
    }

    #[test]
    fn an_existing_file_is_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b.toml");
        assert!(create(&path, "first").unwrap());
        assert!(!create(&path, "second").unwrap());
        assert_eq!(std::fs::read_to_string(path).unwrap(), "first");
    }

    #[test]
    fn the_first_scenario_is_written_only_into_an_empty_repository() {
        let folder = tempfile::tempdir().unwrap();
        let files = || repository_files(folder.path(), Installation { url: "URL", rev: "REV" });
        assert_eq!(files().len(), 6);
        let ignored = IGNORED.lines().map(|line| line.trim_matches('/'));
        assert!(ignored.eq([crate::results::RESULTS, crate::results::PREVIOUS]));
        assert!(files().iter().all(|(_, text)| !text.contains("@URL@") && !text.contains("@REV@")));
        create(&folder.path().join(SCENARIOS).join("mine.toml"), "").unwrap();
        assert_eq!(files().len(), 5);
    }
}
