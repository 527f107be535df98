//! No command overwrites one of its inputs, and none computes for long what it cannot save.

use std::path::{Path, PathBuf};

pub(super) use closecall_campaign::arguments::files_of_campaign;
pub(super) use closecall_campaign::inputs::{files_of_controller, files_of_scenario, files_of_trajectories};
use closecall_traffic::atomic::{WriteError, check_folder, check_writable};
pub(super) use closecall_traffic::same_file::Output;
use closecall_traffic::same_file::check_outputs;

use super::CliError;

/// Returns an error if an output is one of the inputs, under whatever path, or if two outputs are
/// the same file.
pub(super) fn protect(inputs: &[PathBuf], outputs: &[Output<'_>]) -> Result<(), CliError> {
    check_outputs(inputs, outputs).map_err(|message| CliError::Usage { message })
}

/// Returns an error if a file cannot be written, before a long computation begins.
pub(super) fn must_be_writable(file: Option<&Path>) -> Result<(), WriteError> {
    file.map_or(Ok(()), check_writable)
}

/// Returns an error if no file can be written into a folder, which need not exist yet, before a long
/// computation begins.
pub(super) fn must_be_folder(folder: Option<&Path>) -> Result<(), WriteError> {
    folder.map_or(Ok(()), check_folder)
}

/// Returns an error if the folder of a data set holds something already: its files would be taken for
/// files of the new data set.
pub(super) fn must_be_new(folder: &Path) -> Result<(), CliError> {
    if std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        let folder = folder.display();
        return Err(CliError::usage(format!("--out {folder} holds files already: name a new or an empty folder")));
    }
    Ok(check_folder(folder)?)
}
