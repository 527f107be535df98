//! The JSON Schema of scenario files, with the ranges that the check of a scenario applies.
//!
//! The types give the keys and words. The ranges come from the checks themselves: a scenario that
//! uses every key is changed in one number at a time, far beyond any range, and the check answers
//! with the range that it allows. The schema thus cannot state another range than the check. Rules
//! between several keys remain with the check.

use std::collections::BTreeMap;
use std::path::Path;

use closecall_traffic::{ActorId, Check, KeyPath, Problem, Range, Segment};
use serde_json::{Value, json};
use toml::Table;

use super::{SCHEMA_VERSION, ScenarioConfig, ScenarioError, ScenarioFile};

/// A scenario that uses every key.
const EVERY_KEY: &str = include_str!("../../docs/reference/scenario/every-key.toml");
/// The actor in [`EVERY_KEY`] that follows trajectory data, a file that is not part of the program.
const RECORDED_ACTOR: &str = "recorded";
/// The key of a LiDAR that names a file, which is not part of the program either.
const PATTERN_FILE: &str = "pattern-file";
/// The key of a pattern that names a file.
const BEAMS_FILE: &str = "beams-file";
/// Larger than every number that a scenario allows.
const HUGE: f64 = 1e300;
/// A bound of this size or larger is left out of the schema: the quantity may have any value.
const UNBOUNDED: f64 = 1e12;
/// The pattern of the names of parameters.
const NAME_PATTERN: &str = "^[a-z][a-z0-9-]*$";
/// The pattern of the names of scenarios: SCENARIO, or SCENARIO@MEMBER for an entry of an ensemble.
const SCENARIO_PATTERN: &str = "^[a-z][a-z0-9-]*(@[a-z][a-z0-9-]*)?$";

/// Returns the JSON Schema of scenario files.
///
/// The schema states keys, types, and the range of each number whose limits do not depend on other
/// keys. Rules between several keys are not part of the schema.
pub fn strict_schema() -> Value {
    let mut schema = schemars::schema_for!(ScenarioConfig).to_value();
    for (pointer, range) in ranges(&schema) {
        if let Some(object) = schema.pointer_mut(&pointer).and_then(Value::as_object_mut) {
            if range.high() < UNBOUNDED {
                object.insert("maximum".to_owned(), json!(range.high()));
            }
            if range.low() > -UNBOUNDED {
                let key = if range.includes_low() { "minimum" } else { "exclusiveMinimum" };
                object.insert(key.to_owned(), json!(range.low()));
            }
        }
    }
    let mut insert = |pointer: &str, key: &str, value: Value| {
        if let Some(object) = schema.pointer_mut(pointer).and_then(Value::as_object_mut) {
            object.insert(key.to_owned(), value);
        }
    };
    insert("/properties/schema-version", "const", json!(SCHEMA_VERSION));
    insert("/properties/name", "pattern", json!(SCENARIO_PATTERN));
    insert("/properties/actor", "minItems", json!(1));
    insert("/properties/requirements", "uniqueItems", json!(true));
    insert("/$defs/ActorId", "pattern", json!(ActorId::PATTERN));
    insert("/$defs/ParameterName", "pattern", json!(NAME_PATTERN));
    insert("/$defs/Lane", "minimum", json!(1));
    let one_of = |keys: &[&str]| {
        let alternatives: Vec<Value> = keys.iter().map(|key| json!({ "required": [key] })).collect();
        json!({ "oneOf": alternatives })
    };
    insert(
        "/$defs/RelativeStartConfig",
        "allOf",
        json!([one_of(&["gap-m", "thw-s", "settled"]), one_of(&["speed-mps", "closing-mps"])]),
    );
    insert("/$defs/TrafficConfig", "allOf", json!([one_of(&["mean-thw-s", "density-per-km"])]));
    schema
}

/// Returns the range of each number, by the JSON pointer of its schema. If a table is used in
/// several places, the range contains the ranges of all of them.
fn ranges(schema: &Value) -> BTreeMap<String, Range> {
    let Ok(mut document) = EVERY_KEY.parse::<Table>() else { return BTreeMap::new() };
    if let Some(actors) = document.get_mut("actor").and_then(toml::Value::as_array_mut) {
        actors.retain(|actor| actor.get("id").and_then(toml::Value::as_str) != Some(RECORDED_ACTOR));
    }
    // A pattern in a file has the ranges of a pattern in the scenario.
    let sensors = document.get_mut("sensors").and_then(toml::Value::as_table_mut);
    for (_, sensor) in sensors.into_iter().flatten() {
        match sensor {
            toml::Value::Table(sensor) => remove_files(sensor),
            toml::Value::Array(sensors) => {
                sensors.iter_mut().filter_map(toml::Value::as_table_mut).for_each(remove_files);
            }
            _ => {}
        }
    }
    let mut search = Search { schema, document: &document, ranges: BTreeMap::new() };
    // The range of a number of a distribution depends on the other numbers, so it is left out.
    for (key, value) in document.iter().filter(|(key, _)| *key != "parameters") {
        search.visit(&format!("/properties/{key}"), &[Segment::Key(key.clone())], value);
    }
    search.ranges
}

