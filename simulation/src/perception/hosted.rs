//! Perceptions that are objects of the program that has Closecall as a library, such as a Python
//! program: `python:NAME@VERSION`.
//!
//! The program registers the words that start a process with the object. From then on the name is a
//! perception like any other. A manifest outlives the program: its folder can be read without it,
//! but its samples cannot be run again.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The words that start the process of each perception, by its name.
static REGISTRY: Mutex<BTreeMap<String, Vec<String>>> = Mutex::new(BTreeMap::new());

fn registry() -> MutexGuard<'static, BTreeMap<String, Vec<String>>> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registers a perception. `name` is `python:NAME@VERSION`. A perception of the same name is
/// replaced.
pub fn register(name: &str, words: Vec<String>) {
    registry().insert(name.to_owned(), words);
}

/// Forgets a perception.
pub fn unregister(name: &str) {
    registry().remove(name);
}

/// Returns the words that start the process of a perception; `None` if it is not registered.
pub fn words(name: &str) -> Option<Vec<String>> {
    registry().get(name).cloned()
}

/// Returns why a perception cannot be run.
pub(super) fn missing() -> String {
    let names: Vec<String> = registry().keys().map(|name| format!("`{name}`")).collect();
    let registered =
        if names.is_empty() { "this program has none".to_owned() } else { format!("there is {}", names.join(", ")) };
    format!("it is an object of a Python program, and can be run from there only: {registered}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_a_process_as_long_as_it_is_registered() {
        let name = "python:Mine@1a2b";
        assert_eq!(words(name), None);
        register(name, vec!["python3".to_owned()]);
        assert_eq!(words(name), Some(vec!["python3".to_owned()]));
        assert!(missing().contains("there is `python:Mine@1a2b`"), "{}", missing());
        unregister(name);
        assert_eq!(words(name), None);
    }
}
