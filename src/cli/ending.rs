//! The ends of a campaign before its last sample: a signal, a failing sample, too many errors. Such a campaign has no
//! verdict and no reports. Its journal is complete up to its end, and the command that resumes it is printed.

use std::ops::ControlFlow;
use std::path::Path;

use clap::Args;
use closecall_campaign::execution::{Campaign, End, ResumeReport};
use closecall_campaign::record::Record;
use closecall_campaign::summary::Summary;
use serde_json::json;

use super::args::Format;
use super::interrupt::Signal;
use super::output::{outln, print_error};
use super::summary::print_counts;
use crate::exit_code::ExitCode;

/// When a campaign ends before its last sample.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct EndArgs {
    /// End at the first failing sample: the ego collides under the controller under test, or a controller ends in an
    /// error. There is then no verdict
    #[arg(long)]
    fail_fast: bool,
    /// End as soon as more than N samples have ended in an error. There is then no verdict
    #[arg(long, value_name = "N")]
    max_errors: Option<u64>,
    /// With --resume: run the samples that ended in an error again
    #[arg(long, requires = "resume")]
    pub(super) retry_errors: bool,
}

/// The reason for which a campaign has ended early.
#[derive(Clone, Debug)]
pub(super) enum Ending {
    /// A signal has stopped it.
    Signal(Signal),
    /// A sample has failed.
    Failure { scenario: String, sample: u64, is_error: bool },
    /// Too many samples have ended in an error.
    Errors { errors: u64 },
}

/// Applies [`EndArgs`] to a running campaign.
#[derive(Clone, Debug)]
pub(super) struct EndRule {
    args: EndArgs,
    errors: u64,
    pub(super) ending: Option<Ending>,
}

impl EndRule {
    pub(super) fn new(args: EndArgs) -> Self {
        Self { args, errors: 0, ending: None }
    }

    /// Returns `Break` if the campaign ends after this record.
    pub(super) fn observe(&mut self, record: &Record) -> ControlFlow<End> {
        let is_error = record.arms.iter().any(|arm| arm.result.is_err());
        let has_collided = record.tallies().last().is_some_and(|tested| tested.collided == Some(true));
        self.errors += u64::from(is_error);
        if self.args.fail_fast && (is_error || has_collided) {
            let (scenario, sample) = (record.scenario.clone(), record.sample);
            self.ending = Some(Ending::Failure { scenario, sample, is_error });
        } else if self.args.max_errors.is_some_and(|most| self.errors > most) {
            self.ending = Some(Ending::Errors { errors: self.errors });
        }
        if self.ending.is_some() { ControlFlow::Break(End::Campaign) } else { ControlFlow::Continue(()) }
    }
}

impl Ending {
    fn exit_code(&self) -> ExitCode {
        match self {
            Self::Signal(signal) => signal.exit_code(),
            Self::Failure { is_error: false, .. } => ExitCode::Fail,
            Self::Failure { is_error: true, .. } | Self::Errors { .. } => ExitCode::SampleError,
        }
    }

    fn message(&self) -> String {
        match self {
            Self::Signal(signal) => signal.name().to_owned(),
            Self::Failure { scenario, sample, is_error } => {
                let what = if *is_error { "ended in an error" } else { "has a collision of the ego" };
                format!("sample {sample} of {scenario} {what}")
            }
            Self::Errors { errors } => format!("{errors} samples ended in an error"),
        }
    }

    /// Prints the counts so far, and how to go on. `out` is the campaign's folder.
    pub(super) fn print(&self, format: Format, campaign: &Campaign, summary: &Summary, out: Option<&Path>) -> ExitCode {
        let (done, of, message) = (summary.total().samples, campaign.len(), self.message());
        let resume = out.map(|_| resume_command(std::env::args(), matches!(self, Self::Errors { .. })));
        match format {
            Format::Json => {
                let ended = json!({ "ended_early": message, "samples": done, "of": of, "resume": resume });
                outln!("{ended:#}");
            }
            Format::Human => {
                print_counts(summary);
                outln!("ENDED EARLY, without a verdict: {message}; {done} of {of} samples are done");
                match (&resume, out) {
                    (Some(resume), Some(out)) => {
                        if let Self::Failure { scenario, sample, .. } = self {
                            let out = quoted(&out.display().to_string());
                            outln!(
                                "look:   closecall replay {out} {sample} --scenario {scenario} --record failure.rrd"
                            );
                        }
                        outln!("resume: {resume}");
                    }
                    _ => outln!("nothing was kept: a campaign with --out can be resumed"),
                }
            }
        }
        self.exit_code()
    }
}

fn quoted(word: &str) -> String {
    shlex::try_quote(word).map_or_else(|_| word.to_owned(), |quoted| quoted.into_owned())
}

/// Returns the command line that resumes this campaign: without the options that would end it at the same sample again.
fn resume_command(args: impl Iterator<Item = String>, retry_errors: bool) -> String {
    let mut words: Vec<String> = args.filter(|word| word != "--fail-fast").collect();
    let wanted = [("--resume", true), ("--retry-errors", retry_errors)];
    for (option, is_wanted) in wanted {
        if is_wanted && !words.iter().any(|word| word == option) {
            words.push(option.to_owned());
        }
    }
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// Prints what was found in the journal of a campaign that goes on.
pub(super) fn print_resumption(report: &ResumeReport) {
    for damaged in &report.damaged {
        let (line, reason) = (damaged.line, &damaged.reason);
        print_error(format_args!("line {line} of the journal was damaged ({reason}): its sample was run again\n"));
    }
    if report.retried > 0 {
        print_error(format_args!("{} samples that had ended in an error were run again\n", report.retried));
    }
    if let Some(torn) = &report.torn {
        let (line, reason) = (torn.line, &torn.reason);
        print_error(format_args!(
            "the journal was torn at line {line} ({reason}): the samples from there on were run again\n"
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_resume_command_is_the_command_with_quotes_and_resume() {
        let of = |text: &str, retry| resume_command(shlex::split(text).unwrap_or_default().into_iter(), retry);
        assert_eq!(
            of("closecall campaign 'a b.toml' --out x --fail-fast", false),
            "closecall campaign 'a b.toml' --out x --resume"
        );
        assert_eq!(of("c campaign --resume --out x", true), "c campaign --resume --out x --retry-errors");
    }
}
