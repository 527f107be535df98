//! Changes single values of a scenario from the command line: `--set key=value`.
//!
//! A setting changes the text of the scenario. All later steps (checking, hashing, the campaign's
//! manifest, replay) thus work on one text and need no special case.

use std::fmt;
use std::str::FromStr;

use closecall_traffic::suggest::hint;
use toml_edit::{ArrayOfTables, DocumentMut, Formatted, InlineTable, Item, TableLike, Value};

/// One `key=value` from the command line.
///
/// The key is a path of keys joined by dots. An actor is identified by its id or by its index, from
/// 0 (`actor.rear.…`, `actor.2.…`). A key without a dot that is the name of a parameter fixes that
/// parameter: `brake-mps2=6`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    key: Vec<String>,
    value: String,
}

/// Tables at the top level that a file may leave out and a setting may create.
const OPTIONAL_TABLES: [&str; 2] = ["ideal", "fault"];

/// Keys of a parameter that leave its distribution as it is.
const REMARKS: [&str; 5] = ["fitted", "assumed", "observed", "spearman", "note"];

/// A setting that cannot be applied.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// The text is not of the form key=value.
    #[error("`{text}` is not of the form key=value")]
    Form {
        /// The text found.
        text: String,
    },
    /// The value is NaN or infinite.
    #[error("`{key}={value}`: a finite number is needed")]
    NotFinite {
        /// The key.
        key: String,
        /// The value found.
        value: String,
    },
    /// The scenario has no such key.
    #[error("`{key}` leads nowhere: there is no {part}, only {names}{}", hint(part.trim_matches('`'), names))]
    NoSuchKey {
        /// The whole key.
        key: String,
        /// The part that was not found.
        part: String,
        /// The keys that exist there.
        names: String,
    },
    /// Two settings name the same element of a list, by its id and by its index, and contradict
    /// each other.
    #[error("`{first}` and `{second}` contradict each other: give one of them")]
    Contradiction {
        /// The earlier setting.
        first: String,
        /// The later setting.
        second: String,
    },
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key.join("."), self.value)
    }
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
    /// Returns the first two settings that contradict each other: the later one
    /// [undoes](Self::undoes) the earlier one.
    pub fn contradiction(settings: &[Self]) -> Option<[&Self; 2]> {
        settings.iter().enumerate().find_map(|(index, later)| {
            let earlier = settings[..index].iter().find(|earlier| later.undoes(earlier))?;
            Some([earlier, later])
        })
    }

    /// Checks that no two settings contradict each other in this document alone, in which an id and
    /// an index name the same element of a list (`actor.rear.…`, `actor.2.…`). Settings that
    /// contradict each other in any document are the caller's: see [`Self::contradiction`].
    ///
    /// # Errors
    /// [`SettingError::Contradiction`] with the first two settings.
    pub(super) fn check_together(settings: &[Self], document: &DocumentMut) -> Result<(), SettingError> {
        let by_index: Vec<Self> = settings.iter().map(|setting| setting.by_index(document)).collect();
        for (index, later) in settings.iter().enumerate() {
            for (earlier, same) in settings[..index].iter().zip(&by_index) {
                if by_index[index].undoes(same) && !later.undoes(earlier) {
                    return Err(SettingError::Contradiction { first: earlier.to_string(), second: later.to_string() });
                }
            }
        }
        Ok(())
    }

    /// Returns the setting with the index of each element of a list that it names by its id.
    fn by_index(&self, document: &DocumentMut) -> Self {
        let mut key = self.key.clone();
        let mut table: Option<&dyn TableLike> = Some(document.as_table());
        let mut parts = key.iter_mut();
        while let (Some(parent), Some(part)) = (table, parts.next()) {
            table = match parent.get(part.as_str()) {
                Some(Item::ArrayOfTables(elements)) => {
                    let Some(name) = parts.next() else { break };
                    let index = index_of(elements, name);
                    if let Some(index) = index {
                        *name = index.to_string();
                    }
                    index.and_then(|index| elements.get(index)).map(|element| element as &dyn TableLike)
                }
                item => item.and_then(Item::as_table_like),
            };
        }
        Self { key, value: self.value.clone() }
    }

    /// Returns true if nothing is left of an `earlier` setting after this one: it has the same key
    /// and another value, it replaces the table in which the earlier key is, or it gives a
    /// parameter that the earlier one fixed a distribution or another value. A part of a table that
    /// an earlier setting gave, and a value of a parameter whose distribution it gave, are no
    /// contradiction.
    pub fn undoes(&self, earlier: &Self) -> bool {
        if self.key == earlier.key {
            return !is_equal(&self.value(), &earlier.value());
        }
        if let (Some((name, value)), Some((fixed, fixed_value))) = (self.fixed(), earlier.fixed())
            && name == fixed
        {
            return !is_equal(&value, &fixed_value);
        }
        let replaces_table = earlier.key.starts_with(&self.key);
        let gives_distribution = match (&earlier.key[..], &self.key[..]) {
            ([fixed], [table, name, rest @ ..]) => {
                let is_remark = rest.first().is_some_and(|key| REMARKS.contains(&key.as_str()));
                table == "parameters" && name == fixed && !is_remark
            }
            _ => false,
        };
        replaces_table || gives_distribution
    }

    /// Returns the parameter that the setting fixes, and its value, whichever way it is written. A
    /// key without a dot may also be a key of the file.
    fn fixed(&self) -> Option<(&str, Value)> {
        match &self.key[..] {
            [name] => Some((name.as_str(), self.value())),
            [table, name] if table == "parameters" => {
                let value = self.value().as_inline_table()?.get("fixed")?.clone();
                Some((name.as_str(), value))
            }
            [table, name, key] if table == "parameters" && key == "fixed" => Some((name.as_str(), self.value())),
            _ => None,
        }
    }

    /// Sets the value in `document`.
    ///
    /// # Errors
    /// [`SettingError::NoSuchKey`] if a part of the key other than the last one does not exist.
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
            return Err(self.no_such_key(
                &format!("`{name}`"),
                format!("the parameters {parameters} and the keys {}", keys(document.as_table())),
            ));
        }
        let Some((last, parents)) = self.key.split_last() else { return Ok(()) };
        let mut table: &mut dyn TableLike = document.as_table_mut();
        let mut parents = parents.iter();
        while let Some(part) = parents.next() {
            // Below the first level, a table that the file leaves out is created. Its content is
            // checked like the rest.
            let is_optional = *part != self.key[0] || OPTIONAL_TABLES.contains(&part.as_str());
            if !table.contains_key(part) && is_optional {
                table.insert(part, Item::Value(Value::InlineTable(InlineTable::new())));
            }
            let names = keys(table);
            let item = table.get_mut(part).ok_or_else(|| self.no_such_key(&format!("`{part}`"), names))?;
            table = match item {
                Item::ArrayOfTables(tables) => self.element(part, tables, parents.next())?,
                item => item
                    .as_table_like_mut()
                    .ok_or_else(|| self.no_such_key(&format!("table `{part}`"), "a value".to_owned()))?,
            };
        }
        if table.get(last).is_some_and(Item::is_array_of_tables) {
            return Err(self.no_such_key(&format!("single `{last}`"), "a list of them".to_owned()));
        }
        table.insert(last, Item::Value(value));
        Ok(())
    }

    /// Returns the element of an array of tables that the next part of the key identifies, by its
    /// id or by its index.
    fn element<'a>(
        &self,
        array: &str,
        tables: &'a mut ArrayOfTables,
        name: Option<&String>,
    ) -> Result<&'a mut dyn TableLike, SettingError> {
        let ids: Vec<String> =
            tables.iter().map(|table| table.get("id").and_then(Item::as_str).unwrap_or_default().to_owned()).collect();
        let not_found = || {
            let part = name.map_or_else(|| format!("single `{array}`"), |name| format!("`{name}`"));
            let ids: Vec<String> = ids.iter().map(|id| format!("`{id}`")).collect();
            self.no_such_key(&part, format!("`{array}` with a name and a key: {}", ids.join(", ")))
        };
        let name = name.ok_or_else(not_found)?;
        let index = index_of(tables, name).ok_or_else(not_found)?;
        match tables.get_mut(index) {
            Some(table) => Ok(table),
            None => Err(not_found()),
        }
    }

    fn no_such_key(&self, part: &str, names: String) -> SettingError {
        SettingError::NoSuchKey { key: self.key.join("."), part: part.to_owned(), names }
    }

    /// Returns the value as TOML. A text that is not valid TOML becomes a string.
    fn value(&self) -> Value {
        Value::from_str(&self.value).unwrap_or_else(|_| Value::String(Formatted::new(self.value.clone())))
    }
}

