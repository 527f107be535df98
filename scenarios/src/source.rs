//! Where a scenario comes from: a file, a folder, standard input, or the library inside the
//! program.
//!
//! | argument | scenario |
//! |---|---|
//! | `-` | the text of standard input |
//! | `FILE` | that file |
//! | `FOLDER` | each scenario directly in it, in alphabetical order, then each scenario of its folders |
//! | `NAME` | `NAME.toml`, else `scenarios/NAME.toml`, else the scenario of the library with that name |
//! | `FOLDER/NAME` | the same scenario of the library by its folder there, as `traffic/busy-overtake` |

//!
//! A folder may have TOML files of other kinds. `closecall.toml` is no scenario, and neither is a
//! file with none of the keys `road`, `actor` and `base`. Both are skipped, and [`skipped`] names
//! all but `closecall.toml`. A file that is no valid TOML, or is empty, may be a scenario with a
//! mistake.

use std::io::{Error, ErrorKind, Read};
use std::path::{Path, PathBuf};

use closecall_traffic::input::read_text;

use super::{ScenarioError, ScenarioFile, Setting, library};

/// The argument that stands for standard input.
const STANDARD_INPUT: &str = "-";
/// The folder in which a repository keeps its scenarios.
pub const SCENARIOS: &str = "scenarios";
/// The name of a project file, which holds the settings of a repository: a TOML file that is no
/// scenario.
pub const PROJECT_FILE: &str = "closecall.toml";
/// The keys that identify a scenario: it has at least one of them.
pub const KEYS_OF_SCENARIO: [&str; 3] = ["road", "actor", "base"];
/// Largest length of a scenario on standard input (bytes).
const MAX_LENGTH: u64 = 16 * 1024 * 1024;

/// The reason for which arguments do not name scenarios.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// Standard input is named more than once.
    #[error("`-` is standard input, and can be given once")]
    StandardInputTwice,
    /// A folder has no scenario file.
    #[error("{} contains no scenario file (*.toml)", folder.display())]
    NoScenario {
        /// The folder.
        folder: PathBuf,
    },
    /// A folder cannot be read.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Returns the message about two files whose names are the same, or about one file that is named
/// twice.
pub fn same_name(first: &Path, second: &Path, name: &str) -> String {
    match first == second {
        true => format!("{} is named twice", first.display()),
        false => format!("{} and {} have the same name `{name}`", first.display(), second.display()),
    }
}

/// Returns the scenarios that the arguments of a command name: each folder is replaced by the
/// scenario files in it.
///
/// # Errors
/// [`SourceError`] if standard input is named twice, or if a folder cannot be read or has no
/// scenario file.
pub fn expand(paths: &[PathBuf]) -> Result<Vec<PathBuf>, SourceError> {
    let inputs = paths.iter().filter(|path| path.as_os_str() == STANDARD_INPUT).count();
    if inputs > 1 {
        return Err(SourceError::StandardInputTwice);
    }
    let mut expanded = Vec::new();
    for path in paths {
        if path.is_dir() {
            expanded.extend(scenario_files(path)?);
        } else {
            expanded.push(path.clone());
        }
    }
    Ok(expanded)
}

fn scenario_files(folder: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let mut files = all_toml_files(folder)?;
    files.retain(|path| may_be_scenario(path));
    if files.is_empty() {
        return Err(SourceError::NoScenario { folder: folder.to_owned() });
    }
    Ok(files)
}

/// Returns the TOML files that [`expand`] leaves out because they are no scenarios.
pub fn skipped(paths: &[PathBuf]) -> Vec<PathBuf> {
    let folders = paths.iter().filter(|path| path.is_dir());
    let files = folders.flat_map(|folder| all_toml_files(folder).unwrap_or_default());
    files.filter(|path| !may_be_scenario(path)).collect()
}

/// Returns the TOML files in a folder, then the files of its folders.
fn all_toml_files(folder: &Path) -> Result<Vec<PathBuf>, ScenarioError> {
    let mut files = toml_files(folder)?;
    append_below(folder, &mut files)?;
    Ok(files)
}

/// Returns the entries of a folder, in alphabetical order.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, ScenarioError> {
    let fail = |source| ScenarioError::Read { path: folder.to_owned(), source };
    let entries = std::fs::read_dir(folder).map_err(fail)?;
    let mut paths = entries.map(|entry| Ok(entry.map_err(fail)?.path())).collect::<Result<Vec<_>, _>>()?;
    paths.sort();
    Ok(paths)
}

/// Returns the TOML files directly in a folder, except a project file, in alphabetical order.
fn toml_files(folder: &Path) -> Result<Vec<PathBuf>, ScenarioError> {
    let is_wanted = |path: &PathBuf| {
        let is_toml = path.extension().is_some_and(|extension| extension == "toml");
        is_toml && path.is_file() && !path.ends_with(PROJECT_FILE)
    };
    Ok(entries(folder)?.into_iter().filter(is_wanted).collect())
}

