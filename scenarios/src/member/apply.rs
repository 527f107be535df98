//! Applies a member of a driver ensemble to a scenario: changes the text of the scenario's drivers.

use std::path::PathBuf;

use closecall_traffic::kebab_name;
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::config::{Member, Set, SetValue};
use super::keys::{ALIKE, KINDS, MODELS, path_in};
use crate::{ScenarioError, ScenarioFile};

/// A member that does not fit a scenario.
#[derive(Debug, thiserror::Error)]
#[error("failed to apply the member {} to {scenario}: {source}", member.display())]
pub struct ApplyError {
    /// The member's file.
    pub member: PathBuf,
    /// The scenario's name.
    pub scenario: String,
    /// What is wrong.
    pub source: Box<ScenarioError>,
}

/// The result of applying a member to a scenario.
#[derive(Clone, Debug)]
pub enum Application {
    /// The scenario with the member's drivers, named SCENARIO@MEMBER.
    Entry(Box<ScenarioFile>),
    /// The member changes nothing: the scenario has no driver with one of its keys, or the values
    /// are the same.
    NoEffect,
}

/// Path of the ego's human driver below `driver`.
const HUMAN_OF_EGO: [&str; 2] = ["ego-stack", "human"];

/// A value of the scenario that a member sets.
struct Place {
    /// The path of the value's key in the scenario.
    path: Vec<String>,
    /// The index of the member's `[[set]]` with the new value.
    set: usize,
}

impl Member {
    /// Applies the member to every human driver of `file` that is not prescribed, the ego's driver
    /// included, and checks the result.
    ///
    /// If only replaced values use a parameter, the parameter keeps its name and gets the member's
    /// distribution. All other parameters then keep their values in every sampling design. In any
    /// other case a distribution becomes a new parameter.
    ///
    /// # Errors
    /// [`ApplyError`] if a value is not valid for a driver of the scenario.
    pub fn apply(&self, file: &ScenarioFile) -> Result<Application, ApplyError> {
        let scenario = &file.config().name;
        let fail = |source| ApplyError {
            member: self.path().to_owned(),
            scenario: scenario.clone(),
            source: Box::new(source),
        };
        let Ok(mut document) = file.text().parse::<DocumentMut>() else { return Ok(Application::NoEffect) };
        let before = document.to_string();
        let count = document.get("actor").and_then(Item::as_array_of_tables).map_or(0, |actors| actors.len());
        let mut places = Vec::new();
        for index in 0..count {
            self.change_actor(&mut document, index, &mut places);
        }
        self.set_values(&mut document, &places);
        if document.to_string() == before {
            return Ok(Application::NoEffect);
        }
        document.insert("name", Item::Value(format!("{scenario}@{}", self.name()).into()));
        let entry = file.with_text(&document.to_string()).map_err(fail)?;
        entry.check().map_err(fail)?;
        Ok(Application::Entry(Box::new(entry)))
    }

    /// Changes the car-following model of one actor if the member asks for it, and collects the
    /// places of the keys to set.
    fn change_actor(&self, document: &mut DocumentMut, index: usize, places: &mut Vec<Place>) {
        let Some(actor) = actor_mut(document, index) else { return };
        let Some(mut driver) = actor.get_mut("driver").and_then(Item::as_table_like_mut) else { return };
        let mut parents = vec!["driver".to_owned()];
        if driver.contains_key(HUMAN_OF_EGO[0]) {
            for key in HUMAN_OF_EGO {
                let Some(inner) = driver.get_mut(key).and_then(Item::as_table_like_mut) else { return };
                driver = inner;
                parents.push(key.to_owned());
            }
        }
        let Some(kind) = KINDS.into_iter().find(|kind| driver.contains_key(kind)) else { return };
        let (kind, model) = self.with_model(driver, kind);
        let Some(table) = driver.get_mut(&kind).and_then(Item::as_table_like_mut) else { return };
        let sets = || self.sets.iter().enumerate().filter(|(_, set)| set.drivers.contains(&kind));
        if sets().any(|(_, set)| set.key.starts_with("lapse.")) {
            // One of two keys gives a lapse. The member's key replaces the scenario's whole table.
            table.remove("lapse");
        }
        let parents: Vec<String> =
            ["actor".to_owned(), index.to_string()].into_iter().chain(parents).chain([kind.clone()]).collect();
        places.extend(sets().filter_map(|(set, Set { key, .. })| {
            let keys = path_in(&kind, &model, key)?;
            Some(Place { path: parents.iter().cloned().chain(keys).collect(), set })
        }));
    }

