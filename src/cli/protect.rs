//! No command overwrites one of its inputs.

use std::path::PathBuf;

pub(super) use closecall_campaign::arguments::files_of_campaign as of_campaign;
use closecall_campaign::fingerprint::named_files;
pub(super) use closecall_scenarios::same_file::Output;
use closecall_scenarios::same_file::check_outputs;
use closecall_scenarios::trajectory_data::input_files;
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::scenario::ScenarioFile;

use super::CliError;

/// Returns an error if an output is one of the inputs, under whatever path, or if two outputs are the same file.
pub(super) fn protect(inputs: &[PathBuf], outputs: &[Output<'_>]) -> Result<(), CliError> {
    check_outputs(inputs, outputs).map_err(|message| CliError::Usage { message })
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
