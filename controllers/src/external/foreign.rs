//! Calls of functions of a library that an exception of C++ must not leave.
//!
//! Rust cannot catch an exception of another language, nor read its text: an exception that leaves
//! a function of a library would end the process with a message that says nothing to the author of
//! the library. On its way it passes the frame of the call, which names the function and ends the
//! process itself.

use std::io::{Write as _, stderr};

/// A call of a function, which an exception leaves if this value is dropped.
struct Left(&'static str);

impl Drop for Left {
    fn drop(&mut self) {
        // Nothing else can be done if standard error is closed.
        drop(writeln!(stderr().lock(), "{}", left_text(self.0)));
        std::process::abort();
    }
}

/// Returns what an exception that leaves a function means for the author of the library.
fn left_text(function: &str) -> String {
    format!(
        "the library threw a C++ exception out of {function}: catch it inside the function, and answer with an error"
    )
}

/// Calls a function of a library, whose name is for messages. If an exception leaves the function,
/// the process writes so to standard error and aborts.
pub fn foreign_call<T>(function: &'static str, call: impl FnOnce() -> T) -> T {
    let left = Left(function);
    let result = call();
    std::mem::forget(left);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_returns_what_the_function_returns() {
        assert_eq!(foreign_call("closecall_controller_abi", || 1), 1);
    }

    #[test]
    fn the_message_names_the_function_and_what_to_do() {
        let text = left_text("closecall_controller_step");
        assert!(text.contains("out of closecall_controller_step: catch it inside the function"), "{text}");
    }
}
