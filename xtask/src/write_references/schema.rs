//! The tables and keys of the scenario file, as its JSON Schema lists them.

use serde_json::Value;

/// A step from a table to something in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// A key.
    Key(String),
    /// Any element of an array.
    Element,
    /// Any entry of a table whose keys are names of the user's choice.
    Name,
}

/// A path from the root of the file.
pub(crate) type Way = Vec<Step>;

/// The kind of a key's value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    /// A number; `sampled` if a parameter `"$name"` may give it.
    Number {
        /// True if a parameter may give it.
        sampled: bool,
    },
    /// A whole number.
    Whole,
    /// True or false.
    Flag,
    /// Text.
    Text,
    /// One of several words, each with its description; `sampled` if a parameter `"$name"` may give
    /// it.
    Word {
        /// The words, each with its description.
        words: Vec<(String, String)>,
        /// True if a parameter may give it.
        sampled: bool,
    },
    /// A list.
    List(Box<Kind>),
    /// A list of a fixed length.
    Tuple(Box<Kind>, u64),
    /// A table whose keys are fixed: see its own section.
    Table,
    /// A table whose keys are names of the user's choice.
    Map(Box<Kind>),
    /// One of several kinds.
    Either(Vec<Kind>),
}

/// A key of a table.
#[derive(Clone, Debug)]
pub(crate) struct Key {
    /// Its name.
    pub(crate) name: String,
    /// Its doc comment, in one line.
    pub(crate) description: String,
    /// True if it has to be given.
    pub(crate) required: bool,
    /// The schema's default, if it has one.
    pub(crate) default: Option<Value>,
    /// The kind of its value.
    pub(crate) kind: Kind,
}

/// A table of the file.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    /// The name of its definition in the schema, empty for the file itself.
    definition: String,
    /// Where it stands.
    pub(crate) ways: Vec<Way>,
    /// Its doc comment, in one line.
    pub(crate) description: String,
    /// True if exactly one of its keys is given.
    pub(crate) is_choice: bool,
    /// Its keys.
    pub(crate) keys: Vec<Key>,
}

/// Returns all tables, each before its inner tables. `order` gives the position of a key among its
/// neighbours.
pub(crate) fn tables(schema: &Value, order: &dyn Fn(&str) -> usize) -> Vec<Table> {
    let mut reader = Reader { definitions: &schema["$defs"], order, tables: Vec::new() };
    reader.visit(schema, String::new(), Vec::new());
    reader.tables
}

struct Reader<'a> {
    definitions: &'a Value,
    order: &'a dyn Fn(&str) -> usize,
    tables: Vec<Table>,
}

impl<'a> Reader<'a> {
    /// Adds the table that `schema` defines, and its inner tables.
    fn visit(&mut self, schema: &'a Value, definition: String, way: Way) {
        let (mut properties, is_choice) = properties(schema);
        properties.sort_by_key(|property| (self.order)(property.name));
        let is_same = |table: &&mut Table| !definition.is_empty() && table.definition == definition;
        if let Some(table) = self.tables.iter_mut().find(is_same) {
            table.ways.push(way.clone());
        // A choice of one kind is no choice: its content gets its own section.
        } else if !is_choice || properties.len() > 1 {
            let keys = properties.iter().map(|property| self.key(property)).collect();
            let (ways, description) = (vec![way.clone()], description(schema));
            self.tables.push(Table { definition, ways, description, is_choice, keys });
        }
        for property in properties {
            let mut inner = way.clone();
            inner.push(Step::Key(property.name.to_owned()));
            self.descend(property.schema, inner);
        }
    }

    /// Visits the tables that a value of `schema` holds.
    fn descend(&mut self, schema: &'a Value, way: Way) {
        if let Some((name, target)) = self.reference(schema) {
            if properties(target).0.is_empty() {
                self.descend(target, way);
            } else {
                self.visit(target, name.to_owned(), way);
            }
            return;
        }
        for alternative in alternatives(schema) {
            self.descend(alternative, way.clone());
        }
        let with = |step| way.iter().cloned().chain([step]).collect::<Way>();
        if schema["items"].is_object() {
            self.descend(&schema["items"], with(Step::Element));
        }
        if schema["additionalProperties"].is_object() {
            self.descend(&schema["additionalProperties"], with(Step::Name));
        }
    }

