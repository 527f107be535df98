//! Turns the keywords of a call into the arguments of a command.
//!
//! The arguments of a command are a struct. Its fields are the options of the command line and the
//! keywords of a call. A field whose name begins with `..` is a struct of further arguments: the call
//! gives their keywords beside all others. The attributes for clap say which arguments exclude each
//! other.

use std::slice::Iter;

use clap::{Arg, Args, Command};
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::{Map, Value};

use super::CliError;
use super::argument::Argument;

/// The beginning of the name of a field that is a struct of further arguments.
const GROUP: &str = "..";

/// For each expected value, the words of serde and the words for a user.
const EXPECTED: [(&str, &str); 10] = [
    ("u64", "a whole number, 0 or more"),
    ("u32", "a whole number, 0 or more"),
    ("u16", "a whole number, 0 or more"),
    ("usize", "a whole number, 0 or more"),
    ("f64", "a number"),
    ("a sequence", "a list"),
    ("a boolean", "True or False"),
    ("path string", "a path"),
    ("a string", "a text"),
    ("string or map", "a text"),
];
/// For each given value, the words of serde and the words for a user. A word before a quoted value is
/// left out.
const GIVEN: [(&str, &str); 9] = [
    ("integer ", ""),
    ("floating point ", ""),
    ("string ", ""),
    ("boolean `true`", "True"),
    ("boolean `false`", "False"),
    ("null", "None"),
    ("unit value", "None"),
    ("map", "a dictionary"),
    ("sequence", "a list"),
];

/// Returns a message of serde in words for a user: it names the value that is not allowed, and the
/// expected value.
fn plain(message: &str) -> String {
    if let Some(unknown) = message.strip_prefix("unknown variant ") {
        return unknown.to_owned();
    }
    let types = ["invalid type: ", "invalid value: "];
    let wrong =
        types.iter().find_map(|kind| message.strip_prefix(*kind)).and_then(|rest| rest.rsplit_once(", expected "));
    let Some((given, expected)) = wrong else { return message.to_owned() };
    let given = GIVEN.iter().find_map(|(word, plain)| Some(format!("{plain}{}", given.strip_prefix(*word)?)));
    let expected = EXPECTED.iter().find(|(word, _)| *word == expected).map_or(expected, |(_, plain)| *plain);
    match given {
        Some(given) => format!("{given} is not allowed: expected {expected}"),
        None => format!("expected {expected}"),
    }
}

/// Returns the arguments of a command from its keywords, which are a JSON object.
pub(super) fn arguments<T: Args + DeserializeOwned>(keywords: &str) -> Result<T, CliError> {
    let refused = |error: serde_json::Error| CliError::usage(error.to_string());
    let mut keywords: Map<String, Value> = serde_json::from_str(keywords).map_err(refused)?;
    check_conflicts::<T>(&keywords)?;
    let arguments = T::deserialize(Group(&mut keywords)).map_err(refused)?;
    match keywords.keys().next() {
        Some(name) => Err(CliError::usage(format!("there is no keyword `{name}`"))),
        None => Ok(arguments),
    }
}

/// Refuses keywords that exclude each other.
fn check_conflicts<T: Args>(keywords: &Map<String, Value>) -> Result<(), CliError> {
    let command = T::augment_args(Command::new("call"));
    let name = |arg: &Arg| arg.get_long().unwrap_or_default().replace('-', "_");
    let is_given = |arg: &&Arg| keywords.contains_key(&name(arg));
    for arg in command.get_arguments().filter(is_given) {
        if let Some(other) = command.get_arg_conflicts_with(arg).into_iter().find(is_given) {
            return Err(CliError::usage(format!("{}= cannot be used with {}=", name(arg), name(other))));
        }
    }
    Ok(())
}

/// Deserialises a struct from its keywords, and removes these keywords from the map.
struct Group<'a>(&'a mut Map<String, Value>);

