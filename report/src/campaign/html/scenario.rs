//! One scenario: its worst samples, how the outcome depends on the sampled values, the margins, and
//! the coverage.

use std::io;

use closecall_scenarios::ScenarioFile;
use maud::{Markup, PreEscaped, html};

use super::page::legend_key;
use super::{coverage, influence, samples};
use crate::campaign::findings::Findings;
use crate::campaign::overview::{Fate, MARGINS, MarginBins, ScenarioOverview};
use crate::campaign::recordings::card_beside;
use crate::campaign::words::worst_first;
use crate::charts;
use crate::charts::style::{arm_colour, css, fate_colour};
use crate::units::labelled;
use closecall_traffic::statistics::format::percent;
use closecall_traffic::words::counted;

/// Returns the section of one scenario.
pub(super) fn section(findings: &Findings<'_>, scenario: &ScenarioOverview) -> io::Result<Markup> {
    let file = findings.files.iter().find(|file| file.config().name == scenario.name);
    // The map of the only scenario, and of the worst, stands above.
    let is_above = worst_scenario(findings).is_some_and(|worst| worst.name == scenario.name);
    Ok(html! {
        section.scenario {
            h2 { (scenario.name) }
            @if let Some(file) = file { p.what { (file.config().description) } (faults(file)) }
            (samples::errors(findings, scenario))
            (samples::flaky(scenario))
            details {
                summary { "Samples, margins and coverage" }
                (samples::worst(findings, scenario))
                @if !is_above { (map(scenario)?) }
                (influence::section(findings, scenario)?)
                (margins(scenario)?)
                (coverage::tables(findings.judged, &scenario.name))
                (sampled_values(findings, scenario)?)
            }
        }
    })
}

/// Returns the faults that a scenario injects; nothing if it injects none.
fn faults(file: &ScenarioFile) -> Markup {
    let stated =
        file.concrete(&file.space().nominal()).map_or_else(|_| Vec::new(), |concrete| concrete.sensors.stated_faults());
    let texts: Vec<String> = stated.iter().map(ToString::to_string).collect();
    html! { @if !texts.is_empty() { p { strong { "Injected faults: " } (texts.join("; ")) "." } } }
}

/// Returns the scenario with the gate that misses its bound by most, else the first.
fn worst_scenario<'a>(findings: &Findings<'a>) -> Option<&'a ScenarioOverview> {
    let scenarios = &findings.overview.scenarios;
    let named = |name: &str| scenarios.iter().find(|scenario| scenario.name == name);
    worst_first(findings.judged).first().and_then(|gate| named(&gate.scenario)).or(scenarios.first())
}

/// Returns the title of the evidence: samples of all scenarios, and the map of this one. `None` if
/// there is neither.
fn evidence_title(scenarios: usize, has_samples: bool, mapped: Option<&str>) -> Option<String> {
    let samples = if scenarios > 1 { "Worst samples of all scenarios" } else { "Worst samples" };
    match (has_samples, mapped) {
        (true, Some(mapped)) => Some(format!("{samples}, and the map of {mapped}")),
        (true, None) => Some(samples.to_owned()),
        (false, mapped) => mapped.map(|mapped| format!("The map of {mapped}")),
    }
}

/// Returns the evidence that is looked at first: the outcome map of the worst scenario, and
/// pictures of the worst samples. Without any outcome there is no map.
pub(super) fn evidence(findings: &Findings<'_>) -> io::Result<Markup> {
    let stills = findings.worst_stills();
    let has_outcome = |scenario: &&ScenarioOverview| scenario.points().any(|point| point.fate != Fate::Error);
    let worst = worst_scenario(findings).filter(has_outcome);
    let mapped = worst.map(|worst| worst.name.as_str());
    let title = evidence_title(findings.overview.scenarios.len(), !stills.is_empty(), mapped);
    let Some(title) = title else { return Ok(Markup::default()) };
    Ok(html! {
        h2 { (title) }
        @if !stills.is_empty() {
            div.stills {
                @for (still, recording) in stills {
                    figure {
                        @let name = format!("Recording of {}, sample {}", still.scenario, still.sample);
                        a href=(recording) { span role="img" aria-label=(name) { (PreEscaped(&still.svg)) } }
                        figcaption {
                            strong { (still.verdict) } " " (still.scenario) ", sample " (still.sample) ": " (still.sentence) ". "
                            a href=(recording) { "Recording" } ", " a href=(card_beside(recording)) { "incident card" }
                        }
                    }
                }
            }
        }
        @if let Some(worst) = worst { (map(worst)?) }
    })
}

