//! No command overwrites one of its inputs.

use std::path::{Path, PathBuf};

use closecall_campaign::fingerprint::named_files;
use closecall_scenarios::recordings::input_files;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::scenario::ScenarioFile;

use super::CliError;

/// A file that a command writes, with the option that names it.
pub(super) type Output<'a> = (&'static str, Option<&'a Path>);

/// Returns an error if an output is one of the inputs, under whatever path, or if two outputs are the same file.
pub(super) fn protect(inputs: &[PathBuf], outputs: &[Output<'_>]) -> Result<(), CliError> {
    let named: Vec<(&str, &Path)> = outputs.iter().filter_map(|(option, path)| Some((*option, (*path)?))).collect();
    for (index, (option, output)) in named.iter().enumerate() {
        if let Some(input) = inputs.iter().find(|input| is_same_file(input, output)) {
            let message = format!("{option} would overwrite the input {}", input.display());
            return Err(CliError::Usage { message });
        }
        if let Some((other, _)) = named[..index].iter().find(|(_, other)| is_same_file(other, output)) {
            return Err(CliError::Usage { message: format!("{other} and {option} name the same file") });
        }
    }
    Ok(())
}

/// Returns true if two paths lead to the same file, which need not exist.
fn is_same_file(one: &Path, other: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(one), Ok(other)) = (one.metadata(), other.metadata()) {
        use std::os::unix::fs::MetadataExt as _;
        // Two names of one file, by a hard link.
        return (one.dev(), one.ino()) == (other.dev(), other.ino());
    }
    one == other || matches!((canonical(one), canonical(other)), (Some(one), Some(other)) if one == other)
}

/// Returns the canonical path of a file, which need not exist if its folder does.
fn canonical(path: &Path) -> Option<PathBuf> {
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_folder)
}

/// Returns the files from which a scenario was read.
pub(super) fn of_scenario(file: &ScenarioFile) -> Vec<PathBuf> {
    let recorded = file.trajectory_files().iter().flat_map(|path| input_files(path));
    std::iter::once(file.path().to_owned()).chain(recorded).collect()
}

/// Returns the files of trajectory data, which may be several for one path.
pub(super) fn of_trajectories(paths: &[PathBuf]) -> Vec<PathBuf> {
    paths.iter().flat_map(|path| input_files(path)).collect()
}

/// Returns the files that the command of a controller names.
pub(super) fn of_controller(controller: &ControllerChoice) -> Vec<PathBuf> {
    match controller {
        ControllerChoice::Exec(settings) => named_files(settings, None).into_iter().map(|(_, path)| path).collect(),
        ControllerChoice::Acc | ControllerChoice::Mis => Vec::new(),
    }
}

/// Returns the files of a campaign's folder. Its recordings, which can be made again, are not among them.
pub(super) fn of_campaign(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file()).collect()
}

/// Parses the path of a recording, whose extension must be .rrd.
pub(super) fn recording(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(extension) if extension == "rrd" => Ok(path),
        _ => Err(format!("`{text}` must end with .rrd")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_recognised_under_any_path() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir(path("sub"))?;
        std::fs::write(path("a.toml"), "")?;
        std::fs::hard_link(path("a.toml"), path("hard.toml"))?;
        #[cfg(unix)]
        std::os::unix::fs::symlink(path("a.toml"), path("soft.toml"))?;
        let inputs = [path("a.toml")];
        for same in ["a.toml", "sub/../a.toml", "hard.toml", "soft.toml"] {
            assert!(protect(&inputs, &[("--output", Some(&path(same)))]).is_err(), "{same}");
        }
        assert!(protect(&inputs, &[("--output", Some(&path("b.toml"))), ("--trace", None)]).is_ok());
        let (one, other) = (path("new.csv"), path("sub/../new.csv"));
        assert!(protect(&inputs, &[("--record", Some(&one)), ("--trace", Some(&other))]).is_err());
        Ok(())
    }
}
