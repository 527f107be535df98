//! Controllers of the program that has Closecall as a library, such as a Python program:
//! `python:NAME`.
//!
//! The program registers a [`ControllerFactory`] under a name. From then on the name is a
//! controller like any other, on a command line and in a manifest. A manifest outlives the program:
//! its folder can be read without it, but its samples cannot be run again.
//!
//! A name may end with `@VERSION`. Reports leave the version out. A manifest keeps it, so that a
//! campaign is not resumed with a controller that has changed.
//!
//! A controller runs in the process of its program, or in worker processes that load it for
//! themselves: see [`HostedProcess`].

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings};

use super::isolated::Isolated;
use crate::run::ControllerFactory;

pub use super::hosted_process::HostedProcess;

/// The prefix of the names.
pub const PREFIX: &str = "python";

type Factories = BTreeMap<String, Arc<dyn ControllerFactory>>;

static REGISTRY: Mutex<Factories> = Mutex::new(BTreeMap::new());
/// The reasons for which controllers cannot be loaded in this process, by their names.
static REFUSED: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());

fn registry() -> MutexGuard<'static, Factories> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lets a worker process refuse the samples of a controller that it cannot load, with this reason.
pub fn refuse(name: &str, reason: String) {
    REFUSED.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned(), reason);
}

/// Returns the factory of a controller in its worker process.
///
/// # Errors
/// The reason for which this process cannot load it.
pub(super) fn in_worker(process: HostedProcess) -> Result<Arc<dyn ControllerFactory>, String> {
    let refused = REFUSED.lock().unwrap_or_else(PoisonError::into_inner).get(&process.id).cloned();
    match (refused, registry().get(&process.id).cloned()) {
        (Some(reason), _) => Err(reason),
        (None, Some(factory)) => Ok(Arc::new(Named { name: process.name, factory })),
        (None, None) => {
            Err(format!("the process of the controller does not have `{}`: {}", process.id, registered_names()))
        }
    }
}

/// A controller stays registered as long as this value lives.
#[derive(Debug)]
pub struct Registration(String);

impl Drop for Registration {
    fn drop(&mut self) {
        // A factory is dropped without the lock, since its code may wait for another thread.
        let factory = registry().remove(&self.0);
        drop(factory);
    }
}

/// Registers a controller. `name` is `python:NAME` or `python:NAME@VERSION`. A controller of the
/// same name is replaced.
#[must_use]
pub fn register(name: &str, factory: Arc<dyn ControllerFactory>) -> Registration {
    let earlier = registry().insert(name.to_owned(), factory);
    drop(earlier);
    Registration(name.to_owned())
}

/// Returns the names that are registered, for a message.
pub(super) fn registered_names() -> String {
    let names: Vec<String> = registry().keys().map(|name| format!("`{name}`")).collect();
    if names.is_empty() { "this program has none".to_owned() } else { format!("there is {}", names.join(", ")) }
}

/// The name of a controller of the program that has Closecall as a library.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostedController(String);

impl HostedController {
    /// Creates the name, which begins with `python:`.
    pub(super) fn new(name: &str) -> Self {
        Self(name.to_owned())
    }

    /// Returns true if the program has registered the controller.
    pub(super) fn is_registered(&self) -> bool {
        registry().contains_key(&self.0)
    }

    /// Returns true if the program has registered the controller for separate processes.
    pub(super) fn has_processes(&self) -> bool {
        let factory = registry().get(&self.0).cloned();
        factory.is_some_and(|factory| factory.isolated().is_some())
    }

    /// Returns the name in reports, which lacks the version.
    pub(super) fn name(&self) -> String {
        self.0.split_once('@').map_or(&self.0[..], |(name, _)| name).to_owned()
    }

    /// Returns the factory, under the given name. The controllers of a name that is not registered
    /// fail at their first step.
    pub(super) fn factory(&self, name: String) -> Arc<dyn ControllerFactory> {
        let factory = registry().get(&self.0).cloned();
        let factory = factory.unwrap_or_else(|| Arc::new(Missing { name: self.name() }));
        Arc::new(Named { name, factory })
    }
}

/// Writes the name with its version.
impl fmt::Display for HostedController {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A factory under another name.
struct Named {
    name: String,
    factory: Arc<dyn ControllerFactory>,
}

impl ControllerFactory for Named {
    fn name(&self) -> &str {
        &self.name
    }

    fn settings(&self, settings: &EgoSettings) -> EgoSettings {
        self.factory.settings(settings)
    }

    fn has_mis(&self, settings: &EgoSettings) -> bool {
        self.factory.has_mis(settings)
    }

    fn looks_back(&self, settings: &EgoSettings) -> bool {
        self.factory.looks_back(settings)
    }

    fn isolated(&self) -> Option<Isolated> {
        match self.factory.isolated()? {
            Isolated::Hosted(hosted) => Some(Isolated::Hosted(HostedProcess { name: self.name.clone(), ..hosted })),
            native @ Isolated::Native(_) => Some(native),
        }
    }

    fn in_thread(&self, run: &mut (dyn FnMut() + Send)) {
        self.factory.in_thread(run);
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        self.factory.build(settings)
    }
}

/// A controller that is not registered.
#[derive(Clone)]
struct Missing {
    name: String,
}

impl ControllerFactory for Missing {
    fn name(&self) -> &str {
        &self.name
    }

    fn has_mis(&self, _: &EgoSettings) -> bool {
        false
    }

    fn build(&self, _: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(self.clone())
    }
}

impl EgoController for Missing {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        let reason = format!(
            "`{}` is a controller of a Python program, and can be run from there only: {}",
            self.name,
            registered_names()
        );
        Err(ControllerError::Own { reason, time: input.time })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::ControllerChoice;

    #[test]
    fn a_name_is_a_controller_as_long_as_it_is_registered() {
        let name = "python:mine@1a2b";
        let refused = name.parse::<ControllerChoice>().unwrap_err().to_string();
        assert!(refused.contains("`python:mine@1a2b` is a controller of a Python program"), "{refused}");
        let registration = register(name, ControllerChoice::ACC.factory());
        let choice: ControllerChoice = name.parse().unwrap();
        assert_eq!((choice.to_string(), choice.name()), (name.to_owned(), "python:mine".to_owned()));
        let stored = serde_json::to_string(&choice).unwrap();
        drop(registration);
        // The manifest can still be read, and names the controller that is missing.
        assert_eq!(serde_json::from_str::<ControllerChoice>(&stored).unwrap(), choice);
        assert_eq!(choice.factory().name(), "python:mine");
        let other = ControllerChoice::Hosted(HostedController::new("python:mine@3c4d"));
        assert_eq!(
            ControllerChoice::names(&[choice, ControllerChoice::ACC, other]),
            ["python:mine-1", "acc", "python:mine-2"]
        );
        assert!(name.parse::<ControllerChoice>().is_err());
    }
}
