//! The factors for driver, sensor and controller that ship with the program: `factors.toml`.

use closecall_controllers::DriverConfig;
use closecall_scenarios::ScenarioFile;
use serde::Deserialize;

use super::factor::{FactorKind, FactorRange};

/// The list.
const TEXT: &str = include_str!("factors.toml");

/// A factor of the list that does not apply to a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// The key.
    pub key: String,
    /// The reason.
    pub reason: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    factor: Vec<Entry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    key: String,
    range: [f64; 2],
    kind: String,
    source: String,
}

/// Returns the factors of the list that apply to a scenario, and those that do not. `named` are the
/// keys that the user varies.
pub(super) fn factors_of(file: &ScenarioFile, named: &[FactorRange]) -> (Vec<FactorRange>, Vec<LeftOut>) {
    let (mut ranges, mut left_out) = (Vec::new(), Vec::new());
    let Ok(document) = toml::from_str::<toml::Value>(file.text()) else { return (ranges, left_out) };
    for range in entries().iter().flat_map(|entry| with_actors(file, entry)) {
        let reason = match value_at(&document, &range.key) {
            _ if named.iter().any(|named| named.key == range.key) => Some("it is given with another range".to_owned()),
            Found::Value(toml::Value::String(name)) if name.starts_with('$') => {
                Some(format!("the scenario samples it as `{}`", &name[1..]))
            }
            Found::Value(toml::Value::Table(_)) => Some("the scenario gives it a distribution".to_owned()),
            Found::NoTable if !range.key.starts_with("sensors.") => {
                Some("the scenario does not have its table".to_owned())
            }
            _ => None,
        };
        match reason {
            Some(reason) => left_out.push(LeftOut { key: range.key, reason }),
            None => ranges.push(range),
        }
    }
    (ranges, left_out)
}

fn entries() -> Vec<Entry> {
    // A test reads the list.
    toml::from_str::<List>(TEXT).map(|list| list.factor).unwrap_or_default()
}

/// Returns the factor of an entry for each actor that its key stands for.
fn with_actors(file: &ScenarioFile, entry: &Entry) -> Vec<FactorRange> {
    let is_meant: fn(&DriverConfig) -> bool = match entry.key.split(['{', '}']).nth(1) {
        Some("ego") => |driver| matches!(driver, DriverConfig::EgoStack(_)),
        Some("overtaker") => |driver| matches!(driver, DriverConfig::Overtaker(_)),
        Some(_) => |driver| matches!(driver, DriverConfig::Wiedemann99(_)),
        None => return vec![entry.range(entry.key.clone())],
    };
    let key = |actor: &str| {
        let parts: Vec<&str> = entry.key.split(['{', '}']).collect();
        format!("{}{actor}{}", parts[0], parts[2])
    };
    let actors = file.config().actors.iter().filter(|actor| is_meant(&actor.driver));
    actors.map(|actor| entry.range(key(actor.id.as_str()))).collect()
}

impl Entry {
    fn range(&self, key: String) -> FactorRange {
        let kind = FactorKind::ALL.into_iter().find(|kind| kind.name() == self.kind).unwrap_or(FactorKind::Named);
        FactorRange { key, low: self.range[0], high: self.range[1], kind, source: self.source.clone() }
    }
}

enum Found<'a> {
    Value(&'a toml::Value),
    /// The table exists, and leaves the key to its default.
    Default,
    NoTable,
}

/// Finds a key of a scenario.
fn value_at<'a>(document: &'a toml::Value, key: &str) -> Found<'a> {
    let mut at = document;
    let mut parts = key.split('.').peekable();
    while let Some(part) = parts.next() {
        let next = match at {
            toml::Value::Array(items) => {
                items.iter().find(|item| item.get("id").and_then(toml::Value::as_str) == Some(part))
            }
            _ => at.get(part),
        };
        at = match next {
            Some(next) => next,
            None if parts.peek().is_none() => return Found::Default,
            None => return Found::NoTable,
        };
    }
    Found::Value(at)
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::library;

    use super::*;

    #[test]
    fn every_entry_of_the_list_has_a_kind_a_source_and_a_range() {
        let entries = toml::from_str::<List>(TEXT).unwrap().factor;
        assert!(entries.len() > 20);
        for entry in entries {
            assert!(entry.range[0] < entry.range[1], "{}", entry.key);
            assert!(entry.source.len() > 10 && entry.range(String::new()).kind != FactorKind::Named, "{}", entry.key);
        }
    }

    #[test]
    fn what_the_scenario_samples_or_lacks_is_left_out_with_the_reason() {
        let name = "low-thw-overtake";
        let file = ScenarioFile::parse(&library::path(name), library::text(name).unwrap(), &[]).unwrap();
        let (ranges, left_out) = factors_of(&file, &["sensors.rear-object.dropout=0..0.1".parse().unwrap()]);
        let reason = |key: &str| left_out.iter().find(|left| left.key.ends_with(key)).map(|left| left.reason.as_str());
        assert_eq!(reason("overtaker.reaction-s"), Some("the scenario samples it as `reaction-s`"));
        assert_eq!(reason("rear-object.dropout"), Some("it is given with another range"));
        assert!(ranges.iter().any(|range| range.key == "actor.ego.driver.ego-stack.mis.engage-gap-m"));
        assert!(ranges.iter().any(|range| range.key == "sensors.rear-object.range-m"));
        // Every factor that is left can be set to both of its ends.
        for range in ranges {
            for end in [0.0, 1.0] {
                ScenarioFile::parse(file.path(), file.text(), &[range.at(end).unwrap()]).unwrap().check().unwrap();
            }
        }
    }
}
