//! The samples of a campaign as JUnit XML: one suite for each scenario, one case for each sample
//! and controller. A collision of the ego in the arm under test is a failure, a sample without an
//! outcome is an error. A collision in the baseline is no failure: the system under test is
//! compared with it. `junit.xml` has the verdict.
//!
//! The file is written case by case, so that memory does not grow with the number of cases. It
//! depends on the outcomes alone and holds no wall-clock times.

use std::io::{self, Write};
use std::path::Path;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

use super::outcomes::OutcomeRow;
use super::recordings::card_beside;
use closecall_scenarios::outcome::Collision;
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::shown::shown;

/// The counts of one suite. The file states them before the cases.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SuiteTotals {
    /// The scenario's name.
    pub scenario: String,
    /// The number of cases.
    pub tests: usize,
    /// The number of cases with a collision of the ego.
    pub failures: usize,
    /// The number of cases without an outcome.
    pub errors: usize,
}

/// Writes the file. Each row has the path of its recording, if there is one, relative to the file's
/// folder. The rows are grouped by scenario, in the order of `suites`; `tested` is the controller
/// under test.
///
/// # Errors
/// The first error of `rows`, or [`WriteError`]. An existing file then stays as it is.
pub fn write_samples<E: From<WriteError>>(
    path: &Path,
    suites: &[SuiteTotals],
    tested: &str,
    rows: impl IntoIterator<Item = Result<(OutcomeRow, Option<String>), E>>,
) -> Result<(), E> {
    let mut row_error = None;
    let written = write_file(path, |file| {
        let rows = rows.into_iter().map_while(|row| row.map_err(|error| row_error = Some(error)).ok());
        report(file, suites, tested, rows)?;
        if row_error.is_some() { Err(io::Error::other("a row is an error")) } else { Ok(()) }
    });
    match row_error {
        Some(error) => Err(error),
        None => Ok(written?),
    }
}

fn report(
    file: impl Write,
    suites: &[SuiteTotals],
    tested: &str,
    rows: impl Iterator<Item = (OutcomeRow, Option<String>)>,
) -> io::Result<()> {
    let mut xml = Writer::new_with_indent(file, b' ', 4);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let sum = |count: fn(&SuiteTotals) -> usize| suites.iter().map(count).sum::<usize>();
    let all = SuiteTotals {
        scenario: "closecall".to_owned(),
        tests: sum(|suite| suite.tests),
        failures: sum(|suite| suite.failures),
        errors: sum(|suite| suite.errors),
    };
    xml.write_event(Event::Start(totals("testsuites", &all)))?;
    let mut rows = rows.peekable();
    for suite in suites {
        xml.write_event(Event::Start(totals("testsuite", suite)))?;
        while let Some((row, recording)) = rows.next_if(|(row, _)| row.scenario == suite.scenario) {
            case(&mut xml, &row, recording.as_deref(), tested)?;
        }
        xml.write_event(Event::End(BytesEnd::new("testsuite")))?;
    }
    if let Some((row, _)) = rows.next() {
        return Err(io::Error::other(format!("`{}` is not among the suites", row.scenario)));
    }
    xml.write_event(Event::End(BytesEnd::new("testsuites")))?;
    xml.into_inner().write_all(b"\n")
}

fn totals<'a>(element: &'a str, suite: &SuiteTotals) -> BytesStart<'a> {
    let mut start = BytesStart::new(element);
    start.push_attribute(("name", suite.scenario.as_str()));
    for (key, count) in [("tests", suite.tests), ("errors", suite.errors), ("failures", suite.failures)] {
        start.push_attribute((key, count.to_string().as_str()));
    }
    start
}

fn case<W: Write>(xml: &mut Writer<W>, row: &OutcomeRow, recording: Option<&str>, tested: &str) -> io::Result<()> {
    let name = format!("sample {}, {}", row.sample, row.controller);
    let mut start = BytesStart::new("testcase");
    start.push_attribute(("name", legal_xml(&name).as_str()));
    start.push_attribute(("classname", legal_xml(&row.scenario).as_str()));
    xml.write_event(Event::Start(start))?;
    if let Some((element, kind, message)) = problem(row, tested) {
        let element = xml.create_element(element).with_attribute(("message", legal_xml(&message).as_str()));
        element.with_attribute(("type", legal_xml(&kind).as_str())).write_empty()?;
    }
    // JUnit has no attachments. CI servers read these lines instead.
    let attached = recording.map_or_else(String::new, |recording| {
        format!("\n[[ATTACHMENT|{recording}]]\n[[ATTACHMENT|{}]]", card_beside(recording))
    });
    let text = legal_xml(&format!("seed {}, sample {}, controller {}{attached}", row.seed, row.sample, row.controller));
    xml.create_element("system-out").write_text_content(BytesText::new(&text))?;
    xml.write_event(Event::End(BytesEnd::new("testcase")))
}