/// Appends the TOML files of the folders in a folder. A link is not followed, so that no folder is
/// entered twice, and neither is a folder whose name begins with a dot.
fn append_below(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), ScenarioError> {
    let is_hidden = |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    for path in entries(folder)? {
        if path.is_dir() && !path.is_symlink() && !is_hidden(&path) {
            files.extend(toml_files(&path)?);
            append_below(&path, files)?;
        }
    }
    Ok(())
}

/// Returns false for a TOML file without any key of a scenario, such as the drivers of an ensemble,
/// a fleet or a `Cargo.toml`. A file that is empty, or cannot be read as TOML, may be a scenario
/// with a mistake, and is not passed over.
fn may_be_scenario(path: &Path) -> bool {
    let text = read_text(path).ok().filter(|text| !text.trim().is_empty());
    let document = text.and_then(|text| text.parse::<toml::Table>().ok());
    document.is_none_or(|document| KEYS_OF_SCENARIO.iter().any(|key| document.contains_key(*key)))
}

/// Reads the scenario that one argument names, and applies the settings.
///
/// # Errors
/// [`ScenarioError`] if there is no such scenario, if it is not valid, or if no value uses one of
/// its parameters. A name close to one of the library is answered with that name.
pub fn load(path: &Path, settings: &[Setting]) -> Result<ScenarioFile, ScenarioError> {
    read(path, settings)?.refuse_unused()
}

fn read(path: &Path, settings: &[Setting]) -> Result<ScenarioFile, ScenarioError> {
    if path.as_os_str() == STANDARD_INPUT {
        return from_standard_input(settings);
    }
    if let Some(file) = existing(path) {
        return ScenarioFile::load(&file, settings);
    }
    match scenario_in_library(path)? {
        Some((name, text)) => ScenarioFile::parse(&library::path(name), text, settings),
        None => ScenarioFile::load(path, settings),
    }
}

/// Returns the name and the text of the scenario of the library that an argument names; `None` for
/// the path of a file.
fn scenario_in_library(path: &Path) -> Result<Option<(&'static str, &'static str)>, ScenarioError> {
    let word = path.to_str().unwrap_or_default();
    let scenario = library::named(word).and_then(|name| Some((name, library::text(name)?)));
    if scenario.is_none() && (is_name(path) || (path.extension().is_none() && library::has_folder(word))) {
        let name = word.rsplit('/').next().unwrap_or_default();
        let suggestion = match library::named(name) {
            // In another folder of the library.
            Some(name) => format!("; did you mean `{name}`?"),
            None => library::suggestion(name),
        };
        return Err(ScenarioError::Unknown { name: path.display().to_string(), suggestion });
    }
    Ok(scenario)
}

/// Returns the text of the file that an argument names, or of the scenario of the library.
///
/// # Errors
/// [`ScenarioError`] if there is neither, or the file cannot be read as text.
pub fn text(path: &Path) -> Result<String, ScenarioError> {
    if existing(path).is_none()
        && let Some((_, text)) = scenario_in_library(path)?
    {
        return Ok(text.to_owned());
    }
    let file = existing(path).unwrap_or_else(|| path.to_owned());
    read_text(&file).map_err(|source| ScenarioError::Read { path: path.to_owned(), source })
}

/// Returns true for a name without folder and extension, which may name a scenario of the library.
fn is_name(path: &Path) -> bool {
    path.components().count() == 1 && path.extension().is_none()
}

/// Returns the file that `path` names, with or without its extension and folder; `None` if there is
/// none.
pub fn existing(path: &Path) -> Option<PathBuf> {
    let file = path.with_extension("toml");
    let named = [file.clone(), Path::new(SCENARIOS).join(file)];
    if path.exists() {
        return Some(path.to_owned());
    }
    named.into_iter().find(|file| is_name(path) && file.is_file())
}