/// Removes the keys of a sensor that name other files.
fn remove_files(sensor: &mut Table) {
    sensor.remove(PATTERN_FILE);
    if sensor.get("pattern").is_some_and(|pattern| pattern.get(BEAMS_FILE).is_some()) {
        sensor.remove("pattern");
    }
}

/// The search for the ranges of all numbers of a document.
struct Search<'a> {
    schema: &'a Value,
    document: &'a Table,
    /// The ranges by the JSON pointer of the number's schema.
    ranges: BTreeMap<String, Range>,
}

impl Search<'_> {
    /// Adds the ranges of the numbers in `value`, which lies at `path` of the document and has the
    /// schema at `pointer`.
    fn visit(&mut self, pointer: &str, path: &[Segment], value: &toml::Value) {
        let within = |segment| path.iter().cloned().chain([segment]).collect::<Vec<_>>();
        match value {
            toml::Value::Table(table) => {
                for (key, inner) in table {
                    for target in self.properties(pointer, key) {
                        self.visit(&target, &within(Segment::Key(key.clone())), inner);
                    }
                }
            }
            toml::Value::Array(values) => {
                for (index, inner) in values.iter().enumerate() {
                    for target in self.resolved(pointer).into_iter().map(|target| format!("{target}/items")) {
                        self.visit(&target, &within(Segment::Index(index)), inner);
                    }
                }
            }
            _ if self.is_number(pointer) => {
                if let Some(range) = allowed(self.document, path) {
                    let ranges = self.ranges.entry(pointer.to_owned()).or_insert(range);
                    *ranges = hull(*ranges, range);
                }
            }
            _ => {}
        }
    }

    /// Returns the pointers of the schemas that the schema at `pointer` refers to, itself included.
    fn resolved(&self, pointer: &str) -> Vec<String> {
        let Some(schema) = self.schema.pointer(pointer) else { return Vec::new() };
        if let Some(target) = schema["$ref"].as_str().and_then(|target| target.strip_prefix('#')) {
            return self.resolved(target);
        }
        let mut pointers = vec![pointer.to_owned()];
        for kind in ["anyOf", "oneOf"] {
            for index in 0..schema[kind].as_array().map_or(0, Vec::len) {
                pointers.extend(self.resolved(&format!("{pointer}/{kind}/{index}")));
            }
        }
        pointers
    }

    /// Returns the pointers of the schemas of a key.
    fn properties(&self, pointer: &str, key: &str) -> Vec<String> {
        let candidates = self.resolved(pointer).into_iter().map(|target| format!("{target}/properties/{key}"));
        candidates.filter(|target| self.schema.pointer(target).is_some()).collect()
    }

    fn is_number(&self, pointer: &str) -> bool {
        self.resolved(pointer).iter().any(|target| {
            let kind = self.schema.pointer(target).map(|schema| &schema["type"]);
            kind.is_some_and(|kind| {
                kind == "number" || kind.as_array().is_some_and(|all| all.contains(&json!("number")))
            })
        })
    }
}

/// Returns the range that the check allows at `path`, or `None` if the check states no range for
/// that key alone. The check is asked with a number that no range contains.
fn allowed(document: &Table, path: &[Segment]) -> Option<Range> {
    [-HUGE, HUGE].into_iter().find_map(|number| {
        let mut changed = toml::Value::Table(document.clone());
        let mut target = &mut changed;
        for segment in path {
            target = match segment {
                Segment::Key(key) => target.get_mut(key)?,
                Segment::Index(index) => target.get_mut(*index)?,
            };
        }
        *target = toml::Value::Float(number);
        let text = toml::to_string(&changed).ok()?;
        let file = match ScenarioFile::parse(Path::new("schema"), &text, &[]) {
            Ok(file) => file,
            Err(ScenarioError::Value { source, .. }) => return range_at(&source.problem, &source.path, path),
            Err(_) => return None,
        };
        let error = file.config().check(&file.space().nominal()).err()?;
        range_at(&error.problem, &error.path, path)
    })
}

fn range_at(problem: &Problem, key_path: &KeyPath, path: &[Segment]) -> Option<Range> {
    match problem {
        Problem::OutOfRange { allowed, .. } if key_path.0 == path => Some(*allowed),
        _ => None,
    }
}

/// Returns the smallest range that contains both.
fn hull(first: Range, second: Range) -> Range {
    let low = first.low().min(second.low());
    let includes_low = [first, second].iter().any(|range| range.low() <= low && range.includes_low());
    let high = first.high().max(second.high());
    if includes_low { Range::closed(low, high) } else { Range::above(low, high) }
}

#[cfg(test)]
mod tests;
