//! The methods by which rare events are sampled, and their names.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A method that samples a rare event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Subset simulation, repeated at fixed levels.
    Subset,
    /// Importance sampling from a mixture that cross-entropy finds.
    Importance,
    /// A search for the first case. It states no probability.
    Search,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 3] = [Self::Subset, Self::Importance, Self::Search];

    /// Returns the name, as on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Subset => "subset",
            Self::Importance => "importance",
            Self::Search => "search",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is not the name of a method.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` is not a method for rare events: one of `subset`, `importance`, `search` is needed")]
pub struct UnknownMethod {
    word: String,
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(word: &str) -> Result<Self, UnknownMethod> {
        let method = Self::ALL.into_iter().find(|method| method.name() == word);
        method.ok_or_else(|| UnknownMethod { word: word.to_owned() })
    }
}
