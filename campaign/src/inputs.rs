//! The files that a command reads, so that none of them is overwritten.

use std::path::{Path, PathBuf};

use closecall_recorded::trajectory_data::input_files;
use closecall_scenarios::ScenarioFile;
use closecall_simulation::controller::ControllerChoice;

use crate::fingerprint::{named_files, program_files};

/// Returns the files from which a scenario was read, and those that its perception program names.
pub fn files_of_scenario(file: &ScenarioFile) -> Vec<PathBuf> {
    let recorded = file.trajectory_files().iter().flat_map(|path| input_files(path));
    let program = file.program().map(|program| program_files(&program, program.folder.map(Path::new)));
    let program_files = program.into_iter().flatten().map(|(_, path)| path);
    std::iter::once(file.path().to_owned()).chain(recorded).chain(program_files).collect()
}

/// Returns the files of trajectory data, which may be several for one path.
pub fn files_of_trajectories(paths: &[PathBuf]) -> Vec<PathBuf> {
    paths.iter().flat_map(|path| input_files(path)).collect()
}

/// Returns the files that a controller names: the files of its command, or its library.
pub fn files_of_controller(controller: &ControllerChoice) -> Vec<PathBuf> {
    let files = controller.exec().map(|settings| named_files(settings, None)).unwrap_or_default();
    let native = controller.native().map(|settings| PathBuf::from(&settings.path));
    files.into_iter().map(|(_, path)| path).chain(native).collect()
}
