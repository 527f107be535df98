//! The counts: how often the ego collides in each arm, the confidence of this rate, and the changes
//! by the system under test.
//!
//! Many scenarios have a row each, those with the worst gates first. Intervals, bars and causes are
//! folded then.

use super::super::text::{goals, imposed, not_prevented};
use super::super::words::p_text;
use std::cmp::Reverse;
use std::io;

use maud::{Markup, html};

use super::page::{number, number_heads, table, text_heads};
use crate::campaign::findings::Findings;
use crate::charts;
use closecall_campaign::arm_pairs::{CORRECTION, pair_results};
use closecall_campaign::gate::Standing;
use closecall_campaign::harm;
use closecall_campaign::ledger::{ArmCounts, Inference};
use closecall_campaign::summary::{Counts, Summary};
use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::counted;

/// Number of rows of the table on the screen if there are many scenarios. The others are folded.
/// Paper has all rows.
const ROWS: usize = 6;

/// Returns the counts of the campaign.
pub(super) fn counts(findings: &Findings<'_>) -> io::Result<Markup> {
    if !findings.has_many() {
        return collisions(findings);
    }
    let rows = worst_first(findings);
    let (first, others) = rows.split_at(rows.len().min(ROWS));
    let head = compact_head(findings.summary);
    let compact = |rows: &[Row<'_>]| table(&head, &html! { @for row in rows { (compact_row(row)) } });
    Ok(html! {
        h2 { "Counts of each scenario" }
        div.screen {
            (compact(first))
            details { summary { (counted(others.len(), "more scenario")) } (compact(others)) }
        }
        div.paper.counts { (compact(&rows)) }
        p.note { (RATES_NOTE) }
        details { summary { "Intervals, pairs and causes in each scenario" } (collisions(findings)?) }
    })
}

/// A scenario of the compact table.
struct Row<'a> {
    name: &'a str,
    counts: &'a Counts,
    is_paired: bool,
    /// Numbers of gates that are not met, and that are undecided.
    gates: [usize; 2],
}

/// Returns the scenarios: most missed gates first, then most induced collisions and most collisions
/// of the arm under test.
fn worst_first<'a>(findings: &Findings<'a>) -> Vec<Row<'a>> {
    let of_standing = |name: &str, standing: Standing| {
        findings.judged.gates.iter().filter(|gate| gate.scenario == name && gate.standing() == standing).count()
    };
    let row = |(name, counts): &'a (String, Counts)| Row {
        name,
        counts,
        is_paired: findings.summary.is_paired(),
        gates: [of_standing(name, Standing::Fail), of_standing(name, Standing::Inconclusive)],
    };
    let mut rows: Vec<Row<'a>> = findings.summary.scenarios.iter().map(row).collect();
    let collisions = |row: &Row<'_>| row.counts.arms.last().map_or(0, |tested| tested.collisions);
    rows.sort_by_key(|row| Reverse((row.gates[0], row.counts.pairs.induced, collisions(row))));
    rows
}

fn compact_head(summary: &Summary) -> Markup {
    html! {
        th { "scenario" }
        (number_heads(&["samples"]))
        @for controller in &summary.controllers { th.number { "collisions with " (controller) } }
        @if summary.is_paired() { (number_heads(&["prevented", "induced", "in both"])) }
        (number_heads(&["gates not met", "undecided", "errors"]))
    }
}

fn compact_row(row: &Row<'_>) -> Markup {
    let counts = row.counts;
    let collisions = |arm: &ArmCounts| {
        let rate = arm.collision_rate().map_or_else(String::new, |rate| format!(" ({})", percent(rate)));
        format!("{}{rate}", arm.collisions)
    };
    html! {
        tr.collided[row.gates[0] > 0] {
            td { (row.name) }
            (number(counts.samples))
            @for arm in &counts.arms { (number(collisions(arm))) }
            @if row.is_paired { (number(counts.pairs.prevented)) (number(counts.pairs.induced)) (number(counts.pairs.both)) }
            (number(row.gates[0]))
            (number(row.gates[1]))
            (number(counts.errors()))
        }
    }
}

