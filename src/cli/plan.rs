//! How much of a campaign is run, and how much of that is checked, on the command line.

use std::time::Duration;

use clap::{Args, ValueEnum};

use super::CliError;
use super::gates::share;
use closecall_campaign::ledger::Inference;
use closecall_campaign::validity::CheckPlan;

/// Samples of each scenario where nobody says otherwise.
const SAMPLES: u64 = 200;
/// Most samples of each scenario where the number comes from the outcomes or the clock.
const MOST_SAMPLES: u64 = 1_000_000;

/// Settings for an occasion. Whatever is given beside it counts before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Preset {
    /// For a pull request, in minutes: 1,000 paired samples of each scenario; without a collision they bound its
    /// probability at 0.3 % with 95 % confidence
    Pr,
    /// For the night: 20,000 paired samples of each scenario; without a collision they bound its probability at 0.015 %
    Nightly,
}

impl Preset {
    const fn samples(self) -> u64 {
        match self {
            Self::Pr => 1_000,
            Self::Nightly => 20_000,
        }
    }
}

/// How much is run.
#[derive(Clone, Debug, Args)]
pub(super) struct PlanArgs {
    /// Samples of each scenario [default: 200; with --until-certain or --time-budget the most there may be: 1000000]
    #[arg(short = 'n', long = "samples", value_parser = clap::value_parser!(u64).range(1..))]
    samples: Option<u64>,
    /// Settings for an occasion: number of samples, paired where the controller has a baseline
    #[arg(long, value_enum)]
    preset: Option<Preset>,
    /// With --max-probability: stop each scenario as soon as the samples say whether its probability is low enough, by
    /// bounds that hold although they are looked at after every sample
    #[arg(long, requires = "max_probability", conflicts_with_all = ["partition", "max_collisions", "max_induced"])]
    until_certain: bool,
    /// Stop after this long, such as 90s, 15m or 8h, shared out evenly among the scenarios; the samples that are judged
    /// are those before the first that was not over
    #[arg(
        long,
        value_name = "TIME",
        value_parser = duration,
        conflicts_with_all = ["partition", "resume", "max_collisions", "max_induced"]
    )]
    time_budget: Option<Duration>,
    /// Check this share of the samples for whether the simulator can be believed, above 0 and up to 1; the first four of
    /// each scenario always are
    #[arg(long, value_name = "SHARE", value_parser = share, default_value_t = CheckPlan::SHARE)]
    check_share: f64,
    /// Check no more samples of each scenario than this, beside the first four
    #[arg(long, value_name = "N", default_value_t = CheckPlan::AT_MOST)]
    check_at_most: u64,
}

impl PlanArgs {
    /// Samples of each scenario, at most.
    pub(super) fn samples(&self) -> u64 {
        let otherwise = match self.inference() {
            Inference::FixedSamples => SAMPLES,
            Inference::Sequential => MOST_SAMPLES,
        };
        self.samples.or(self.preset.map(Preset::samples)).unwrap_or(otherwise)
    }

    /// True where a preset asks for a baseline.
    pub(super) fn wants_pairs(&self) -> bool {
        self.preset.is_some()
    }

    /// What the number of samples comes from.
    pub(super) fn inference(&self) -> Inference {
        if self.until_certain || self.time_budget.is_some() { Inference::Sequential } else { Inference::FixedSamples }
    }

    /// True where a scenario ends once its answer is certain.
    pub(super) fn ends_when_certain(&self) -> bool {
        self.until_certain
    }

    /// The time for all scenarios together.
    pub(super) fn time_budget(&self) -> Option<Duration> {
        self.time_budget
    }

    /// Which samples are checked.
    pub(super) fn checks(&self) -> Result<CheckPlan, CliError> {
        CheckPlan::new(self.check_share, self.check_at_most)
            .map_err(|error| CliError::Usage { message: format!("--check-share: {error}") })
    }
}

/// A time above 0, in seconds, minutes or hours.
fn duration(text: &str) -> Result<Duration, String> {
    let units = [("s", 1.0), ("m", 60.0), ("h", 3_600.0)];
    let (number, unit_s) =
        units.iter().find_map(|(unit, s)| text.strip_suffix(unit).map(|number| (number, *s))).unwrap_or((text, 1.0));
    let time = number.parse().ok().filter(|value: &f64| *value > 0.0);
    time.and_then(|value| Duration::try_from_secs_f64(value * unit_s).ok())
        .ok_or_else(|| format!("`{text}` is not a time above 0 such as 90s, 15m or 8h"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        assert_eq!(duration("90"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("2h"), Ok(Duration::from_secs(7_200)));
        for text in ["", "0s", "-1m", "nan", "inf", "1d", "m", "1e300h"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