/// Returns the name, the type and the message of the element for a failure or an error, or `None`
/// if the case passes.
fn problem(row: &OutcomeRow, tested: &str) -> Option<(&'static str, String, String)> {
    match (&row.result, row.ego_collision()) {
        (Err(error), _) => Some(("error", error.kind.clone(), error.message.clone())),
        (Ok(_), Some(collision)) if row.controller == tested => {
            Some(("failure", "collision".to_owned(), message(collision)))
        }
        (Ok(_), _) => None,
    }
}

/// Returns the text without control characters, and without the characters that XML does not allow
/// even in escaped form.
pub(super) fn legal_xml(text: &str) -> String {
    let is_legal = |c: char| matches!(c, '\t' | '\n' | '\r' | '\u{20}'..='\u{fffd}' | '\u{10000}'..);
    shown(text).chars().map(|c| if is_legal(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

fn message(collision: &Collision) -> String {
    let [first, second] = &collision.between;
    let [first_mps, second_mps] = collision.delta_v_mps;
    format!(
        "{first} and {second} collided at {} with {:.2} m/s; change of velocity {first_mps:.2} and {second_mps:.2} m/s",
        collision.time, collision.relative_speed_mps,
    )
}

#[cfg(test)]
mod tests {
    use super::super::outcomes::tests::rows;
    use super::super::xunit_schema::against_schema;
    use super::*;

    fn suite(scenario: &str, [tests, failures, errors]: [usize; 3]) -> SuiteTotals {
        SuiteTotals { scenario: scenario.to_owned(), tests, failures, errors }
    }

    fn written(suites: &[SuiteTotals], rows: Vec<OutcomeRow>) -> io::Result<String> {
        let recorded = |row: OutcomeRow| {
            let recording = (row.ego_collision().is_some()).then(|| "recordings/0.rrd".to_owned());
            (row, recording)
        };
        let mut file = Vec::new();
        report(&mut file, suites, "acc", rows.into_iter().map(recorded))?;
        let text = String::from_utf8(file).unwrap();
        assert_eq!(against_schema(&text), Vec::<String>::new(), "{text}");
        Ok(text)
    }

    #[test]
    fn a_collision_of_the_arm_under_test_fails_and_an_error_is_an_error() {
        insta::assert_snapshot!(written(&[suite("low-thw-overtake", [3, 1, 1])], rows()).unwrap());
    }

    #[test]
    fn one_suite_for_each_scenario() {
        let mut rows = rows();
        rows[2].scenario = "other".to_owned();
        let suites = [suite("low-thw-overtake", [2, 1, 0]), suite("other", [1, 0, 1])];
        let text = written(&suites, rows.clone()).unwrap();
        let position = |part: &str| text.find(part).unwrap();
        assert!(position("<testsuite name=\"other\"") > position("sample 0, mis"));
        assert!(position("sample 1, mis") > position("<testsuite name=\"other\""));
        assert!(text.contains("<testsuites name=\"closecall\" tests=\"3\" errors=\"1\" failures=\"1\">"));
        assert!(written(&suites[..1], rows).is_err(), "a row without a suite is an error");
    }

    #[test]
    fn a_message_of_a_controller_is_always_legal_xml() {
        let mut rows = rows();
        if let Err(failure) = &mut rows[2].result {
            failure.message = "a bell \u{7}, an escape \u{1b}[31m, ]]> & <tags>\nand a second line".to_owned();
        }
        let text = written(&[suite("low-thw-overtake", [3, 1, 1])], rows).unwrap();
        assert!(!text.contains(['\u{7}', '\u{1b}']) && text.contains("&lt;tags&gt;"), "{text}");
        let mut reader = quick_xml::Reader::from_str(&text);
        loop {
            match reader.read_event().unwrap() {
                Event::Eof => break,
                Event::Start(start) | Event::Empty(start) => {
                    start.attributes().for_each(|attribute| drop(attribute.unwrap()));
                }
                _ => {}
            }
        }
    }
}
