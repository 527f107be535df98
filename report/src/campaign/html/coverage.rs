//! What the samples cover of that which a scenario states in `[coverage]`.

use closecall_campaign::verdict::Judgement;
use closecall_traffic::statistics::format::percent;
use maud::{Markup, html};

use super::page::{number, number_heads, table, text_heads};
use crate::units::labelled;

/// Returns the tables of a scenario: items and crosses, then the bins of each. Empty if it states
/// nothing.
pub(super) fn tables(judged: &Judgement, scenario: &str) -> Markup {
    let results = judged.coverage.iter().find(|(name, _)| name == scenario).map_or(&[][..], |(_, results)| results);
    html! {
        @if !results.is_empty() {
            h3 { "Coverage that the scenario asks for" }
            p.note { "The weight of a bin is its probability, by the distributions of the scenario. Collisions are the ego's, arm by arm." }
            (table(
                &html! { (text_heads(&["item or cross", "bins of"])) (number_heads(&["bins", "covered", "share", "samples in none"])) },
                &html! {
                    @for result in results {
                        tr {
                            td { (result.name) }
                            td { (result.subjects.iter().map(|subject| labelled(subject)).collect::<Vec<_>>().join(" × ")) }
                            (number(result.bins.len())) (number(result.covered)) (number(percent(result.share()))) (number(result.outside))
                        }
                    }
                },
            ))
            @for result in results {
                details {
                    summary { "Bins of " (result.name) @if result.covered < result.bins.len() as u64 { ", holes first" } }
                    (table(
                        &html! { (text_heads(&result.subjects.iter().map(String::as_str).collect::<Vec<_>>())) (number_heads(&["samples", "needed", "weight", "collisions"])) },
                        &html! {
                            @for bin in result.holes().chain(result.bins.iter().filter(|bin| bin.hits >= result.at_least)) {
                                tr {
                                    @for label in &bin.bins { td { (label) } }
                                    (number(bin.hits)) (number(result.at_least))
                                    (number(bin.weight.map_or_else(|| "-".to_owned(), percent)))
                                    (number(bin.collided.iter().map(u64::to_string).collect::<Vec<_>>().join(" : ")))
                                }
                            }
                        },
                    ))
                }
            }
        }
    }
}