fn from_standard_input(settings: &[Setting]) -> Result<ScenarioFile, ScenarioError> {
    let path = PathBuf::from("<standard input>");
    let mut bytes = Vec::new();
    let fail = |source| ScenarioError::Read { path: path.clone(), source };
    std::io::stdin().lock().take(MAX_LENGTH + 1).read_to_end(&mut bytes).map_err(fail)?;
    if bytes.len() as u64 > MAX_LENGTH {
        return Err(fail(Error::new(ErrorKind::InvalidData, "the text is longer than 16 MiB")));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let line = error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        ScenarioError::NotText { path: path.clone(), line: line + 1 }
    })?;
    ScenarioFile::parse(&path, &text, settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_that_no_value_uses_is_refused_unless_a_setting_replaced_its_use() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        let text = library::text("low-thw-overtake").unwrap();
        let more = "[parameters]\nuseless = { uniform = { min = 0.0, max = 1.0 } }";
        std::fs::write(&path, text.replace("[parameters]", more)).unwrap();
        let error = load(&path, &[]).unwrap_err().to_string();
        assert!(error.contains("unused parameter: `useless`"), "{error}");
        std::fs::write(&path, text).unwrap();
        let file = load(&path, &["actor.front.event.0.then.brake.deceleration-mps2=6".parse().unwrap()]).unwrap();
        assert!(file.space().iter().any(|(name, _)| name.as_str() == "brake-mps2"));
    }

    #[test]
    fn a_folder_stands_for_its_scenario_files() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.toml", "a.toml", "closecall.toml", "notes.md"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let paths = expand(&[folder.path().to_owned(), PathBuf::from("-")]).unwrap();
        assert_eq!(paths, [folder.path().join("a.toml"), folder.path().join("b.toml"), PathBuf::from("-")]);
        let empty = tempfile::tempdir().unwrap();
        assert!(expand(&[empty.path().to_owned()]).unwrap_err().to_string().contains("contains no scenario file"));
        assert!(expand(&[PathBuf::from("-"), PathBuf::from("-")]).is_err());
    }

    #[test]
    fn a_folder_stands_for_the_scenarios_of_its_folders_too() {
        let folder = tempfile::tempdir().unwrap();
        let write = |path: &str, text: &str| {
            let path = folder.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        write("z.toml", "");
        write("Cargo.toml", "[package]\nname = 'a'\n");
        write("traffic/busy.toml", "road = {}\n");
        write("traffic/closecall.toml", "[gate]\n");
        write("traffic/deep/derived.toml", "base = 'a'\n");
        write("fleets/cars.toml", "[[vehicle]]\n");
        write("faults/broken.toml", "road = {");
        write(".git/hidden.toml", "road = {}\n");
        let paths = expand(&[folder.path().to_owned()]).unwrap();
        let expected = ["z.toml", "faults/broken.toml", "traffic/busy.toml", "traffic/deep/derived.toml"];
        assert_eq!(paths, expected.map(|path| folder.path().join(path)));
        // What is skipped is named, except project files.
        let left_out = ["Cargo.toml", "fleets/cars.toml"].map(|path| folder.path().join(path));
        assert_eq!(skipped(&[folder.path().to_owned()]), left_out);
        // A file that is named is not skipped.
        assert_eq!(expand(&[left_out[0].clone()]).unwrap(), [left_out[0].clone()]);
        assert!(skipped(&left_out).is_empty());
    }

    #[test]
    fn a_check_of_a_scenario_without_requirements_says_that_there_are_none() {
        let checked = |setting: &str| load(Path::new("low-thw-overtake"), &[setting.parse().unwrap()]).unwrap().check();
        let error = checked("requirements=[]").unwrap_err().to_string();
        assert!(error.contains("but one of the `requirements` (none is stated) is needed"), "{error}");
        let error = checked("requirements=[\"MIS-2\"]").unwrap_err().to_string();
        assert!(error.contains("but one of the `requirements` (MIS-2) is needed"), "{error}");
    }

    #[test]
    fn every_scenario_of_the_library_is_in_its_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
        let paths = expand(&[folder]).unwrap();
        let mut stems: Vec<&str> = paths.iter().map(|path| path.file_stem().unwrap().to_str().unwrap()).collect();
        let mut names: Vec<&str> = library::names().collect();
        stems.sort_unstable();
        names.sort_unstable();
        assert_eq!(stems, names);
    }

    #[test]
    fn a_name_of_the_library_is_a_scenario_and_a_similar_one_a_suggestion() {
        assert_eq!(load(Path::new("paper-figure"), &[]).unwrap().config().name, "paper-figure");
        let error = load(Path::new("paper-figur"), &[]).unwrap_err().to_string();
        assert!(error.contains("did you mean `paper-figure`?"), "{error}");
        assert!(!load(Path::new("zzz.toml"), &[]).unwrap_err().to_string().contains("did you mean"));
        // By its folder in the library, and only by that one.
        assert_eq!(load(Path::new("traffic/busy-overtake"), &[]).unwrap().config().name, "busy-overtake");
        assert_eq!(load(Path::new("faults/camera-dead"), &[]).unwrap().config().name, "camera-dead");
        for word in ["acc/busy-overtake", "traffic/busy-overtak"] {
            let error = load(Path::new(word), &[]).unwrap_err();
            assert!(matches!(error, ScenarioError::Unknown { .. }), "{word}: {error}");
            assert!(error.to_string().contains("did you mean `busy-overtake`?"), "{error}");
        }
        assert!(matches!(load(Path::new("some/busy-overtake"), &[]).unwrap_err(), ScenarioError::Read { .. }));
        assert!(text(Path::new("low-thw-overtake")).unwrap().contains("schema-version"));
        assert!(text(Path::new("no-such-name")).is_err());
    }
}