    /// Replaces the car-following model if the member names another one. Returns the kind of the
    /// driver and its model.
    fn with_model(&self, driver: &mut dyn TableLike, kind: &str) -> (String, String) {
        let holder: &mut dyn TableLike = match kind {
            "overtaker" => {
                let follow = driver.get_mut(kind).and_then(Item::as_table_like_mut);
                match follow.and_then(|table| table.get_mut("follow")).and_then(Item::as_table_like_mut) {
                    Some(follow) => follow,
                    None => return (kind.to_owned(), String::new()),
                }
            }
            _ => driver,
        };
        let Some(old) = MODELS.into_iter().find(|model| holder.contains_key(model)) else {
            return (kind.to_owned(), String::new());
        };
        let new = self.follow.as_ref().map_or(old, |follow| follow.model.as_str());
        if new != old
            && let Some(table) = holder.remove(old)
        {
            let converted = table.as_table_like().map(|table| converted(table, new)).unwrap_or_default();
            holder.insert(new, Item::Value(Value::InlineTable(converted)));
        }
        let kind = if kind == "overtaker" { kind } else { new };
        (kind.to_owned(), new.to_owned())
    }

    /// Writes the values of the member into their places.
    fn set_values(&self, document: &mut DocumentMut, places: &[Place]) {
        let old_parameters: Vec<Option<String>> =
            places.iter().map(|place| parameter_at(document, &place.path)).collect();
        for (place, old) in places.iter().zip(&old_parameters) {
            let set = &self.sets[place.set];
            let is_exclusive = |name: &str| {
                let replaced = places
                    .iter()
                    .zip(&old_parameters)
                    .filter(|(other, used)| other.set == place.set && used.as_deref() == Some(name));
                uses(document.as_item(), name) == replaced.count()
            };
            match old.as_deref().filter(|name| is_exclusive(name)) {
                Some(name) => put_parameter(document, name, self, set),
                None => {
                    let value = match set.value {
                        SetValue::Number(number) => Value::from(number),
                        SetValue::Distribution(_) => {
                            let name = new_name(document, &place.path, &set.key);
                            put_parameter(document, &name, self, set);
                            Value::from(format!("${name}"))
                        }
                    };
                    insert(document, &place.path, value);
                }
            }
        }
        remove_unused(document, old_parameters.into_iter().flatten());
    }
}

/// Returns the table of `model` with the values that `table` gives to another model: of the keys
/// that both models have, and of the pairs of keys that mean the same.
fn converted(table: &dyn TableLike, model: &str) -> InlineTable {
    let mut converted = InlineTable::new();
    for (key, item) in table.iter() {
        let alike = ALIKE.into_iter().find_map(|(wiedemann, idm)| match model {
            "idm" if key == wiedemann => Some(idm),
            "wiedemann99" if key == idm => Some(wiedemann),
            _ => None,
        });
        let keeps = path_in(model, model, key).is_some() || ["lapse", "perception"].contains(&key);
        if let Some(key) = alike.or(keeps.then_some(key))
            && let Ok(value) = item.clone().into_value()
        {
            converted.insert(key, value);
        }
    }
    // A headway that the scenario leaves out keeps the default of the scenario's model.
    let defaults = [
        ("idm", "standstill-gap-m", 1.5),
        ("idm", "time-gap-s", 0.9),
        ("wiedemann99", "cc0-m", 2.0),
        ("wiedemann99", "cc1-s", 1.5),
    ];
    for (new_model, key, default) in defaults {
        if new_model == model && !converted.contains_key(key) {
            converted.insert(key, Value::from(default));
        }
    }
    converted
}

