//! Changes single values of a scenario from the command line: `--set key=value`.
//!
//! A setting changes the text of the scenario before the text is checked, hashed, or stored in the
//! campaign's manifest. All later steps thus work on one text and need no special case.

use std::fmt;
use std::str::FromStr;

use closecall_traffic::suggest::hint;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Formatted, InlineTable, Item, TableLike, Value};

/// One `key=value` from the command line.
///
/// The key is a path of keys joined by dots. An element of a list is identified by its index, from
/// 0, or by its `id` or `name` (`actor.2.…`, `actor[2].…`, `actor.rear.…`). A key without a dot
/// that is the name of a parameter fixes that parameter: `brake-mps2=6`. The value replaces a whole
/// list, a whole element of a list, or a single value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    key: Vec<String>,
    value: String,
}

/// Tables at the top level that a file may leave out and a setting may create.
const OPTIONAL_TABLES: [&str; 3] = ["ideal", "fault", "controller"];

/// Keys of a parameter that leave its distribution as it is.
const REMARKS: [&str; 5] = ["fitted", "assumed", "observed", "spearman", "note"];

/// A setting that cannot be applied.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingError {
    /// The text is not of the form key=value.
    #[error("`{text}` is not of the form key=value")]
    Form {
        /// The text of the setting.
        text: String,
    },
    /// The value begins like a list, a table or a quoted text, but is not valid TOML.
    #[error(
        "the value of `{key}` is no TOML: {message}: lists are written [1, 2], tables {{key = 1}}, texts in quotes"
    )]
    NotToml {
        /// The key.
        key: String,
        /// What is wrong.
        message: String,
    },
    /// The value is NaN or infinite.
    #[error("`{key}={value}`: a finite number is needed")]
    NotFinite {
        /// The key.
        key: String,
        /// The value of the setting.
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
    /// A list has no such element.
    #[error("`{key}` leads nowhere: there is no {part}: {allowed}{}", hint(part.trim_matches('`'), allowed))]
    NoSuchElement {
        /// The whole key.
        key: String,
        /// The part that was not found.
        part: String,
        /// What is allowed.
        allowed: String,
    },
    /// The scenario cannot have the value.
    #[error("`{setting}`: {message}")]
    Value {
        /// The setting.
        setting: String,
        /// What is wrong and what is allowed.
        message: String,
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
        let (path, value) = text.split_once('=').ok_or_else(form)?;
        let mut key = Vec::new();
        for part in path.split('.') {
            // `list[0]` is the same as `list.0`.
            let (name, indices) = part.trim().split_once('[').unwrap_or((part.trim(), "]"));
            let indices = indices.strip_suffix(']').ok_or_else(form)?;
            key.push(name.trim().to_owned());
            if part.contains('[') {
                key.extend(indices.split("][").map(|index| index.trim().to_owned()));
            }
        }
        let value = value.trim().to_owned();
        if key.iter().any(|part| part.is_empty() || part.contains(['[', ']'])) || value.is_empty() {
            return Err(form());
        }
        let key_text = || key.join(".");
        if value.parse().is_ok_and(|number: f64| !number.is_finite()) {
            return Err(SettingError::NotFinite { key: key_text(), value });
        }
        if value.starts_with(['[', '{', '"', '\''])
            && let Err(error) = Value::from_str(&value)
        {
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            return Err(SettingError::NotToml { key: key_text(), message });
        }
        Ok(Self { key, value })
    }
}

impl Setting {
    /// Returns the first pair of settings that contradict each other: the later setting
    /// [undoes](Self::undoes) the earlier one.
    pub fn contradiction(settings: &[Self]) -> Option<[&Self; 2]> {
        settings.iter().enumerate().find_map(|(index, later)| {
            let earlier = settings[..index].iter().find(|earlier| later.undoes(earlier))?;
            Some([earlier, later])
        })
    }

