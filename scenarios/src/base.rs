//! Scenarios that say only how they differ from a scenario of the library.
//!
//! A file whose first key is `base` names a scenario of the library. Its own keys replace the keys
//! of the base: tables are merged key by key, lists and lists of tables are replaced as a whole.
//! The criteria of the base (`requirements`, `checks`, `gate`) do not carry over, and neither does
//! a parameter that no value uses. The result is one text, on which all later steps work, and a
//! campaign's folder keeps the whole scenario.

use closecall_traffic::{KeyPath, Segment};
use toml_edit::{DocumentMut, Item, TableLike};

use super::file::used_parameters;
use super::{library, locate};

/// The key of the table of parameters.
const PARAMETERS: &str = "parameters";
/// The key that names the base.
const BASE: &str = "base";
/// The keys by which a scenario is judged. They do not carry over from the base: another question
/// needs its own answer.
const JUDGED_BY: [&str; 3] = ["requirements", "checks", "gate"];

/// Returns the text of the whole scenario, or `None` if the text names no base.
///
/// # Errors
/// Returns a line and a message if the library does not have the base.
pub(super) fn expand(text: &str) -> Result<Option<String>, (usize, String)> {
    // Most files have no base, and the reader reports a file that is not TOML.
    if !text.contains(BASE) {
        return Ok(None);
    }
    let own = text;
    let Ok(mut document) = own.parse::<DocumentMut>() else { return Ok(None) };
    let Some(base) = document.remove(BASE) else { return Ok(None) };
    let name = base.as_str().unwrap_or_default();
    let Some(text) = library::plain_text(name) else {
        let names: Vec<&str> = library::plain_names().collect();
        let key = KeyPath(vec![Segment::Key(BASE.to_owned())]);
        let value = base.to_string();
        let message = format!("`{BASE}` is {}, but one of the library is needed: {}", value.trim(), names.join(", "));
        return Err((locate::line_of(own, &key).unwrap_or(1), message));
    };
    let mut whole = text.parse::<DocumentMut>().map_err(|error| (1, error.to_string()))?;
    for key in JUDGED_BY {
        whole.remove(key);
    }
    merge(whole.as_table_mut(), document.as_table());
    remove_unused(&mut whole, &document);
    Ok(Some(whole.to_string()))
}

/// Removes the parameters of the base that no value uses. Unused parameters of `file` stay: the
/// reader refuses them.
fn remove_unused(whole: &mut DocumentMut, file: &DocumentMut) {
    let Ok(document) = toml::from_str::<toml::Table>(&whole.to_string()) else { return };
    let used = used_parameters(&document);
    let file = file.get(PARAMETERS).and_then(Item::as_table_like);
    let is_own = |name: &str| file.is_some_and(|file| file.contains_key(name));
    let Some(parameters) = whole.get_mut(PARAMETERS).and_then(Item::as_table_like_mut) else { return };
    let names: Vec<String> = parameters.iter().map(|(name, _)| name.to_owned()).collect();
    for name in names.iter().filter(|name| !used.contains(&name.as_str()) && !is_own(name)) {
        parameters.remove(name);
    }
}

/// Replaces the values of `target` by the values of `source`, and merges tables.
fn merge(target: &mut dyn TableLike, source: &dyn TableLike) {
    for (key, item) in source.iter() {
        let both = target.get_mut(key).and_then(Item::as_table_like_mut).zip(item.as_table_like());
        match both {
            Some((inner, item)) => merge(inner, item),
            None => {
                target.insert(key, item.clone());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::ScenarioFile;

    fn parse(text: &str) -> Result<ScenarioFile, String> {
        ScenarioFile::parse(Path::new("own.toml"), text, &[]).map_err(|error| error.to_string())
    }

    #[test]
    fn a_file_with_a_base_has_its_keys_but_for_its_own() {
        let text = "base = \"low-thw-overtake\"\nname = \"own\"\nsensors.mode = \"object\"\n[[fault.rear-object]]\ndead = true\n";
        let derived = parse(text).unwrap();
        let base = parse(super::library::text("low-thw-overtake").unwrap()).unwrap();
        assert_eq!(derived.config().name, "own");
        assert_eq!(derived.config().actors, base.config().actors);
        assert_eq!(derived.config().fault.rear_object.len(), 1);
        assert_ne!(derived.config().sensors.mode, base.config().sensors.mode);
        assert_eq!(derived.config().sensors.tracker, base.config().sensors.tracker);
    }

    #[test]
    fn a_parameter_of_the_base_that_is_not_used_any_more_goes_and_an_own_one_is_refused() {
        let whole = super::library::text("overtake-without-brake").unwrap();
        let actors = &whole[whole.find("[[actor]]").unwrap()..whole.find("[sensors]").unwrap()];
        let derived = parse(&format!("base = \"low-thw-overtake\"\nname = \"own\"\n{actors}")).unwrap();
        let names: Vec<String> = derived.space().iter().map(|(name, _)| name.to_string()).collect();
        assert!(!names.contains(&"brake-phase".to_owned()) && names.contains(&"closing-mps".to_owned()), "{names:?}");
        let unused = "base = \"low-thw-overtake\"\nname = \"own\"\ntags = [\"$x\"]\nparameters.x = { uniform = { min = 0, max = 1 } }\n";
        let error = parse(unused).unwrap().refuse_unused().unwrap_err().to_string();
        assert!(error.contains("unused parameter: `x`"), "{error}");
    }

    #[test]
    fn an_error_names_the_line_of_the_own_file() {
        let text = "base = \"low-thw-overtake\"\nname = \"own\"\n\n[[fault.rear-lidar]]\ndrop-out = 0.5\n";
        let error = parse(text).unwrap_err();
        assert!(error.contains("own.toml:5") && error.contains("drop-out"), "{error}");
        let line = |keys: &str| {
            let file = parse(&format!("base = \"low-thw-overtake\"\nname = \"own\"\n{keys}")).unwrap();
            file.check().and_then(|()| file.refuse_unused()).unwrap_err().line()
        };
        assert_eq!(line("\n[sensors.rear-camera]\nyaw-deg = 90\n"), Some(5), "a value out of range");
        assert_eq!(line("[parameters]\nx = { uniform = { min = 0, max = 1 } }\n"), Some(4), "an unused parameter");
        assert_eq!(line("parameters.cruise-mps.uniform = { min = -90, max = -80 }\n"), None, "a value of the base");
        // The same words stand elsewhere in the file, and the first of them is right.
        let twice = "[sensors.rear-camera]\nyaw-deg = 20\n[[fault.rear-object]]\nyaw-deg = 20\n";
        assert_eq!(line(twice), Some(6), "the second of two");
        let words = twice.replace("object]]\nyaw-deg = 20", "object]]\nyaw-deg = 'x'");
        let syntax = parse(&format!("base = \"low-thw-overtake\"\nname = \"own\"\n{words}")).unwrap_err();
        assert!(syntax.contains("own.toml:6: `yaw-deg`"), "{syntax}");
    }

    #[test]
    fn a_base_that_the_library_does_not_have_is_refused() {
        let error = parse("# mine\nbase = \"low-thw\"\nname = \"own\"\n").unwrap_err();
        assert!(error.contains("own.toml:2: "), "{error}");
        assert!(error.contains("`base` is \"low-thw\"") && error.contains("low-thw-overtake"), "{error}");
    }
}
