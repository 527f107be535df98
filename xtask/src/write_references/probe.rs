//! The values that the checks of a scenario allow, read from the messages of the checks.
//!
//! The scenario that uses every key is changed in one place and checked again. The message about a
//! number far beyond any range states the allowed range.

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::PathBuf;

use closecall::scenarios::{ScenarioError, ScenarioFile};
use closecall::traffic::{KeyPath, Problem, Segment};
use toml::{Table, Value};

use super::files::{EVERY_KEY, at_root};
use super::schema::Step;

/// Larger than every number that a scenario allows.
const HUGE: f64 = 1e300;
/// The largest number of a distribution: a bound that only excludes what no quantity of a scenario
/// can be.
const LIMIT: &str = "1000000000000";
/// The largest number below 1: a bound that excludes 1.
const BELOW_ONE: &str = "0.9999999999999999";

/// A scenario that can be changed and checked.
#[derive(Clone, Debug)]
pub(crate) struct Probe {
    path: PathBuf,
    text: String,
    table: Table,
}

impl Probe {
    /// Reads the scenario that uses every key.
    pub(crate) fn new() -> Result<Self, Box<dyn Error>> {
        let path = at_root(EVERY_KEY);
        let text = std::fs::read_to_string(&path)?;
        let table = text.parse()?;
        Ok(Self { path, text, table })
    }

    /// Returns the position of a key's first use in the file, comments aside.
    pub(crate) fn position(&self, key: &str) -> usize {
        let is_part = |c: char| c.is_ascii_alphanumeric() || c == '-';
        let uses = |line: &&str| !line.starts_with('#') && line.split(|c: char| !is_part(c)).any(|word| word == key);
        let mut start = 0;
        for line in self.text.lines() {
            if uses(&line) {
                let within = line.match_indices(key).map(|(index, _)| index).find(|&index| {
                    let before = line[..index].chars().next_back();
                    let after = line[index + key.len()..].chars().next();
                    !before.is_some_and(is_part) && !after.is_some_and(is_part)
                });
                return start + within.unwrap_or(0);
            }
            start += line.len() + 1;
        }
        usize::MAX
    }

    /// Returns the values at `way`, each with its path.
    pub(crate) fn values(&self, way: &[Step]) -> Vec<(KeyPath, Value)> {
        let mut values = vec![(Vec::new(), Value::Table(self.table.clone()))];
        for step in way {
            values = values.into_iter().flat_map(|(path, value)| step_into(step, path, value)).collect();
        }
        values.into_iter().map(|(path, value)| (KeyPath(path), value)).collect()
    }

    /// Returns the allowed values at `at`, or `None` if the check allows any number there.
    pub(crate) fn allowed(&self, at: &KeyPath, is_whole: bool) -> Option<String> {
        let wrong =
            if is_whole { [Value::Integer(255), Value::Integer(0)] } else { [Value::Float(-HUGE), Value::Float(HUGE)] };
        let text = wrong.into_iter().find_map(|value| {
            let error = self.with(at, Some(value)).and_then(|table| self.check(&table).err())?;
            let ScenarioError::Value { source, .. } = error else { return None };
            let allowed = match source.problem {
                Problem::OutOfRange { allowed, .. } => allowed.to_string(),
                Problem::WrongCount { allowed, .. } => allowed.to_owned(),
                Problem::UnknownLane { .. } => "a lane of this road, counted from 1".to_owned(),
                _ => return None,
            };
            at.0.starts_with(&source.path.0).then_some(allowed)
        })?;
        let minimum = self.with_key(at, "min").and_then(|path| self.at(&path)).and_then(|value| value.as_float());
        shortened(&text, minimum)
    }

    /// Reads and checks a changed scenario.
    pub(crate) fn check(&self, table: &Table) -> Result<ScenarioFile, ScenarioError> {
        let file = ScenarioFile::parse(&self.path, &table.to_string(), &[])?;
        file.check()?;
        Ok(file)
    }