fn actor_mut(document: &mut DocumentMut, index: usize) -> Option<&mut Table> {
    document.get_mut("actor")?.as_array_of_tables_mut()?.get_mut(index)
}

/// Returns the name of the parameter at `path` of the document, if there is one.
fn parameter_at(document: &mut DocumentMut, path: &[String]) -> Option<String> {
    let [_, index, keys @ ..] = path else { return None };
    let mut table: &dyn TableLike = actor_mut(document, index.parse().ok()?)?;
    let (last, parents) = keys.split_last()?;
    for key in parents {
        table = table.get(key)?.as_table_like()?;
    }
    table.get(last)?.as_str()?.strip_prefix('$').map(str::to_owned)
}

/// Inserts `value` at `path`, and creates the tables on the way that do not exist.
fn insert(document: &mut DocumentMut, path: &[String], value: Value) {
    let [_, index, keys @ .., last] = path else { return };
    let Some(actor) = index.parse().ok().and_then(|index| actor_mut(document, index)) else { return };
    let mut table: &mut dyn TableLike = actor;
    for key in keys {
        if !table.contains_key(key) {
            table.insert(key, Item::Value(Value::InlineTable(InlineTable::new())));
        }
        let Some(next) = table.get_mut(key).and_then(Item::as_table_like_mut) else { return };
        table = next;
    }
    table.insert(last, Item::Value(value));
}

/// Writes the member's value as the distribution of the parameter `name`.
fn put_parameter(document: &mut DocumentMut, name: &str, member: &Member, set: &Set) {
    let mut table = match &set.value {
        SetValue::Number(number) => InlineTable::from_iter([("fixed", Value::from(*number))]),
        SetValue::Distribution(distribution) => {
            let text = toml::Value::Table(distribution.clone()).to_string();
            match text.parse::<Value>() {
                Ok(Value::InlineTable(table)) => table,
                _ => return,
            }
        }
    };
    table.insert("assumed", Value::from(format!("member {} of the driver ensemble: {}", member.name(), set.source)));
    let parameters = document.entry("parameters").or_insert_with(|| Item::Table(Table::new()));
    if let Some(parameters) = parameters.as_table_like_mut() {
        parameters.insert(name, Item::Value(Value::InlineTable(table)));
    }
}

/// Returns the name of a new parameter for a key of an actor.
fn new_name(document: &mut DocumentMut, path: &[String], key: &str) -> String {
    let actor = path.get(1).and_then(|index| index.parse().ok()).and_then(|index| actor_mut(document, index));
    let id = actor.and_then(|actor| actor.get("id")).and_then(Item::as_str).unwrap_or("driver").to_owned();
    let mut name = kebab_name(&format!("{id}-{key}"));
    let is_taken = |name: &str| {
        document.get("parameters").and_then(Item::as_table_like).is_some_and(|parameters| parameters.contains_key(name))
    };
    while is_taken(&name) {
        name.push_str("-of-member");
    }
    name
}

/// Returns the number of values that use the parameter `name`.
fn uses(item: &Item, name: &str) -> usize {
    let of_table = |table: &dyn TableLike| table.iter().map(|(_, item)| uses(item, name)).sum();
    match item {
        Item::Value(value) => uses_in_value(value, name),
        Item::Table(table) => of_table(table),
        Item::ArrayOfTables(tables) => tables.iter().map(|table| of_table(table)).sum(),
        Item::None => 0,
    }
}

fn uses_in_value(value: &Value, name: &str) -> usize {
    match value {
        Value::String(text) => usize::from(text.value().strip_prefix('$') == Some(name)),
        Value::Array(values) => values.iter().map(|value| uses_in_value(value, name)).sum(),
        Value::InlineTable(table) => table.iter().map(|(_, value)| uses_in_value(value, name)).sum(),
        _ => 0,
    }
}

/// Removes the parameters of `names` that no value uses.
fn remove_unused(document: &mut DocumentMut, names: impl Iterator<Item = String>) {
    for name in names {
        if uses(document.as_item(), &name) == 0
            && let Some(parameters) = document.get_mut("parameters").and_then(Item::as_table_like_mut)
        {
            parameters.remove(&name);
        }
    }
}

#[cfg(test)]
mod tests;
