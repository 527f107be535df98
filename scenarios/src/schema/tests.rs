use std::sync::LazyLock;

use closecall_traffic::{ActorId, is_kebab_name};

use super::super::library;
use super::*;
use crate::criteria::Expression;

/// Returns the first rule of `schema` that `value` breaks, for the keywords that the schema of
/// scenarios uses.
fn broken(root: &Value, schema: &Value, value: &Value) -> Option<String> {
    let rule = |holds: bool, keyword: &str| (!holds).then(|| format!("{keyword} of {value}"));
    if let Some(target) = schema["$ref"].as_str() {
        let target = root.pointer(target.strip_prefix('#').unwrap()).unwrap();
        if let Some(reason) = broken(root, target, value) {
            return Some(reason);
        }
    }
    let list = |keyword: &str| schema[keyword].as_array().cloned().unwrap_or_default();
    let holding =
        |keyword: &str| list(keyword).iter().filter(|subschema| broken(root, subschema, value).is_none()).count();
    if let Some(subschema) = list("allOf").iter().find_map(|subschema| broken(root, subschema, value)) {
        return Some(subschema);
    }
    let number = value.as_f64();
    let bound = |keyword: &str, holds: fn(f64, f64) -> bool| match (number, schema[keyword].as_f64()) {
        (Some(number), Some(bound)) => rule(holds(number, bound), keyword),
        _ => None,
    };
    let kinds = match &schema["type"] {
        Value::Array(kinds) => kinds.clone(),
        Value::Null => Vec::new(),
        kind => vec![kind.clone()],
    };
    let is_of = |kind: &Value| match kind.as_str().unwrap() {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        _ => value.is_null(),
    };
    None.or_else(|| rule(kinds.is_empty() || kinds.iter().any(is_of), "type"))
        .or_else(|| rule(schema.get("const").is_none_or(|only| only == value), "const"))
        .or_else(|| rule(schema.get("enum").is_none_or(|words| words.as_array().unwrap().contains(value)), "enum"))
        .or_else(|| rule(schema.get("anyOf").is_none() || holding("anyOf") > 0, "anyOf"))
        .or_else(|| rule(schema.get("oneOf").is_none() || holding("oneOf") == 1, "oneOf"))
        .or_else(|| {
            let (pattern, text) = (schema["pattern"].as_str()?, value.as_str()?);
            let name = if pattern.starts_with("^\\$") { text.strip_prefix('$') } else { Some(text) };
            let is_criterion = pattern.contains("(<=|>=)");
            let is_matched = if is_criterion {
                text.parse::<Expression>().is_ok()
            } else if pattern == ActorId::PATTERN {
                name.is_some_and(|name| ActorId::new(name).is_ok())
            } else {
                name.is_some_and(is_kebab_name)
            };
            rule(is_matched, "pattern")
        })
        .or_else(|| bound("minimum", |number, bound| number >= bound))
        .or_else(|| bound("exclusiveMinimum", |number, bound| number > bound))
        .or_else(|| bound("maximum", |number, bound| number <= bound))
        .or_else(|| {
            let object = value.as_object()?;
            let missing = list("required").into_iter().find(|key| !object.contains_key(key.as_str().unwrap()));
            missing.map(|key| format!("{key} is missing")).or_else(|| {
                object.iter().find_map(|(key, inner)| match schema["properties"].get(key) {
                    Some(property) => broken(root, property, inner).map(|reason| format!("{key}: {reason}")),
                    None if schema["additionalProperties"] == false => Some(format!("unknown key {key}")),
                    None if schema["additionalProperties"].is_object() => {
                        broken(root, &schema["additionalProperties"], inner)
                    }
                    None => None,
                })
            })
        })
        .or_else(|| value.as_array()?.iter().find_map(|inner| broken(root, schema.get("items")?, inner)))
}

fn verdict(text: &str) -> Option<String> {
    static SCHEMA: LazyLock<Value> = LazyLock::new(strict_schema);
    let schema = &*SCHEMA;
    let value = serde_json::to_value(text.parse::<Table>().unwrap()).unwrap();
    broken(schema, schema, &value)
}

#[test]
fn every_valid_scenario_satisfies_the_schema() {
    let annotated = include_str!("../../../docs/reference/scenario/annotated.toml");
    for text in library::names().filter_map(library::text).chain([EVERY_KEY, annotated]) {
        assert_eq!(verdict(text), None, "{text}");
    }
}

#[test]
fn a_width_for_each_lane_satisfies_the_schema() {
    let text = library::text("low-thw-overtake").unwrap();
    for widths in ["[3.5, 3.75, 3.25]", "[3.5, \"$cruise-mps\", 3.25]"] {
        assert_eq!(verdict(&text.replacen("lane-width-m = 3.75", &format!("lane-width-m = {widths}"), 1)), None);
    }
}

#[test]
fn what_check_refuses_the_schema_refuses() {
    let text = library::text("low-thw-overtake").unwrap();
    for (from, to) in [
        ("duration-s = 60.0", "duration-s = 0.0"),
        ("duration-s = 60.0", "duration-s = 1e9"),
        ("duration-s = 60.0", "duraton-s = 60.0"),
        ("friction = 0.9", "friction = 3.0"),
        ("lane-width-m = 3.75", "lane-width-m = -1"),
        ("lane-width-m = 3.75", "lane-width-m = [3.5, 3.75, 12.0]"),
        ("lane-width-m = 3.75", "lane-width-m = [3.5, [3.75], 3.5]"),
        ("light = \"day\"", "light = \"noon\""),
        ("class = \"car\"", "class = \"cart\""),
        ("lane = 2", "lane = 0"),
        ("schema-version = 1", "schema-version = 2"),
        ("gap-m = 120.0,", "gap-m = 120.0, thw-s = 2.0,"),
        ("max-deceleration-mps2 = 1.0", "max-deceleration-mps2 = 100.0"),
        ("sdlp-m = 0.2", "sdlp-m = -0.2"),
    ] {
        assert!(text.contains(from), "{from}");
        let changed = text.replacen(from, to, 1);
        assert!(verdict(&changed).is_some(), "{to}");
    }
}

#[test]
fn most_numbers_have_a_range() {
    let schema = strict_schema();
    let ranges_found = ranges(&schema);
    assert!(
        ranges_found.len() >= 60,
        "only {} ranges: {:?}",
        ranges_found.len(),
        ranges_found.keys().collect::<Vec<_>>()
    );
}
