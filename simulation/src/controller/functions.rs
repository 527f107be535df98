//! An ego stack whose functions an arm switches: `acc-aeb`, `acc+aeb`, `cruise+aeb`, `human+aeb`.
//!
//! ```text
//!  functions = base { ("+" | "-") function }
//!  base      = "acc" | "cruise" | "human"    adaptive cruise control, a cruise control that does not look ahead, or the
//!                                            human driver of the scenario
//!  function  = "aeb" | "mis"                 a human drives without `mis`
//! ```
//!
//! `acc` alone is the scenario's stack without its margin increase system, with emergency braking
//! if the scenario has it. An arm that names emergency braking has it or not, whatever the scenario
//! says: with the settings of the scenario, or with its defaults.

use std::fmt;

use closecall_controllers::EgoSettings;

/// The functions of an arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Functions {
    /// Who drives.
    base: Base,
    /// Whether emergency braking is switched on or off; as in the scenario if `None`.
    aeb: Option<bool>,
    /// Whether the margin increase system of the scenario is on.
    mis: bool,
}

/// Who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Base {
    /// Adaptive cruise control.
    Acc,
    /// A cruise control that does not look ahead.
    Cruise,
    /// The human driver of the scenario.
    Human,
}

impl Base {
    const ALL: [Self; 3] = [Self::Acc, Self::Cruise, Self::Human];

    const fn name(self) -> &'static str {
        match self {
            Self::Acc => "acc",
            Self::Cruise => "cruise",
            Self::Human => "human",
        }
    }
}

impl Functions {
    /// Adaptive cruise control, and no other function.
    pub const ACC_ALONE: Self = Self { base: Base::Acc, aeb: Some(false), mis: false };
    /// Adaptive cruise control and emergency braking.
    pub const ACC_AND_AEB: Self = Self { base: Base::Acc, aeb: Some(true), mis: false };
    /// Cruise control and emergency braking.
    pub const CRUISE_AND_AEB: Self = Self { base: Base::Cruise, aeb: Some(true), mis: false };
    /// The human driver, and no function.
    pub const HUMAN_ALONE: Self = Self { base: Base::Human, aeb: Some(false), mis: false };
    /// The human driver and emergency braking.
    pub const HUMAN_AND_AEB: Self = Self { base: Base::Human, aeb: Some(true), mis: false };

    /// What is allowed, in words.
    pub const ALLOWED: &'static str = "`acc`, `cruise` or `human`, then `+aeb` or `-aeb`, then `+mis` unless a human drives, as in `acc-aeb`, `acc+aeb`, `cruise+aeb` and `human+aeb`";

    /// Returns true if a text begins like a list of functions. It then names no other controller.
    pub fn is_meant(text: &str) -> bool {
        let begins = |base: Base| text.strip_prefix(base.name()).is_some_and(|rest| rest.starts_with(['+', '-']));
        Base::ALL.into_iter().any(|base| begins(base) || (base != Base::Acc && text == base.name()))
    }

    /// Reads a list of functions as [`Display`](fmt::Display) writes it: a list has one spelling.
    pub fn parse(text: &str) -> Option<Self> {
        let all = Base::ALL.into_iter().flat_map(|base| {
            [None, Some(false), Some(true)]
                .into_iter()
                .flat_map(move |aeb| [false, true].map(move |mis| Self { base, aeb, mis }))
        });
        // Without a switch it is the controller `acc`.
        let is_switched = |of: &Self| of.base != Base::Acc || of.aeb.is_some() || of.mis;
        let is_allowed = |of: &Self| of.base != Base::Human || !of.mis;
        all.filter(is_switched).filter(is_allowed).find(|of| of.to_string() == text)
    }

    /// Returns true if the arm has a margin increase system. It then needs a stack that has one.
    pub const fn needs_mis(self) -> bool {
        self.mis
    }

    /// Returns true if a human drives, so that the arm needs a scenario that has one.
    pub const fn needs_human(self) -> bool {
        matches!(self.base, Base::Human)
    }

    /// Returns the stack with these functions.
    #[must_use]
    pub fn of(self, settings: &EgoSettings) -> EgoSettings {
        let switched = match self.aeb {
            None => *settings,
            Some(true) => settings.with_aeb(),
            Some(false) => settings.without_aeb(),
        };
        let switched = if self.mis { switched } else { switched.without_mis() };
        match self.base {
            Base::Acc => switched,
            Base::Cruise => switched.without_following(),
            Base::Human => switched.with_human(),
        }
    }
}

impl fmt::Display for Functions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.base.name())?;
        match self.aeb {
            Some(true) => f.write_str("+aeb")?,
            Some(false) => f.write_str("-aeb")?,
            None => {}
        }
        f.write_str(if self.mis { "+mis" } else { "" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_functions_has_one_spelling() {
        for text in [
            "acc-aeb",
            "acc+aeb",
            "acc+aeb+mis",
            "acc-aeb+mis",
            "acc+mis",
            "cruise",
            "cruise-aeb",
            "cruise+aeb",
            "human",
            "human-aeb",
            "human+aeb",
        ] {
            assert!(Functions::is_meant(text), "{text}");
            assert_eq!(Functions::parse(text).map(|functions| functions.to_string()).as_deref(), Some(text));
        }
        for text in [
            "acc+mis+aeb",
            "acc+aeb+aeb",
            "acc-mis",
            "acc+",
            "acc+abs",
            "cruise+acc",
            "acc",
            "human+aeb+mis",
            "human+mis",
            "human+acc",
        ] {
            assert_eq!(Functions::parse(text), None, "{text}");
        }
        assert!(!Functions::is_meant("acc") && !Functions::is_meant("gap-1.2") && !Functions::is_meant("accelerate"));
    }
}