    fn reference(&self, schema: &Value) -> Option<(&'a str, &'a Value)> {
        let name = schema["$ref"].as_str()?.strip_prefix("#/$defs/")?;
        let (name, target) = self.definitions.as_object()?.get_key_value(name)?;
        Some((name.as_str(), target))
    }

    fn key(&self, property: &Property<'a>) -> Key {
        let Property { name, schema, required, variant } = *property;
        let target = self.reference(schema).map(|(_, target)| target);
        let texts = [variant, Some(schema), target].into_iter().flatten().map(description);
        let description = texts.into_iter().find(|text| !text.is_empty()).unwrap_or_default();
        let default = schema.get("default").filter(|default| !default.is_null()).cloned();
        Key { name: name.to_owned(), description, required, default, kind: self.kind(schema) }
    }

    fn kind(&self, schema: &'a Value) -> Kind {
        if let Some((name, target)) = self.reference(schema) {
            return match name {
                "Number" => Kind::Number { sampled: true },
                _ => self.kind(target),
            };
        }
        if !properties(schema).0.is_empty() {
            return Kind::Table;
        }
        let words: Vec<_> = alternatives(schema)
            .filter_map(|alternative| Some((alternative["const"].as_str()?.to_owned(), description(alternative))))
            .collect();
        if !words.is_empty() {
            return Kind::Word { words, sampled: false };
        }
        let kinds: Vec<Kind> = alternatives(schema)
            .filter(|alternative| alternative["type"] != "null")
            .map(|alternative| self.kind(alternative))
            .collect();
        match &kinds[..] {
            [] => self.plain_kind(schema),
            [only] => only.clone(),
            // A word, or the name of a parameter that gives it.
            [Kind::Word { words, .. }, Kind::Text] => Kind::Word { words: words.clone(), sampled: true },
            _ => Kind::Either(kinds),
        }
    }

    fn plain_kind(&self, schema: &'a Value) -> Kind {
        let is = |name: &str| match &schema["type"] {
            Value::Array(types) => types.iter().any(|kind| kind == name),
            kind => kind == name,
        };
        if is("array") {
            let element = Box::new(self.kind(&schema["items"]));
            return match schema["maxItems"].as_u64() {
                Some(length) if schema["minItems"] == schema["maxItems"] => Kind::Tuple(element, length),
                _ => Kind::List(element),
            };
        }
        if schema["additionalProperties"].is_object() {
            Kind::Map(Box::new(self.kind(&schema["additionalProperties"])))
        } else if is("integer") {
            Kind::Whole
        } else if is("number") && is("string") {
            Kind::Either(vec![Kind::Number { sampled: false }, Kind::Text])
        } else if is("number") {
            Kind::Number { sampled: false }
        } else if is("boolean") {
            Kind::Flag
        } else {
            Kind::Text
        }
    }
}

/// A key as the schema has it.
#[derive(Clone, Copy)]
struct Property<'a> {
    name: &'a str,
    schema: &'a Value,
    required: bool,
    /// The variant that the key names, in a tagged enumeration.
    variant: Option<&'a Value>,
}

/// The keys of an object, or of the single-key objects of a tagged enumeration; and whether it is
/// an enumeration.
fn properties(schema: &Value) -> (Vec<Property<'_>>, bool) {
    if let Some(properties) = schema["properties"].as_object() {
        let is_required =
            |name: &str| schema["required"].as_array().is_some_and(|all| all.iter().any(|required| required == name));
        let property = |(name, schema)| Property { name, schema, required: is_required(name), variant: None };
        return (properties.iter().map(|(name, schema)| property((name.as_str(), schema))).collect(), false);
    }
    let variants = schema["oneOf"].as_array().map(Vec::as_slice).unwrap_or_default();
    let keys = variants.iter().flat_map(|variant| {
        let properties = variant["properties"].as_object().into_iter().flatten();
        properties.map(move |(name, schema)| Property { name, schema, required: false, variant: Some(variant) })
    });
    (keys.collect(), true)
}

fn alternatives(schema: &Value) -> impl Iterator<Item = &Value> {
    ["anyOf", "oneOf"].into_iter().filter_map(move |key| schema[key].as_array()).flatten()
}

/// The first paragraph of a doc comment, in one line.
fn description(schema: &Value) -> String {
    let text = schema["description"].as_str().unwrap_or_default();
    text.split("\n\n").next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}
