//! Configuration values that are either fixed or given by a sampled parameter.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, IntoDeserializer, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::actor::is_kebab_name;

/// The character that marks a parameter name in place of a value.
const PARAMETER_MARK: char = '$';

/// The name of a sampled parameter: lower-case letters, digits and hyphens, starting with a letter.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct ParameterName(String);

impl ParameterName {
    /// Creates a parameter name. Returns `None` if `name` is not a valid one.
    pub fn new(name: &str) -> Option<Self> {
        is_kebab_name(name).then(|| Self(name.to_owned()))
    }

    /// Returns the name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for ParameterName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl<'de> Deserialize<'de> for ParameterName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::new(&text).ok_or_else(|| {
            de::Error::custom(format_args!(
                "`{text}` is not a parameter's name: lower-case letters, digits and hyphens, starting with a letter"
            ))
        })
    }
}

/// A number that is either fixed or given by a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Num {
    /// The number; finite.
    Fixed(f64),
    /// The value of a parameter, written `"$name"`.
    Parameter(ParameterName),
}

impl From<f64> for Num {
    fn from(value: f64) -> Self {
        Self::Fixed(value)
    }
}

impl Serialize for Num {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(value) => serializer.serialize_f64(*value),
            Self::Parameter(name) => serializer.collect_str(&format_args!("{PARAMETER_MARK}{name}")),
        }
    }
}

fn parameter<E: de::Error>(text: &str, otherwise: &str) -> Result<ParameterName, E> {
    text.strip_prefix(PARAMETER_MARK)
        .and_then(ParameterName::new)
        .ok_or_else(|| E::custom(format_args!("`{text}` is neither {otherwise} nor a parameter such as \"$name\"")))
}

struct NumVisitor;

impl Visitor<'_> for NumVisitor {
    type Value = Num;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a parameter such as \"$name\"")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Num, E> {
        if value.is_finite() {
            Ok(Num::Fixed(value))
        } else {
            Err(E::custom(format_args!("{value} is not allowed: a finite number is needed")))
        }
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Num, E> {
        Ok(Num::Fixed(value as f64))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Num, E> {
        Ok(Num::Fixed(value as f64))
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Num, E> {
        parameter(text, "a number").map(Num::Parameter)
    }
}

impl<'de> Deserialize<'de> for Num {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumVisitor)
    }
}

impl JsonSchema for Num {
    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A finite number, or the name of a parameter such as \"$name\".",
            "anyOf": [{ "type": "number" }, { "type": "string", "pattern": "^\\$[a-z][a-z0-9-]*$" }]
        })
    }
}

/// A label that is either fixed or given by a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice<T> {
    /// The label.
    Fixed(T),
    /// The label that a parameter gives, written `"$name"`.
    Parameter(ParameterName),
}

impl<T: Serialize> Serialize for Choice<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(value) => value.serialize(serializer),
            Self::Parameter(name) => serializer.collect_str(&format_args!("{PARAMETER_MARK}{name}")),
        }
    }
}

struct ChoiceVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ChoiceVisitor<T> {
    type Value = Choice<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a word or a parameter such as \"$name\"")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Choice<T>, E> {
        if text.starts_with(PARAMETER_MARK) {
            parameter(text, "a word").map(Choice::Parameter)
        } else {
            T::deserialize(text.to_owned().into_deserializer()).map(Choice::Fixed)
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Choice<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ChoiceVisitor(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Choice<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("{}OrParameter", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let fixed = generator.subschema_for::<T>();
        json_schema!({ "anyOf": [fixed, { "type": "string", "pattern": "^\\$[a-z][a-z0-9-]*$" }] })
    }
}
