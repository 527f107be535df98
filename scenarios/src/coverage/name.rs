//! Names of coverage items and crosses.

use std::borrow::Borrow;
use std::fmt;
use std::str::FromStr;

use arrayvec::ArrayString;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Largest length of a name (bytes).
const MOST_BYTES: usize = 40;

/// The name of a coverage item or cross: lower-case letters, digits and hyphens, starting with a letter, at most 40 of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CoverageName(ArrayString<MOST_BYTES>);

impl CoverageName {
    /// Returns the name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for CoverageName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_plain = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
        let starts = text.starts_with(|letter: char| letter.is_ascii_lowercase());
        match ArrayString::from(text) {
            Ok(name) if starts && text.chars().all(is_plain) => Ok(Self(name)),
            _ => Err(format!(
                "`{text}` is not the name of a coverage item: at most {MOST_BYTES} lower-case letters, digits and hyphens, \
                 starting with a letter"
            )),
        }
    }
}

impl Borrow<str> for CoverageName {
    fn borrow(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for CoverageName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Serialize for CoverageName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0)
    }
}

impl<'de> Deserialize<'de> for CoverageName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

impl JsonSchema for CoverageName {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "CoverageName".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "pattern": "^[a-z][a-z0-9-]{0,39}$" })
    }
}
