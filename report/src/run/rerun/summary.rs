//! The texts of a recording: the verdict, which is read first, and the story with the table of each
//! run.

use std::fmt::Write as _;

use closecall_traffic::{Measured, Time};

use crate::escape::plain_underscores;
use crate::run::film::{Film, fate_word, headway_text};
use closecall_campaign::ledger::PairFate;
use closecall_scenarios::causal::{CausalSentence, LETTERS};

/// Returns the verdict in Markdown: the event, how close it was, and the actions of the system.
pub(super) fn verdict(films: &[Film]) -> String {
    let mut page = String::new();
    match (films, Film::pair_fate(films)) {
        ([baseline, tested], Some(fate)) => push_pair(&mut page, [baseline, tested], fate),
        _ => {
            for film in films {
                page.push_str(&film.foreword);
            }
            for film in films.iter().filter(|film| film.outcome.is_some() || films.len() == 1) {
                push_single(&mut page, film, films.len() > 1);
            }
        }
    }
    strong(&page)
}

/// Returns a page with all its text in the viewer's strong colour. The usual text of its light
/// theme has a contrast of 3.97 : 1 only.
fn strong(page: &str) -> String {
    let line = |line: &str| match line.split_once(' ') {
        _ if line.is_empty() || line.starts_with('#') || line.starts_with("| ---") => line.to_owned(),
        Some(("|", cells)) => {
            let cells = cells.trim_end_matches('|').split(" | ").map(|cell| format!("| **{}** ", cell.trim()));
            format!("{}|", cells.collect::<String>())
        }
        Some(("-", text)) => format!("- **{}**", text.replace("**", "").trim()),
        _ => format!("**{}**", line.replace("**", "").trim()),
    };
    page.lines().map(|text| line(&plain_underscores(text)) + "\n").collect()
}

/// Returns the story in Markdown: the events of each film, the table of each film, and the key of
/// the letters.
pub(super) fn story(films: &[Film]) -> String {
    let mut page = String::new();
    for film in films {
        push_story(&mut page, film);
    }
    for film in films {
        push_table(&mut page, film);
    }
    if films.iter().any(|film| film.outcome.is_some()) {
        // Writing to a string cannot fail.
        let _ = writeln!(page, "\n{LETTERS}.");
    }
    strong(&page)
}

/// Appends the verdict on a pair.
fn push_pair(page: &mut String, films: [&Film; 2], fate: PairFate) {
    let [baseline, tested] = films;
    push_head(page, fate_word(fate), tested);
    // Writing to a string cannot fail.
    let [without, with] = [baseline, tested].map(Film::sentence);
    let happened = |told: &Option<CausalSentence<'_>>| told.as_ref().map_or_else(String::new, CausalSentence::happened);
    let is_same = happened(&without) == happened(&with);
    // Where no MIS is judged, the emergency brake is: the sentence about the arm under test ends
    // with it.
    let has_no_mis = tested.outcome.as_ref().is_some_and(|outcome| outcome.mis.is_err());
    let braked = without.as_ref().filter(|_| has_no_mis).and_then(CausalSentence::emergency_braking);
    let braked = braked.map_or_else(String::new, |braked| format!("; {braked}"));
    let _ = writeln!(page, "- **{}:** {}{braked}", baseline.arm_label(), happened(&without));
    let reason = with.as_ref().map_or_else(String::new, CausalSentence::reason);
    let in_tested = if is_same { "the same".to_owned() } else { happened(&with) };
    let _ = writeln!(page, "- **{}:** {in_tested}; {reason}", tested.arm_label());
    if let Some(line) = tested.headways_and_sight(Some(baseline)) {
        let _ = writeln!(page, "- {line}");
    }
}

/// Appends the verdict in one word, with the sample.
fn push_head(page: &mut String, word: &str, film: &Film) {
    let sample = film.outcome.as_ref().map_or_else(String::new, |outcome| {
        let conditions = conditions(film, quoted);
        format!(" · {} · seed {} · sample {}{conditions}", outcome.scenario, outcome.seed, outcome.sample)
    });
    // Writing to a string cannot fail.
    let _ = write!(page, "**{word}**{sample}\n\n");
}

/// The end of a note about a metric that is not critical.
const NOT_CRITICAL: &str = ": not critical";

