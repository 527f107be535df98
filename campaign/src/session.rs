//! A command that another program calls in its own process, such as a Python program. It prints
//! nothing: its warnings are kept for the caller. It receives no signal: its caller stops it.
//!
//! A command runs in one thread, and looks up its session there.

use std::cell::RefCell;
use std::ffi::OsString;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::interrupt::{self, Signal};
use crate::stop::StopFlag;

/// How a caller follows and stops a command.
#[derive(Clone, Debug, Default)]
pub struct Session {
    /// A request to end a campaign after the samples that are running.
    pub stop: StopFlag,
    /// Number of the samples of a campaign that are done, and of all.
    pub samples: Arc<[AtomicU64; 2]>,
    warnings: Arc<Mutex<Vec<String>>>,
}

/// The command that this thread runs.
#[derive(Default)]
struct Running {
    arguments: Vec<String>,
    session: Option<Session>,
}

thread_local! {
    static RUNNING: RefCell<Running> = RefCell::default();
}

impl Session {
    /// Runs a command in this thread. `call` is the call as its program spells it, such as
    /// `closecall.campaign('low-thw-overtake')`.
    pub fn run<T>(&self, call: &str, command: impl FnOnce() -> T) -> T {
        RUNNING.set(Running { arguments: vec![call.to_owned()], session: Some(self.clone()) });
        let result = command();
        RUNNING.take();
        result
    }

    /// Returns the warnings of the command.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Sets the arguments of the program, whose commands nothing calls but itself. What is not UTF-8 is
/// replaced, as they are texts of manifests and messages.
pub fn set_arguments(arguments: &[OsString]) {
    let arguments = arguments.iter().map(|argument| argument.to_string_lossy().into_owned()).collect();
    RUNNING.set(Running { arguments, session: None });
}

/// Returns the words of the command line, which begin with the program's name. A call from another
/// program is one word.
pub fn arguments() -> Vec<String> {
    RUNNING.with_borrow(|running| running.arguments.clone())
}

/// Returns true if another program calls the command.
pub fn is_active() -> bool {
    RUNNING.with_borrow(|running| running.session.is_some())
}

/// Keeps a warning for the caller. Returns false if there is none.
pub fn keep_warning(text: &str) -> bool {
    RUNNING.with_borrow(|running| {
        let Some(session) = &running.session else { return false };
        session.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(text.to_owned());
        true
    })
}

/// Lets the caller, or a signal, stop a campaign.
pub fn stop_on_request(stop: &mut StopFlag) {
    match RUNNING.with_borrow(|running| running.session.clone()) {
        Some(session) => *stop = session.stop,
        None => interrupt::stop_gracefully(stop),
    }
}

/// Returns the signal that has stopped the campaign. A request of the caller counts as Ctrl-C.
pub fn received() -> Option<Signal> {
    match RUNNING.with_borrow(|running| running.session.clone()) {
        Some(session) => session.stop.is_set().then_some(Signal::Interrupt),
        None => interrupt::received(),
    }
}

/// Tells the caller how many samples of how many are done.
pub fn report(done: u64, all: u64) {
    RUNNING.with_borrow(|running| {
        if let Some(session) = &running.session {
            session.samples[1].store(all, Ordering::Relaxed);
            session.samples[0].store(done, Ordering::Relaxed);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_called_command_reports_to_its_caller() {
        let session = Session::default();
        session.run("closecall.campaign('x')", || {
            assert!(is_active() && keep_warning("two"));
            assert_eq!(arguments(), ["closecall.campaign('x')"]);
            report(3, 8);
            assert_eq!(received(), None);
            session.stop.set();
            assert_eq!(received(), Some(Signal::Interrupt));
        });
        assert_eq!(session.warnings(), ["two"]);
        assert_eq!(session.samples.each_ref().map(|count| count.load(Ordering::Relaxed)), [3, 8]);
        assert!(!is_active() && !keep_warning("for the terminal"));
    }
}
