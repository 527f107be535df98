//! The frame of a page, and what several parts of a page share.

use std::fmt::Display;
use std::io;
use std::path::Path;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{ledger, provenance, samples, scenario, verdict};
use crate::campaign::ensemble::ensemble_html;
use crate::campaign::findings::Findings;
use closecall_scenarios::atomic::{WriteError, write_file};

/// The style sheet of all pages.
const STYLE: &str = include_str!("style.css");

/// Writes the page of a campaign.
///
/// # Errors
/// [`WriteError`] if a chart cannot be drawn or the file cannot be written. An existing file then stays as it is.
pub(in crate::campaign) fn write_html(path: &Path, findings: &Findings<'_>) -> Result<(), WriteError> {
    write_file(path, |file| file.write_all(campaign(findings)?.into_string().as_bytes()))
}

/// Returns the page of a campaign.
pub(super) fn campaign(findings: &Findings<'_>) -> io::Result<Markup> {
    let title = format!("{}: {}", findings.judged.word(), findings.scenario_names());
    let body = html! {
        (verdict::header(findings))
        (ledger::collisions(findings)?)
        (ensemble_html(findings.summary, findings.manifest))
        (verdict::gates(findings))
        (verdict::requirements(findings))
        (ledger::validity(findings))
        @for overview in &findings.overview.scenarios { (scenario::section(findings, overview)?) }
        (samples::slowest(findings))
        (provenance::provenance(findings))
    };
    Ok(document(&title, &body))
}

/// Returns a whole page.
pub(crate) fn document(title: &str, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (body) } }
        }
    }
}

/// Returns a table that scrolls sideways if the page is too narrow; `head` holds cells, `rows` holds rows.
pub(crate) fn table(head: &Markup, rows: &Markup) -> Markup {
    html! {
        div.wide {
            table {
                thead { tr { (head) } }
                tbody { (rows) }
            }
        }
    }
}

/// Returns the heads of columns of text.
pub(crate) fn text_heads(names: &[&str]) -> Markup {
    html! { @for name in names { th { (name) } } }
}

/// Returns the heads of columns of numbers.
pub(crate) fn number_heads(names: &[&str]) -> Markup {
    html! { @for name in names { th.number { (name) } } }
}

/// Returns a cell with a number.
pub(crate) fn number(value: impl Display) -> Markup {
    html! { td.number { (value.to_string()) } }
}

/// Returns an entry of a legend, in the colour that the charts use.
pub(crate) fn legend_key(colour: &str, text: &str) -> Markup {
    html! { span.key style={ "--key:" (colour) } { (text) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        let page = document("<b> & \"c\"", &html! { p { "<script>" } }).into_string();
        assert!(page.contains("<title>&lt;b&gt; &amp; &quot;c&quot;</title>"), "{page}");
        assert!(page.contains("<p>&lt;script&gt;</p>"), "{page}");
    }
}
