//! Collects the failures of a campaign, attributes and explains them.

use closecall_campaign::saved::SavedCampaign;
use closecall_sensors::SensorMode;
use closecall_traffic::words::counted;
use rayon::prelude::*;

use super::{FailureRow, order, read_rows};
use crate::attribution::attribute;
use crate::case::{Case, CausesError, check_repeats, fails};
use crate::explain::{Explanation, explain};

/// Largest number of failures that a report attributes. The report of a large campaign then takes
/// seconds.
const MOST_ATTRIBUTED: usize = 200;

/// The failures of a campaign.
#[derive(Clone, Debug, Default)]
pub struct Failures {
    /// The failures in the order of the table.
    pub rows: Vec<FailureRow>,
    /// Number of failures without an attribution, because of the sensors or because there are too
    /// many.
    pub without_attribution: usize,
}

/// Returns the failures of the arm under test of a campaign, with attributions and stored
/// explanations.
///
/// # Errors
/// [`CausesError`] if the folder cannot be read.
pub fn campaign_failures(saved: &SavedCampaign) -> Result<Failures, CausesError> {
    let mut rows = rows(saved)?;
    let attributed: Vec<_> = rows
        .par_iter()
        .take(MOST_ATTRIBUTED)
        .map(|row| match &row.attribution {
            Some(kept) => Some(kept.clone()),
            None => {
                let case = Case::of(saved, Some(&row.scenario), row.sample, Some(&row.controller)).ok()?;
                let is_fast = case.sensors() != SensorMode::Full && is_built_in(saved, &row.controller);
                if is_fast { attribute(&case, &[]).ok()?.1 } else { None }
            }
        })
        .collect();
    for (row, attribution) in rows.iter_mut().zip(attributed) {
        row.attribution = attribution;
    }
    let without_attribution = rows.iter().filter(|row| row.attribution.is_none()).count();
    Ok(Failures { rows, without_attribution })
}

/// Explains failures of the arm under test: `sample` alone, or up to `most` in the order of the
/// table. Returns the explanations in that order, and all failures of the campaign with them.
///
/// # Errors
/// [`CausesError`] if the folder cannot be read, the campaign has no such scenario, or a sample has
/// no outcome or no failure.
pub fn explain_failures(
    saved: &SavedCampaign,
    scenario: Option<&str>,
    sample: Option<u64>,
    most: u64,
) -> Result<(Vec<Explanation>, Failures), CausesError> {
    if let Some(sample) = sample {
        let case = Case::of(saved, scenario, sample, None)?;
        let Some(explanation) = explain(&case)? else { return Err(passes(saved, &case)) };
        check_repeats(saved, &[case])?;
        let mut failures = campaign_failures(saved)?;
        keep(&mut failures.rows, explanation.clone());
        return Ok((vec![explanation], failures));
    }
    if scenario.is_some() {
        // Checks that there is such a scenario.
        saved.file(scenario)?;
    }
    let mut failures = campaign_failures(saved)?;
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let chosen = failures.rows.iter().filter(|row| scenario.is_none_or(|name| row.scenario == name)).take(most);
    let (mut explanations, mut cases) = (Vec::new(), Vec::new());
    for row in chosen {
        let case = Case::of(saved, Some(&row.scenario), row.sample, Some(&row.controller))?;
        explanations.push(explain(&case)?.ok_or_else(|| passes(saved, &case))?);
        cases.push(case);
    }
    check_repeats(saved, &cases)?;
    for explanation in &explanations {
        keep(&mut failures.rows, explanation.clone());
    }
    Ok((explanations, failures))
}

/// Returns the error for a sample that does not fail, with some that do. If the sample fails in the
/// journal, returns the error for a sample that does not repeat.
pub(crate) fn passes(saved: &SavedCampaign, case: &Case) -> CausesError {
    let rows = match (has_failed(saved, case), rows(saved)) {
        (Ok(true), _) => {
            return CausesError::NotRepeated { sample: case.sample, controller: case.arm.controller.name().to_owned() };
        }
        (Ok(false), Ok(rows)) => rows,
        // A journal that cannot be read shows neither that the sample passes nor that no sample
        // fails.
        (Err(error), _) | (_, Err(error)) => return error,
    };
    let scenario = &case.file.config().name;
    let failing: Vec<u64> = rows.iter().filter(|row| row.scenario == *scenario).map(|row| row.sample).collect();
    let failing = failing_words(&failing);
    CausesError::Passes { sample: case.sample, controller: case.arm.controller.name().to_owned(), failing }
}

/// Number of failing samples that a message names.
const NAMED: usize = 5;

/// Returns the numbers of the first failing samples, and how many others there are.
fn failing_words(samples: &[u64]) -> String {
    let named = samples.iter().take(NAMED).map(u64::to_string).collect::<Vec<_>>().join(", ");
    match samples.len() {
        0 => "none".to_owned(),
        count if count <= NAMED => named,
        count => format!("{named} and {}", counted(count - NAMED, "other")),
    }
}

/// Returns whether the case fails in the journal of the campaign.
fn has_failed(saved: &SavedCampaign, case: &Case) -> Result<bool, CausesError> {
    let (scenario, controller) = (&case.file.config().name, case.arm.controller.name());
    for record in saved.folder().records()? {
        let record = record?;
        if (&record.scenario, record.sample) == (scenario, case.sample) {
            let mut arms = record.arms.iter().filter(|arm| arm.controller == controller);
            return Ok(arms.any(|arm| arm.result.as_ref().is_ok_and(fails)));
        }
    }
    Ok(false)
}

/// Returns the failures of the arm under test with stored explanations.
fn rows(saved: &SavedCampaign) -> Result<Vec<FailureRow>, CausesError> {
    let kept = read_rows(saved.folder());
    let mut rows = Vec::new();
    for record in saved.folder().records()? {
        let Some(row) = FailureRow::of(&record?) else { continue };
        let explained = kept.iter().find(|explained| explained.is_same(&row) && explained.time_s == row.time_s);
        rows.push(explained.cloned().unwrap_or(row));
    }
    if rows.is_empty() {
        // Only all samples together show that none fails.
        saved.folder().complete_records()?.try_for_each(|record| record.map(drop))?;
    }
    rows.sort_by(order);
    Ok(rows)
}

/// Returns whether the controller is part of this program: a report does not start another author's
/// process.
fn is_built_in(saved: &SavedCampaign, controller: &str) -> bool {
    let manifest = saved.manifest();
    let mut arms = manifest.arms.iter().zip(manifest.arm_names());
    arms.any(|(arm, name)| name == controller && arm.built_in().is_some())
}

fn keep(rows: &mut [FailureRow], explanation: Explanation) {
    let is_of = |row: &&mut FailureRow| {
        (&row.scenario, row.sample, &row.controller)
            == (&explanation.scenario, explanation.sample, &explanation.controller)
    };
    if let Some(row) = rows.iter_mut().find(is_of) {
        row.explain(explanation);
    }
    rows.sort_by(order);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_that_names_some_failing_samples_says_how_many_others_fail() {
        assert_eq!(failing_words(&[]), "none");
        assert_eq!(failing_words(&[3, 7, 1, 9, 4]), "3, 7, 1, 9, 4");
        assert_eq!(failing_words(&[3, 7, 1, 9, 4, 2]), "3, 7, 1, 9, 4 and 1 other");
        assert_eq!(failing_words(&[245; 46]), "245, 245, 245, 245, 245 and 41 others");
    }
}
