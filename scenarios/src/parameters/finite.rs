//! Deserialization of numbers that must be finite.
//!
//! `nan` and `inf` are legal TOML. They are refused while the file is parsed, so that the error
//! states the line and the value.

use std::collections::BTreeMap;
use std::fmt;

use closecall_traffic::{ParameterName, Value};
use schemars::{Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};

/// A finite number in a file.
struct Finite(f64);

impl<'de> Deserialize<'de> for Finite {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        finite(f64::deserialize(deserializer)?).map(Self)
    }
}

/// Returns `value` if it is finite, and an error that names it otherwise.
fn finite<E: Error>(value: f64) -> Result<f64, E> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(E::custom(format_args!("{value} is not allowed: a finite number is needed")))
    }
}

/// Reads a finite number or a label.
struct ValueVisitor;

impl Visitor<'_> for ValueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a label")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        finite(value).map(Value::Number)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }

    fn visit_str<E: Error>(self, label: &str) -> Result<Value, E> {
        Ok(Value::Label(label.to_owned()))
    }
}

/// Deserializes an optional number or label.
pub(super) fn value<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Value>, D::Error> {
    deserializer.deserialize_any(ValueVisitor).map(Some)
}

/// Returns the JSON Schema of [`value`].
pub(super) fn value_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "description": "The same number or label in every sample.",
        "anyOf": [{ "type": "number" }, { "type": "string", "minLength": 1 }]
    })
}

/// Deserializes a finite number.
pub(super) fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Finite::deserialize(deserializer).map(|finite| finite.0)
}

/// Deserializes an optional finite number.
pub(super) fn option<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    number(deserializer).map(Some)
}

/// Deserializes a list of finite numbers.
pub(super) fn list<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let list = Vec::<Finite>::deserialize(deserializer)?;
    Ok(list.into_iter().map(|finite| finite.0).collect())
}

/// Deserializes an optional pair of finite numbers.
pub(super) fn pair<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<[f64; 2]>, D::Error> {
    let [low, high] = <[Finite; 2]>::deserialize(deserializer)?;
    Ok(Some([low.0, high.0]))
}

/// Deserializes finite rank correlations, by the name of the other parameter.
pub(super) fn correlations<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeMap<ParameterName, f64>, D::Error> {
    let entries = BTreeMap::<ParameterName, Finite>::deserialize(deserializer)?;
    Ok(entries.into_iter().map(|(name, value)| (name, value.0)).collect())
}

/// Deserializes optional labels with finite weights.
pub(super) fn weights<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<BTreeMap<String, f64>>, D::Error> {
    let weights = BTreeMap::<String, Finite>::deserialize(deserializer)?;
    Ok(Some(weights.into_iter().map(|(label, weight)| (label, weight.0)).collect()))
}
