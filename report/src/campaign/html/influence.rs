//! The influence of parameters on the result of a scenario, from the campaign's own samples.

use std::io;

use maud::{Markup, PreEscaped, html};

use super::page::{number, table, text_heads};
use crate::campaign::findings::Findings;
use crate::campaign::overview::{EventInfluence, FEW_EVENTS, ScenarioOverview};
use crate::charts::{TornadoBar, TornadoTexts, tornado};
use closecall_traffic::statistics::sensitivity::given_data::Influence;
use closecall_traffic::statistics::sensitivity::jackknife::Estimate;

/// Returns the section, with a tornado chart for each event.
pub(super) fn section(findings: &Findings<'_>, scenario: &ScenarioOverview) -> io::Result<Markup> {
    let events = match scenario.influence.events(findings.manifest.sampling.design) {
        Ok(events) => events,
        Err(reason) => {
            return Ok(html! {
                h3 { "What moves the result" }
                p.note { "Nothing can be said: " (reason) "." }
            });
        }
    };
    Ok(html! {
        h3 { "What moves the result" }
        p.note {
            "The bars show the smallest and the largest rate over equally probable parts of a parameter's distribution, or over its "
            "labels, with 95 % intervals; the line is the rate of all samples. The index is the share of the variance between the parts, "
            "less the share that chance puts there (first order). Grey: its interval reaches 0. "
            code { "closecall study sensitivity" }
            " runs a design of its own for interactions, and for what the scenario does not sample."
        }
        @for event in &events { (event_influence(event)?) }
    })
}

fn event_influence(event: &EventInfluence) -> io::Result<Markup> {
    let title = format!("{}: {} of {}", event.event.title(), event.events, event.samples);
    let Some(parameters) = &event.parameters else {
        return Ok(html! { p { strong { (title) } ": " (FEW_EVENTS) "." } });
    };
    let percent = |rate: &Estimate| (100.0 * rate.value, rate.interval_95.map(|bound| 100.0 * bound));
    let bar = |(name, influence): &(String, Influence)| {
        let by = |a: &&Estimate, b: &&Estimate| a.value.total_cmp(&b.value);
        let (low, high) = (influence.rates.iter().min_by(by)?, influence.rates.iter().max_by(by)?);
        let ((low, low_interval), (high, high_interval)) = (percent(low), percent(high));
        Some(TornadoBar {
            label: name.clone(),
            ends: [low, high],
            intervals_95: [low_interval, high_interval],
            note: format!("{}; index {:.2}", event.from_to(influence), influence.index.value),
            is_grey: influence.index.interval_95[0] <= 0.0,
        })
    };
    let bars: Vec<TornadoBar> = parameters.iter().filter_map(bar).collect();
    let heads = ["parameter", &title, "lowest → highest part"];
    let texts = TornadoTexts { heads, scale: "smallest and largest rate over the parts of the distribution [%]" };
    let chart = tornado(&bars, 100.0 * event.events as f64 / event.samples as f64, texts)?;
    Ok(html! {
        figure.broad.causes tabindex="0" { (PreEscaped(chart)) }
        details {
            summary { "Figures" }
            (table(&text_heads(&["parameter", "first-order index", "95 % interval", "rate in each part, in rising order"]), &html! {
                @for (name, influence) in parameters {
                    tr {
                        td { (name) }
                        (number(format!("{:.3}", influence.index.value)))
                        @let [low, high] = influence.index.interval_95;
                        (number(format!("{low:.3} to {high:.3}")))
                        @let rates = influence.rates.iter().map(|rate| format!("{:.1} %", 100.0 * rate.value));
                        td { (rates.collect::<Vec<_>>().join(", ")) }
                    }
                }
            }))
        }
    })
}
