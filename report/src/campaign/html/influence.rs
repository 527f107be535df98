//! What moves the result of a scenario, from the campaign's own samples.

use std::io;

use maud::{Markup, PreEscaped, html};

use super::page::{number, table, text_heads};
use crate::campaign::findings::Findings;
use crate::campaign::overview::{EventInfluence, FEW_EVENTS, ScenarioOverview};
use crate::charts::{TornadoBar, tornado};

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
            "The bars are first-order indices: the share of the variance that is explained by which equally probable part of its "
            "distribution a parameter lies in, corrected for the share that chance alone explains, with 95 % intervals. Interactions of "
            "parameters are not in it; `closecall sensitivity` runs a design of its own for them, and for what the scenario does not sample."
        }
        @for event in &events { (of_event(event)?) }
    })
}

fn of_event(event: &EventInfluence) -> io::Result<Markup> {
    let title = format!("{}: {} of {}", event.event.title(), event.events, event.samples);
    let Some(parameters) = &event.parameters else {
        return Ok(html! { p { strong { (title) } ": " (FEW_EVENTS) "." } });
    };
    let bar = |(name, influence): &(String, _)| {
        let closecall_statistics::sensitivity::given_data::Influence { index, .. } = influence;
        TornadoBar {
            label: name.clone(),
            value: index.value,
            interval_95: index.interval_95,
            inner: None,
            note: event.from_to(influence),
            is_grey: index.interval_95[0] <= 0.0,
        }
    };
    let bars: Vec<TornadoBar> = parameters.iter().map(bar).collect();
    let heads = ["parameter", &title, "lowest → highest part"];
    let chart = tornado(&bars, heads, "first-order index; grey: its interval reaches 0")?;
    Ok(html! {
        figure.map { (PreEscaped(chart)) }
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