/// Returns the colours of the fates that occur, with their meaning.
fn fate_legend(scenario: &ScenarioOverview) -> Markup {
    let occurs = |fate: &Fate| scenario.points().any(|point| point.fate == *fate);
    html! {
        p.legend {
            @for fate in Fate::ALL.into_iter().filter(occurs) {
                (legend_key(&css(fate_colour(fate)), fate.word(scenario.is_paired())))
            }
        }
    }
}

fn map(scenario: &ScenarioOverview) -> io::Result<Markup> {
    let Some(pair) = scenario.map() else { return Ok(Markup::default()) };
    let tested = scenario.arms.last().map_or("", String::as_str);
    let [across, up] = pair.axes.map(|index| labelled(scenario.axes[index].name()));
    Ok(html! {
        h3 { "Outcome map" }
        p.note {
            "Of all pairs of parameters, " (across) " and " (up) " tell the most about the outcome. The stronger the colour "
            "of a cell, the larger the share of its samples with a collision in the arm under test. Points are samples, drawn "
            "evenly from the samples of each colour."
        }
        (fate_legend(scenario))
        p.legend {
            @for share in [0.25, 0.5, 1.0] {
                (legend_key(&charts::cell_css(share), &format!("{:.0} % collide with {tested}", 100.0 * share)))
            }
        }
        figure.map { (charts::outcome_map(scenario, pair)?) }
    })
}

fn margins(scenario: &ScenarioOverview) -> io::Result<Markup> {
    Ok(html! {
        h3 { "Margins of the ego" }
        p.legend {
            @for (index, arm) in scenario.arms.iter().enumerate() {
                (legend_key(&css(arm_colour(index + 1 == scenario.arms.len())), arm))
            }
        }
        div.charts {
            @for (kind, arms) in MARGINS.iter().zip(&scenario.margins) {
                figure {
                    (charts::margin(kind, arms)?)
                    figcaption { (absent(&scenario.arms, arms)) }
                }
            }
        }
        p.note {
            "Number of samples of each arm over the value; the last bin holds all larger values. Deceleration and jerk "
            "count until the ego collides."
        }
    })
}

/// Returns how many samples of each arm lack the margin.
fn absent(arms: &[String], bins: &[MarginBins]) -> String {
    let absent = arms.iter().zip(bins).filter(|(_, bins)| bins.absent > 0);
    absent
        .map(|(arm, bins)| format!("{arm}: {} without", counted(bins.absent, "sample")))
        .collect::<Vec<_>>()
        .join("; ")
}

/// Returns how the samples cover the parameters. A report of many scenarios has no chart of each
/// parameter: they would be nearly half of its bytes, and the explorer draws each with a choice of samples.
fn sampled_values(findings: &Findings<'_>, scenario: &ScenarioOverview) -> io::Result<Markup> {
    if scenario.axes.is_empty() {
        return Ok(Markup::default());
    }
    let (hit, all) = scenario
        .pairs
        .iter()
        .map(|pair| pair.coverage(&scenario.axes))
        .fold((0, 0), |(hit, all), [more, cells]| (hit + more, all + cells));
    Ok(html! {
        h3 { "Coverage of the sampled values" }
        @if all > 0 {
            p.note {
                (percent(hit as f64 / all as f64)) " of the cells of all pairs of parameters have a sample "
                "(" (hit) " of " (all) "). Cells are of equal width, not of equal probability: cells that a "
                "distribution hardly reaches stay empty."
            }
        }
        @if findings.has_many() {
            p.note { "The explorer (" code { "closecall view" } ") shows the distribution of each parameter." }
        } @else {
            (fate_legend(scenario))
            div.charts {
                @for (axis, counts) in scenario.axes.iter().zip(&scenario.coverage) {
                    figure { (charts::coverage(axis, counts)?) }
                }
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::evidence_title;

    #[test]
    fn the_title_does_not_give_the_samples_of_several_scenarios_to_the_mapped_one() {
        let title = |scenarios, has_samples, mapped| evidence_title(scenarios, has_samples, mapped).unwrap_or_default();
        assert_eq!(title(1, true, Some("a")), "Worst samples, and the map of a");
        assert_eq!(title(2, true, Some("a")), "Worst samples of all scenarios, and the map of a");
        assert_eq!(title(2, true, None), "Worst samples of all scenarios");
        assert_eq!(title(2, false, Some("a")), "The map of a");
        assert_eq!(evidence_title(1, false, None), None, "a page without an outcome has neither");
    }
}
