//! One sample, as the explorer shows it: what happened and why, when, and from above.

use closecall_studies::minimize::Minimized;
use closecall_traffic::shown::shown;
use maud::{Markup, html};

use crate::run::figure::{incident, timeline};
use crate::run::film::Film;

/// Returns a sample in all arms as a part of a page. `difference` says that it is another run than the
/// campaign's.
pub fn sample_part(films: &[Film], difference: Option<&str>) -> String {
    finished(&html! {
        @if let Some(difference) = difference {
            p.headline { (difference) }
        }
        p.headline { (Film::verdict_word(films)) }
        div.arms { (incident(films)) }
        (timeline(films))
    })
}

/// Returns the smallest failing case of a sample beside its twin that passes, as a part of a page.
/// `films` are the films of both.
pub fn twin_part(minimized: &Minimized, films: &[Film]) -> String {
    finished(&html! {
        h3 { "The smallest case that fails" }
        p { (minimized.sentence) }
        @if !minimized.off_nominal.is_empty() {
            table {
                thead { tr { th { "parameter" } th.number { "smallest case" } th.number { "sample" } th.number { "nominal" } } }
                tbody {
                    @for offset in &minimized.off_nominal {
                        tr {
                            td { (offset.name) }
                            td.number { (short(&offset.value)) }
                            td.number { (short(&offset.sampled)) }
                            td.number { (short(&offset.nominal)) }
                        }
                    }
                }
            }
        }
        @match &minimized.twin {
            Some(twin) => p.headline { "It passes when " (twin.words) "." },
            None => p { "No single parameter was found with which it passes." },
        }
        div.arms { (incident(films)) }
        (timeline(films))
    })
}

/// Returns a number with three digits behind the point. Words stay as they are.
fn short(value: &str) -> String {
    value.parse().map_or_else(|_| value.to_owned(), |number: f64| format!("{number:.3}"))
}

fn finished(part: &Markup) -> String {
    shown(&part.0).into_owned()
}
