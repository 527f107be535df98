//! `closecall list`: the scenario library, which is part of the program.

use clap::Args;
use closecall_report::json::stamped;
use closecall_scenarios::library::{LibraryEntry, entries};
use closecall_scenarios::member;
use serde_json::json;

use super::CliError;
use super::args::Format;
use super::help::{examples, heading};
use super::output::{outln, print_text, textln};
use super::terminal::{cut, output_columns};
use crate::exit_code::ExitCode;

/// The names of the groups that `closecall list` does not list one by one.
const FAULTS: &str = "faults";
const MEMBERS: &str = "members";
/// Least width of a question beside the name of its scenario (columns). In a narrower terminal the
/// question is left out.
const LEAST_QUESTION: usize = 30;
/// The tag of a scenario that injects a fault.
const FAULT_TAG: &str = "fault";
/// The tag of a scenario that repeats another one without its hazard, and is named after it.
const TWIN_TAG: &str = "twin";
/// The tags of scenarios about other functions than the margin increase system.
const OTHER_FUNCTIONS: [&str; 2] = ["acc", "aeb"];

/// Arguments of `closecall list`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall list",
    "closecall list headline",
    "closecall list --format json > library.json",
]))]
pub(super) struct ListArgs {
    /// Describe these scenarios in full: part of their names, one of their tags or requirements, in
    /// any case, `faults`, or the `members` of the driver ensemble [default: the scenarios without a
    /// fault, a line each]
    what: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t, help_heading = heading::OUTPUT)]
    format: Format,
}

pub(super) fn list(args: &ListArgs) -> Result<ExitCode, CliError> {
    let (listed, members) = (entries()?, member::entries()?);
    let wanted = args.what.as_deref().map(str::to_lowercase);
    match (args.format, wanted.as_deref()) {
        (Format::Json, _) => outln!("{:#}", stamped(json!({ "scenarios": listed, "members": members }), None, None)),
        (Format::Human, None) => Overview::of(&listed).print(),
        (Format::Human, Some(MEMBERS)) => {
            members.iter().for_each(|member| print_text(format_args!("{}\n", member.to_string().trim_end())));
            textln!("\nAn ensemble takes such a name: `closecall campaign SCENARIO --ensemble NAME`.");
        }
        (Format::Human, Some(what)) => {
            let is_meant = |entry: &&LibraryEntry| match what {
                FAULTS => is_fault(entry),
                _ => {
                    let mut words = entry.tags.iter().chain(&entry.requirements);
                    entry.name.contains(what) || words.any(|word| word.to_lowercase() == what)
                }
            };
            let meant: Vec<&LibraryEntry> = listed.iter().filter(is_meant).collect();
            if meant.is_empty() && members.iter().any(|member| member.name == what) {
                let said =
                    format!("`{what}` is a member of the driver ensemble: `closecall list {MEMBERS}` describes it");
                return Err(CliError::usage(said));
            }
            if meant.is_empty() {
                return Err(CliError::usage(format!(
                    "no scenario has `{what}` in its name, as a tag or as a requirement: `closecall list` names all, `{FAULTS}` and `{MEMBERS}` are groups"
                )));
            }
            meant.into_iter().for_each(|scenario| print_text(format_args!("{}\n", scenario)));
        }
    }
    Ok(ExitCode::Pass)
}

fn has_tag(scenario: &LibraryEntry, tag: &str) -> bool {
    scenario.tags.iter().any(|own| own == tag)
}

fn is_fault(scenario: &LibraryEntry) -> bool {
    has_tag(scenario, FAULT_TAG)
}

/// The overview of the library. It fits a terminal of 24 rows with its prompt.
struct Overview<'a> {
    /// The scenarios of the margin increase system without a fault. A twin is named beside its scenario: *ramp-merges
    /// [-without-merge]*.
    rows: Vec<(String, &'a LibraryEntry)>,
    /// How to list the others.
    notes: Vec<String>,
}

