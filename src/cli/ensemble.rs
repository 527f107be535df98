//! The driver ensemble of a campaign, on the command line.

use std::path::PathBuf;

use clap::Args;
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::member::{Ensemble, ensemble_of, members};
use serde::Deserialize;

use super::CliError;
use super::argument::Argument;
use super::help::heading;
use super::output::print_error;

/// The driver ensemble of a campaign.
#[derive(Clone, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct EnsembleArgs {
    /// Run each scenario with each member of a driver ensemble, as an entry SCENARIO@MEMBER of its
    /// own on the same samples, and state the verdict over the members: median and worst. Members
    /// are files, folders of them, or names (`closecall list` shows them) [default: all members of
    /// the program]
    #[arg(long, value_name = "DIR|FILE|NAME", num_args = 0.., help_heading = heading::SCENARIO)]
    ensemble: Option<Vec<PathBuf>>,
}

impl EnsembleArgs {
    /// Returns the scenarios with every member; the scenarios themselves if no ensemble is
    /// requested.
    pub(super) fn apply(&self, files: Vec<ScenarioFile>) -> Result<Ensemble, CliError> {
        let Some(arguments) = &self.ensemble else {
            return Ok(Ensemble { entries: files, without_effect: Vec::new() });
        };
        let ensemble = ensemble_of(&files, &members(arguments)?)?;
        for (scenario, member) in &ensemble.without_effect {
            print_error(format_args!("{scenario}: the member `{member}` has no effect, and is not run\n"));
        }
        if ensemble.entries.is_empty() {
            return Err(CliError::usage(format!(
                "{}: no member has any effect on these scenarios: nothing can be run",
                Argument("ensemble")
            )));
        }
        Ok(ensemble)
    }
}
