//! The controllers that ship, by the names that the command line knows.

use std::sync::Arc;

use closecall_controllers::{EgoController, EgoSettings, EgoStack};

use crate::run::ControllerFactory;

/// A controller that ships.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BuiltIn {
    /// The scenario's ego stack without its margin increase system: adaptive cruise control and emergency braking.
    Acc,
    /// The scenario's whole ego stack.
    Mis,
}

impl BuiltIn {
    /// The name on the command line and in every report.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Acc => "acc",
            Self::Mis => "mis",
        }
    }

    /// The factory of this controller.
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