    /// Returns the scenario with another value at `at`, or with none; `None` if there is no such
    /// place.
    pub(crate) fn with(&self, at: &KeyPath, value: Option<Value>) -> Option<Table> {
        let mut root = Value::Table(self.table.clone());
        let (last, way) = at.0.split_last()?;
        let mut place = &mut root;
        for segment in way {
            place = match segment {
                Segment::Key(key) => {
                    place.as_table_mut()?.entry(key.clone()).or_insert_with(|| Value::Table(Table::new()))
                }
                Segment::Index(index) => place.as_array_mut()?.get_mut(*index)?,
            };
        }
        match (last, value) {
            (Segment::Key(key), Some(value)) => drop(place.as_table_mut()?.insert(key.clone(), value)),
            (Segment::Key(key), None) => drop(place.as_table_mut()?.remove(key)),
            (Segment::Index(index), Some(value)) => *place.as_array_mut()?.get_mut(*index)? = value,
            (Segment::Index(_), None) => return None,
        }
        match root {
            Value::Table(table) => Some(table),
            _ => None,
        }
    }

    /// The path of a neighbour of `at`.
    fn with_key(&self, at: &KeyPath, key: &str) -> Option<KeyPath> {
        let (_, way) = at.0.split_last()?;
        Some(KeyPath(way.iter().cloned().chain([Segment::Key(key.to_owned())]).collect()))
    }

    fn at(&self, path: &KeyPath) -> Option<Value> {
        let mut value = Value::Table(self.table.clone());
        for segment in &path.0 {
            value = match segment {
                Segment::Key(key) => value.get(key)?.clone(),
                Segment::Index(index) => value.get(*index)?.clone(),
            };
        }
        Some(value)
    }
}

fn step_into(step: &Step, path: Vec<Segment>, value: Value) -> Vec<(Vec<Segment>, Value)> {
    let with = |segment| path.iter().cloned().chain([segment]).collect::<Vec<_>>();
    match (step, value) {
        (Step::Key(key), Value::Table(mut table)) => {
            table.remove(key).map(|value| (with(Segment::Key(key.clone())), value)).into_iter().collect()
        }
        (Step::Name, Value::Table(table)) => {
            table.into_iter().map(|(key, value)| (with(Segment::Key(key)), value)).collect()
        }
        (Step::Element, Value::Array(values)) => {
            values.into_iter().enumerate().map(|(index, value)| (with(Segment::Index(index)), value)).collect()
        }
        _ => Vec::new(),
    }
}

/// A range as the check says it, in fewer words: `a number from 0.2 to 5` is `0.2 to 5`.
fn shortened(text: &str, minimum: Option<f64>) -> Option<String> {
    let text = text.replace(&PI.to_string(), "π").replace(&FRAC_PI_2.to_string(), "π/2");
    // A bound that is the neighbour `min` of the example is that key.
    let named = |bound: &str| match minimum {
        Some(minimum) if bound == minimum.to_string() => "`min`".to_owned(),
        _ => bound.to_owned(),
    };
    let lowest = format!("-{LIMIT}");
    if let Some((low, high)) = text.strip_prefix("a number above ").and_then(|rest| rest.split_once(" and up to ")) {
        return Some(match high {
            LIMIT => format!("above {}", named(low)),
            BELOW_ONE => format!("above {low}, below 1"),
            _ => format!("above {low}, up to {high}"),
        });
    }
    match text.split_once(" from ").map(|(_, range)| range.split_once(" to ")) {
        Some(Some((low, high))) if low == lowest && high == LIMIT => None,
        Some(Some((low, high))) if high == LIMIT => Some(format!("{} or more", named(low))),
        Some(Some((low, high))) if text.starts_with("a number") => Some(format!("{low} to {high}")),
        _ => Some(text.clone()),
    }
}
