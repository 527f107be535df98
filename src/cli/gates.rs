//! What a campaign is judged by, on the command line.

use clap::Args;
use closecall_scenarios::sampling::Design;

use super::CliError;
use closecall_campaign::probability::ProbabilityGate;
use closecall_campaign::verdict::{Gates, MAX_FLIP_RATE};

/// The confidence of the gate on the probability, where nobody says otherwise.
const CONFIDENCE: f64 = 0.95;

/// The gates of a campaign.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Gates")]
pub(super) struct GateArgs {
    /// Fail where E collides in more samples than this
    #[arg(long, value_name = "K")]
    max_collisions: Option<u64>,
    /// Pass only where the probability of a collision of E is surely no higher than this, in every scenario; 4
    /// (inconclusive) where the samples do not say
    #[arg(long, value_name = "P", value_parser = probability)]
    pub(super) max_probability: Option<f64>,
    /// With --max-probability: how sure one wants to be, above 0.5 and below 1 [default: 0.95]
    #[arg(long, value_name = "C", value_parser = confidence, requires = "max_probability")]
    confidence: Option<f64>,
    /// In paired campaigns: fail where more collisions than this happen only with the controller under test
    #[arg(long, value_name = "K")]
    pub(super) max_induced: Option<u64>,
    /// Fail where the system engages in a larger share of the samples of any scenario, 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = share)]
    max_engagement_rate: Option<f64>,
    /// Fail where E falls by more than this below the speed of the vehicle ahead, in any sample
    #[arg(long, value_name = "M/S", value_parser = super::args::positive)]
    max_speed_deficit_mps: Option<f64>,
    /// Fail where E's acceleration changes faster than this before any collision, in any sample
    #[arg(long, value_name = "M/S³", alias = "max-jerk-mps3", value_parser = super::args::positive)]
    max_jerk: Option<f64>,
    /// The campaign is invalid where more of its checked verdicts flip at half the time step, 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = MAX_FLIP_RATE)]
    max_flip_rate: f64,
}

impl GateArgs {
    /// The gates, for a campaign with or without a baseline whose samples are laid out by `design`.
    pub(super) fn gates(&self, is_paired: bool, design: Design) -> Result<Gates, CliError> {
        if self.max_probability.is_some() && design != Design::Random {
            let message = format!(
                "--max-probability needs independent samples, which --design {design} does not give: use --design random"
            );
            return Err(CliError::Usage { message });
        }
        if self.max_induced.is_some() && !is_paired {
            let message = "--max-induced needs --paired: induced collisions are known only of pairs".to_owned();
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

    /// The gate on the probability.
    pub(super) fn probability(&self) -> Result<Option<ProbabilityGate>, CliError> {
        let gate = |max| ProbabilityGate::new(max, self.confidence.unwrap_or(CONFIDENCE));
        let usage = |error| CliError::Usage { message: format!("--max-probability: {error}") };
        self.max_probability.map(gate).transpose().map_err(usage)
    }
}

/// A probability that could be shown: above 0 and below 1.
fn probability(text: &str) -> Result<f64, String> {
    between(text, 0.0, "above 0 and below 1")
}

/// A confidence: above one half and below 1.
fn confidence(text: &str) -> Result<f64, String> {
    between(text, 0.5, "above 0.5 and below 1")
}

fn between(text: &str, low: f64, allowed: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > low && value < 1.0 => Ok(value),
        _ => Err(format!("`{text}` is not a number {allowed}")),
    }
}

/// A share: 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err(format!("`{text}` is not a number from 0 to 1")),
    }
}
