//! Identifiers of the actors in a scenario.

use std::fmt;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The name of an actor: letters, digits, hyphens and underscores, starting with a letter or an
/// underscore. Names that differ in upper and lower case are different names, so that a name of
/// another tool (`OverTaker`, `Ego` beside `ego`) is kept.
///
/// A name is written as it is in every output: it needs no quotes in the key of a setting
/// (`actor.NAME.…`, for which it has no dot), CSV, XML, HTML, an entity path of a recording, or a
/// shell. No file has the name of an actor, because some file systems do not tell upper from lower
/// case.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct ActorId(Arc<str>);

/// The error for a text that is not a valid actor name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not an actor's name: {allowed}", allowed = ActorId::ALLOWED)]
pub struct InvalidActorId {
    name: String,
}

impl ActorId {
    /// The names that are allowed, in words.
    pub const ALLOWED: &str =
        "letters (a-z, A-Z), digits, hyphens and underscores, starting with a letter or an underscore";
    /// The names that are allowed, as a regular expression.
    pub const PATTERN: &str = "^[A-Za-z_][A-Za-z0-9_-]*$";

    /// Creates an identifier from a name.
    ///
    /// # Errors
    /// [`InvalidActorId`] if `name` is empty, does not start with a letter or an underscore, or
    /// contains characters other than `a-z`, `A-Z`, `0-9`, `-` and `_`.
    pub fn new(name: &str) -> Result<Self, InvalidActorId> {
        let is_valid = name.starts_with(may_start) && name.chars().all(may_contain);
        if is_valid { Ok(Self(name.into())) } else { Err(InvalidActorId { name: name.to_owned() }) }
    }

    /// Returns the name nearest to a text: an underscore replaces each character that a name cannot
    /// have, and precedes a text that cannot begin one.
    pub fn nearest(text: &str) -> Self {
        let start = if text.starts_with(may_start) || !text.starts_with(may_contain) { "" } else { "_" };
        let replaced = text.chars().map(|c| if may_contain(c) { c } else { '_' });
        let name: String = start.chars().chain(replaced).collect();
        Self(if name.is_empty() { "_".into() } else { name.into() })
    }

    /// Returns the name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

fn may_start(c: char) -> bool {
    c.is_ascii_alphabetic() || c == '_'
}

fn may_contain(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '-')
}

/// Returns true if `name` consists of lower-case letters, digits and hyphens, and starts with a
/// letter: the rule for the names of scenarios, which also name files, of parameters, members of
/// ensembles and sensors.
pub fn is_kebab_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

/// Returns a text as a name of lower-case letters, digits and hyphens: a hyphen replaces each other
/// character, and `v-` precedes a text that does not begin with a letter.
pub fn kebab_name(text: &str) -> String {
    let plain: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    if is_kebab_name(&plain) { plain } else { format!("v-{plain}") }
}

impl TryFrom<String> for ActorId {
    type Error = InvalidActorId;
    fn try_from(name: String) -> Result<Self, InvalidActorId> {
        Self::new(&name)
    }
}

impl From<ActorId> for String {
    fn from(id: ActorId) -> Self {
        id.0.to_string()
    }
}

impl fmt::Display for ActorId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_another_tool_is_a_name_if_no_output_has_to_quote_it() {
        for name in ["ego", "Ego", "EGO", "OverTaker_2", "_lead", "__", "v-2nd", "front", &"x".repeat(1_000)] {
            assert_eq!(ActorId::new(name).unwrap().as_str(), name);
        }
        assert_ne!(ActorId::new("Ego"), ActorId::new("ego"));
        for name in ["", "2nd", "-a", "a b", "a.b", "a/b", "a$b", "é", "a\n", "a=b", "a,b", "a\"b"] {
            let error = ActorId::new(name).unwrap_err().to_string();
            assert!(error.ends_with("hyphens and underscores, starting with a letter or an underscore"), "{error}");
        }
    }

    #[test]
    fn the_nearest_name_differs_only_where_it_has_to() {
        for (text, nearest) in [
            ("OverTaker_2", "OverTaker_2"),
            ("Car 1", "Car_1"),
            ("2nd", "_2nd"),
            ("-a", "_-a"),
            (" a.b", "_a_b"),
            ("Überholer", "_berholer"),
            ("", "_"),
        ] {
            assert_eq!(ActorId::nearest(text).as_str(), nearest);
            assert!(ActorId::new(nearest).is_ok());
        }
    }

    #[test]
    fn a_text_becomes_a_name_of_lower_case_letters_digits_and_hyphens() {
        assert_eq!(kebab_name("OverTaker_2"), "overtaker-2");
        assert_eq!(kebab_name("2nd"), "v-2nd");
        assert_eq!(kebab_name(""), "v-");
    }
}
