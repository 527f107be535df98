//! What the samples cover of that which scenarios state in `[coverage]`: as text and for programs.

use std::fmt;

use closecall_campaign::coverage::{BinHits, CoverageResult};
use closecall_campaign::verdict::Judgement;
use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::counted;
use serde_json::{Value, json};

/// Largest number of holes that a text names.
const NAMED_HOLES: usize = 5;

/// What the samples cover, one line for each item and cross. Empty if no scenario states what is to
/// be covered.
#[derive(Clone, Copy, Debug)]
pub struct CoverageText<'a>(pub &'a Judgement);

impl fmt::Display for CoverageText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (scenario, results) in &self.0.coverage {
            writeln!(f, "{scenario}: coverage")?;
            for result in results {
                writeln!(f, "  {}", line(result))?;
                if let Some(rates) = &result.weighted_collision_rates {
                    let rates: Vec<String> = rates.iter().map(|rate| percent(*rate)).collect();
                    writeln!(
                        f,
                        "    the ego collides in {} of the encounters in these bins, by their weights",
                        rates.join(" and ")
                    )?;
                }
            }
        }
        Ok(())
    }
}

/// Returns an item or a cross in one line, with its first holes.
pub(super) fn line(result: &CoverageResult) -> String {
    let (covered, all) = (result.covered, result.bins.len());
    let outside = match result.outside {
        0 => String::new(),
        outside => format!(", {} in none", counted(outside, "sample")),
    };
    let holes: Vec<String> = result.holes().map(|hole| hole_text(result, hole)).collect();
    let named = holes.iter().take(NAMED_HOLES).cloned().collect::<Vec<_>>().join("; ");
    let more = holes.len().saturating_sub(NAMED_HOLES);
    let holes = match (holes.len(), more) {
        (0, _) => String::new(),
        (_, 0) => format!("; holes: {named}"),
        (_, more) => format!("; holes: {named}; and {more} more"),
    };
    format!("{}: {covered} of {all} bins ({}){outside}{holes}", result.name, percent(result.share()))
}

fn hole_text(result: &CoverageResult, hole: &BinHits) -> String {
    let bins = result.subjects.iter().zip(&hole.bins).map(|(subject, bin)| format!("{subject} {bin}"));
    let hits = if hole.hits > 0 { format!(" ({} of {})", hole.hits, result.at_least) } else { String::new() };
    format!("{}{hits}", bins.collect::<Vec<_>>().join(", "))
}

/// Returns the coverage for programs: by scenario, then by item or cross.
pub(crate) fn coverage_json(judged: &Judgement) -> Value {
    let result = |result: &CoverageResult| {
        let mut value = json!(result);
        value["share"] = json!(result.share());
        value["holes"] = json!(result.holes().collect::<Vec<_>>());
        value
    };
    let scenarios = judged.coverage.iter().map(|(scenario, results)| {
        json!({ "scenario": scenario, "coverage": results.iter().map(result).collect::<Vec<_>>() })
    });
    scenarios.collect()
}
