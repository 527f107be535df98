//! A command that another program calls in its own process, such as a Python program. It prints
//! nothing: its output and its messages are kept for the caller. It receives no signal: its caller
//! stops it.
//!
//! A command runs in one thread, and looks up its session there.

use std::cell::RefCell;
use std::ffi::OsString;
use std::fmt::{Arguments, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::interrupt::{self, Signal};
use crate::stop::StopFlag;

/// How a caller follows and stops a command.
#[derive(Clone, Debug, Default)]
pub struct Session {
    /// A request to end a campaign after the samples that are running.
    pub stop: StopFlag,
    /// Number of the samples of a campaign that are done, and of all.
    pub samples: Arc<[AtomicU64; 2]>,
}

/// The output of a command.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Printed {
    /// The text of standard output.
    pub output: String,
    /// The messages of standard error.
    pub messages: Vec<String>,
}

/// The command that this thread runs.
#[derive(Default)]
struct Running {
    arguments: Vec<String>,
    session: Option<Session>,
    printed: Printed,
}

thread_local! {
    static RUNNING: RefCell<Running> = RefCell::default();
}

impl Session {
    /// Runs a command in this thread, and returns its result and its output. The first of the
    /// arguments is the program's name.
    pub fn run<T>(&self, arguments: &[OsString], command: impl FnOnce() -> T) -> (T, Printed) {
        RUNNING.set(Running { arguments: texts(arguments), session: Some(self.clone()), printed: Printed::default() });
        let result = command();
        (result, RUNNING.take().printed)
    }
}

/// Sets the arguments of the program, whose commands nothing calls but itself.
pub fn set_arguments(arguments: &[OsString]) {
    RUNNING.set(Running { arguments: texts(arguments), ..Running::default() });
}

/// Returns the arguments as texts for manifests and messages. What is not UTF-8 is replaced.
fn texts(arguments: &[OsString]) -> Vec<String> {
    arguments.iter().map(|argument| argument.to_string_lossy().into_owned()).collect()
}

/// Returns the arguments of the command. The first is the program's name.
pub fn arguments() -> Vec<String> {
    RUNNING.with_borrow(|running| running.arguments.clone())
}

/// Returns true if another program calls the command.
pub fn is_active() -> bool {
    RUNNING.with_borrow(|running| running.session.is_some())
}

/// Keeps a text for the caller. Returns false if there is none.
pub fn keep_output(text: Arguments<'_>) -> bool {
    RUNNING.with_borrow_mut(|running| running.session.is_some() && running.printed.output.write_fmt(text).is_ok())
}

/// Keeps a message for the caller. Returns false if there is none.
pub fn keep_message(text: Arguments<'_>) -> bool {
    RUNNING.with_borrow_mut(|running| {
        if running.session.is_some() {
            running.printed.messages.push(text.to_string().trim().to_owned());
        }
        running.session.is_some()
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
    fn a_called_command_prints_to_its_caller() {
        let session = Session::default();
        let ((), printed) = session.run(&["closecall".into(), "list".into()], || {
            assert!(is_active());
            assert_eq!(arguments(), ["closecall", "list"]);
            assert!(keep_output(format_args!("one ")) && keep_output(format_args!("line")));
            assert!(keep_message(format_args!("warning: two\n")));
            report(3, 8);
            assert_eq!(received(), None);
            session.stop.set();
            assert_eq!(received(), Some(Signal::Interrupt));
        });
        assert_eq!(printed, Printed { output: "one line".to_owned(), messages: vec!["warning: two".to_owned()] });
        assert_eq!(session.samples.each_ref().map(|count| count.load(Ordering::Relaxed)), [3, 8]);
        assert!(!is_active() && !keep_output(format_args!("for the terminal")));
    }
}
