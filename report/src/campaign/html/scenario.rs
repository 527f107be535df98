//! One scenario: its worst samples, how the outcome depends on what was sampled, the margins, and the coverage.

use std::io;

use super::samples;
use super::text::{Html, element, escape};
use crate::campaign::findings::Findings;
use crate::campaign::overview::{Fate, MARGINS, ScenarioOverview};
use crate::charts;
use crate::units::labelled;

pub(super) fn write(html: &mut Html, findings: &Findings<'_>, scenario: &ScenarioOverview) -> io::Result<()> {
    html.raw("<section>");
    html.element("h2", &scenario.name);
    if let Some(file) = findings.files.iter().find(|file| file.config().name == scenario.name) {
        html.classed("p", "what", &file.config().description);
    }
    samples::errors(html, scenario);
    samples::worst(html, findings, scenario);
    map(html, scenario)?;
    margins(html, scenario)?;
    coverage(html, scenario)?;
    html.raw("</section>");
    Ok(())
}

/// What the colours of the fates mean: those that occur.
fn legend(html: &mut Html, scenario: &ScenarioOverview) {
    let occurs = |fate: &Fate| scenario.points().any(|point| point.fate == *fate);
    let entries: String = Fate::ALL
        .into_iter()
        .filter(occurs)
        .map(|fate| element("span", &format!("key {}", class_of(fate)), fate.word(scenario.is_paired())))
        .collect();
    html.raw(&format!("<p class=\"legend\">{entries}</p>"));
}

const fn class_of(fate: Fate) -> &'static str {
    match fate {
        Fate::Passed => "passed",
        Fate::Prevented => "prevented",
        Fate::Failed => "failed",
        Fate::Induced => "induced",
        Fate::Error => "error",
    }
}

fn map(html: &mut Html, scenario: &ScenarioOverview) -> io::Result<()> {
    let Some(pair) = scenario.map() else { return Ok(()) };
    let [across, up] = pair.axes.map(|place| labelled(scenario.axes[place].name()));
    html.element("h3", "Outcome map");
    html.classed(
        "p",
        "note",
        format!(
            "Of all two parameters, {across} and {up} tell most of the outcome. A cell is the darker, the larger the \
             share of its samples in which E collides in any arm; points are samples, drawn evenly from each colour."
        ),
    );
    legend(html, scenario);
    html.raw(&format!("<figure class=\"map\">{}</figure>", charts::outcome_map(scenario, pair)?));
    Ok(())
}

fn margins(html: &mut Html, scenario: &ScenarioOverview) -> io::Result<()> {
    html.element("h3", "Margins of E");
    let tested = scenario.arms.len().saturating_sub(1);
    let key = |(place, arm): (usize, &String)| {
        element("span", if place == tested { "key tested" } else { "key baseline" }, arm)
    };
    let keys: String = scenario.arms.iter().enumerate().map(key).collect();
    html.raw(&format!("<p class=\"legend\">{keys}</p>"));
    html.raw("<div class=\"charts\">");
    for (kind, arms) in MARGINS.iter().zip(&scenario.margins) {
        let absent: Vec<String> = scenario
            .arms
            .iter()
            .zip(arms)
            .filter(|(_, bins)| bins.absent > 0)
            .map(|(arm, bins)| format!("{arm}: {} samples without", bins.absent))
            .collect();
        let caption = escape(&absent.join("; "));
        let chart = charts::margin(kind, arms)?;
        html.raw(&format!("<figure>{chart}<figcaption>{caption}</figcaption></figure>"));
    }
    html.raw("</div>");
    html.classed(
        "p",
        "note",
        "Samples of each arm over the value; the last bin holds all that lies beyond. Deceleration and jerk count until a \
         collision of E.",
    );
    Ok(())
}

fn coverage(html: &mut Html, scenario: &ScenarioOverview) -> io::Result<()> {
    if scenario.axes.is_empty() {
        return Ok(());
    }
    html.element("h3", "Coverage of the sampled values");
    let (hit, all) = scenario
        .pairs
        .iter()
        .map(|pair| pair.coverage(&scenario.axes))
        .fold((0, 0), |(hit, all), [more, cells]| (hit + more, all + cells));
    if let Some(share) = (all > 0).then(|| 100.0 * hit as f64 / all as f64) {
        let text = format!(
            "{share:.1} % of the cells of every two parameters' plane have a sample ({hit} of {all}). Cells are of equal \
             width, not of equal probability: those that a distribution hardly reaches stay empty."
        );
        html.classed("p", "note", text);
    }
    legend(html, scenario);
    html.raw("<div class=\"charts\">");
    for (axis, counts) in scenario.axes.iter().zip(&scenario.coverage) {
        html.raw(&format!("<figure>{}</figure>", charts::coverage(axis, counts)?));
    }
    html.raw("</div>");
    Ok(())
}
