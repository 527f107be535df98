//! The ends of a campaign before its last sample: a signal, a failing sample, too many errors. Such
//! a campaign has no verdict and no reports. Its journal is complete up to its end, and the command
//! that resumes it is printed.

use std::path::Path;

use clap::Args;
use closecall_campaign::end_rule::{EarlyEnd, EndRule, EndedEarly, Kept};
use closecall_campaign::execution::Campaign;
use closecall_campaign::interrupt::Signal;
use closecall_campaign::session;
use closecall_campaign::summary::Summary;
use serde::Deserialize;

use super::CliError;
use super::actions::command_for;
use super::help::heading;
use super::keywords::needs;
use crate::exit_code::ExitCode;

/// When a campaign ends before its last sample.
#[derive(Clone, Copy, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct EndArgs {
    /// End as soon as the ego collides under the controller under test, a controller ends in an
    /// error, or a gate can only fail. There is then no verdict
    #[arg(long, help_heading = heading::EXECUTION)]
    fail_fast: bool,
    /// End as soon as more than N samples have ended in an error. There is then no verdict
    #[arg(long, value_name = "N", help_heading = heading::EXECUTION)]
    max_errors: Option<u64>,
    /// With --resume: run the samples that ended in an error again. A sample that succeeds only then
    /// is flaky; --max-flaky limits their number
    #[arg(long, help_heading = heading::EXECUTION)]
    pub(super) retry_errors: bool,
}

/// The reason for which a campaign has ended early.
#[derive(Clone, Debug)]
pub(super) enum Ending {
    /// A signal has stopped it.
    Signal(Signal),
    /// The rule of the command line has ended it.
    Rule(EarlyEnd),
}

impl EndArgs {
    /// Returns true if an option is named.
    pub(super) const fn is_named(&self) -> bool {
        self.fail_fast || self.max_errors.is_some() || self.retry_errors
    }

    /// Refuses samples to run again if no campaign goes on.
    pub(super) fn check(&self, is_resumed: bool) -> Result<(), CliError> {
        needs(("retry-errors", self.retry_errors), ("resume", is_resumed))
    }

    /// Returns the rule that ends the campaign early.
    pub(super) const fn rule(&self) -> EndRule {
        EndRule { fail_fast: self.fail_fast, max_errors: self.max_errors }
    }
}

impl Ending {
    pub(super) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Signal(signal) => (*signal).into(),
            Self::Rule(EarlyEnd::Failure { is_error: false, .. } | EarlyEnd::Gate { .. }) => ExitCode::Fail,
            Self::Rule(EarlyEnd::Failure { is_error: true, .. } | EarlyEnd::Errors { .. }) => ExitCode::SampleError,
        }
    }

    fn message(&self) -> String {
        match self {
            Self::Signal(signal) => signal.name().to_owned(),
            Self::Rule(ending) => ending.to_string(),
        }
    }

    /// Returns the counts so far, and how to go on. `out` is the campaign's folder.
    pub(super) fn ended<'a>(
        &'a self,
        campaign: &Campaign,
        summary: &'a Summary,
        out: Option<&'a Path>,
    ) -> EndedEarly<'a> {
        EndedEarly {
            message: self.message(),
            ending: if let Self::Rule(ending) = self { Some(ending) } else { None },
            done: summary.total().samples,
            all: campaign.len(),
            errors: summary.total().errors(),
            summary,
            kept: out.map(|folder| Kept { folder, command: session::arguments() }),
            command_for,
        }
    }
}
