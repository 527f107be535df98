//! What went wrong with a process after its last answer, as it unloaded its library: a destructor
//! of a static object that crashes, for example. No sample is concerned, so that none pays for it.
//! A command says it at its end.

use std::collections::BTreeSet;
use std::process::ExitStatus;
use std::sync::{Mutex, PoisonError};

use super::error::{ExecError, how, last_lines};

/// Largest number of messages that are kept. The text that a process writes may differ each time.
const MOST_MESSAGES: usize = 5;

type Messages = Mutex<BTreeSet<String>>;

static BAD_ENDS: Messages = Mutex::new(BTreeSet::new());
static LEFT_OVER: Messages = Mutex::new(BTreeSet::new());

/// Returns the messages about processes that ended badly since the last call, each once, at most 5,
/// and what [`take_left_over`] returns.
pub fn take_bad_ends() -> Vec<String> {
    [take(&BAD_ENDS), take_left_over()].concat()
}

/// Returns the messages about processes that did not keep to the protocol after their last answer,
/// since the last call, each once, at most 5.
pub fn take_left_over() -> Vec<String> {
    take(&LEFT_OVER)
}

/// Keeps that the process of a controller or a perception ended with this status as it unloaded its
/// library, and the last lines of its standard error.
pub(super) fn keep_bad_end(name: &str, status: ExitStatus, stderr: &str) {
    let (how, lines) = (how(status), last_lines(stderr));
    let message = format!(
        "the process of `{name}` ended with {how} after its last sample, as it unloaded its library; no sample is \
         concerned{lines}"
    );
    keep(&BAD_ENDS, message);
}

/// Keeps that the process of a controller did not keep to the protocol after its last answer.
pub fn keep_left_over(name: &str, error: &ExecError) {
    keep(&LEFT_OVER, format!("after its last sample, the process of `{name}` failed: {error}"));
}

fn take(messages: &Messages) -> Vec<String> {
    std::mem::take(&mut *messages.lock().unwrap_or_else(PoisonError::into_inner)).into_iter().collect()
}

fn keep(messages: &Messages, message: String) {
    let mut messages = messages.lock().unwrap_or_else(PoisonError::into_inner);
    if messages.len() < MOST_MESSAGES {
        messages.insert(message);
    }
}
