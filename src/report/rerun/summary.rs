//! What the run was and how it ended, as a page of text.

use std::fmt::Write as _;

use closecall_traffic::Measured;

use super::film::Film;
use super::log::collision_text;

/// The page, in Markdown.
pub(super) fn markdown(film: &Film<'_>) -> String {
    let outcome = film.outcome;
    let mut page = format!("# {}\n\n**{}**\n\n", film.title, verdict(film));
    let mut row = |name: &str, value: &dyn std::fmt::Display| {
        // Writing to a string cannot fail.
        let _ = writeln!(page, "| {name} | {value} |");
    };
    row("scenario", &outcome.scenario);
    row("---", &"---");
    row("controller", &outcome.controller);
    row("seed, sample", &format_args!("{}, {}", outcome.seed, outcome.sample));
    row("duration", &format_args!("{:.2} s", outcome.duration.s()));
    let margins = &outcome.margins;
    row("smallest front headway", &Shown(margins.min_thw_front_s, "s"));
    row("smallest rear headway", &Shown(margins.min_thw_rear_s, "s"));
    row("smallest front gap", &Shown(margins.min_gap_front_m, "m"));
    row("smallest rear gap", &Shown(margins.min_gap_rear_m, "m"));
    row("hardest braking of ego", &format_args!("{:.2} m/s²", margins.max_deceleration_mps2));
    match &outcome.mis {
        Ok(mis) => {
            row("MIS engaged at", &Shown(mis.engaged_at_s, "s"));
            row("front headway then", &Shown(mis.thw_front_at_engagement_s, "s"));
            row("front headway at the critical distance", &Shown(mis.thw_front_at_critical_s, "s"));
            row("mean braking", &Shown(mis.mean_deceleration_mps2, "m/s²"));
            row("reason", &mis.reason);
        }
        Err(absent) => row("MIS", absent),
    }
    page.push_str("\n| parameter | value |\n| --- | --- |\n");
    for (name, value) in outcome.parameters.iter() {
        let _ = writeln!(page, "| {name} | {value} |");
    }
    page
}

fn verdict(film: &Film<'_>) -> String {
    let collisions = &film.outcome.collisions;
    if collisions.is_empty() {
        return "No collision.".to_owned();
    }
    let texts: Vec<String> =
        collisions.iter().map(|collision| format!("{}: {}.", collision.time, collision_text(collision))).collect();
    texts.join("\n\n")
}

/// A value with its unit, or why there is none.
struct Shown(Measured, &'static str);

impl std::fmt::Display for Shown {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Ok(value) => write!(f, "{value:.2} {}", self.1),
            Err(absent) => write!(f, "({absent})"),
        }
    }
}