/// Appends the verdict on one film. The verdict of a re-enactment lies below the comparison with
/// the recorded encounter.
fn push_single(page: &mut String, film: &Film, is_reenactment: bool) {
    // What is critical is read first.
    let is_critical = |note: &&(Time, String)| note.1.contains(": CRITICAL");
    let word = match (&film.outcome, film.worst_collision()) {
        (None, _) if film.notes.iter().any(|note| is_critical(&note)) => "CRITICAL · recorded traffic",
        (None, _) => "Recorded traffic",
        (Some(_), Some(_)) => "COLLISION",
        (Some(_), None) => "NO COLLISION",
    };
    if film.foreword.is_empty() && !is_reenactment {
        push_head(page, word, film);
    }
    match film.sentence() {
        // The comparison has it, and the actions of the system.
        Some(_) if is_reenactment => {
            push_head(page, "Simulated", film);
        }
        Some(sentence) => {
            let _ = writeln!(page, "- **{}:** {sentence}", film.arm_label());
            if let Some(line) = film.headways_and_sight(None) {
                let _ = writeln!(page, "- {line}");
            }
        }
        None => {
            let _ = write!(page, "**{}**\n\n", film.title);
            for (time, note) in film.notes.iter().filter(is_critical) {
                let _ = writeln!(page, "- {:.2} s: {note}", time.s());
            }
            // Each other fact takes one line, and the verdict fits its view. The log has each fact
            // in full.
            let rest = || film.notes.iter().filter(|note| !is_critical(note));
            let happened = rest().filter(|note| !note.1.contains(NOT_CRITICAL));
            let happened: Vec<String> = happened.map(|(time, note)| format!("{:.2} s: {note}", time.s())).collect();
            let measured: Vec<&str> = rest().filter_map(|note| Some(note.1.split_once(NOT_CRITICAL)?.0)).collect();
            for (name, parts) in [("", happened.join("; ")), ("not critical: ", measured.join(", "))] {
                if !parts.is_empty() {
                    let _ = writeln!(page, "- {name}{parts}");
                }
            }
        }
    }
}

/// Letters of the longest setting that the verdict quotes in full. The distributions of `--fitted`
/// are settings of several hundred letters.
const QUOTED_LETTERS: usize = 48;

/// Returns a setting as the verdict quotes it: the value of a long one is left to the story.
fn quoted(setting: &str) -> String {
    match setting.split_once('=') {
        Some((key, _)) if setting.chars().count() > QUOTED_LETTERS => format!("{key}=…"),
        _ => setting.to_owned(),
    }
}

/// Returns the weather and the settings of the command line, each as `shown` writes it.
fn conditions(film: &Film, shown: impl Fn(&str) -> String) -> String {
    let mut text = film.weather().map_or(String::new(), |weather| format!(" · {weather}"));
    for setting in &film.settings {
        let _ = write!(text, " · with `{}`", shown(setting));
    }
    text
}

/// Appends the headline and the story of a film.
fn push_story(page: &mut String, film: &Film) {
    let (arm, conditions) = (film.arm_label(), conditions(film, str::to_owned));
    let _ = write!(page, "### {arm}: {}{conditions}\n\n**{}**\n\n", film.title, film.headline());
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
    row("smallest front headway", &Headway(margins.min_thw_front_s));
    row("smallest rear headway", &Headway(margins.min_thw_rear_s));
    row("smallest front gap", &WithUnit(margins.min_gap_front_m, "m"));
    row("smallest rear gap", &WithUnit(margins.min_gap_rear_m, "m"));
    row("hardest braking of ego", &format_args!("{:.2} m/s²", margins.max_deceleration_mps2));
    match &outcome.mis {
        Ok(mis) => {
            row("MIS engaged at", &WithUnit(mis.engaged_at_s, "s"));
            row("front headway then", &WithUnit(mis.thw_front_at_engagement_s, "s"));
            row("front headway at the critical distance", &WithUnit(mis.thw_front_at_critical_s, "s"));
            row("mean braking", &WithUnit(mis.mean_deceleration_mps2, "m/s²"));
            row("reason", &mis.reason_words());
        }
        Err(absent) => row("MIS", absent),
    }
    for (name, value) in outcome.parameters.iter() {
        row(&format!("parameter {name}"), &value.readable());
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

/// Displays a headway, or the reason for its absence.
struct Headway(Measured);

impl std::fmt::Display for Headway {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            Ok(thw_s) => f.write_str(&headway_text(thw_s)),
            Err(absent) => write!(f, "({absent})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_quotes_short_settings_and_names_the_keys_of_long_ones() {
        assert_eq!(quoted("environment.visibility-m=60"), "environment.visibility-m=60");
        let fitted = "parameters.closing-mps={ empirical = { quantiles = [0.101, 0.247] }, note = \"us101.toml\" }";
        assert_eq!(quoted(fitted), "parameters.closing-mps=…");
    }
}
