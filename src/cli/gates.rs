//! The gates by which a campaign is judged, on the command line and in the project file.

use clap::Args;
use closecall_campaign::arguments::{Confidence, Positive, Probability, Share};
use closecall_campaign::gate::MAX_FLIP_RATE;
use closecall_campaign::gate::{GateOptions, GateSet, GateSource, PresetGates, ProbabilitySpec};
use closecall_campaign::probability::ProbabilityGate;
use closecall_scenarios::criteria::Expression;
use closecall_scenarios::sampling::Design;
use serde::Deserialize;

use super::CliError;
use super::argument::Argument;
use super::help::heading;
use super::keywords::needs;
use super::output::print_error;

/// The gates of a campaign.
#[derive(Clone, Debug, Default, Args, Deserialize)]
#[serde(default)]
pub(super) struct GateArgs {
    /// Require this of the samples of each scenario, such as "p1(min_ttc_rear_s) >= 1.0" or
    /// "lower(prevented | baseline.ego_collided) >= 0.5"; can be repeated.
    /// docs/reference/criteria.md lists aggregates and measures
    #[arg(long = "gate", value_name = "CRITERION", help_heading = heading::GATES)]
    #[serde(rename = "gate")]
    require: Vec<Expression>,
    /// Measure only: no gate is judged, and there is no verdict
    #[arg(long, conflicts_with_all = ["require", "max_collisions", "max_other_collisions", "max_probability", "max_induced",
        "min_prevented", "max_harm", "min_rear_thw", "max_engagement_rate", "max_speed_deficit_mps", "max_jerk", "max_flaky"], help_heading = heading::GATES)]
    no_gate: bool,
    /// Fail if the ego collides in more than K samples of any scenario
    #[arg(long, value_name = "K", help_heading = heading::GATES)]
    max_collisions: Option<u64>,
    /// Fail if vehicles other than the ego collide with each other in more than K samples of any
    /// scenario
    #[arg(long, value_name = "K", help_heading = heading::GATES)]
    max_other_collisions: Option<u64>,
    /// Pass only if the samples show, for every scenario, that the probability of a collision of
    /// the ego is at most P. If they show neither this nor the opposite, the verdict is inconclusive
    #[arg(long, value_name = "P", help_heading = heading::GATES)]
    pub(super) max_probability: Option<Probability>,
    /// Confidence with which --max-probability is to be shown, above 0.5 and below 1 [default:
    /// 0.95]
    #[arg(long, value_name = "C", help_heading = heading::GATES)]
    confidence: Option<Confidence>,
    /// Fail if the system induces a collision in more than K samples of any scenario; needs --paired
    #[arg(long, value_name = "K", help_heading = heading::GATES)]
    pub(super) max_induced: Option<u64>,
    /// Pass only if, in every scenario, at least this share (0 to 1) of the baseline's collisions
    /// is prevented, with 95 % confidence; needs --paired
    #[arg(long, value_name = "SHARE", help_heading = heading::GATES)]
    min_prevented: Option<Share>,
    /// Fail if the harm of all samples of any scenario exceeds this, in expected driver deaths
    #[arg(long, value_name = "HARM", help_heading = heading::GATES)]
    max_harm: Option<Positive>,
    /// Fail if the time headway of the rear vehicle falls below this in any sample
    #[arg(long, value_name = "S", help_heading = heading::GATES)]
    min_rear_thw: Option<Positive>,
    /// Fail if the margin increase system engages in a larger share (0 to 1) of the samples of any
    /// scenario
    #[arg(long, value_name = "SHARE", help_heading = heading::GATES)]
    max_engagement_rate: Option<Share>,
    /// Fail if the ego is slower than the lead vehicle by more than this, in any sample
    #[arg(long, value_name = "M/S", help_heading = heading::GATES)]
    max_speed_deficit_mps: Option<Positive>,
    /// Fail if the ego's jerk exceeds this in any sample, before it collides
    #[arg(long, value_name = "M/S³", alias = "max-jerk-mps3", help_heading = heading::GATES)]
    max_jerk: Option<Positive>,
    /// Declare the campaign invalid if a larger share (0 to 1) of its checked verdicts flips at
    /// half the time step [default: 0.05]
    #[arg(long, value_name = "SHARE", help_heading = heading::GATES)]
    pub(super) max_flip_rate: Option<Share>,
    /// Fail if more than K samples are flaky: they failed, and have an outcome only because of
    /// --retry-crashed or --retry-errors [default: any number; 0 with --preset]
    #[arg(long, value_name = "K", help_heading = heading::GATES)]
    max_flaky: Option<u64>,
}

impl GateArgs {
    /// Returns the gates of the command line, then of a preset, then of the project file.
    /// `is_paired` says whether the campaign has a baseline, `design` is its sampling design.
    pub(super) fn gates(
        &self,
        is_paired: bool,
        design: Design,
        preset: Option<PresetGates>,
    ) -> Result<GateSet, CliError> {
        let mut set = GateSet {
            is_measurement: self.no_gate,
            max_flip_rate: self.max_flip_rate.map_or(MAX_FLIP_RATE, |share| share.0),
            max_flaky: self.max_flaky,
            ..GateSet::default()
        };
        set.probability = self.probability()?.map(|gate| ProbabilitySpec { gate, source: GateSource::CommandLine });
        set.assemble(self.criteria()?, preset, is_paired, design)?;
        set.notes.iter().for_each(|note| print_error(format_args!("note: {note}\n")));
        Ok(set)
    }

    /// Returns the same options for a command that measures unless they name a gate.
    pub(super) fn or_measure(&self) -> Result<Self, CliError> {
        let is_named = !self.criteria()?.is_empty() || self.max_probability.is_some() || self.max_flaky.is_some();
        Ok(Self { no_gate: !is_named, ..self.clone() })
    }

    /// Returns true if a gate other than the one on the probability is named. To judge by none is no gate.
    pub(super) fn names_criterion(&self) -> Result<bool, CliError> {
        Ok(self.max_flip_rate.is_some() || self.max_flaky.is_some() || !self.criteria()?.is_empty())
    }

    /// Returns the criteria that the options stand for.
    fn criteria(&self) -> Result<Vec<Expression>, CliError> {
        let options = GateOptions {
            max_collisions: self.max_collisions,
            max_other_collisions: self.max_other_collisions,
            max_induced: self.max_induced,
            min_prevented: self.min_prevented.map(|share| share.0),
            max_harm: self.max_harm.map(|bound| bound.0),
            min_rear_thw: self.min_rear_thw.map(|bound| bound.0),
            max_engagement_rate: self.max_engagement_rate.map(|share| share.0),
            max_speed_deficit_mps: self.max_speed_deficit_mps.map(|bound| bound.0),
            max_jerk: self.max_jerk.map(|bound| bound.0),
        };
        Ok(self.require.iter().copied().chain(options.criteria().map_err(CliError::usage)?).collect())
    }

    /// Returns the gate on the probability of a collision.
    pub(super) fn probability(&self) -> Result<Option<ProbabilityGate>, CliError> {
        needs(("confidence", self.confidence.is_some()), ("max-probability", self.max_probability.is_some()))?;
        let confidence = self.confidence.map_or(ProbabilityGate::CONFIDENCE, |confidence| confidence.0);
        let gate = |max: Probability| ProbabilityGate::new(max.0, confidence);
        let usage = |error| CliError::usage(format!("{}: {error}", Argument("max-probability")));
        self.max_probability.map(gate).transpose().map_err(usage)
    }
}
