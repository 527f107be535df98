//! Prints the summary of a campaign as text for human readers.

use closecall_campaign::arm_pairs::{CORRECTION, pair_results};
use closecall_campaign::harm;
use closecall_campaign::ledger::{ArmCounts, Inference};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::probability::percent;
use closecall_campaign::summary::{Counts, Summary};
use closecall_campaign::verdict::Judgement;

use closecall_report::campaign::ensemble_text;

use super::output::{out, outln};

/// Width of the names of the arms in the output, at least.
const NAME_WIDTH: usize = 5;

/// Prints the counts of each scenario. Scenarios are never pooled into one sample.
pub(super) fn print_counts(summary: &Summary) {
    for (name, counts) in &summary.scenarios {
        outln!("{name}: {} samples", counts.samples);
        print_scenario(summary, counts);
    }
    if summary.inference == Inference::Sequential {
        outln!(
            "Intervals are confidence sequences: they are valid for any rule that determines the number of samples."
        );
    }
    outln!("Rates are conditional on the sampled scenario: they are not the risk on a road.");
}

/// Prints the verdict over the driver ensemble, if the campaign has one.
pub(super) fn print_ensemble(summary: &Summary, manifest: &Manifest) {
    out!("{}", ensemble_text(summary, manifest));
}

/// Prints the verdict with its reasons.
pub(super) fn print_verdict(judged: &Judgement) {
    outln!("{}", judged.word());
    for reason in &judged.reasons {
        outln!("  {reason}");
    }
}

fn print_scenario(summary: &Summary, counts: &Counts) {
    let width = summary.controllers.iter().map(String::len).fold(NAME_WIDTH, usize::max);
    for (name, arm) in summary.controllers.iter().zip(&counts.arms) {
        print_arm(&format!("{name:<width$}"), arm, summary.inference);
    }
    if summary.is_paired() {
        let pairs = counts.pairs;
        let [prevented, induced] = [pairs.prevented, pairs.induced];
        out!("  pairs: {prevented} prevented, {induced} induced, {} both, {} neither", pairs.both, pairs.neither);
        if let Some(p) = pairs.mcnemar_p(summary.inference) {
            out!("  (exact McNemar p {p:.2e})");
        }
        outln!();
        let of_others = pairs.induced_of_others + pairs.both_of_others;
        if of_others > 0 {
            let tested = summary.controllers.last().map_or("", String::as_str);
            outln!("  in {of_others} of the induced and both, only vehicles other than the ego collide with {tested}");
        }
        if counts.arms.iter().any(|arm| arm.harm > 0.0) {
            outln!(
                "  harm: {:.3} prevented, {:.3} induced ({})",
                pairs.prevented_harm,
                pairs.induced_harm,
                harm::WEIGHT
            );
        }
    }
    if summary.has_references() {
        print_arm_pairs(summary, counts);
    }
    let checks = &counts.checks;
    if let Some(rate) = checks.flip_rate() {
        outln!("  checked: {} runs, {} flipped at half the time step ({})", checks.runs, checks.flips, percent(rate));
    }
}

/// Prints all pairs of arms.
fn print_arm_pairs(summary: &Summary, counts: &Counts) {
    outln!(
        "  all pairs of arms (95 % intervals of the shares; p: exact McNemar, corrected for the pairs by {CORRECTION}):"
    );
    for result in pair_results(summary, counts) {
        let pairs = result.pairs;
        let interval = |[low, high]: [f64; 2]| format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high);
        out!("    {:<28}", format!("{} -> {}:", result.baseline, result.tested));
        out!(" {} prevented ({}),", pairs.prevented, interval(result.prevented_95));
        out!(" {} induced ({}),", pairs.induced, interval(result.induced_95));
        out!(" {} both, {} neither", pairs.both, pairs.neither);
        outln!("{}", result.corrected_p.map_or_else(String::new, |p| format!(", p {p:.2e}")));
    }
}

fn print_arm(name: &str, arm: &ArmCounts, inference: Inference) {
    let [low, high] = arm.interval_95(inference).map(|bound| 100.0 * bound);
    let rate = arm.collision_rate().map_or("-".to_owned(), |rate| format!("{:.1} %", 100.0 * rate));
    out!("  {name} {:>6} collisions  {rate:>7}  (95 %: {low:.1} to {high:.1} %)", arm.collisions);
    if arm.collisions > 0 {
        out!("  delta-v up to {:.1} m/s", arm.max_delta_v_mps);
    }
    if arm.engagements > 0 {
        out!("  {} engaged, goal in reach in {}", arm.engagements, arm.goals_in_reach);
    }
    out!("  up to {:.1} m/s slower than the lead vehicle", arm.max_speed_deficit_mps);
    if arm.errors > 0 {
        out!("  {} ERRORS", arm.errors);
    }
    outln!();
}
