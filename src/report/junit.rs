//! A campaign as JUnit XML, which every CI server shows: one suite for each scenario, one case for each sample and
//! controller. A collision of E is a failure, a sample without an outcome an error.
//!
//! The file depends on the outcomes alone: it holds no wall-clock times.

use std::io;
use std::path::Path;

use quick_junit::{NonSuccessKind, Property, Report, TestCase, TestCaseStatus, TestSuite};

use super::outcomes::OutcomeRow;
use super::write::{WriteError, write_atomically};
use crate::outcome::Collision;

/// Writes the file. Each row comes with the path of its recording, where there is one, relative to the file's folder;
/// the rows of a scenario follow each other.
///
/// # Errors
/// The first error of `rows`, or [`WriteError`]; a file of that name is then as it was.
pub fn write_junit<E: From<WriteError>>(
    path: &Path,
    rows: impl IntoIterator<Item = Result<(OutcomeRow, Option<String>), E>>,
) -> Result<(), E> {
    let report = report(rows)?;
    write_atomically(path, |file| report.serialize(file).map_err(io::Error::other))?;
    Ok(())
}

fn report<E>(rows: impl IntoIterator<Item = Result<(OutcomeRow, Option<String>), E>>) -> Result<Report, E> {
    let mut report = Report::new("closecall");
    let mut suite: Option<TestSuite> = None;
    for row in rows {
        let (row, recording) = row?;
        if suite.as_ref().is_none_or(|suite| suite.name.as_str() != row.scenario) {
            report.add_test_suites(suite.replace(TestSuite::new(row.scenario.as_str())));
        }
        if let Some(suite) = &mut suite {
            suite.add_test_case(case(&row, recording.as_deref()));
        }
    }
    report.add_test_suites(suite);
    Ok(report)
}

fn case(row: &OutcomeRow, recording: Option<&str>) -> TestCase {
    let mut case = TestCase::new(format!("sample {}, {}", row.sample, row.controller), status(row));
    case.set_classname(row.scenario.as_str());
    case.add_property(Property::new("seed", row.seed.to_string()));
    case.add_property(Property::new("sample", row.sample.to_string()));
    case.add_property(Property::new("controller", row.controller.as_str()));
    if let Some(recording) = recording {
        // JUnit has no attachments; this line is what CI servers read instead.
        case.set_system_out(format!("[[ATTACHMENT|{recording}]]"));
    }
    case
}

fn status(row: &OutcomeRow) -> TestCaseStatus {
    match (&row.result, row.ego_collision()) {
        (Err(error), _) => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
            status.set_type(error.kind.as_str()).set_message(error.message.as_str());
            status
        }
        (Ok(_), Some(collision)) => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
            status.set_type("collision").set_message(message(collision));
            status
        }
        (Ok(_), None) => TestCaseStatus::success(),
    }
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
    use std::convert::Infallible;

    use super::super::outcomes::tests::rows;
    use super::*;

    #[test]
    fn a_collision_fails_and_an_error_is_an_error() {
        let recorded = |row: OutcomeRow| {
            let recording = (row.ego_collision().is_some()).then(|| "recordings/0.rrd".to_owned());
            Ok::<_, Infallible>((row, recording))
        };
        let report = report(rows().into_iter().map(recorded)).unwrap();
        insta::assert_snapshot!(report.to_string().unwrap());
    }

    #[test]
    fn one_suite_for_each_scenario() {
        let mut rows = rows();
        rows[2].scenario = "other".to_owned();
        let report = report(rows.into_iter().map(|row| Ok::<_, Infallible>((row, None)))).unwrap();
        let suites: Vec<(&str, usize)> =
            report.test_suites.iter().map(|suite| (suite.name.as_str(), suite.tests)).collect();
        assert_eq!(suites, [("low-thw-overtake", 2), ("other", 1)]);
        assert_eq!((report.tests, report.failures, report.errors), (3, 1, 1));
    }
}