/// Returns the index of the element that a part of a key names, by its id or by its index.
fn index_of(elements: &ArrayOfTables, name: &str) -> Option<usize> {
    let mut ids = elements.iter().map(|element| element.get("id").and_then(Item::as_str));
    ids.position(|id| id == Some(name)).or_else(|| name.parse().ok())
}

/// Returns true if both values mean the same: numbers are compared as numbers (`6` and `6.0`).
fn is_equal(one: &Value, other: &Value) -> bool {
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|number| number as f64));
    match (number(one), number(other)) {
        (Some(one), Some(other)) => one == other,
        _ => one.to_string().trim() == other.to_string().trim(),
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
    fn a_value_is_changed_in_place() {
        assert!(set("duration-s=30").unwrap().starts_with("duration-s = 30\n[parameters]"));
        assert!(set("actor.rear.start.behind.gap-m=90").unwrap().contains("gap-m = 90"));
        assert_eq!(
            "actor.rear.start.behind.gap-m = 90".parse::<Setting>().unwrap().to_string(),
            "actor.rear.start.behind.gap-m=90"
        );
        assert!(set("actor.0.start.behind.gap-m=$gap").unwrap().contains("gap-m = \"$gap\""));
        assert!(set("parameters.brake-mps2.uniform.min=5").unwrap().contains("min = 5"));
    }

    #[test]
    fn a_parameter_is_fixed_by_its_name() {
        assert!(set("brake-mps2=6.5").unwrap().contains("brake-mps2 = { fixed = 6.5 }"));
    }

    #[test]
    fn a_setting_that_undoes_an_earlier_one_is_found() {
        let contradiction = |texts: &[&str]| {
            let settings: Vec<Setting> = texts.iter().map(|text| text.parse().unwrap()).collect();
            Setting::contradiction(&settings).map(|pair| pair.map(ToString::to_string))
        };
        for texts in [
            ["brake-mps2=6", "brake-mps2=4"],
            ["actor.rear.start.behind.gap-m=90", "actor.rear . start.behind.gap-m = 120"],
            ["actor.rear.start.behind.gap-m=90", "actor.rear.start={behind={gap-m=120}}"],
            ["brake-mps2=6", "parameters.brake-mps2.uniform.min=5"],
            ["parameters.brake-mps2={fixed=5}", "brake-mps2=6"],
            ["brake-mps2=6", "parameters.brake-mps2.fixed=5"],
            ["acc:aeb.trigger-mps2=5", "acc:aeb.trigger-mps2=6"],
        ] {
            let [first, second] = contradiction(&texts).unwrap_or_else(|| panic!("{texts:?}"));
            assert_eq!(first, texts[0]);
            assert_eq!(second.replace(' ', ""), texts[1].replace(' ', ""));
        }
        for texts in [
            ["brake-mps2=6", "brake-mps2=6"],
            ["brake-mps2=6", "brake-mps2=6.0"],
            ["brake-mps2=6", "parameters.brake-mps2.fixed=6"],
            ["brake-mps2=6", "parameters.brake-mps2.assumed=a guess"],
            ["brake-mps2=6", "brake=4"],
            ["parameters.brake-mps2.uniform.min=5", "parameters.brake-mps2.uniform.max=7"],
            ["parameters.brake-mps2={uniform={min=4,max=8}}", "brake-mps2=6"],
            ["actor.rear.start={behind={gap-m=120}}", "actor.rear.start.behind.gap-m=90"],
            ["acc:aeb.trigger-mps2=5", "acc+aeb:aeb.trigger-mps2=6"],
            ["aeb.trigger-mps2=5", "acc:aeb.trigger-mps2=6"],
        ] {
            assert_eq!(contradiction(&texts), None, "{texts:?}");
        }
    }

    #[test]
    fn an_id_and_an_index_of_the_same_actor_are_found_in_the_document() {
        let text = format!("{TEXT}[[actor]]\nid = 'front'\nstart = {{ behind = {{ gap-m = 60 }} }}\n");
        let document: DocumentMut = text.parse().unwrap();
        let checked = |texts: [&str; 2]| {
            Setting::check_together(&texts.map(|text| text.parse::<Setting>().unwrap()), &document)
                .map_err(|error| error.to_string())
        };
        for texts in [
            ["actor.rear.start.behind.gap-m=90", "actor.0.start.behind.gap-m=120"],
            ["actor.1.start.behind.gap-m=90", "actor.front.start.behind.gap-m=120"],
            ["actor.1.start.behind.gap-m=90", "actor.front.start={behind={gap-m=120}}"],
        ] {
            let [first, second] = texts;
            let said = format!("`{first}` and `{second}` contradict each other: give one of them");
            assert_eq!(checked(texts), Err(said));
        }
        for texts in [
            ["actor.rear.start.behind.gap-m=90", "actor.1.start.behind.gap-m=120"],
            ["actor.rear.start.behind.gap-m=90", "actor.0.start.behind.gap-m=90.0"],
            ["actor.rear.start={behind={gap-m=120}}", "actor.0.start.behind.gap-m=90"],
            ["actor.7.start.behind.gap-m=90", "actor.nobody.start.behind.gap-m=120"],
            // What the caller finds without the document.
            ["actor.rear.start.behind.gap-m=90", "actor.rear.start.behind.gap-m=120"],
        ] {
            assert_eq!(checked(texts), Ok(()), "{texts:?}");
        }
    }

    #[test]
    fn a_misspelt_part_is_answered_with_a_suggestion() {
        for (text, expected) in
            [("duration=3", "duration-s"), ("actor.raer.id=x", "rear"), ("brake-mps=3", "brake-mps2")]
        {
            let message = set(text).unwrap_err().to_string();
            assert!(message.ends_with(&format!("; did you mean `{expected}`?")), "{message}");
        }
    }

    #[test]
    fn an_invalid_setting_or_unknown_key_is_rejected() {
        let unknown = ["actor.front.id=1", "actor.7.id=1", "actor=3", "road.lanes=2", "duration-s.x=1", "brake=3"];
        for text in ["nonsense", "=1", "a=", "duration-s=nan", "duration-s=-inf"].into_iter().chain(unknown) {
            assert!(set(text).is_err(), "{text}");
        }
    }
}
