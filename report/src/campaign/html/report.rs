//! The page of a campaign.

use std::io;
use std::path::Path;

use maud::{Markup, PreEscaped, html};

use super::page::document;
use super::{ledger, provenance, samples, scenario, verdict};
use crate::campaign::causes;
use crate::campaign::ensemble::ensemble_html;
use crate::campaign::fidelity;
use crate::campaign::findings::Findings;
use crate::campaign::origins;
use closecall_traffic::atomic::{WriteError, write_file};

/// Writes the page of a campaign.
///
/// # Errors
/// [`WriteError`] if a chart cannot be drawn or the file cannot be written. An existing file then
/// stays as it is.
pub(in crate::campaign) fn write_html(path: &Path, findings: &Findings<'_>) -> Result<(), WriteError> {
    write_file(path, |file| file.write_all(campaign(findings)?.into_string().as_bytes()))
}

/// Returns the page of a campaign.
pub(super) fn campaign(findings: &Findings<'_>) -> io::Result<Markup> {
    let title = format!("{}: {}", findings.judged.word(), findings.scenarios_title());
    let body = html! {
        (verdict::gates(findings))
        (verdict::background(findings))
        (origins::section(findings))
        (ledger::counts(findings)?)
        (fidelity::section(findings))
        (scenario::evidence(findings)?)
        (ensemble_html(findings.summary, findings.manifest))
        (verdict::requirements(findings))
        (ledger::validity(findings))
        @if let Some(folder) = findings.folder {
            details { summary { "Causes of the failures" } (causes::table(folder, findings.command_for)) }
        }
        @for overview in &findings.overview.scenarios { (scenario::section(findings, overview)?) }
        details { summary { "Slowest samples" } (samples::slowest(findings)) }
        (provenance::provenance(findings))
        p.paper {
            "On the screen, report.html also has the gates that are met, the samples, margins and coverage of each scenario, the causes of "
            "the failures, and links to the recordings."
        }
    };
    let (contents, body) = with_contents(&body.into_string(), findings.has_many());
    Ok(document(&title, &html! { (verdict::header(findings)) (contents) (body) }))
}

/// Returns a list of contents, which may be folded, and the page whose headings it names.
fn with_contents(body: &str, is_folded: bool) -> (Markup, PreEscaped<String>) {
    const HEADING: &str = "<h2>";
    let mut parts = body.split(HEADING);
    let mut page = parts.next().unwrap_or_default().to_owned();
    let mut titles = Vec::new();
    for (number, part) in parts.enumerate() {
        titles.push(PreEscaped(part.split("</h2>").next().unwrap_or_default()));
        page.push_str(&format!("<h2 id=\"part-{number}\">{part}"));
    }
    let links =
        html! { @for (number, title) in titles.iter().enumerate() { a href={ "#part-" (number) } { (title) } } };
    let contents = html! {
        nav aria-label="Contents" {
            @if is_folded { details { summary { "Contents" } (links) } } @else { (links) }
        }
    };
    (contents, PreEscaped(page))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contents_name_every_heading() {
        let (contents, page) = with_contents("<p>0</p><h2>One</h2><p>1</p><h2>a &lt; b</h2>", false);
        assert_eq!(page.0, "<p>0</p><h2 id=\"part-0\">One</h2><p>1</p><h2 id=\"part-1\">a &lt; b</h2>");
        let contents = contents.into_string();
        assert!(contents.contains("<a href=\"#part-0\">One</a><a href=\"#part-1\">a &lt; b</a>"), "{contents}");
    }

    #[test]
    fn the_contents_of_many_scenarios_are_folded() {
        let body = "<h2>Gates</h2><h2>a</h2>";
        let (folded, open) = (with_contents(body, true).0.into_string(), with_contents(body, false).0.into_string());
        let (outside, inside) = folded.split_once("<details>").unwrap();
        assert!(!outside.contains("<a ") && inside.matches("<a ").count() == 2, "{folded}");
        assert!(!open.contains("<details>") && open.matches("<a ").count() == 2, "{open}");
    }
}
