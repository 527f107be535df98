//! The ledger: who collided how often, how sure that is, and what the system under test changed.

use super::text::{Html, cell, markup, number, percent};
use crate::campaign::findings::Findings;
use closecall_campaign::harm;
use closecall_campaign::ledger::Inference;
use closecall_campaign::summary::Counts;

pub(super) fn write(html: &mut Html, findings: &Findings<'_>) {
    let summary = findings.summary;
    html.element("h2", "Collisions of E");
    let mut rows: Vec<(String, Counts)> = summary.scenarios.clone();
    if rows.len() > 1 {
        rows.push(("all scenarios".to_owned(), summary.total()));
    }
    let arms = || rows.iter().flat_map(|(_, counts)| &counts.arms);
    // One scale for all bars, so that they can be held against each other.
    let most = arms().map(|arm| arm.interval_95(summary.inference)[1]).fold(0.0, f64::max);
    html.table(&[
        "scenario",
        "controller",
        "#samples",
        "#collisions",
        "#rate",
        "#95 %",
        &format!("0 to {}", percent(most)),
        "#ΔV up to [m/s]",
        "#engaged",
        "#goal in reach",
        "#errors",
    ]);
    for (name, counts) in &rows {
        for (place, (controller, arm)) in summary.controllers.iter().zip(&counts.arms).enumerate() {
            let [low, high] = arm.interval_95(summary.inference);
            let is_tested = place + 1 == counts.arms.len();
            let rate = arm.collision_rate();
            html.row(
                if is_tested { "tested" } else { "" },
                &[
                    cell(if place == 0 { name.as_str() } else { "" }),
                    cell(controller),
                    number(arm.outcomes),
                    number(arm.collisions),
                    number(rate.map_or_else(|| "-".to_owned(), percent)),
                    number(format!("{:.2} to {}", 100.0 * low, percent(high))),
                    markup(&bar(rate, [low, high], most, is_tested)),
                    number(if arm.collisions > 0 { format!("{:.1}", arm.max_delta_v_mps) } else { String::new() }),
                    number(arm.engagements),
                    number(arm.goals_in_reach),
                    number(arm.errors),
                ],
            );
        }
    }
    html.end_table();
    if summary.is_paired() {
        pairs(html, &rows, summary.inference);
    }
    html.classed(
        "p",
        "note",
        "Rates are conditional on the sampled scenario: they say how often a sampled encounter ends in a collision of E, \
         not how often that happens on a road.",
    );
}

fn pairs(html: &mut Html, rows: &[(String, Counts)], inference: Inference) {
    html.element("h2", "What the controller under test changes");
    html.table(&[
        "scenario",
        "#prevented",
        "#induced",
        "#collision in both",
        "#in neither",
        "prevented against induced",
        "#McNemar p",
        "#harm prevented",
        "#harm induced",
    ]);
    let most =
        rows.iter().map(|(_, counts)| counts.pairs.prevented.max(counts.pairs.induced)).max().unwrap_or(0).max(1);
    for (name, counts) in rows {
        let pairs = &counts.pairs;
        html.row(
            "",
            &[
                cell(name),
                number(pairs.prevented),
                number(pairs.induced),
                number(pairs.both),
                number(pairs.neither),
                markup(&balance(pairs.prevented, pairs.induced, most)),
                number(pairs.mcnemar_p(inference).map_or_else(|| "-".to_owned(), |p| format!("{p:.1e}"))),
                number(format!("{:.3}", pairs.prevented_harm)),
                number(format!("{:.3}", pairs.induced_harm)),
            ],
        );
    }
    html.end_table();
    html.classed(
        "p",
        "note",
        format!(
            "McNemar p (exact, two-sided): how rare so uneven a split is if the arms are alike; it holds for a number of \
             samples that was fixed in advance. Harm: {}.",
            harm::WEIGHT
        ),
    );
}

/// What the validity checks found, scenario by scenario.
pub(super) fn checks(html: &mut Html, findings: &Findings<'_>) {
    let summary = findings.summary;
    if summary.scenarios.iter().all(|(_, counts)| counts.checks.runs == 0) {
        return;
    }
    html.element("h2", "Validity of the simulation");
    html.table(&["scenario", "#runs checked", "#verdicts flipped at half the time step", "#share", "differences"]);
    for (name, counts) in &summary.scenarios {
        let checks = &counts.checks;
        let broken: Vec<String> =
            checks.broken().map(|(check, count)| format!("{count} × {}", check.finding())).collect();
        let found = if broken.is_empty() { "none".to_owned() } else { broken.join("; ") };
        html.row(
            if broken.is_empty() { "" } else { "collided" },
            &[
                cell(name),
                number(checks.runs),
                number(checks.flips),
                number(checks.flip_rate().map_or_else(|| "-".to_owned(), percent)),
                cell(found),
            ],
        );
    }
    html.end_table();
}

/// Width of the bars [px].
const BAR_PX: f64 = 220.0;

/// A rate with its interval.
fn bar(rate: Option<f64>, [low, high]: [f64; 2], most: f64, is_tested: bool) -> String {
    let x = |probability: f64| if most > 0.0 { BAR_PX * probability / most } else { 0.0 };
    let class = if is_tested { "tested" } else { "baseline" };
    let dot = rate.map_or_else(String::new, |rate| format!("<circle cx=\"{:.1}\" cy=\"9\" r=\"4\"/>", 4.0 + x(rate)));
    format!(
        "<svg class=\"bar {class}\" viewBox=\"0 0 228 18\" width=\"228\" height=\"18\" role=\"img\">\
         <rect x=\"4\" y=\"8\" width=\"220\" height=\"2\" class=\"scale\"/>\
         <rect x=\"{:.1}\" y=\"6\" width=\"{:.1}\" height=\"6\" rx=\"3\"/>{dot}</svg>",
        4.0 + x(low),
        (x(high) - x(low)).max(1.0),
    )
}

/// Prevented collisions to the left of the middle, induced ones to the right.
fn balance(prevented: u64, induced: u64, most: u64) -> String {
    let half = 0.5 * BAR_PX;
    let width = |count: u64| half * count as f64 / most as f64;
    format!(
        "<svg class=\"bar\" viewBox=\"0 0 228 18\" width=\"228\" height=\"18\" role=\"img\">\
         <rect x=\"{:.1}\" y=\"3\" width=\"{:.1}\" height=\"12\" class=\"prevented\"/>\
         <rect x=\"114\" y=\"3\" width=\"{:.1}\" height=\"12\" class=\"induced\"/>\
         <rect x=\"113.5\" y=\"0\" width=\"1\" height=\"18\" class=\"scale\"/></svg>",
        114.0 - width(prevented),
        width(prevented),
        width(induced),
    )
}
