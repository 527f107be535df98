//! Texts that are kept until the process ends, such as commands and names of sensors.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// Returns the same text, which is kept until the process ends. A process sees few such texts, and
/// each is kept once.
pub(crate) fn kept(text: &str) -> &'static str {
    static KEPT: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut all = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(interned) = all.get(text) {
        return interned;
    }
    let leaked: &'static str = Box::leak(text.to_owned().into_boxed_str());
    all.insert(leaked);
    leaked
}
