//! An ego stack whose functions an arm switches: `acc-aeb`, `acc+aeb`, `cruise+aeb`.
//!
//! ```text
//!  functions = base { ("+" | "-") function }
//!  base      = "acc" | "cruise"      adaptive cruise control, or a cruise control that does not look ahead
//!  function  = "aeb" | "mis"
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
    /// Whether the cruise control keeps its distance.
    follows: bool,
    /// Whether emergency braking is switched on or off; as in the scenario if `None`.
    aeb: Option<bool>,
    /// Whether the margin increase system of the scenario is on.
    mis: bool,
}

/// The bases, with whether they keep their distance.
const BASES: [(&str, bool); 2] = [("acc", true), ("cruise", false)];

impl Functions {
    /// Adaptive cruise control, and no other function.
    pub const ACC_ALONE: Self = Self { follows: true, aeb: Some(false), mis: false };
    /// Adaptive cruise control and emergency braking.
    pub const ACC_AND_AEB: Self = Self { follows: true, aeb: Some(true), mis: false };
    /// Cruise control and emergency braking.
    pub const CRUISE_AND_AEB: Self = Self { follows: false, aeb: Some(true), mis: false };

    /// What is allowed, in words.
    pub const ALLOWED: &'static str =
        "`acc` or `cruise`, then `+aeb` or `-aeb`, then `+mis`, as in `acc-aeb`, `acc+aeb` and `cruise+aeb`";

    /// Returns true if a text begins like a list of functions. It then names no other controller.
    pub fn is_meant(text: &str) -> bool {
        BASES.iter().any(|(base, _)| text.strip_prefix(base).is_some_and(|rest| rest.starts_with(['+', '-'])))
            || text == "cruise"
    }

    /// Reads a list of functions as [`Display`](fmt::Display) writes it: a list has one spelling.
    pub fn parse(text: &str) -> Option<Self> {
        let all = BASES.iter().flat_map(|&(_, follows)| {
            [None, Some(false), Some(true)]
                .into_iter()
                .flat_map(move |aeb| [false, true].map(move |mis| Self { follows, aeb, mis }))
        });
        // Without a switch it is the controller `acc`.
        let is_switched = |of: &Self| !of.follows || of.aeb.is_some() || of.mis;
        all.filter(is_switched).find(|of| of.to_string() == text)
    }

    /// Returns true if the arm has a margin increase system. It then needs a stack that has one.
    pub const fn needs_mis(self) -> bool {
        self.mis
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
        if self.follows { switched } else { switched.without_following() }
    }
}

impl fmt::Display for Functions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.follows { "acc" } else { "cruise" })?;
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
        for text in
            ["acc-aeb", "acc+aeb", "acc+aeb+mis", "acc-aeb+mis", "acc+mis", "cruise", "cruise-aeb", "cruise+aeb"]
        {
            assert!(Functions::is_meant(text), "{text}");
            assert_eq!(Functions::parse(text).map(|functions| functions.to_string()).as_deref(), Some(text));
        }
        for text in ["acc+mis+aeb", "acc+aeb+aeb", "acc-mis", "acc+", "acc+abs", "cruise+acc", "acc"] {
            assert_eq!(Functions::parse(text), None, "{text}");
        }
        assert!(!Functions::is_meant("acc") && !Functions::is_meant("gap-1.2") && !Functions::is_meant("accelerate"));
    }
}
