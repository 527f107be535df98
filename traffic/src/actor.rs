//! Identifiers of the actors in a scenario.

use std::fmt;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The name of an actor: lower-case letters, digits and hyphens, starting with a letter.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct ActorId(Arc<str>);

/// The error for a text that is not a valid actor name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not an actor's name: lower-case letters, digits and hyphens, starting with a letter")]
pub struct InvalidActorId {
    name: String,
}

impl ActorId {
    /// Creates an identifier from a name.
    ///
    /// # Errors
    /// [`InvalidActorId`] if `name` is empty, does not start with a letter, or contains characters
    /// other than `a-z`, `0-9` and `-`.
    pub fn new(name: &str) -> Result<Self, InvalidActorId> {
        if is_kebab_name(name) { Ok(Self(name.into())) } else { Err(InvalidActorId { name: name.to_owned() }) }
    }

    /// Returns the name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Returns true if `name` consists of lower-case letters, digits and hyphens, and starts with a
/// letter.
pub(crate) fn is_kebab_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
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