    /// Sets the values in `document`, one after the other.
    ///
    /// # Errors
    /// [`SettingError`] for the first setting that cannot be applied, and for two settings that
    /// contradict each other only in this document: an id and an index name the same element of a
    /// list (`actor.rear.…`, `actor.2.…`). The caller checks for settings that contradict each other
    /// in every document: see [`Self::contradiction`].
    pub(super) fn apply_all(settings: &[Self], document: &mut DocumentMut) -> Result<(), SettingError> {
        let mut by_index: Vec<Self> = Vec::new();
        for (index, later) in settings.iter().enumerate() {
            let same = later.by_index(document);
            for (earlier, earlier_by_index) in settings[..index].iter().zip(&by_index) {
                if same.undoes(earlier_by_index) && !later.undoes(earlier) {
                    return Err(SettingError::Contradiction { first: earlier.to_string(), second: later.to_string() });
                }
            }
            by_index.push(same);
            later.apply(document)?;
        }
        Ok(())
    }

    /// Returns the same setting with indices in place of the ids of list elements.
    fn by_index(&self, document: &mut DocumentMut) -> Self {
        let mut key = self.key.clone();
        let mut node = Some(Node::Table(document.as_table_mut()));
        for part in &mut key {
            let Some(current) = node else { break };
            if let Some(index) = current.index_of(part) {
                *part = index.to_string();
            }
            node = current.child(part);
        }
        Self { key, value: self.value.clone() }
    }

    /// Returns true if this setting leaves nothing of an `earlier` one:
    ///
    /// - Both have the same key and different values.
    /// - This setting replaces the table that contains the earlier key.
    /// - The earlier setting fixes a parameter, and this one gives the parameter a distribution or
    ///   another value.
    ///
    /// A setting may refine an earlier one: it may change a part of a table that the earlier
    /// setting gave, or fix a parameter whose distribution the earlier setting gave.
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

    /// Returns the parameter that the setting fixes, and the value: of `NAME=…`,
    /// `parameters.NAME={fixed=…}` or `parameters.NAME.fixed=…`. The key `NAME` may also be a key
    /// of the file.
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
        if let [name] = &self.key[..] {
            let parameters = document.get_mut("parameters").and_then(Item::as_table_like_mut);
            let names = parameters.as_deref().map(keys).unwrap_or_default();
            if let Some(parameters) = parameters.filter(|parameters| parameters.contains_key(name)) {
                let fixed = InlineTable::from_iter([("fixed", value)]);
                parameters.insert(name, Item::Value(Value::InlineTable(fixed)));
                return Ok(());
            }
            if !document.contains_key(name) {
                let allowed = format!("the parameters {names} and the keys {}", keys(document.as_table()));
                return Err(self.no_such_key(&format!("`{name}`"), allowed));
            }
        }
        let Some((last, parents)) = self.key.split_last() else { return Ok(()) };
        let mut node = Node::Table(document.as_table_mut());
        for (depth, part) in parents.iter().enumerate() {
            // A table that the file leaves out is created if it lies below the first level. The
            // check of the scenario covers the new table too.
            let is_optional = depth > 0 || OPTIONAL_TABLES.contains(&part.as_str());
            if let Node::Table(table) = &mut node
                && is_optional
                && !table.contains_key(part)
            {
                if self.key[depth + 1].parse::<usize>().is_ok() {
                    return Err(self.no_list(&**table, depth));
                }
                table.insert(part, Item::Value(Value::InlineTable(InlineTable::new())));
            }
            let missing = self.missing(&node, (depth > 0).then(|| parents[depth - 1].as_str()), part);
            node = node.child(part).ok_or(missing)?;
        }
        let missing = self.missing(&node, parents.last().map(String::as_str), last);
        let index = node.index_of(last);
        match (node, index) {
            (Node::Table(table), _) => {
                table.insert(last, Item::Value(value));
            }
            (Node::Tables(tables), Some(index)) => match (tables.get_mut(index), value) {
                (Some(element), Value::InlineTable(table)) => *element = table.into_table(),
                _ => {
                    return Err(self.no_such_element(
                        &format!("value `{last}`"),
                        "an element of this list is a table {…}".to_owned(),
                    ));
                }
            },
            (Node::Array(array), Some(index)) => {
                array.replace(index, value);
            }
            (Node::Tables(_) | Node::Array(_) | Node::Value, _) => return Err(missing),
        }
        Ok(())
    }

    /// Returns the error for a part of the key that leads nowhere. `parent` is the part before it.
    fn missing(&self, node: &Node<'_>, parent: Option<&str>, part: &str) -> SettingError {
        let parent = parent.unwrap_or_default();
        match node {
            Node::Table(table) if table.contains_key(part) => {
                self.no_such_key(&format!("table `{part}`"), "a value".to_owned())
            }
            Node::Table(table) => self.no_such_key(&format!("`{part}`"), keys(&**table)),
            Node::Value => self.no_such_key(&format!("table `{parent}`"), "a value".to_owned()),
            Node::Tables(_) | Node::Array(_) => {
                let ids: Vec<String> = node.ids().into_iter().flatten().map(|id| format!("`{id}`")).collect();
                let allowed = match (node.ids().len(), ids.is_empty()) {
                    (0, _) => format!("the list `{parent}` is empty"),
                    (1, true) => format!("the list `{parent}` has the element 0 only"),
                    (count, true) => format!("the list `{parent}` has the elements 0 to {}", count - 1),
                    (count, false) => {
                        format!("the list `{parent}` has the elements 0 to {}, named {}", count - 1, ids.join(", "))
                    }
                };
                self.no_such_element(&format!("`{part}`"), allowed)
            }
        }
    }

    /// Returns the error for a key whose part at `depth` needs a list that `table` does not have.
    fn no_list(&self, table: &dyn TableLike, depth: usize) -> SettingError {
        let list = self.key[..=depth].join(".");
        let names = match keys(table) {
            names if names.is_empty() => "nothing".to_owned(),
            names => names,
        };
        let allowed = format!("the file has {names} there; if the list exists, `{list}=[…]` gives it whole");
        self.no_such_element(&format!("`{}`", self.key[depth]), allowed)
    }

    fn no_such_element(&self, part: &str, allowed: String) -> SettingError {
        SettingError::NoSuchElement { key: self.key.join("."), part: part.to_owned(), allowed }
    }

    fn no_such_key(&self, part: &str, names: String) -> SettingError {
        SettingError::NoSuchKey { key: self.key.join("."), part: part.to_owned(), names }
    }

    /// Returns the value as TOML. A text that is not valid TOML becomes a string.
    fn value(&self) -> Value {
        Value::from_str(&self.value).unwrap_or_else(|_| Value::String(Formatted::new(self.value.clone())))
    }
}