impl<'de> Deserializer<'de> for Group<'_> {
    type Error = serde_json::Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        visitor.visit_map(Fields { keywords: self.0, rest: fields.iter(), field: "" })
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Self::Error> {
        Err(Error::custom("keywords make a struct"))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

/// The fields of a struct that the keywords give.
struct Fields<'a> {
    keywords: &'a mut Map<String, Value>,
    rest: Iter<'static, &'static str>,
    field: &'static str,
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = serde_json::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Self::Error> {
        let is_given = |field: &&&str| field.starts_with(GROUP) || self.keywords.contains_key(**field);
        let Some(field) = self.rest.by_ref().find(is_given) else { return Ok(None) };
        self.field = field;
        let name: StrDeserializer<'_, Self::Error> = field.into_deserializer();
        seed.deserialize(name).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Self::Error> {
        if self.field.starts_with(GROUP) {
            return seed.deserialize(Group(self.keywords));
        }
        let value = self.keywords.remove(self.field).unwrap_or_default();
        seed.deserialize(value)
            .map_err(|error| Error::custom(format!("{}=: {}", self.field, plain(&error.to_string()))))
    }
}

/// The name of an argument, and whether it is given.
type Given = (&'static str, bool);

/// Refuses an argument that needs another one, if that one is missing.
pub(super) fn needs((name, is_given): Given, (needed, needed_is_given): Given) -> Result<(), CliError> {
    match is_given && !needed_is_given {
        true => Err(CliError::usage(format!("{} needs {}", Argument(name), Argument(needed)))),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use closecall_campaign::session;
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Args, Deserialize)]
    struct Arguments {
        file: String,
        #[command(flatten)]
        #[serde(rename = "..limits")]
        limits: Limits,
        #[arg(long, conflicts_with = "most")]
        share: Option<f64>,
    }

    #[derive(Debug, Default, PartialEq, Args, Deserialize)]
    #[serde(default)]
    struct Limits {
        #[arg(long)]
        most: u64,
        #[arg(long)]
        is_strict: bool,
    }

    #[test]
    fn keywords_make_a_struct_with_groups() {
        let limits = Limits { most: 3, is_strict: false };
        let expected = Arguments { file: "a".to_owned(), limits, share: None };
        assert_eq!(arguments::<Arguments>(r#"{"most": 3, "file": "a"}"#).unwrap(), expected);
    }

    #[test]
    fn a_wrong_keyword_is_named() {
        for (keywords, message) in [
            (
                r#"{"file": "a", "most": "three"}"#,
                "most=: \"three\" is not allowed: expected a whole number, 0 or more",
            ),
            (r#"{"file": "a", "most": -1}"#, "most=: `-1` is not allowed: expected a whole number, 0 or more"),
            (r#"{"file": "a", "is_strict": 1}"#, "is_strict=: `1` is not allowed: expected True or False"),
            (r#"{"file": "a", "most": 1.5}"#, "most=: `1.5` is not allowed: expected a whole number, 0 or more"),
            (r#"{"file": "a", "most": true}"#, "most=: True is not allowed: expected a whole number, 0 or more"),
            (r#"{"file": 3}"#, "file=: `3` is not allowed: expected a text"),
            (r#"{"file": ["a, expected u64"]}"#, "file=: a list is not allowed: expected a text"),
            (r#"{"file": "a", "most": 1, "share": 0.5}"#, "share= cannot be used with most="),
            (r#"{"file": "a", "mots": 1}"#, "there is no keyword `mots`"),
            (r#"{"file": "a", "..limits": 1}"#, "there is no keyword `..limits`"),
            ("{}", "missing field `file`"),
        ] {
            assert_eq!(arguments::<Arguments>(keywords).unwrap_err().to_string(), message);
        }
    }

    #[test]
    fn an_argument_is_named_as_its_user_knows_it() {
        let message = || needs(("a-b", true), ("c", false)).unwrap_err().to_string();
        assert_eq!(message(), "--a-b needs --c");
        session::Session::default().run("f()", || assert_eq!(message(), "a_b= needs c="));
        assert!(needs(("a-b", false), ("c", false)).is_ok() && needs(("a-b", true), ("c", true)).is_ok());
    }
}
