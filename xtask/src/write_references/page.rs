//! The page: its introduction, and a section for each table.

use std::error::Error;
use std::fmt::Write;

use closecall::scenarios::ScenarioConfig;
use serde_json::Value;

use super::probe::Probe;
use super::schema::{Key, Kind, Step, Table, Way, tables};
use super::text::Described;

/// Number of places of a table above which its heading leaves out the last ones.
const MOST_TITLES: usize = 3;
/// The defaults of the object-level sensors: of the front radar, the surround sensors and the rear
/// object-level sensor. A sensor without a default does not have the property.
pub(crate) const SENSOR_DEFAULTS: [(&str, [Option<f64>; 3]); 13] = [
    ("range-m", [Some(150.0), Some(14.0), Some(128.8)]),
    ("half-angle-deg", [Some(45.0), None, Some(66.5)]),
    ("range-sd-m", [Some(0.1), Some(0.1), None]),
    ("lateral-sd-m", [Some(0.3), Some(0.15), None]),
    ("drift-sd-m", [Some(0.1), Some(0.05), None]),
    ("drift-time-s", [Some(1.0), Some(1.0), None]),
    ("speed-sd-mps", [Some(0.1), None, None]),
    ("latency-s", [Some(0.08), Some(0.04), Some(0.08)]),
    ("dropout", [Some(0.02), Some(0.02), None]),
    ("confirm-hits", [Some(3.0), Some(2.0), Some(3.0)]),
    ("confirm-window", [Some(5.0), Some(4.0), Some(5.0)]),
    ("coast-s", [Some(0.6), Some(0.3), Some(1.0)]),
    ("class-confidence", [Some(0.97), Some(0.97), Some(0.997)]),
];

const INTRODUCTION: &str = "\
# The scenario file

This page lists every table and key of the scenario file, as `cargo run --release -p closecall-xtask -- write-references`
writes them from the program. [annotated.toml](scenario/annotated.toml) is an example with comments, and
[every-key.toml](scenario/every-key.toml) uses every key. The [glossary](glossary.md) explains the terms.
";

const READING: &str = "
## How to read the tables

- A scenario file is TOML. Keys are in kebab case, and an unknown key is an error. `closecall check FILE` names the line, the
  key, the value and what is allowed. An editor can complete and check the file with the JSON Schema of `closecall tool schema`.