/// What a rate says.
const RATES_NOTE: &str = "Rates are conditional on the sampled scenario: they say how often a sampled encounter ends in a collision of \
                          the ego, not how often this happens on a road.";

/// Returns the collisions of each arm, and of pairs of arms if the campaign is paired.
pub(super) fn collisions(findings: &Findings<'_>) -> io::Result<Markup> {
    let summary = findings.summary;
    // Scenarios are never pooled into one sample: each has a row of its own.
    let scenarios = &summary.scenarios;
    let arms = || scenarios.iter().flat_map(|(_, counts)| &counts.arms);
    // All bars have one scale, so that they can be compared.
    let most = arms().map(|arm| bar_interval(arm, summary.inference)[1]).fold(0.0, f64::max);
    let head = html! {
        (text_heads(&["scenario", "controller"]))
        (number_heads(&["samples", "collisions", "rate", "95 % interval"]))
        th { "0 to " (percent(most)) }
        (number_heads(&["largest ΔV [m/s]", "touches", "R brakes > 3 m/s²", "engaged", "goal in reach", "errors"]))
    };
    let rows = html! {
        @for (name, counts) in scenarios {
            @for (index, (controller, arm)) in summary.controllers.iter().zip(&counts.arms).enumerate() {
                @let is_tested = index + 1 == counts.arms.len();
                tr.tested[is_tested] {
                    td { @if index == 0 { (name) } }
                    td { (controller) }
                    (arm_cells(arm, summary.inference, most, is_tested)?)
                }
            }
        }
    };
    Ok(html! {
        h2 { "Collisions of the ego" }
        (table(&head, &rows))
        @for (name, counts) in scenarios {
            @if let Some(sentence) = imposed(summary, counts) { p { (name) ": " (sentence) "." } }
        }
        @if summary.is_paired() { (pairs(scenarios, summary.inference)?) }
        @if summary.has_references() { (arm_pairs(summary)) }
        p.note {
            (RATES_NOTE) " Touches: samples in which two bumpers meet at less than 0.67 m/s; they are no "
            "collisions. R brakes > 3 m/s²: samples in which the vehicle behind brakes harder before the lead vehicle brakes."
        }
    })
}

/// Returns the interval of the rate of collisions, or the rate alone if no interval is valid.
fn bar_interval(arm: &ArmCounts, inference: Inference) -> [f64; 2] {
    arm.interval_95(inference).unwrap_or([arm.collision_rate().unwrap_or_default(); 2])
}

fn arm_cells(arm: &ArmCounts, inference: Inference, most: f64, is_tested: bool) -> io::Result<Markup> {
    let interval = arm.interval_95(inference);
    let rate = arm.collision_rate();
    Ok(html! {
        (number(arm.outcomes))
        (number(arm.collisions))
        (number(rate.map_or_else(|| "-".to_owned(), percent)))
        (number(interval.map_or_else(|| "-".to_owned(), |[low, high]| format!("{} to {}", percent(low), percent(high)))))
        td.bar { (charts::rate(rate, bar_interval(arm, inference), most, is_tested)?) }
        (number(if arm.collisions > 0 { format!("{:.1}", arm.max_delta_v_mps) } else { String::new() }))
        (number(arm.touches))
        (number(arm.imposed_share().map_or_else(|| "-".to_owned(), percent)))
        (number(arm.engagements))
        (number(arm.goals_in_reach))
        (number(arm.errors))
    })
}