/// A place in a document that the parts of a key lead to.
enum Node<'a> {
    /// A table in either of the two forms of TOML.
    Table(&'a mut dyn TableLike),
    /// A list of tables, written `[[…]]`.
    Tables(&'a mut ArrayOfTables),
    /// A list, written `[…]`.
    Array(&'a mut Array),
    /// A single value. No part of a key leads further.
    Value,
}

impl<'a> Node<'a> {
    fn of_value(value: &'a mut Value) -> Self {
        match value {
            Value::InlineTable(table) => Self::Table(table),
            Value::Array(array) => Self::Array(array),
            _ => Self::Value,
        }
    }

    fn of_item(item: &'a mut Item) -> Self {
        match item {
            Item::Table(table) => Self::Table(table),
            Item::ArrayOfTables(tables) => Self::Tables(tables),
            Item::Value(value) => Self::of_value(value),
            Item::None => Self::Value,
        }
    }

    /// Returns the place that the next part of a key leads to, if there is such a key or element.
    fn child(self, part: &str) -> Option<Self> {
        let index = self.index_of(part);
        match self {
            Self::Table(table) => table.get_mut(part).map(Self::of_item),
            Self::Tables(tables) => tables.get_mut(index?).map(|table| Self::Table(table)),
            Self::Array(array) => array.get_mut(index?).map(Self::of_value),
            Self::Value => None,
        }
    }

    /// Returns the index of the element of a list that a part of a key names, by its `id`, its
    /// `name` or its index. Returns `None` if this is no list, or has no such element.
    fn index_of(&self, part: &str) -> Option<usize> {
        let ids = self.ids();
        let index = || part.parse::<usize>().ok().filter(|index| *index < ids.len());
        ids.iter().position(|id| *id == Some(part)).or_else(index)
    }

    /// Returns the `id` or `name` of each element of a list; nothing if this is no list.
    fn ids(&self) -> Vec<Option<&str>> {
        fn id(table: &dyn TableLike) -> Option<&str> {
            table.get("id").or_else(|| table.get("name")).and_then(Item::as_str)
        }
        match self {
            Self::Tables(tables) => tables.iter().map(|table| id(table)).collect(),
            Self::Array(array) => {
                array.iter().map(|value| value.as_inline_table().and_then(|table| id(table))).collect()
            }
            Self::Table(_) | Self::Value => Vec::new(),
        }
    }
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
            Setting::apply_all(&texts.map(|text| text.parse::<Setting>().unwrap()), &mut document.clone())
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
            // What the caller finds without the document.
            ["actor.rear.start.behind.gap-m=90", "actor.rear.start.behind.gap-m=120"],
        ] {
            assert_eq!(checked(texts), Ok(()), "{texts:?}");
        }
    }

    #[test]
    fn a_list_is_replaced_and_its_elements_are_set_in_both_spellings() {
        const LISTS: &str = "tags = ['a', 'b']\n[sensors]\ncameras = [{ name = 'wide', yaw-deg = 3 }, { name = 'low' }]\n\
                             [[actor]]\nid = 'ego'\n[[actor]]\nid = 'rear'\n[[actor.event]]\nid = 'brakes'\n";
        let set = |text: &str| -> Result<toml::Table, String> {
            let mut document: DocumentMut = LISTS.parse().unwrap();
            let setting: Setting = text.parse().map_err(|error: SettingError| error.to_string())?;
            Setting::apply_all(&[setting], &mut document).map_err(|error| error.to_string())?;
            Ok(document.to_string().parse().unwrap())
        };
        let is = |setting: &str, [from, to]: [&str; 2]| {
            let expected: toml::Table = LISTS.replacen(from, to, 1).parse().unwrap();
            assert_eq!(set(setting), Ok(expected), "{setting}");
        };
        for key in ["sensors.cameras.0.yaw-deg", "sensors.cameras[0].yaw-deg", "sensors.cameras.wide.yaw-deg"] {
            is(&format!("{key}=4"), ["yaw-deg = 3", "yaw-deg = 4"]);
        }
        is("sensors.cameras[1]={name='far'}", ["'low'", "'far'"]);
        is("sensors.cameras=[{name='far'}]", ["{ name = 'wide', yaw-deg = 3 }, { name = 'low' }", "{ name = 'far' }"]);
        is("sensors.cameras=[]", ["[{ name = 'wide', yaw-deg = 3 }, { name = 'low' }]", "[]"]);
        is("tags[1]=c", ["'b'", "'c'"]);
        is("actor.rear.event[0].id=x", ["'brakes'", "'x'"]);
        is("actor[0]={id='me'}", ["'ego'", "'me'"]);
        is("actor[1].event=[{id='x'},{id='y'}]", ["id = 'brakes'", "id = 'x'\n[[actor.event]]\nid = 'y'"]);
        assert_eq!("a[0] . b [1]=2".parse::<Setting>().unwrap().to_string(), "a.0.b.1=2");
        assert_eq!("a[0].b[1][2]=2".parse::<Setting>().unwrap().to_string(), "a.0.b.1.2=2");
        for (setting, said) in [
            (
                "actor.2.id=x",
                "`actor.2.id` leads nowhere: there is no `2`: the list `actor` has the elements 0 to 1, named `ego`, `rear`",
            ),
            ("actor[-1].id=x", "there is no `-1`: the list `actor` has the elements 0 to 1"),
            ("actor.raer.id=x", "did you mean `rear`?"),
            ("tags.2=c", "there is no `2`: the list `tags` has the elements 0 to 1"),
            ("tags.0.x=c", "there is no table `0`, only a value"),
            ("actor.0=3", "an element of this list is a table {…}"),
            ("sensors.lidars.0.name=x", "`sensors.lidars=[…]` gives it whole"),
            ("actor.rear.events.0.id=x", "there is no `events`: the file has `id`, `event` there"),
            ("actor.rear.events.0.id=x", "did you mean `event`?"),
            ("actor[0=3", "is not of the form key=value"),
            ("actor[]=3", "is not of the form key=value"),
            ("actor=[{id=me}]", "the value of `actor` is no TOML: "),
        ] {
            let message = set(setting).unwrap_err();
            assert!(message.contains(said), "{setting}: {message}");
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
        let unknown = ["actor.front.id=1", "actor.7.id=1", "actor.rear=3", "road.lanes=2", "duration-s.x=1", "brake=3"];
        for text in ["nonsense", "=1", "a=", "duration-s=nan", "duration-s=-inf"].into_iter().chain(unknown) {
            assert!(set(text).is_err(), "{text}");
        }
    }
}