- The end of a key is its unit: `gap-m` is in metres, `speed-mps` in metres per second.
- *number* is a finite number, or `\"$name\"`: the value of the parameter `name` in [`[parameters]`](#parameters-NAME).
  Only parameters are sampled. A *fixed number* cannot be a parameter. *word* is one of the words below the table, or
  `\"$name\"` where the table says so. *flag* is `true` or `false`.
- *Default* is the value of an absent key. A *required* key has no default. `-` means that an absent key has no effect, or
  that the text says what holds.
- `--set` changes a value by the path in the heading of its section. The name of a parameter alone fixes the parameter:
  `--set brake-mps2=6`. After the key of a list comes an element: its `id` or `name`, or its index, from 0:
  `--set actor.rear.start.behind.gap-m=90`, `--set actor[2].start.behind.gap-m=90`. A whole list is a value of TOML, which
  also gives a list that the file leaves out: `--set 'sensors.additional-rear-cameras=[{ name = \"left\", yaw-deg = 40 }]'`.

";

/// Returns the text of the page.
pub(crate) fn scenario_page() -> Result<String, Box<dyn Error>> {
    let probe = Probe::new()?;
    let schema = schemars::schema_for!(ScenarioConfig);
    let tables = tables(schema.as_value(), &|key| probe.position(key));
    let mut page = format!("{INTRODUCTION}{READING}");
    for table in &tables {
        section(&mut page, table, &tables, &probe)?;
    }
    Ok(page)
}

fn section(page: &mut String, table: &Table, all: &[Table], probe: &Probe) -> Result<(), Box<dyn Error>> {
    let mut titles: Vec<String> = table.ways.iter().map(|way| format!("`{}`", title(way))).collect();
    if titles.len() > MOST_TITLES {
        titles.truncate(MOST_TITLES - 1);
        titles.push("…".to_owned());
    }
    let way = &table.ways[0];
    writeln!(page, "\n<a id=\"{}\"></a>\n\n### {}\n", anchor(way), titles.join(", "))?;
    let Described { meaning, .. } = Described::new("", &table.description, false);
    if !meaning.is_empty() {
        writeln!(page, "{meaning}\n")?;
    }
    if table.is_choice {
        writeln!(page, "Exactly one of these keys is given.\n\n| key | value | meaning |\n|---|---|---|")?;
    } else {
        writeln!(page, "| key | value | default | meaning |\n|---|---|---|---|")?;
    }
    for key in &table.keys {
        row(page, table, key, all, probe)?;
    }
    words(page, table)
}

fn row(page: &mut String, table: &Table, key: &Key, all: &[Table], probe: &Probe) -> Result<(), Box<dyn Error>> {
    let is_number = !table.is_choice && matches!(key.kind, Kind::Number { .. } | Kind::Either(_));
    let described = Described::new(&key.name, &key.description, is_number);
    let inner: Vec<Way> = table.ways.iter().map(|way| with(way, Step::Key(key.name.clone()))).collect();
    let given = inner.iter().flat_map(|way| probe.values(way)).next();
    let value = value(key, &inner, all, probe);
    let meaning = without_bounds(&described.meaning, &value).replace('|', "\\|");
    if table.is_choice {
        writeln!(page, "| `{}` | {value} | {meaning} |", key.name)?;
        return Ok(());
    }
    let value = described.unit.map_or(value.clone(), |unit| format!("{value} ({unit})"));
    let example = match given {
        Some((_, example)) if is_list(&key.kind) => format!(" Example: `{example}`."),
        _ => String::new(),
    };
    writeln!(page, "| `{}` | {value} | {} | {meaning}{example} |", key.name, default(key, described.default))?;
    Ok(())
}

/// Leaves the bounds of a value out of the meaning of its key: the column of the value has them.
fn without_bounds(meaning: &str, value: &str) -> String {
    let Some((_, bounds)) = value.split_once(", ") else { return meaning.to_owned() };
    let stated = [format!(": {bounds}"), format!(", {bounds}"), format!(" ({bounds})")];
    stated.iter().fold(meaning.to_owned(), |meaning, bounds| meaning.replacen(bounds, "", 1))
}

/// The kind of a key's value, and the allowed values. `ways` are all of its places.
fn value(key: &Key, ways: &[Way], all: &[Table], probe: &Probe) -> String {
    let way = &ways[0];
    let range = |is_whole| {
        let mut values = ways.iter().flat_map(|way| probe.values(way));
        let leaf = values.find(|(_, value)| !value.is_array() && !value.is_table());
        leaf.and_then(|(at, _)| probe.allowed(&at, is_whole))
    };
    let ranged = |name: String, range: Option<String>| range.map_or(name.clone(), |range| format!("{name}, {range}"));
    match &key.kind {
        Kind::Number { .. } | Kind::Whole => ranged(name(&key.kind), range(key.kind == Kind::Whole)),
        Kind::Table | Kind::Map(_) => {
            link(way, all).map_or(name(&key.kind), |link| format!("[{}]({link})", name(&key.kind)))
        }
        Kind::List(element) => match (&**element, link(way, all)) {
            (Kind::Table, Some(link)) => format!("[list of tables]({link})"),
            _ => name(&key.kind),
        },
        Kind::Either(kinds) => {
            let names: Vec<String> = kinds
                .iter()
                .map(|kind| match (kind, link(way, all)) {
                    (Kind::Table, Some(link)) => format!("[table]({link})"),
                    (Kind::Number { .. }, _) => ranged(name(kind), range(false)),
                    _ => name(kind),
                })
                .collect();
            names.join(", or ")
        }
        kind => name(kind),
    }
}

fn name(kind: &Kind) -> String {
    match kind {
        Kind::Number { sampled: true } => "number".to_owned(),
        Kind::Number { sampled: false } => "fixed number".to_owned(),
        Kind::Whole => "whole number".to_owned(),
        Kind::Flag => "flag".to_owned(),
        Kind::Text => "text".to_owned(),
        Kind::Word { sampled: true, .. } => "word or `\"$name\"`".to_owned(),
        Kind::Word { sampled: false, .. } => "word".to_owned(),
        Kind::List(element) | Kind::Tuple(element, _) if **element == Kind::Table => "list of tables".to_owned(),
        Kind::List(element) if matches!(**element, Kind::Tuple(_, 2)) => "list of pairs of numbers".to_owned(),
        Kind::List(element) => format!("list of {}", plural(element)),
        Kind::Tuple(element, length) => format!("list of {length} {}", plural(element)),
        Kind::Table => "table".to_owned(),
        Kind::Map(element) => format!("table of {}", plural(element)),
        Kind::Either(kinds) => kinds.iter().map(name).collect::<Vec<_>>().join(", or "),
    }
}

fn plural(kind: &Kind) -> String {
    match kind {
        Kind::List(element) => format!("lists of {}", plural(element)),
        Kind::Tuple(element, length) => format!("lists of {length} {}", plural(element)),
        kind => format!("{}s", name(kind)),
    }
}

/// The default of a key, from its doc comment or from the schema.
fn default(key: &Key, stated: Option<String>) -> String {
    if key.required {
        return "required".to_owned();
    }
    let of_sensors = SENSOR_DEFAULTS.iter().find(|(name, _)| is_sensor_key(key, name));
    if let (None, Some((_, values))) = (&stated, of_sensors) {
        return values.map(|value| value.map_or("-".to_owned(), |value| value.to_string())).join(" / ");
    }
    match (&key.default, stated) {
        (_, Some(stated)) => stated,
        (Some(Value::String(word)), None) if word.is_empty() => "empty".to_owned(),
        (Some(Value::String(word)), None) => format!("`{word}`"),
        (Some(Value::Array(list)), None) if list.is_empty() => "none".to_owned(),
        (Some(Value::Object(map)), None) if map.is_empty() => "none".to_owned(),
        (Some(Value::Object(_)), None) => "its defaults".to_owned(),
        (Some(value), None) => value.to_string().trim_end_matches(".0").to_owned(),
        (None, None) => "-".to_owned(),
    }
}

/// True if `key` is the key `name` of an object-level sensor: only there such keys have no default
/// in the schema.
fn is_sensor_key(key: &Key, name: &str) -> bool {
    key.name == name && key.default.is_none()
}

/// True if the value has several parts, whose form an example shows.
fn is_list(kind: &Kind) -> bool {
    match kind {
        Kind::List(element) | Kind::Map(element) => **element != Kind::Table,
        kind => matches!(kind, Kind::Tuple(..)),
    }
}

/// The words of a table, each with its meaning.
fn words(page: &mut String, table: &Table) -> Result<(), Box<dyn Error>> {
    for key in &table.keys {
        let Kind::Word { words, .. } = &key.kind else { continue };
        writeln!(page, "\nWords of `{}`:\n", key.name)?;
        for (word, description) in words {
            writeln!(page, "- `{word}`: {description}")?;
        }
    }
    Ok(())
}

/// The anchor of the table at `way`, or of the first table below it.
fn link(way: &Way, all: &[Table]) -> Option<String> {
    let depth = |table: &&Table| table.ways.iter().filter(|way_in| way_in.starts_with(way)).map(Vec::len).min();
    let nearest = all.iter().filter(|table| depth(table).is_some()).min_by_key(depth)?;
    Some(format!("#{}", anchor(&nearest.ways[0])))
}

fn with(way: &Way, step: Step) -> Way {
    way.iter().cloned().chain([step]).collect()
}

fn parts(way: &Way) -> Vec<&str> {
    way.iter()
        .filter_map(|step| match step {
            Step::Element => None,
            Step::Name => Some("NAME"),
            Step::Key(key) => Some(key.as_str()),
        })
        .collect()
}

/// The path as a file writes it.
pub(crate) fn title(way: &Way) -> String {
    match &way[..] {
        [] => "top level".to_owned(),
        [Step::Key(key)] => format!("[{key}]"),
        [Step::Key(key), Step::Element] => format!("[[{key}]]"),
        [Step::Key(key), Step::Name] => format!("[{key}.NAME]"),
        [Step::Key(table), Step::Element, Step::Key(key), Step::Element] => format!("[[{table}.{key}]]"),
        _ => parts(way).join("."),
    }
}

fn anchor(way: &Way) -> String {
    if way.is_empty() { "top-level".to_owned() } else { parts(way).join("-") }
}
