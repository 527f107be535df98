//! A built-in controller with its own settings: `acc+aeb:aeb.trigger-mps2=5`.
//!
//! The settings of a scenario act on every arm. These settings act on one arm: two settings of a
//! function can be compared on the same samples.

use std::fmt;
use std::sync::Arc;

use closecall_controllers::StackPatch;

use super::BuiltIn;
use super::built_in::BuiltInFactory;
use crate::run::ControllerFactory;

/// Separates the controller and its settings.
const SEPARATOR: char = ':';
/// The path of keys under which a scenario has the settings of the ego stack, behind `actor` and
/// the actor's name.
const STACK: [&str; 2] = ["driver", "ego-stack"];

/// A built-in controller with settings of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tuned {
    /// The controller.
    pub base: BuiltIn,
    /// The settings, as `KEY=VALUE` below the ego stack.
    settings: Vec<String>,
}

/// A setting that an arm cannot have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{setting}` cannot be set in an arm: {problem}")]
pub struct TunedError {
    /// The setting.
    pub setting: String,
    /// What is wrong, and what is allowed.
    pub problem: String,
}

impl Tuned {
    /// Returns the controller with one more setting, which is below the ego stack, or below the
    /// whole scenario.
    ///
    /// # Errors
    /// [`TunedError`] if the ego stack has no such key, the value is out of range, or the key has
    /// another value already.
    pub fn with(mut self, setting: &str) -> Result<Self, TunedError> {
        let fail = |problem: String| TunedError { setting: setting.to_owned(), problem };
        let Some((key, value)) = setting.split_once('=') else {
            return Err(fail("it has the form KEY=VALUE, as in `aeb.trigger-mps2=5`".to_owned()));
        };
        let parts: Vec<&str> = key.trim().split('.').collect();
        let below = match parts.as_slice() {
            ["actor", _, driver, stack, below @ ..] if [*driver, *stack] == STACK => below,
            all => all,
        };
        let key = below.join(".");
        let wanted = format!("{key}={}", value.trim());
        let is_same_key = |setting: &&String| setting.split_once('=').is_some_and(|(other, _)| other == key);
        match self.settings.iter().find(is_same_key).cloned() {
            Some(present) if present == wanted => return Ok(self),
            Some(present) => return Err(fail(format!("`{present}` is set already: give one of them"))),
            None => self.settings.push(wanted),
        }
        self.patch().map_err(fail)?;
        Ok(self)
    }

    /// Reads a controller with settings as [`Display`](fmt::Display) writes it.
    pub(super) fn parse(base: BuiltIn, settings: &str) -> Result<Self, TunedError> {
        let untuned = Self { base, settings: Vec::new() };
        settings.split(SEPARATOR).try_fold(untuned, |tuned, setting| tuned.with(setting))
    }

    /// Returns a controller without its own settings.
    pub const fn new(base: BuiltIn) -> Self {
        Self { base, settings: Vec::new() }
    }

    fn patch(&self) -> Result<StackPatch, String> {
        StackPatch::parse(&self.settings.join("\n"))
    }

    /// Returns a factory of this controller.
    pub(super) fn factory(&self) -> Arc<dyn ControllerFactory> {
        // The settings were read before.
        let patch = self.patch().ok();
        Arc::new(BuiltInFactory { name: self.to_string(), built_in: self.base, patch })
    }
}

impl fmt::Display for Tuned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.base)?;
        self.settings.iter().try_for_each(|setting| write!(f, "{SEPARATOR}{setting}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_of_one_arm_are_below_the_ego_stack_or_below_the_scenario() {
        let tuned = Tuned::new(BuiltIn::Acc).with("aeb.trigger-mps2=5").unwrap();
        assert_eq!(tuned.to_string(), "acc:aeb.trigger-mps2=5");
        let same = Tuned::new(BuiltIn::Acc).with("actor.ego.driver.ego-stack.aeb.trigger-mps2 = 5").unwrap();
        assert_eq!(same, tuned);
        let more = tuned.with("aeb.trigger-mps2=5").unwrap().with("acc.time-gap-s=1.5").unwrap();
        assert_eq!(more.to_string(), "acc:aeb.trigger-mps2=5:acc.time-gap-s=1.5");
        // Neither value may win in silence.
        let refused = more.with("actor.ego.driver.ego-stack.aeb.trigger-mps2=6").unwrap_err().to_string();
        assert!(refused.contains("=6") && refused.contains("`aeb.trigger-mps2=5` is set already"), "{refused}");
    }

    #[test]
    fn what_is_no_setting_of_the_stack_is_refused_with_what_is_allowed() {
        let refusal = |text: &str| Tuned::new(BuiltIn::Acc).with(text).unwrap_err().to_string();
        assert!(refusal("aeb.onset-mps2=5").contains("trigger-mps2"), "{}", refusal("aeb.onset-mps2=5"));
        assert!(refusal("brakes.trigger-mps2=5").contains("aeb"), "{}", refusal("brakes.trigger-mps2=5"));
        assert!(refusal("aeb.trigger-mps2=50").contains("9"), "{}", refusal("aeb.trigger-mps2=50"));
        assert!(refusal("aeb.trigger-mps2=hard").contains("hard"), "{}", refusal("aeb.trigger-mps2=hard"));
        assert!(refusal("aeb").contains("KEY=VALUE"), "{}", refusal("aeb"));
    }
}
