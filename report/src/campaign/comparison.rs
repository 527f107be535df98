//! Comparisons with an earlier campaign, or with a baseline file, as text for human readers.

use std::fmt;

use closecall_campaign::baseline::{BaselineComparison, SampleErrors, ScenarioBaselineComparison};
use closecall_campaign::compare::{Means, ScenarioComparison};
use closecall_campaign::margins::MarginRegression;
use closecall_traffic::words::counted;

/// Largest number of samples that a list in a text names.
const MAX_LISTED: usize = 12;

/// The comparison of two campaigns, without its verdict.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonText<'a> {
    /// The scenarios.
    pub scenarios: &'a [ScenarioComparison],
    /// The differences of the manifests.
    pub differences: &'a [String],
    /// Share by which a quantile of a margin may fall (-).
    pub tolerance: f64,
}

impl fmt::Display for ComparisonText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for difference in self.differences {
            writeln!(f, "differs: {difference}")?;
        }
        for scenario in self.scenarios {
            writeln!(
                f,
                "{}: {}, {} the same to the last bit",
                scenario.scenario,
                counted(scenario.samples, "sample"),
                scenario.same
            )?;
            write_list(f, "newly failing", &scenario.newly_failing)?;
            write_list(f, "fixed", &scenario.fixed)?;
            writeln!(f, "  {:>6} failing in both", scenario.still_failing)?;
            if !scenario.newly_in_error.is_empty() {
                write_list(f, "newly in error", &scenario.newly_in_error)?;
            }
            if !scenario.no_longer_in_error.is_empty() {
                write_list(f, "no longer in error", &scenario.no_longer_in_error)?;
            }
            if !scenario.still_in_error.is_empty() {
                write_list(f, "in error in both, and not compared", &scenario.still_in_error)?;
            }
            for margin in &scenario.margins {
                let Some(Means { baseline, current }) = margin.means() else { continue };
                write!(f, "  {:<16} mean {baseline:.3}, now {current:.3} ({:+.3})", margin.key, current - baseline)?;
                if let Some(worst) = margin.worst {
                    write!(f, "; sample {} lost most ({:+.3})", worst.sample, worst.change)?;
                }
                writeln!(f)?;
            }
            for MarginRegression { margin, quantile, baseline, current } in scenario.margin_regressions(self.tolerance)
            {
                writeln!(f, "  REGRESSION: {margin} {quantile} {baseline:.3}, now {current:.3}")?;
            }
        }
        Ok(())
    }
}

/// The comparison of a campaign with a baseline file, with its verdict.
#[derive(Clone, Copy, Debug)]
pub struct BaselineText<'a>(pub &'a BaselineComparison);

impl fmt::Display for BaselineText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for ScenarioBaselineComparison { scenario, newly_failing, fixed, newly_in_error, margins } in &self.0.scenarios
        {
            writeln!(f, "{scenario}")?;
            write_list(f, "newly failing", newly_failing)?;
            write_list(f, "fixed", fixed)?;
            if !newly_in_error.is_empty() {
                write_list(f, "newly in error", newly_in_error)?;
            }
            for MarginRegression { margin, quantile, baseline, current } in margins {
                writeln!(f, "  {margin} {quantile}: {baseline:.3} in the baseline, now {current:.3}")?;
            }
        }
        for scenario in &self.0.new_scenarios {
            writeln!(f, "{scenario}: not in the baseline, and not compared")?;
        }
        for SampleErrors { scenario, samples, baseline, current } in &self.0.not_compared {
            writeln!(
                f,
                "{scenario}: not compared: of {}, {baseline} ended in an error in the baseline, and now {current}",
                counted(*samples, "sample")
            )?;
        }
        writeln!(f, "{}", self.0.regression())
    }
}

/// Writes how many samples there are of a kind, and the first of them.
fn write_list(f: &mut fmt::Formatter<'_>, kind: &str, samples: &[u64]) -> fmt::Result {
    let mut named: Vec<String> = samples.iter().take(MAX_LISTED).map(u64::to_string).collect();
    if samples.len() > MAX_LISTED {
        named.push(format!("… {} more", samples.len() - MAX_LISTED));
    }
    let colon = if named.is_empty() { "" } else { ": " };
    writeln!(f, "  {:>6} {kind}{colon}{}", samples.len(), named.join(", "))
}
