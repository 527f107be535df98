//! The decision between skipping a test and failing it.

use std::io::Write;

use crate::Need;

/// The environment variable that lists the needs that must not be lacking.
const VARIABLE: &str = "CLOSECALL_REQUIRE";

/// Says that the calling test is skipped because `need` is lacking. The test has to return after
/// this call.
///
/// The message goes to standard error past the test runner's capture, and shows although the test
/// passes.
///
/// # Panics
/// If `CLOSECALL_REQUIRE` lists `need`, or holds a word that is not a need.
pub fn skip(need: Need, reason: &str) {
    match decide(&required(), need, reason) {
        // One write: lines of tests that run at the same time do not mix.
        Ok(message) => std::io::stderr().write_all(message.as_bytes()).expect("standard error is open"),
        Err(message) => panic!("{message}"),
    }
}

/// Returns the needs that `CLOSECALL_REQUIRE` lists.
///
/// # Panics
/// If the variable holds a word that is not a need.
pub(crate) fn required() -> Vec<Need> {
    let list = std::env::var_os(VARIABLE).unwrap_or_default();
    parse(&list.to_string_lossy()).unwrap_or_else(|message| panic!("{message}"))
}

/// Reads a list of needs. Empty entries count for nothing, so that a script may build the list by
/// appending.
fn parse(list: &str) -> Result<Vec<Need>, String> {
    list.split(',').map(str::trim).filter(|word| !word.is_empty()).map(str::parse).collect()
}

/// Returns the line that says that a test is skipped, or as an error the message of its failure.
fn decide(required: &[Need], need: Need, reason: &str) -> Result<String, String> {
    if required.contains(&need) {
        return Err(format!("required ({need}): {reason}"));
    }
    Ok(format!("skipped ({need}): {reason}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_of_this_test_run_holds_known_words_only() {
        required();
    }

    #[test]
    fn a_list_names_needs_by_their_words() {
        assert_eq!(parse(""), Ok(vec![]));
        assert_eq!(parse("viewer, data,"), Ok(vec![Need::Viewer, Need::Data]));
        let all = Need::ALL.map(Need::word).join(",");
        assert_eq!(parse(&all), Ok(Need::ALL.to_vec()));
    }

    #[test]
    fn an_unknown_word_is_an_error_that_lists_the_known_ones() {
        let message = parse("viewer,veiwer").unwrap_err();
        let words = "viewer, onnxruntime, display, data, python, browser, exchange";
        assert_eq!(message, format!("CLOSECALL_REQUIRE holds the unknown word `veiwer`; known are {words}"));
        assert!(parse("Viewer").is_err() && parse("viewer data").is_err());
    }

    #[test]
    fn only_a_required_need_fails_a_test() {
        let reason = "CLOSECALL_RERUN does not name the Rerun viewer";
        assert_eq!(decide(&[Need::Data], Need::Viewer, reason), Ok(format!("skipped (viewer): {reason}\n")));
        assert_eq!(decide(&[Need::Viewer], Need::Viewer, reason), Err(format!("required (viewer): {reason}")));
    }
}