impl<'a> Overview<'a> {
    fn of(listed: &'a [LibraryEntry]) -> Self {
        let (faults, plain): (Vec<&LibraryEntry>, Vec<&LibraryEntry>) =
            listed.iter().partition(|entry| is_fault(entry));
        let is_of_other = |entry: &&LibraryEntry| OTHER_FUNCTIONS.iter().any(|tag| has_tag(entry, tag));
        let (others, plain): (Vec<&LibraryEntry>, Vec<&LibraryEntry>) = plain.into_iter().partition(is_of_other);
        // What a twin adds to the name of a scenario.
        let added = |twin: &LibraryEntry, scenario: &LibraryEntry| -> Option<&'static str> {
            let is_pair = has_tag(twin, TWIN_TAG) && !has_tag(scenario, TWIN_TAG);
            twin.name.strip_prefix(scenario.name).filter(|added| is_pair && added.starts_with('-'))
        };
        let is_beside = |entry: &LibraryEntry| plain.iter().any(|scenario| added(entry, scenario).is_some());
        let name = |scenario: &LibraryEntry| match plain.iter().find_map(|twin| added(twin, scenario)) {
            Some(added) => format!("{} [{added}]", scenario.name),
            None => scenario.name.to_owned(),
        };
        let rows = plain.iter().filter(|entry| !is_beside(entry)).map(|entry| (name(entry), *entry)).collect();
        let others: Vec<&str> = others.iter().map(|entry| entry.name).collect();
        let notes = vec![
            format!("Other functions of the ego: {}", others.join(", ")),
            format!("[-…]: twin without the hazard. {} inject a fault: `closecall list {FAULTS}`.", faults.len()),
            format!("One in full: `closecall list NAME`. Drivers: `closecall list {MEMBERS}`."),
        ];
        Self { rows, notes }
    }

    fn print(&self) {
        let width = self.rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        let has_room = output_columns().is_none_or(|columns| columns >= width + LEAST_QUESTION);
        for (name, scenario) in &self.rows {
            let question = scenario.question.replace("the margin increase system", "the MIS");
            let line = if has_room { format!("{name:width$}  {question}") } else { name.clone() };
            outln!("{}", cut(&line));
        }
        self.notes.iter().for_each(|note| print_text(format_args!("{note}\n")));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns and rows of a terminal. The prompt takes one row.
    const TERMINAL: [usize; 2] = [80, 24];

    #[test]
    fn the_overview_fits_a_terminal_and_names_every_scenario_without_a_fault() {
        let listed = entries().unwrap();
        let overview = Overview::of(&listed);
        let [columns, rows] = TERMINAL;
        // A note that is wrapped has an indentation of two columns.
        let of_notes: usize = overview.notes.iter().map(|note| note.chars().count().div_ceil(columns - 2)).sum();
        assert!(overview.rows.len() + of_notes < rows, "{} and {of_notes} rows", overview.rows.len());
        assert!(overview.rows.iter().all(|(name, _)| name.len() + LEAST_QUESTION <= columns), "room for the questions");
        let mut named: Vec<String> = Vec::new();
        for (name, scenario) in &overview.rows {
            let added = name.split_once(" [").map(|(_, added)| added.trim_end_matches(']'));
            named.push(scenario.name.to_owned());
            named.extend(added.map(|added| format!("{}{added}", scenario.name)));
        }
        let (_, others) = overview.notes[0].split_once(": ").unwrap();
        named.extend(others.split(", ").map(str::to_owned));
        let mut all: Vec<String> =
            listed.iter().filter(|entry| !is_fault(entry)).map(|entry| entry.name.to_owned()).collect();
        named.sort();
        all.sort();
        assert_eq!(named, all);
        // A scenario that begins like another one is no twin of it.
        assert!(overview.rows.iter().any(|(name, _)| name == "low-thw-overtake-at-cut-out"));
    }
}
