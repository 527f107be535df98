//! How an output was made, as keys of its JSON.

use closecall_campaign::manifest::version;
use closecall_scenarios::Setting;
use serde_json::{Value, json};

/// The version of the keys. It changes if a key changes its meaning, not if one is added.
const SCHEMA_VERSION: u32 = 1;

/// Adds the origin of an output: to an object, or to each object of a list. Existing keys stay.
/// `seed` and `settings` are `None` for an output that does not depend on them.
pub fn stamped(mut value: Value, seed: Option<u64>, settings: Option<&[Setting]>) -> Value {
    let objects = match &mut value {
        Value::Array(list) => list.iter_mut().collect(),
        value => vec![value],
    };
    let version = version();
    for object in objects.into_iter().filter_map(Value::as_object_mut) {
        let mut add = |key: &str, value: Value| {
            object.entry(key.to_owned()).or_insert(value);
        };
        add("schema_version", json!(SCHEMA_VERSION));
        add("closecall_version", json!(version));
        if let Some(seed) = seed {
            add("seed", json!(seed));
        }
        if let Some(settings) = settings {
            add("settings", settings.iter().map(ToString::to_string).collect());
        }
    }
    value
}
