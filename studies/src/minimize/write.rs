//! The scenario files of a smallest case and of its twin.

use std::path::{Path, PathBuf};

use closecall_campaign::action::CommandFor;
use closecall_scenarios::{ScenarioFile, Setting, SettingError};
use closecall_traffic::atomic::write_file;
use closecall_traffic::input;
use serde::Serialize;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::Minimized;
use crate::case::{Case, CausesError};

/// Tables and keys that belong to a campaign of many samples, and not to a single case.
const OF_CAMPAIGNS: [&str; 6] = ["parameters", "requirements", "checks", "gate", "expects", "expects-share"];

/// How every file begins that the command writes.
const MADE: &str = "# Made by `closecall minimize`";

/// The files that were written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MinimizedFiles {
    /// The smallest failing case.
    pub failing: PathBuf,
    /// The nearest case that passes.
    pub twin: Option<PathBuf>,
}

/// Returns the files of a smallest case and of its twin: `output`, or else a name made of the
/// scenario and the sample, and beside it a file with `-passes` at the end of its name.
///
/// # Errors
/// [`CausesError::Foreign`] if such a file exists already, and `closecall minimize` has not written
/// it.
pub fn output_files(case: &Case, output: Option<&Path>) -> Result<[PathBuf; 2], CausesError> {
    let usual = || format!("{}-{}.toml", case.file.config().name, case.sample).into();
    let failing = output.map_or_else(usual, Path::to_owned);
    let stem = failing.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let files = [failing.clone(), failing.with_file_name(format!("{stem}-passes.toml"))];
    let is_foreign =
        |path: &&PathBuf| path.exists() && !input::read_text(path).is_ok_and(|text| text.starts_with(MADE));
    match files.iter().find(is_foreign) {
        Some(path) => Err(CausesError::Foreign { path: path.clone() }),
        None => Ok(files),
    }
}

/// Writes the smallest case and its twin.
///
/// # Errors
/// [`CausesError`] if a case is no valid scenario, or a file cannot be written.
pub fn write_files(
    case: &Case,
    minimized: &Minimized,
    [path, twin]: &[PathBuf; 2],
    command_for: CommandFor,
) -> Result<MinimizedFiles, CausesError> {
    let stem = path.file_stem().map_or_else(|| "minimized".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let name = named(&stem);
    let failing = concrete(case, &minimized.settings, &Text { name: &name, minimized, is_twin: false, command_for })?;
    let passing = match &minimized.twin {
        Some(twin) => {
            let name = format!("{name}-passes");
            Some(concrete(case, &twin.settings, &Text { name: &name, minimized, is_twin: true, command_for })?)
        }
        None => None,
    };
    let write = |path: &Path, text: &str| write_file(path, |file| file.write_all(text.as_bytes()));
    write(path, &failing)?;
    if let Some(passing) = &passing {
        write(twin, passing)?;
    }
    Ok(MinimizedFiles { failing: path.clone(), twin: passing.map(|_| twin.clone()) })
}

/// The text of a file about its case.
struct Text<'a> {
    name: &'a str,
    minimized: &'a Minimized,
    is_twin: bool,
    command_for: CommandFor,
}

/// Returns a name of a scenario that is made of the name of a file.
fn named(stem: &str) -> String {
    let is_allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    let text: String = stem.to_lowercase().chars().map(|c| if is_allowed(c) { c } else { '-' }).collect();
    let text = text.trim_matches('-');
    if text.starts_with(|c: char| c.is_ascii_lowercase()) { text.to_owned() } else { format!("case-{text}") }
}

