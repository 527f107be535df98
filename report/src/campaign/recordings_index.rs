//! The recordings of a campaign on one page: a still picture of each critical moment beside its numbers, and the
//! commands that open it and run it again.

use std::fmt::Write as _;
use std::path::Path;

use closecall_traffic::Measured;

use crate::escape::escaped;
use closecall_scenarios::atomic::{WriteError, write_file};
use closecall_simulation::outcome::Outcome;

/// One recorded sample.
#[derive(Clone, Debug)]
pub struct IndexEntry {
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// Why it was recorded, in words.
    pub reasons: Vec<&'static str>,
    /// The recording's file, as seen from the page.
    pub file: String,
    /// The command that runs it again.
    pub replay: String,
    /// How it ended in one sentence, and what the system did, for each arm.
    pub story: Vec<String>,
    /// The critical moment, as an SVG picture.
    pub still: String,
    /// The outcome of each arm, the baseline first.
    pub outcomes: Vec<Outcome>,
}

const HEAD: &str = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>Recordings</title>\n<style>\n\
body{font-family:sans-serif;margin:2em auto;max-width:75em;padding:0 1em;color:#222}\n\
section{display:flex;flex-wrap:wrap;gap:1.5em;border-top:1px solid #ccc;padding:1.2em 0}\n\
section>div{flex:1 1 30em;min-width:0}svg{max-width:100%;height:auto;border:1px solid #ddd}\n\
code{display:block;background:#f3f3f3;padding:.5em;margin:.4em 0;overflow-x:auto;white-space:pre}\n\
td,th{text-align:left;padding:.1em 1em .1em 0}.failure{color:#b00020}\n</style></head><body>\n";

/// Writes the page.
///
/// # Errors
/// [`WriteError`] where it cannot be written.
pub fn write_index(path: &Path, entries: &[IndexEntry]) -> Result<(), WriteError> {
    let page = page(entries);
    write_file(path, |file| file.write_all(page.as_bytes()))
}

fn page(entries: &[IndexEntry]) -> String {
    let mut page = String::from(HEAD);
    // Writing to a string cannot fail: results are dropped.
    let _ = write!(
        page,
        "<h1>Recordings</h1>\n<p>{} recorded samples. Each picture shows the critical moment from above: driving \
         direction to the right, the road drawn wider than it is. The recordings open in the Rerun viewer 0.36: \
         </p><code>pip install rerun-sdk==0.36.3</code>\n",
        entries.len()
    );
    for entry in entries {
        section(&mut page, entry);
    }
    page.push_str("</body></html>\n");
    page
}

fn section(page: &mut String, entry: &IndexEntry) {
    let name = format!("{} · sample {}", entry.scenario, entry.sample);
    let _ = write!(
        page,
        "<section id=\"{0}-{1}\">\n<div>{2}</div>\n<div>\n<h2>{3}</h2>\n<p>Recorded as {4}.</p>\n",
        escaped(&entry.scenario),
        entry.sample,
        entry.still,
        escaped(&name),
        escaped(&entry.reasons.join(", "))
    );
    for line in &entry.story {
        let class = if line.contains("COLLISION") { " class=\"failure\"" } else { "" };
        let _ = writeln!(page, "<p{class}>{}</p>", escaped(line));
    }
    numbers(page, &entry.outcomes);
    let _ = write!(
        page,
        "<p>Open it, from this page's folder:</p><code>rerun {}</code>\n<p>Run it again, from the folder that the \
         campaign was run in:</p><code>{}</code>\n</div>\n</section>\n",
        escaped(&entry.file),
        escaped(&entry.replay)
    );
}

type Number = (&'static str, fn(&Outcome) -> String);

const NUMBERS: [Number; 6] = [
    ("collisions", |outcome| outcome.collisions.len().to_string()),
    ("hardest impact [m/s]", |outcome| {
        let speeds = outcome.collisions.iter().map(|collision| collision.relative_speed_mps);
        speeds.max_by(f64::total_cmp).map_or("-".to_owned(), |speed_mps| format!("{speed_mps:.1}"))
    }),
    ("smallest front headway [s]", |outcome| shown(outcome.margins.min_thw_front_s)),
    ("smallest rear headway [s]", |outcome| shown(outcome.margins.min_thw_rear_s)),
    ("hardest braking [m/s²]", |outcome| format!("{:.1}", outcome.margins.max_deceleration_mps2)),
    ("MIS engaged at [s]", |outcome| outcome.mis.as_ref().map_or("-".to_owned(), |mis| shown(mis.engaged_at_s))),
];

fn shown(value: Measured) -> String {
    value.map_or_else(|absent| absent.to_string(), |value| format!("{value:.2}"))
}

fn numbers(page: &mut String, outcomes: &[Outcome]) {
    page.push_str("<table><tr><th></th>");
    for outcome in outcomes {
        let _ = write!(page, "<th>{}</th>", escaped(&outcome.controller));
    }
    page.push_str("</tr>\n");
    for (name, of) in NUMBERS {
        let _ = write!(page, "<tr><td>{name}</td>");
        for outcome in outcomes {
            let _ = write!(page, "<td>{}</td>", escaped(&of(outcome)));
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</table>\n");
}
