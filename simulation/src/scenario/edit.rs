//! Changes of single values from the command line: `--set key=value`.
//!
//! A setting changes the text of the scenario, so that everything behind it (checking, hashing, the campaign's
//! manifest, replay) sees one text and needs no second path.

use std::str::FromStr;

use toml_edit::{ArrayOfTables, DocumentMut, Formatted, InlineTable, Item, TableLike, Value};

/// One `key=value` from the command line.
///
/// The key is a path of keys joined by dots. An actor is named by its id or its place (`actor.rear.…`, `actor.2.…`).
/// A key without a dot that is the name of a parameter fixes that parameter: `brake-mps2=6`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    key: Vec<String>,
    value: String,
}

/// A setting that cannot be applied.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// Not of the form key=value.
    #[error("`{text}` is not of the form key=value")]
    Form {
        /// The text found.
        text: String,
    },
    /// A number that is none.
    #[error("`{key}={value}`: a finite number is needed")]
    NotFinite {
        /// The key.
        key: String,
        /// The value found.
        value: String,
    },
    /// The key leads nowhere.
    #[error("`{key}` leads nowhere: there is no {part}, only {known}")]
    NoSuchKey {
        /// The whole key.
        key: String,
        /// The part that was not found.
        part: String,
        /// What there is instead.
        known: String,
    },
}

impl FromStr for Setting {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, SettingError> {
        let form = || SettingError::Form { text: text.to_owned() };
        let (key, value) = text.split_once('=').ok_or_else(form)?;
        let key: Vec<String> = key.trim().split('.').map(|part| part.trim().to_owned()).collect();
        let value = value.trim().to_owned();
        if key.iter().any(String::is_empty) || value.is_empty() {
            return Err(form());
        }
        if value.parse().is_ok_and(|number: f64| !number.is_finite()) {
            return Err(SettingError::NotFinite { key: key.join("."), value });
        }
        Ok(Self { key, value })
    }
}

impl Setting {
    /// Changes the value in `document`.
    ///
    /// # Errors
    /// [`SettingError::NoSuchKey`] where a part of the key other than the last does not exist.
    pub(super) fn apply(&self, document: &mut DocumentMut) -> Result<(), SettingError> {
        let value = self.value();
        if let [name] = &self.key[..]
            && let Some(parameters) = document.get_mut("parameters").and_then(Item::as_table_like_mut)
            && parameters.contains_key(name)
        {
            let fixed = InlineTable::from_iter([("fixed", value)]);
            parameters.insert(name, Item::Value(Value::InlineTable(fixed)));
            return Ok(());
        }
        if let [name] = &self.key[..]
            && !document.contains_key(name)
        {
            let parameters = document.get("parameters").and_then(Item::as_table_like).map(keys).unwrap_or_default();
            return Err(self.lost(
                &format!("`{name}`"),
                format!("the parameters {parameters} and the keys {}", keys(document.as_table())),
            ));
        }
        let Some((last, way)) = self.key.split_last() else { return Ok(()) };
        let mut table: &mut dyn TableLike = document.as_table_mut();
        let mut way = way.iter();
        while let Some(part) = way.next() {
            // Below the first level a table may be left out of the file; what it then holds is checked like the rest.
            if !table.contains_key(part) && *part != self.key[0] {
                table.insert(part, Item::Value(Value::InlineTable(InlineTable::new())));
            }
            let known = keys(table);
            let item = table.get_mut(part).ok_or_else(|| self.lost(&format!("`{part}`"), known))?;
            table = match item {
                Item::ArrayOfTables(tables) => self.element(part, tables, way.next())?,
                item => item
                    .as_table_like_mut()
                    .ok_or_else(|| self.lost(&format!("table `{part}`"), "a value".to_owned()))?,
            };
        }
        if table.get(last).is_some_and(Item::is_array_of_tables) {
            return Err(self.lost(&format!("single `{last}`"), "a list of them".to_owned()));
        }
        table.insert(last, Item::Value(value));
        Ok(())
    }

    /// The element of an array of tables that the next part of the key names, by its id or by its place.
    fn element<'a>(
        &self,
        array: &str,
        tables: &'a mut ArrayOfTables,
        name: Option<&String>,
    ) -> Result<&'a mut dyn TableLike, SettingError> {
        let ids: Vec<String> =
            tables.iter().map(|table| table.get("id").and_then(Item::as_str).unwrap_or_default().to_owned()).collect();
        let lost = || {
            let part = name.map_or_else(|| format!("single `{array}`"), |name| format!("`{name}`"));
            self.lost(&part, format!("`{array}` with a name and a key: {}", ids.join(", ")))
        };
        let name = name.ok_or_else(lost)?;
        let place = ids.iter().position(|id| id == name).or_else(|| name.parse().ok()).ok_or_else(lost)?;
        match tables.get_mut(place) {
            Some(table) => Ok(table),
            None => Err(lost()),
        }
    }

    fn lost(&self, part: &str, known: String) -> SettingError {
        SettingError::NoSuchKey { key: self.key.join("."), part: part.to_owned(), known }
    }

    /// The value as TOML; what is not TOML is taken for a word.
    fn value(&self) -> Value {
        Value::from_str(&self.value).unwrap_or_else(|_| Value::String(Formatted::new(self.value.clone())))
    }
}

fn keys(table: &dyn TableLike) -> String {
    table.iter().map(|(key, _)| format!("`{key}`")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "duration-s = 60 # long\n[parameters]\nbrake-mps2 = { uniform = { min = 4, max = 8 } }\n\
                        [[actor]]\nid = 'rear'\nstart = { behind = { gap-m = 120 } }\n";

    fn set(text: &str) -> Result<String, SettingError> {
        let mut document: DocumentMut = TEXT.parse().unwrap();
        text.parse::<Setting>()?.apply(&mut document)?;
        Ok(document.to_string())
    }

    #[test]
    fn a_value_is_changed_where_it_stands() {
        assert!(set("duration-s=30").unwrap().starts_with("duration-s = 30\n[parameters]"));
        assert!(set("actor.rear.start.behind.gap-m=90").unwrap().contains("gap-m = 90"));
        assert!(set("actor.0.start.behind.gap-m=$gap").unwrap().contains("gap-m = \"$gap\""));
        assert!(set("parameters.brake-mps2.uniform.min=5").unwrap().contains("min = 5"));
    }

    #[test]
    fn a_parameter_is_fixed_by_its_name() {
        assert!(set("brake-mps2=6.5").unwrap().contains("brake-mps2 = { fixed = 6.5 }"));
    }

    #[test]
    fn what_leads_nowhere_is_refused() {
        let lost = ["actor.front.id=1", "actor.7.id=1", "actor=3", "road.lanes=2", "duration-s.x=1", "brake=3"];
        for text in ["nonsense", "=1", "a=", "duration-s=nan", "duration-s=-inf"].into_iter().chain(lost) {
            assert!(set(text).is_err(), "{text}");
        }
    }
}
