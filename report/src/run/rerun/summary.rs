//! The summary of a recording as a page of text: the story of each run, its outcome, and its metrics.

use std::fmt::Write as _;

use closecall_traffic::Measured;

use crate::run::film::Film;

/// Returns the page in Markdown: the forewords, then the headline and the story of each film, then the table of each
/// film.
pub(super) fn markdown(films: &[Film]) -> String {
    let mut page = String::new();
    for film in films {
        page.push_str(&film.foreword);
    }
    for film in films {
        push_story(&mut page, film);
    }
    for film in films {
        push_table(&mut page, film);
    }
    page
}

/// Appends the headline and the story of a film.
fn push_story(page: &mut String, film: &Film) {
    // Writing to a string cannot fail.
    let _ = write!(page, "### {}\n\n**{}**\n\n", film.title, film.headline());
    if let Some(verdict) = film.mis_summary() {
        let _ = write!(page, "{verdict}\n\n");
    }
    for line in film.story() {
        let mark = if line.is_severe { "**" } else { "" };
        let _ = writeln!(page, "- {mark}{:.2} s: {}{mark}", line.time.s(), line.text);
    }
    page.push('\n');
}

/// Appends the table of a film. Recorded traffic has none.
fn push_table(page: &mut String, film: &Film) {
    let Some(outcome) = &film.outcome else { return };
    let mut row = |name: &str, value: &dyn std::fmt::Display| {
        let _ = writeln!(page, "| {name} | {value} |");
    };
    row("controller", &outcome.controller);
    row("---", &"---");
    row("scenario", &outcome.scenario);
    row("seed, sample", &format_args!("{}, {}", outcome.seed, outcome.sample));
    row("duration", &format_args!("{:.2} s", outcome.duration.s()));
    let margins = &outcome.margins;
    row("smallest front headway", &WithUnit(margins.min_thw_front_s, "s"));
    row("smallest rear headway", &WithUnit(margins.min_thw_rear_s, "s"));
    row("smallest front gap", &WithUnit(margins.min_gap_front_m, "m"));
    row("smallest rear gap", &WithUnit(margins.min_gap_rear_m, "m"));
    row("hardest braking of ego", &format_args!("{:.2} m/s²", margins.max_deceleration_mps2));
    match &outcome.mis {
        Ok(mis) => {
            row("MIS engaged at", &WithUnit(mis.engaged_at_s, "s"));
            row("front headway then", &WithUnit(mis.thw_front_at_engagement_s, "s"));
            row("front headway at the critical distance", &WithUnit(mis.thw_front_at_critical_s, "s"));
            row("mean braking", &WithUnit(mis.mean_deceleration_mps2, "m/s²"));
            row("reason", &mis.reason);
        }
        Err(absent) => row("MIS", absent),
    }
    for (name, value) in outcome.parameters.iter() {
        row(&format!("parameter {name}"), value);
    }
    page.push('\n');
}

/// Displays a value with its unit, or the reason for its absence.
struct WithUnit(Measured, &'static str);

impl std::fmt::Display for WithUnit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Ok(value) => write!(f, "{value:.2} {}", self.1),
            Err(absent) => write!(f, "({absent})"),
        }
    }
}
