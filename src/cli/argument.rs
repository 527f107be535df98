//! The name of an argument, as the caller knows it.

use std::fmt;

use closecall_campaign::session;

/// An argument in a message: `--max-induced` on the command line, `max_induced=` in a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Argument(pub(super) &'static str);

impl fmt::Display for Argument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match session::is_active() {
            true => write!(f, "{}=", self.0.replace('-', "_")),
            false => write!(f, "--{}", self.0),
        }
    }
}