fn pairs(scenarios: &[(String, Counts)], inference: Inference) -> io::Result<Markup> {
    let most =
        scenarios.iter().map(|(_, counts)| counts.pairs.prevented.max(counts.pairs.induced)).max().unwrap_or(0).max(1);
    let head = html! {
        th { "scenario" }
        (number_heads(&["prevented", "induced", "collision in both", "in neither"]))
        th { "prevented against induced" }
        (number_heads(&["McNemar p", "harm prevented", "harm induced"]))
    };
    let rows = html! {
        @for (name, counts) in scenarios {
            @let pairs = &counts.pairs;
            tr {
                td { (name) }
                (number(pairs.prevented))
                (number(pairs.induced))
                (number(pairs.both))
                (number(pairs.neither))
                td.bar { (charts::balance(pairs.prevented, pairs.induced, most)?) }
                (number(pairs.mcnemar_p(inference).map_or_else(|| "-".to_owned(), p_text)))
                (number(format!("{:.3}", pairs.prevented_harm)))
                (number(format!("{:.3}", pairs.induced_harm)))
            }
        }
    };
    Ok(html! {
        h2 { "What the controller under test changes" }
        (table(&head, &rows))
        @for (name, counts) in scenarios {
            @for sentence in [not_prevented(counts), goals(counts)].into_iter().flatten() {
                p { (name) ": " (sentence) "." }
            }
        }
        p.note {
            "McNemar p (mid-p, two-sided), of the samples in which some vehicle collides in one arm alone: the probability of "
            "a split at least this uneven if both arms are alike. It is valid only if the number of samples was fixed in "
            "advance. Harm: " (harm::WEIGHT) "."
        }
    })
}

/// Returns the table of all pairs of arms.
fn arm_pairs(summary: &Summary) -> Markup {
    let head = html! {
        (text_heads(&["scenario", "from", "to"]))
        (number_heads(&["prevented", "95 % interval", "induced", "95 % interval", "both", "neither", "McNemar p", "corrected"]))
    };
    let interval = |interval: Option<[f64; 2]>| {
        interval.map_or_else(|| "-".to_owned(), |[low, high]| format!("{} to {}", percent(low), percent(high)))
    };
    let p_or_dash = |p: Option<f64>| p.map_or_else(|| "-".to_owned(), p_text);
    let rows = html! {
        @for (name, counts) in &summary.scenarios {
            @for (index, result) in pair_results(summary, counts).iter().enumerate() {
                tr {
                    td { @if index == 0 { (name) } }
                    td { (result.baseline) }
                    td { (result.tested) }
                    (number(result.pairs.prevented))
                    (number(interval(result.prevented_95)))
                    (number(result.pairs.induced))
                    (number(interval(result.induced_95)))
                    (number(result.pairs.both))
                    (number(result.pairs.neither))
                    (number(p_or_dash(result.mcnemar_p)))
                    (number(p_or_dash(result.corrected_p)))
                }
            }
        }
    };
    html! {
        h2 { "All pairs of arms" }
        (table(&head, &rows))
        p.note {
            "Each arm with each arm before it, on the same samples. McNemar mid-p, corrected for the number of pairs of a "
            "scenario (" (CORRECTION) "). The intervals are exact, each for its own share of the samples."
        }
    }
}

/// Returns the findings of the validity checks in each scenario; empty if no run was checked.
pub(super) fn validity(findings: &Findings<'_>) -> Markup {
    let summary = findings.summary;
    if summary.scenarios.iter().all(|(_, counts)| counts.checks.runs == 0) {
        return Markup::default();
    }
    let head = html! {
        th { "scenario" }
        (number_heads(&["runs checked", "verdicts flipped at half the time step", "share"]))
        th { "differences" }
    };
    let rows = html! {
        @for (name, counts) in &summary.scenarios {
            @let checks = &counts.checks;
            @let broken: Vec<String> =
                checks.broken().map(|(check, count)| format!("{count} × {}", check.finding())).collect();
            tr.collided[!broken.is_empty()] {
                td { (name) }
                (number(checks.runs))
                (number(checks.flips))
                (number(checks.flip_rate().map_or_else(|| "-".to_owned(), percent)))
                td { @if broken.is_empty() { "none" } @else { (broken.join("; ")) } }
            }
        }
    };
    let total = summary.total().checks;
    let broken: u64 = total.broken().map(|(_, count)| count).sum();
    html! {
        h2 { "Validity of the simulation" }
        @if findings.has_many() {
            p {
                (counted(total.runs, "run")) " checked: " (counted(total.flips, "verdict")) " flipped at half the time step, "
                (counted(broken, "difference")) " in another check."
            }
            details { summary { "Checks of each scenario" } (table(&head, &rows)) }
        } @else { (table(&head, &rows)) }
    }
}
