//! The verdict over a driver ensemble, in each format.

use closecall_campaign::ensemble::{EnsembleVerdict, MemberValue, Quantity, Spread, verdicts};
use closecall_campaign::manifest::Manifest;
use closecall_campaign::summary::Summary;
use closecall_traffic::statistics::format::percent;
use maud::{Markup, html};
use serde_json::{Map, Value, json};

use super::html::{number, number_heads, table, text_heads};

/// A note for readers: the members are no sample.
const NOTE: &str = "Members are ways in which humans drive, not a sample of drivers: no weights are assumed. Of an even number, \
                    the less favourable of the two in the middle is the median.";

/// Returns the verdict over the ensemble of each scenario with members, as JSON.
pub fn ensemble_json(summary: &Summary, manifest: &Manifest) -> Value {
    Value::Array(verdicts(summary, &manifest.without_effect).iter().map(verdict_json).collect())
}

fn verdict_json(verdict: &EnsembleVerdict) -> Value {
    let member = |member_value: &MemberValue| json!({ "member": member_value.member, "value": member_value.value, "interval_95": member_value.interval_95 });
    let spreads: Map<String, Value> = verdict
        .spreads
        .iter()
        .map(|spread| {
            let value = json!({
                "median": member(&spread.median),
                "worst": member(&spread.worst),
                "undefined": spread.undefined,
            });
            (spread.quantity.key().to_owned(), value)
        })
        .collect();
    json!({
        "scenario": verdict.scenario,
        "members": verdict.members,
        "without_effect": verdict.without_effect,
        "quantities": spreads,
    })
}

/// Returns the verdict over the ensemble as lines of text; empty if no scenario has members.
pub fn ensemble_text(summary: &Summary, manifest: &Manifest) -> String {
    let mut text = String::new();
    for verdict in verdicts(summary, &manifest.without_effect) {
        text.push_str(&format!(
            "{} over {} members of the driver ensemble:\n",
            verdict.scenario,
            verdict.members.len()
        ));
        for spread in &verdict.spreads {
            text.push_str(&format!(
                "  {}: median {}, worst {}{}\n",
                spread.quantity.text(),
                shown(spread, &spread.median),
                shown(spread, &spread.worst),
                without_value(spread),
            ));
        }
        if !verdict.without_effect.is_empty() {
            text.push_str(&format!("  without effect, not run: {}\n", verdict.without_effect.join(", ")));
        }
    }
    text
}

/// Returns the verdict over the ensemble as Markdown; empty if no scenario has members.
pub(super) fn ensemble_markdown(summary: &Summary, manifest: &Manifest) -> String {
    let verdicts = verdicts(summary, &manifest.without_effect);
    if verdicts.is_empty() {
        return String::new();
    }
    let mut text = "| scenario | members | quantity | median | worst |\n|---|---:|---|---|---|\n".to_owned();
    for verdict in &verdicts {
        for spread in &verdict.spreads {
            text.push_str(&format!(
                "| {} | {} | {} | {} | {} |\n",
                verdict.scenario,
                verdict.members.len(),
                spread.quantity.text(),
                shown(spread, &spread.median),
                shown(spread, &spread.worst),
            ));
        }
    }
    text.push('\n');
    for verdict in verdicts.iter().filter(|verdict| !verdict.without_effect.is_empty()) {
        let members = verdict.without_effect.join(", ");
        text.push_str(&format!("{}: without effect, not run: {members}.\n\n", verdict.scenario));
    }
    format!("{text}{NOTE}\n\n")
}

/// Returns the section of the verdict over the ensemble; empty if no scenario has members.
pub(super) fn ensemble_html(summary: &Summary, manifest: &Manifest) -> Markup {
    let verdicts = verdicts(summary, &manifest.without_effect);
    if verdicts.is_empty() {
        return Markup::default();
    }
    let head = html! {
        (text_heads(&["scenario"])) (number_heads(&["members"])) (text_heads(&["quantity", "median", "worst", "no value"]))
    };
    let rows = html! {
        @for verdict in &verdicts {
            @for spread in &verdict.spreads {
                tr {
                    td { (verdict.scenario) }
                    (number(verdict.members.len()))
                    td { (spread.quantity.text()) }
                    td { (shown(spread, &spread.median)) }
                    td { (shown(spread, &spread.worst)) }
                    td { (spread.undefined.join(", ")) }
                }
            }
        }
    };
    html! {
        h2 { "Driver ensemble" }
        (table(&head, &rows))
        @for verdict in verdicts.iter().filter(|verdict| !verdict.without_effect.is_empty()) {
            p { (verdict.scenario) ": without effect, not run: " (verdict.without_effect.join(", ")) "." }
        }
        p { (NOTE) }
    }
}

/// Returns the value of a member with its interval and its name.
fn shown(spread: &Spread, member: &MemberValue) -> String {
    let value = value_text(spread.quantity, member.value);
    match member.interval_95 {
        Some([low, high]) => format!("{value} ({} to {}, {})", percent(low), percent(high), member.member),
        None => format!("{value} ({})", member.member),
    }
}

fn value_text(quantity: Quantity, value: f64) -> String {
    if quantity.is_share() { percent(value) } else { format!("{value:+.5}") }
}

/// Returns the end of a line that names the members without a value.
fn without_value(spread: &Spread) -> String {
    if spread.undefined.is_empty() {
        return String::new();
    }
    format!("; no value for {}: nothing collides without the system", spread.undefined.join(", "))
}
