//! A campaign on one page, for people: the verdict with its reasons and bounds first, then the ledger, the worst samples,
//! and how the outcome depends on what was sampled.
//!
//! The page is alone: styles and charts stand in it, it loads nothing, and runs no script. It shows wall times, so it is
//! not among the files that are the same to the last byte.

mod ledger;
mod made;
mod samples;
mod scenario;
mod text;
mod verdict;

#[cfg(test)]
mod tests;

use std::io;
use std::path::Path;

use super::findings::Findings;
use closecall_scenarios::atomic::{WriteError, write_file};
use text::{Html, escape};

const STYLE: &str = include_str!("style.css");

/// Writes the page.
///
/// # Errors
/// [`WriteError`] where a chart cannot be drawn or the file cannot be written; a file of that name is then as it was.
pub fn write_html(path: &Path, findings: &Findings<'_>) -> Result<(), WriteError> {
    write_file(path, |file| file.write_all(page(findings)?.as_bytes()))
}

fn page(findings: &Findings<'_>) -> io::Result<String> {
    let names: Vec<&str> = findings.files.iter().map(|file| file.config().name.as_str()).collect();
    let title = format!("{}: {}", findings.judged.verdict, names.join(", "));
    let mut body = Html::default();
    verdict::write(&mut body, findings);
    ledger::write(&mut body, findings);
    verdict::requirements(&mut body, findings);
    ledger::checks(&mut body, findings);
    for scenario in &findings.overview.scenarios {
        scenario::write(&mut body, findings, scenario)?;
    }
    samples::slowest(&mut body, findings);
    made::write(&mut body, findings);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
         <style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
        escape(&title),
        body.finish(),
    ))
}
