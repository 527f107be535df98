//! The built-in controllers, by their names on the command line.

use std::fmt;
use std::sync::Arc;

use closecall_controllers::{EgoController, EgoSettings, EgoStack, R157Driver, R157Fuzzy, Slower, Slowing, StackPatch};

use super::{Functions, TimeGap};
use crate::run::ControllerFactory;

/// A built-in controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BuiltIn {
    /// The scenario's ego stack without its margin increase system: adaptive cruise control and
    /// emergency braking.
    Acc,
    /// The scenario's complete ego stack.
    Mis,
    /// The scenario's complete ego stack, whose margin increase system plans for the time to
    /// closest encounter.
    MisTtce,
    /// The scenario's complete ego stack, with a margin increase system that engages earlier and
    /// may brake harder.
    MisExtended,
    /// As [`BuiltIn::Acc`], but slowing down gently from the first second on, without looking back.
    Blind,
    /// Like [`BuiltIn::Blind`], but twice as strong and over twice the distance.
    Crawl,
    /// The scenario's ego stack with the functions that the arm names.
    Stack(Functions),
    /// Like [`BuiltIn::Acc`], with another constant time gap.
    Gap(TimeGap),
    /// As [`BuiltIn::Acc`], with the minimum following distance of UN Regulation 157.
    R157Gap,
    /// The competent and careful human driver of UN Regulation 157.
    R157Driver,
    /// The fuzzy safety model of UN Regulation 157.
    R157Fsm,
}

/// Writes the name on the command line and in reports.
impl fmt::Display for BuiltIn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Acc => f.write_str("acc"),
            Self::Mis => f.write_str("mis"),
            Self::MisTtce => f.write_str("mis-ttce"),
            Self::MisExtended => f.write_str("mis-extended"),
            Self::Blind => f.write_str("blind"),
            Self::Crawl => f.write_str("crawl"),
            Self::Stack(functions) => functions.fmt(f),
            Self::Gap(gap) => write!(f, "gap-{gap}"),
            Self::R157Gap => f.write_str("r157-gap"),
            Self::R157Driver => f.write_str("r157-driver"),
            Self::R157Fsm => f.write_str("r157-fsm"),
        }
    }
}

impl BuiltIn {
    /// The controllers whose name has no number.
    pub(super) const FIXED: [Self; 9] = [
        Self::Acc,
        Self::Mis,
        Self::MisTtce,
        Self::MisExtended,
        Self::Blind,
        Self::Crawl,
        Self::R157Gap,
        Self::R157Driver,
        Self::R157Fsm,
    ];

    /// Returns true if the controller is a margin increase system, so that it needs a stack that
    /// has one.
    pub const fn needs_mis(self) -> bool {
        match self {
            Self::Stack(functions) => functions.needs_mis(),
            _ => matches!(self, Self::Mis | Self::MisTtce | Self::MisExtended),
        }
    }

    /// Returns true if a human drives, so that the controller needs a scenario whose ego has a
    /// human driver.
    pub const fn needs_human(self) -> bool {
        matches!(self, Self::Stack(functions) if functions.needs_human())
    }

    /// Returns true if the settings of the stack are all that makes the controller.
    pub const fn is_stack(self) -> bool {
        !matches!(self, Self::Blind | Self::Crawl | Self::R157Driver | Self::R157Fsm)
    }

    /// Returns the controller's settings, made from the settings of the scenario.
    pub(super) fn settings(self, settings: &EgoSettings) -> EgoSettings {
        match self {
            Self::Acc | Self::Blind | Self::Crawl => settings.without_mis(),
            Self::Mis => *settings,
            Self::MisTtce => settings.with_ttce_mis(),
            Self::MisExtended => settings.with_extended_mis(),
            Self::Stack(functions) => functions.of(settings),
            Self::Gap(gap) => settings.with_time_gap(gap.s()),
            Self::R157Gap => settings.with_r157_gap(),
            Self::R157Driver => R157Driver::settings(*settings),
            Self::R157Fsm => settings.with_fuzzy_safety(),
        }
    }

    /// Returns a controller for one run, with its settings made from the settings of the scenario.
    pub(super) fn controller(self, settings: EgoSettings) -> Box<dyn EgoController> {
        match self {
            Self::Blind => Box::new(Slower::new(settings, Slowing::BLIND)),
            Self::Crawl => Box::new(Slower::new(settings, Slowing::CRAWL)),
            Self::R157Driver => Box::new(R157Driver::new(settings)),
            Self::R157Fsm => Box::new(R157Fuzzy::new(settings)),
            _ => Box::new(EgoStack::new(settings)),
        }
    }

    /// Returns a factory of this controller.
    pub fn factory(self) -> Arc<dyn ControllerFactory> {
        Arc::new(BuiltInFactory { name: self.to_string(), built_in: self, patch: None })
    }
}

/// Creates a built-in controller for each run.
pub(super) struct BuiltInFactory {
    pub(super) name: String,
    pub(super) built_in: BuiltIn,
    /// Settings of the arm alone.
    pub(super) patch: Option<StackPatch>,
}

impl ControllerFactory for BuiltInFactory {
    fn name(&self) -> &str {
        &self.name
    }

    fn is_built_in(&self) -> bool {
        true
    }

    fn settings(&self, settings: &EgoSettings) -> EgoSettings {
        let settings = self.built_in.settings(settings);
        self.patch.as_ref().map_or(settings, |patch| settings.patched(patch))
    }

    fn has_mis(&self, settings: &EgoSettings) -> bool {
        self.settings(settings).mis().is_some()
    }

    /// Cruise control, emergency braking and the models of UN Regulation 157 look ahead and to the
    /// sides.
    fn looks_back(&self, settings: &EgoSettings) -> bool {
        self.has_mis(settings)
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        self.built_in.controller(self.settings(settings))
    }
}
