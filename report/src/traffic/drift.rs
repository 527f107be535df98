//! The comparison of new traffic with fitted distributions, as a table for human readers.

use std::fmt;

use closecall_campaign::drift::{Drift, LEVEL};

/// The comparison as a table.
#[derive(Clone, Copy, Debug)]
pub struct DriftText<'a>(pub &'a Drift);

impl fmt::Display for DriftText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "                            fitted             new      distance   found    p, for all    values needed"
        )?;
        writeln!(
            f,
            "quantity                  n   median      n   median                from     the tests  for this    5 %"
        )?;
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        let count = |value: Option<u64>| value.map_or("-".to_owned(), |value| value.to_string());
        for drift in &self.0.quantities {
            let cut = drift.cut_from.zip(drift.cut_to);
            let cut = cut.map_or_else(String::new, |(from, to)| format!("  {} from {from} to {to}", drift.quantity));
            let mark = if drift.corrected_p_value.is_some_and(|p_value| p_value < LEVEL) { "  DRIFTED" } else { "" };
            writeln!(
                f,
                "{:<22} {:>4} {:>8.3} {:>6} {:>8} {:>13} {:>7} {:>13} {:>9} {:>6}{cut}{mark}",
                drift.name,
                drift.fitted_n,
                drift.fitted_median,
                drift.n,
                number(drift.median),
                number(drift.distance),
                number(drift.found_from),
                number(drift.corrected_p_value),
                count(drift.needed),
                count(drift.needed_for_five_percent),
            )?;
        }
        let verdict = match (self.0.is_tested, self.0.has_drifted) {
            (false, _) => "INCONCLUSIVE: no quantity has enough new values",
            (true, true) => "DRIFTED: the new traffic does not match the fitted distributions",
            (true, false) => "no drift found: a shift too small for these numbers of values is not excluded",
        };
        writeln!(f, "{verdict} (level {:.0} %, Holm's correction)", 100.0 * LEVEL)
    }
}