/// Returns the text of a concrete scenario, in which every parameter has its value.
fn concrete(case: &Case, settings: &[String], text: &Text<'_>) -> Result<String, CausesError> {
    let parsed: Vec<Setting> = settings.iter().map(|setting| setting.parse()).collect::<Result<_, SettingError>>()?;
    let file = ScenarioFile::parse(case.file.path(), case.file.text(), &parsed)?;
    let values = file.space().nominal();
    let mut document: DocumentMut = file.text().parse().unwrap_or_default();
    OF_CAMPAIGNS.iter().for_each(|key| drop(document.remove(key)));
    inline(document.as_table_mut(), &|name| {
        let name = closecall_traffic::ParameterName::new(name)?;
        Some(match values.get(&name)? {
            closecall_traffic::Value::Number(number) => Value::from(*number),
            closecall_traffic::Value::Label(label) => Value::from(label.as_str()),
        })
    });
    let minimized = text.minimized;
    document.insert("name", Item::Value(text.name.into()));
    document.insert("description", Item::Value(sentence(text).into()));
    let kind = if text.is_twin { "passes" } else { "fails" };
    document.insert("tags", Item::Value(Value::Array(Array::from_iter(["regression", kind]))));
    let random = InlineTable::from_iter([("seed", number(minimized.seed)), ("sample", number(minimized.sample))]);
    document.insert("random-numbers", Item::Value(Value::InlineTable(random)));
    if let Some(sensors) = document.entry("sensors").or_insert(Item::Table(Table::new())).as_table_like_mut() {
        sensors.insert("mode", Item::Value(minimized.sensors.as_str().into()));
    }
    // A campaign that names no controller judges by the gate. Without the gate, it would drive with
    // another controller than this case needs.
    if minimized.is_default() {
        document.insert("gate", Item::Table(gate(case, text)));
    }
    let written = format!("{}{document}", heading(text));
    // The file must be a scenario. A mistake shows here, and not when the file is run.
    ScenarioFile::parse(Path::new(text.name), &written, &[])?.check()?;
    Ok(written)
}

/// Returns the gate that holds a case to its outcome.
fn gate(case: &Case, text: &Text<'_>) -> Table {
    let collision = &text.minimized.collision;
    let (ego, least) = if text.is_twin {
        ("count(ego_collided) <= 0", "count(others_collided) <= 0")
    } else {
        let mut parties = [&collision.striking, &collision.struck].into_iter();
        let involves_ego = parties.any(|party| Some(&party.actor) == case.file.ego_id());
        if involves_ego { ("count(ego_collided) >= 1", "") } else { ("count(others_collided) >= 1", "") }
    };
    let require = Array::from_iter([ego, least].into_iter().filter(|text| !text.is_empty()));
    let mut gate = Table::new();
    gate.insert("require", Item::Value(Value::Array(require)));
    gate
}

/// Returns a seed or the number of a sample. TOML has no number above the largest signed one. Such
/// a seed is written as text, which the check below refuses with a message.
fn number(value: u64) -> Value {
    i64::try_from(value).map_or_else(|_| Value::from(value.to_string()), Value::from)
}

fn sentence(text: &Text<'_>) -> String {
    let twin = text.minimized.twin.as_ref();
    match (text.is_twin, twin) {
        (false, _) if text.minimized.nearest.is_some() => {
            let distance_sd = text.minimized.distance_sd.unwrap_or_default();
            let nearest = "The nearest failure that a search has found";
            format!(
                "{} {nearest}: {distance_sd:.2} standard deviations from the nominal case.",
                text.minimized.sentence
            )
        }
        (true, Some(twin)) => format!("Passes when {}. Otherwise: {}", twin.words, text.minimized.sentence),
        _ => match &text.minimized.reference {
            Some(reference) => format!("{} No vehicle collides with {reference}.", text.minimized.sentence),
            None => text.minimized.sentence.clone(),
        },
    }
}

fn heading(text: &Text<'_>) -> String {
    let minimized = text.minimized;
    format!(
        "{MADE} from sample {} of `{}`, seed {}.\n# {}\n# Run: {}\n",
        minimized.sample,
        minimized.scenario,
        minimized.seed,
        sentence(text),
        minimized.run_command("FILE", text.command_for),
    )
}

/// Replaces every `"$name"` by the value of the parameter.
fn inline(table: &mut dyn TableLike, value: &dyn Fn(&str) -> Option<Value>) {
    for (_, item) in table.iter_mut() {
        match item {
            Item::Value(inner) => inline_value(inner, value),
            Item::Table(inner) => inline(inner, value),
            Item::ArrayOfTables(tables) => tables.iter_mut().for_each(|inner| inline(inner, value)),
            Item::None => {}
        }
    }
}

fn inline_value(item: &mut Value, value: &dyn Fn(&str) -> Option<Value>) {
    match item {
        Value::String(text) => {
            if let Some(minimized) = text.value().strip_prefix('$').and_then(value) {
                let decor = item.decor().clone();
                *item = minimized;
                *item.decor_mut() = decor;
            }
        }
        Value::Array(values) => values.iter_mut().for_each(|inner| inline_value(inner, value)),
        Value::InlineTable(inner) => inline(inner, value),
        _ => {}
    }
}
