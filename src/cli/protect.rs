//! No command overwrites one of its inputs.

use std::path::{Path, PathBuf};

use closecall_campaign::fingerprint::named_files;
use closecall_scenarios::same_file::is_same_file;
use closecall_scenarios::trajectory_data::input_files;
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
    let files = controller.exec().map(|settings| named_files(settings, None)).unwrap_or_default();
    files.into_iter().map(|(_, path)| path).collect()
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
    fn an_output_is_neither_an_input_nor_another_output() {
        let [input, new] = ["a.toml", "new.csv"].map(Path::new);
        let inputs = [input.to_owned()];
        assert!(protect(&inputs, &[("--output", Some(input))]).is_err());
        assert!(protect(&inputs, &[("--output", Some(new)), ("--trace", None)]).is_ok());
        assert!(protect(&inputs, &[("--record", Some(new)), ("--trace", Some(new))]).is_err());
    }
}
