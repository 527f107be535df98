//! Criteria as configuration files state them.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::expression::Expression;
use super::measure::{MEASURES, Measure, MeasureKind};

/// The gates of a scenario file or of a project file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct GateConfig {
    /// Criteria that the samples of each scenario must satisfy, such as `count(ego_collided) <= 0`
    /// or `p1(min_ttc_rear_s) >= 1.0`.
    #[serde(default)]
    pub require: Vec<Expression>,
    /// Highest probability of a collision of the ego that passes, above 0 and below 1. The exact
    /// upper bound of each scenario must not exceed it.
    pub max_probability: Option<f64>,
    /// Confidence of that bound, above 0.5 and below 1; 0.95 if absent.
    pub confidence: Option<f64>,
}

impl GateConfig {
    /// Confidence of the bound on the probability of a collision if no file or option gives one (-).
    pub const CONFIDENCE: f64 = 0.95;

    /// Returns true if nothing is asked.
    pub fn is_empty(&self) -> bool {
        self.require.is_empty() && self.max_probability.is_none()
    }
}

/// The name of a flag: something that happens in a run, or does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlagName(&'static Measure);

impl FlagName {
    /// Returns the flag.
    pub const fn measure(self) -> &'static Measure {
        self.0
    }
}

impl std::str::FromStr for FlagName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match Measure::named(text) {
            Some(measure) if measure.kind == MeasureKind::Flag => Ok(Self(measure)),
            _ => Err(format!("`{text}` cannot be expected of a run; these can: {}", names().join(", "))),
        }
    }
}

fn names() -> Vec<&'static str> {
    MEASURES.iter().filter(|measure| measure.kind == MeasureKind::Flag).map(|measure| measure.name).collect()
}

impl Serialize for FlagName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.name)
    }
}

impl<'de> Deserialize<'de> for FlagName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

impl JsonSchema for FlagName {
    fn schema_name() -> Cow<'static, str> {
        "FlagName".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "enum": names(), "description": "Something that happens in a run, or does not." })
    }
}

impl Serialize for Expression {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Expression {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

impl JsonSchema for Expression {
    fn schema_name() -> Cow<'static, str> {
        "Criterion".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "string",
            "description": "An aggregate of a measure and its bound, such as `p99(min_ttc_rear_s) >= 1.0`.",
            "pattern": "^\\s*[a-z][a-z0-9.]*\\s*\\(.*\\)\\s*(<=|>=)\\s*\\S+\\s*$",
            "examples": ["count(ego_collided) <= 0", "lower(prevented | baseline.ego_collided) >= 0.5"],
        })
    }
}
