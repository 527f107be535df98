//! No command overwrites one of its inputs.

use std::path::PathBuf;

pub(super) use closecall_campaign::arguments::files_of_campaign as of_campaign;
pub(super) use closecall_campaign::inputs::{of_controller, of_scenario, of_trajectories};
pub(super) use closecall_traffic::same_file::Output;
use closecall_traffic::same_file::check_outputs;

use super::CliError;

/// Returns an error if an output is one of the inputs, under whatever path, or if two outputs are
/// the same file.
pub(super) fn protect(inputs: &[PathBuf], outputs: &[Output<'_>]) -> Result<(), CliError> {
    check_outputs(inputs, outputs).map_err(|message| CliError::Usage { message })
}
