//! The gates by which a campaign is judged, on the command line.

use clap::Args;
use closecall_campaign::probability::ProbabilityGate;
use closecall_campaign::verdict::{Gates, MAX_FLIP_RATE};
use closecall_scenarios::sampling::Design;

use super::CliError;
use super::args::positive;

/// Default confidence of the gate on the probability.
const CONFIDENCE: f64 = 0.95;

/// The gates of a campaign.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Gates")]
pub(super) struct GateArgs {
    /// Fail if the ego collides in more than K samples
    #[arg(long, value_name = "K")]
    max_collisions: Option<u64>,
    /// Pass only if the samples show, for every scenario, that the probability of a collision of the ego is at most P.
    /// The verdict is inconclusive if they show neither that nor the opposite
    #[arg(long, value_name = "P", value_parser = probability)]
    pub(super) max_probability: Option<f64>,
    /// Confidence with which --max-probability is to be shown, above 0.5 and below 1 [default: 0.95]
    #[arg(long, value_name = "C", value_parser = confidence, requires = "max_probability")]
    confidence: Option<f64>,
    /// Fail if the ego collides in more than K samples in which it does not collide with the baseline; needs --paired
    #[arg(long, value_name = "K")]
    pub(super) max_induced: Option<u64>,
    /// Fail if the margin increase system engages in a larger share (0 to 1) of the samples of any scenario
    #[arg(long, value_name = "SHARE", value_parser = share)]
    max_engagement_rate: Option<f64>,
    /// Fail if the ego is slower than the lead vehicle by more than this, in any sample
    #[arg(long, value_name = "M/S", value_parser = positive)]
    max_speed_deficit_mps: Option<f64>,
    /// Fail if the ego's jerk exceeds this in any sample, before a collision of its own
    #[arg(long, value_name = "M/S³", alias = "max-jerk-mps3", value_parser = positive)]
    max_jerk: Option<f64>,
    /// Declare the campaign invalid if a larger share (0 to 1) of its checked verdicts flips at half the time step
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = MAX_FLIP_RATE)]
    max_flip_rate: f64,
}

impl GateArgs {
    /// Returns the gates. `is_paired` says whether the campaign has a baseline, `design` is its sampling design.
    pub(super) fn gates(&self, is_paired: bool, design: Design) -> Result<Gates, CliError> {
        if self.max_probability.is_some() && design != Design::Random {
            let message = format!(
                "--max-probability needs independent samples, and those of --design {design} are not: use --design random"
            );
            return Err(CliError::Usage { message });
        }
        if self.max_induced.is_some() && !is_paired {
            let message =
                "--max-induced needs --paired: without a baseline it is not known which collisions are induced"
                    .to_owned();
            return Err(CliError::Usage { message });
        }
        Ok(Gates {
            max_collisions: self.max_collisions,
            probability: self.probability()?,
            max_induced: self.max_induced,
            max_engagement_rate: self.max_engagement_rate,
            max_speed_deficit_mps: self.max_speed_deficit_mps,
            max_jerk_mps3: self.max_jerk,
            max_flip_rate: self.max_flip_rate,
        })
    }

    /// Returns the gate on the probability of a collision.
    pub(super) fn probability(&self) -> Result<Option<ProbabilityGate>, CliError> {
        let gate = |max| ProbabilityGate::new(max, self.confidence.unwrap_or(CONFIDENCE));
        let usage = |error| CliError::Usage { message: format!("--max-probability: {error}") };
        self.max_probability.map(gate).transpose().map_err(usage)
    }
}

/// Parses a probability, above 0 and below 1: 0 and 1 cannot be shown by samples.
fn probability(text: &str) -> Result<f64, String> {
    between(text, 0.0, "above 0 and below 1")
}

/// Parses a confidence, above 0.5 and below 1.
fn confidence(text: &str) -> Result<f64, String> {
    between(text, 0.5, "above 0.5 and below 1")
}

fn between(text: &str, low: f64, allowed: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > low && value < 1.0 => Ok(value),
        _ => Err(format!("`{text}` is not a number {allowed}")),
    }
}

/// Parses a share, 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err(format!("`{text}` is not a number from 0 to 1")),
    }
}
