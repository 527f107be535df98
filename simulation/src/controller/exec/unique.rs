//! JSON in which no key of an object is there twice. `serde_json` takes the last value of such a key
//! without a word, and its author cannot know which one counts.

use std::cell::RefCell;
use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

/// Why a line is refused.
pub(crate) enum Refused {
    /// It is not JSON.
    NotJson(serde_json::Error),
    /// An object of it has this key twice.
    Repeated(String),
}

/// Parses a line of JSON.
///
/// # Errors
/// [`Refused`] if it is not JSON, or if an object has a key twice.
pub(crate) fn parse(line: &[u8]) -> Result<Value, Refused> {
    let repeated = RefCell::new(None);
    let mut reader = serde_json::Deserializer::from_slice(line);
    let value = Reading { repeated: &repeated }.deserialize(&mut reader);
    let whole = value.and_then(|value| reader.end().map(|()| value));
    whole.map_err(|error| repeated.take().map_or(Refused::NotJson(error), Refused::Repeated))
}

/// Reads one value.
#[derive(Clone, Copy)]
struct Reading<'a> {
    /// The first key that is there twice.
    repeated: &'a RefCell<Option<String>>,
}

impl<'de> DeserializeSeed<'de> for Reading<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Reading<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value of JSON")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = list.next_element_seed(self)? {
            values.push(value);
        }
        Ok(Value::Array(values))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            let value = entries.next_value_seed(self)?;
            if object.contains_key(&key) {
                self.repeated.replace(Some(key));
                return Err(A::Error::custom("a key is there twice"));
            }
            object.insert(key, value);
        }
        Ok(Value::Object(object))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_read_to_the_last_bit() {
        let text = r#"{"a":[-0.1234567890123456,18446744073709551615,-3,true,null,"x\n"],"b":{"a":{}}}"#;
        assert!(parse(text.as_bytes()).is_ok_and(|value| value == serde_json::from_str::<Value>(text).unwrap()));
    }

    #[test]
    fn a_key_that_is_there_twice_is_named_wherever_it_is() {
        for text in [r#"{"a":1,"a":1}"#, r#"[{"b":{"a":1,"c":0,"a":2}}]"#, r#"{"a":1,"a":2"#, r#"{"a":1,"\u0061":2}"#] {
            assert!(matches!(parse(text.as_bytes()), Err(Refused::Repeated(key)) if key == "a"), "{text}");
        }
        for text in ["", "{}{}", "{\"a\":1", "nan"] {
            assert!(matches!(parse(text.as_bytes()), Err(Refused::NotJson(_))), "{text}");
        }
    }
}
