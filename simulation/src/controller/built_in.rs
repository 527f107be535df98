//! The built-in controllers, by their names on the command line.

use std::sync::Arc;

use closecall_controllers::{EgoController, EgoSettings, EgoStack};

use crate::run::ControllerFactory;

/// A built-in controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BuiltIn {
    /// The scenario's ego stack without its margin increase system: adaptive cruise control and emergency braking.
    Acc,
    /// The scenario's complete ego stack.
    Mis,
}

impl BuiltIn {
    /// Returns the name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Acc => "acc",
            Self::Mis => "mis",
        }
    }

    /// Returns a factory of this controller.
    pub fn factory(self) -> Arc<dyn ControllerFactory> {
        Arc::new(self)
    }
}

impl ControllerFactory for BuiltIn {
    fn name(&self) -> &str {
        (*self).name()
    }

    fn has_mis(&self, settings: &EgoSettings) -> bool {
        *self == Self::Mis && settings.mis().is_some()
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        match self {
            Self::Acc => Box::new(EgoStack::new(settings.without_mis())),
            Self::Mis => Box::new(EgoStack::new(*settings)),
        }
    }
}
