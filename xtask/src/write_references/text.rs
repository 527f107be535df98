//! The unit and the default of a key, which a doc comment states beside the meaning.

/// The units that doc comments put into brackets.
const UNITS: [&str; 15] =
    ["m/s³", "m/s²", "m/s", "rad/s", "10⁻⁴ rad/s", "1/m", "mm/h", "mm", "m", "s", "rad", "deg", "kg", "EV", "0 to 1"];

/// The ends of keys with their units. If one end is the end of another, the longer stands first.
const ENDS: [(&str, &str); 13] = [
    ("-mm-per-h", "mm/h"),
    ("-per-s", "1/s"),
    ("-per-m", "1/m"),
    ("-mps3", "m/s³"),
    ("-mps2", "m/s²"),
    ("-mps", "m/s"),
    ("-radps", "rad/s"),
    ("-rad", "rad"),
    ("-deg", "deg"),
    ("-kg", "kg"),
    ("-mm", "mm"),
    ("-m", "m"),
    ("-s", "s"),
];

/// Phrases that the page itself says about all of its keys.
const SELF_EVIDENT: [&str; 6] = [
    ", as a scenario file describes them",
    ", as a scenario file describes it",
    " as a scenario file describes them",
    " as a scenario file describes it",
    " as described in a scenario file",
    " (-)",
];

/// A doc comment, taken apart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Described {
    /// The meaning of the key.
    pub(crate) meaning: String,
    /// Its unit.
    pub(crate) unit: Option<String>,
    /// Its value if it is absent.
    pub(crate) default: Option<String>,
}

impl Described {
    /// Takes a doc comment of the key `name` apart. `is_number` says whether the key has a unit of
    /// its own.
    pub(crate) fn new(name: &str, description: &str, is_number: bool) -> Self {
        let mut plain = description.replace("[`", "`").replace("`]", "`");
        for phrase in SELF_EVIDENT {
            plain = plain.replace(phrase, "");
        }
        let (meaning, default) = match default_in(&plain) {
            Some(split) => (split.rest, Some(split.value)),
            None => (plain, None),
        };
        let by_name = ENDS.iter().find(|(end, _)| is_number && name.ends_with(end)).map(|(_, unit)| (*unit).to_owned());
        let written = UNITS.iter().find(|unit| is_number && meaning.contains(&format!(" ({unit})")));
        let unit = by_name.or(written.filter(|unit| **unit != "0 to 1").map(|unit| (*unit).to_owned()));
        let meaning = match written {
            Some(unit) => meaning.replacen(&format!(" ({unit})"), "", 1),
            None => meaning,
        };
        Self { meaning, unit, default }
    }
}

/// A default that a doc comment states, and the comment without it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct StatedDefault {
    /// The default.
    pub(crate) value: String,
    /// The rest of the comment.
    pub(crate) rest: String,
}

/// Finds the default in a doc comment, which says `; 3 if absent.` or `Default: 3.`
pub(crate) fn default_in(text: &str) -> Option<StatedDefault> {
    if let Some((before, after)) = text.split_once("Default: ") {
        let end = after.find(". ").unwrap_or(after.len());
        let value = after[..end].trim_end_matches('.').to_owned();
        let rest = format!("{} {}", before.trim_end(), after[end..].trim_start_matches('.').trim_start());
        return Some(StatedDefault { value, rest: rest.trim_end().to_owned() });
    }
    for end in [" if absent", " where absent", " by default"] {
        if let Some((before, after)) = text.split_once(end)
            && let Some((meaning, value)) = before.rsplit_once("; ")
        {
            return Some(StatedDefault { value: value.to_owned(), rest: format!("{meaning}{after}") });
        }
    }
    None
}
