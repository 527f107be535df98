//! The number of samples of a campaign, and the samples that are checked, on the command line.

use std::time::Duration;

use clap::{Args, ValueEnum};
use closecall_campaign::arguments::{Count, PositiveShare, WallTime, parsed_option};
use closecall_campaign::gate::PresetGates;
use closecall_campaign::ledger::Inference;
use closecall_campaign::validity::CheckPlan;
use closecall_scenarios::sampling::Design;
use serde::Deserialize;

use super::CliError;
use super::argument::Argument;
use super::help::heading;

/// Default number of samples of each scenario.
const SAMPLES: u64 = 200;
/// Default limit of the number of samples of each scenario, if the outcomes or the clock determine
/// the number.
const MAX_SAMPLES: u64 = 1_000_000;

/// A set of settings for a purpose. Settings that are given explicitly take precedence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Preset {
    /// For a pull request, in minutes: 1,000 paired samples of each scenario. If none ends in a
    /// collision, its probability is at most 0.3 % with 95 % confidence. Without a seed it draws
    /// one
    Pr,
    /// For a nightly run: 20,000 paired samples of each scenario. If none ends in a collision, its
    /// probability is at most 0.015 % with 95 % confidence
    Nightly,
}

impl Preset {
    /// Returns the gates that the preset sets on a paired campaign: the system must induce hardly
    /// any collision.
    const fn gates(self) -> PresetGates {
        match self {
            Self::Pr => PresetGates { name: "pr", require: &["upper(induced) <= 0.01"] },
            Self::Nightly => PresetGates { name: "nightly", require: &["upper(induced) <= 0.005"] },
        }
    }

    const fn samples(self) -> u64 {
        match self {
            Self::Pr => 1_000,
            Self::Nightly => 20_000,
        }
    }
}

/// The size of a campaign.
#[derive(Clone, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct PlanArgs {
    /// Number of samples of each scenario [default: 200]. With --until-certain or --time-budget the
    /// largest number [default: 1000000]
    #[arg(short = 'n', long = "samples", allow_negative_numbers = true, help_heading = heading::SAMPLES)]
    #[serde(rename = "n")]
    samples: Option<Count>,
    /// Number of samples for a purpose, paired with the baseline unless the controller under test
    /// is the baseline
    #[arg(long, value_enum, help_heading = heading::SAMPLES)]
    preset: Option<Preset>,
    /// With --max-probability: stop each scenario as soon as its samples show whether its
    /// probability is low enough. The bounds (confidence sequences) are valid although they are
    /// evaluated after every sample
    #[arg(long, conflicts_with_all = ["partition", "max_collisions", "max_induced"], help_heading = heading::SAMPLES)]
    pub(super) until_certain: bool,
    /// Stop after this wall time, such as 90s, 15m or 8h, divided evenly among the scenarios. Only
    /// the samples before the first unfinished one are judged
    #[arg(
        long,
        value_name = "TIME",
        conflicts_with_all = ["partition", "resume", "max_collisions", "max_induced"],
        help_heading = heading::SAMPLES
    )]
    #[serde(deserialize_with = "parsed_option")]
    time_budget: Option<WallTime>,
    /// Share of the samples in which the validity of the simulator is checked, above 0 and up to 1.
    /// The first two samples of each scenario are always checked [default: 0.01]
    #[arg(long, value_name = "SHARE", help_heading = heading::VALIDITY)]
    check_share: Option<PositiveShare>,
    /// Largest number of samples of each scenario that are checked, besides the first two
    /// [default: 1000]
    #[arg(long, value_name = "N", help_heading = heading::VALIDITY)]
    check_at_most: Option<u64>,
    /// Check the validity of the simulator in no sample, for measurements of speed. Every report
    /// says so
    #[arg(long, conflicts_with_all = ["check_share", "check_at_most"], help_heading = heading::VALIDITY)]
    no_validity_checks: bool,
}

impl PlanArgs {
    /// Returns the wall time after which the samples stop.
    pub(super) fn time_budget(&self) -> Option<Duration> {
        self.time_budget.map(|time| time.0)
    }

    /// Returns the gates of the preset, if there is one and the campaign is paired.
    pub(super) fn preset_gates(&self, is_paired: bool) -> Option<PresetGates> {
        self.preset.filter(|_| is_paired).map(Preset::gates)
    }

    /// Returns the largest number of flaky samples that the preset allows.
    pub(super) fn preset_max_flaky(&self) -> Option<u64> {
        self.preset.map(|_| 0)
    }

    /// Returns the largest number of samples of each scenario.
    pub(super) fn samples(&self) -> u64 {
        let default = if self.is_sequential() { MAX_SAMPLES } else { SAMPLES };
        self.named_samples().or(self.preset.map(Preset::samples)).unwrap_or(default)
    }

    /// Returns true if the campaign judges a pull request, so that its seed is drawn unless it is
    /// named.
    pub(super) fn judges_pull_requests(&self) -> bool {
        self.preset == Some(Preset::Pr)
    }

    /// Returns the number of samples that is named.
    pub(super) fn named_samples(&self) -> Option<u64> {
        self.samples.map(|samples| samples.0)
    }

    /// Returns true if a preset is named.
    pub(super) const fn names_preset(&self) -> bool {
        self.preset.is_some()
    }

    /// Returns true if other checks than the usual ones are named.
    pub(super) fn names_checks(&self) -> bool {
        self.no_validity_checks || self.check_share.is_some() || self.check_at_most.is_some()
    }

    /// Returns true if the validity of the simulator is checked in no sample.
    pub(super) const fn switches_checks_off(&self) -> bool {
        self.no_validity_checks
    }

    /// Returns true if a preset requests a baseline.
    pub(super) fn wants_pairs(&self) -> bool {
        self.preset.is_some()
    }

    /// Returns which bounds of a probability the samples of a design allow.
    pub(super) fn inference(&self, design: Design) -> Result<Inference, CliError> {
        match (design, self.is_sequential()) {
            (Design::Random, true) => Ok(Inference::Sequential),
            (Design::Random, false) => Ok(Inference::FixedSamples),
            (_, false) => Ok(Inference::Design),
            (design, true) => Err(CliError::usage(format!(
                "{} needs independent samples: the design `random` draws them, and `{design}` does not",
                Argument("time-budget")
            ))),
        }
    }

    /// Returns true if the outcomes or the clock determine the number of samples.
    pub(super) const fn is_sequential(&self) -> bool {
        self.until_certain || self.time_budget.is_some()
    }

    /// Returns the samples that are checked.
    pub(super) fn checks(&self) -> Result<CheckPlan, CliError> {
        if self.no_validity_checks {
            return Ok(CheckPlan::off());
        }
        let share = self.check_share.map_or(CheckPlan::SHARE, |share| share.0);
        CheckPlan::new(share, self.check_at_most.unwrap_or(CheckPlan::AT_MOST))
            .map_err(|error| CliError::usage(format!("{}: {error}", Argument("check-share"))))
    }
}
