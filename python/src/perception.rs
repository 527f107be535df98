//! Perceptions that are Python objects. Each run starts a Python process with the object, which speaks the protocol of perception
//! processes: `closecall._perceive`.

use closecall_simulation::perception::hosted;
use pyo3::prelude::*;

/// Gives a perception its name. `words` start the process of a run.
#[pyfunction]
pub(crate) fn register_perception(name: &str, words: Vec<String>) {
    hosted::register(name, words);
}

/// Forgets a perception.
#[pyfunction]
pub(crate) fn unregister_perception(name: &str) {
    hosted::unregister(name);
}
