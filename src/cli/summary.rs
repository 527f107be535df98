//! What a campaign comes to, for people.

use super::output::{out, outln};
use crate::campaign::summary::{Counts, Summary};
use crate::campaign::verdict::Judgement;

/// Prints the counts of each scenario, and of all.
pub(super) fn print_counts(summary: &Summary) {
    for (name, counts) in &summary.scenarios {
        outln!("{name}: {} samples", counts.samples);
        print_scenario(summary, counts);
    }
    if summary.scenarios.len() > 1 {
        outln!("all scenarios");
        print_scenario(summary, &summary.total());
    }
    outln!("Rates are conditional on the sampled scenario: they are not the risk of a road.");
}

/// Prints the verdict with its reasons.
pub(super) fn print_verdict(judged: &Judgement) {
    outln!("{}", judged.verdict);
    for reason in &judged.reasons {
        outln!("  {reason}");
    }
}

fn print_scenario(summary: &Summary, counts: &Counts) {
    for (name, arm) in summary.controllers.iter().zip(&counts.arms) {
        let [low, high] = arm.interval_95().map(|bound| 100.0 * bound);
        let rate = arm.collision_rate().map_or("-".to_owned(), |rate| format!("{:.1} %", 100.0 * rate));
        out!("  {name:<5} {:>6} collisions  {rate:>7}  (95 %: {low:.1} to {high:.1} %)", arm.collisions);
        if arm.engagements > 0 {
            out!("  {} engaged, goal in reach in {}", arm.engagements, arm.goals_in_reach);
        }
        out!("  up to {:.1} m/s slower than ahead", arm.max_speed_deficit_mps);
        if arm.errors > 0 {
            out!("  {} ERRORS", arm.errors);
        }
        outln!();
    }
    if summary.is_paired() {
        let pairs = counts.pairs;
        outln!(
            "  pairs: {} prevented, {} induced, {} both, {} neither",
            pairs.prevented,
            pairs.induced,
            pairs.both,
            pairs.neither,
        );
    }
}
