//! The names of sensors.

use std::sync::{Mutex, PoisonError};

/// Returns the one reference to a name. A process sees few names, so that they are never released.
pub(crate) fn intern_name(name: &str) -> &'static str {
    static NAMES: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    match names.iter().find(|interned| **interned == name) {
        Some(interned) => interned,
        None => {
            let name: &'static str = Box::leak(name.into());
            names.push(name);
            name
        }
    }
}
