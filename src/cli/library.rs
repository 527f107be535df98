//! `closecall list`: the scenario library, which is part of the program.

use clap::Args;
use closecall_report::json::stamped;
use closecall_scenarios::library::{LibraryEntry, entries};
use closecall_scenarios::member;
use serde_json::json;

use super::CliError;
use super::args::Format;
use super::help::{examples, heading};
use super::output::{outln, print_text};
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

/// Arguments of `closecall list`.
#[derive(Debug, Args)]
#[command(after_help = examples([
    "closecall list",
    "closecall list headline",
    "closecall list --format json > library.json",
]))]
pub(super) struct ListArgs {
    /// Describe these scenarios in full: part of their names, one of their tags or requirements, in
    /// any case, `faults`, or the `members` of the driver ensemble [default: a line for each scenario
    /// without a fault]
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
        (Format::Human, None) => {
            overview(&listed, &members.iter().map(|member| member.name.as_str()).collect::<Vec<_>>())
        }
        (Format::Human, Some(MEMBERS)) => {
            members.iter().for_each(|member| print_text(format_args!("{}\n", member.to_string().trim_end())));
            outln!("\nAn ensemble takes such a name: `closecall campaign SCENARIO --ensemble NAME`.");
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

fn is_fault(scenario: &LibraryEntry) -> bool {
    scenario.tags.iter().any(|tag| tag == FAULT_TAG)
}

/// Prints a line for each scenario without a fault, and how many others there are.
fn overview(listed: &[LibraryEntry], members: &[&str]) {
    let (faults, plain): (Vec<&LibraryEntry>, Vec<&LibraryEntry>) = listed.iter().partition(|entry| is_fault(entry));
    let width = plain.iter().map(|scenario| scenario.name.len()).max().unwrap_or(0);
    let has_room = output_columns().is_none_or(|columns| columns >= width + LEAST_QUESTION);
    for scenario in &plain {
        let question = scenario.question.replace("the margin increase system", "the MIS");
        let line = if has_room { format!("{:width$}  {question}", scenario.name) } else { scenario.name.to_owned() };
        outln!("{}", cut(&line));
    }
    print_text(format_args!(
        "{} more inject a fault: `closecall list {FAULTS}`. `closecall list NAME` describes one in full.\n",
        faults.len()
    ));
    print_text(format_args!("Members of the driver ensemble (`closecall list {MEMBERS}`): {}\n", members.join(", ")));
    print_text(format_args!(
        "A command takes a name in place of a file: `closecall run {}`. `closecall new NAME --from LIBRARY_NAME` writes a copy.\n",
        plain.first().map_or("paper-figure", |first| first.name)
    ));
}
