//! The samples of a campaign that ended in an error: they may fail or not.

use std::fmt;

use closecall_campaign::saved::SavedCampaign;
use closecall_traffic::words::counted;

use crate::case::CausesError;

/// Samples that ended in an error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleErrors {
    /// Number of samples that ended in an error.
    pub errors: u64,
    /// Number of all samples.
    pub samples: u64,
    /// The scenario of the first one.
    pub scenario: String,
    /// The number of the first one.
    pub first: u64,
    /// The message of the first one.
    pub message: String,
}

impl SampleErrors {
    /// Returns the errors of a campaign in one arm, by default in the arm under test; `None` if
    /// there are none. `scenario` may be left out for all scenarios.
    ///
    /// # Errors
    /// [`CausesError`] if the folder cannot be read.
    pub fn of(
        saved: &SavedCampaign,
        scenario: Option<&str>,
        controller: Option<&str>,
    ) -> Result<Option<Self>, CausesError> {
        let (mut samples, mut found): (u64, Option<Self>) = (0, None);
        for record in saved.folder().records()? {
            let record = record?;
            if scenario.is_some_and(|name| record.scenario != name) {
                continue;
            }
            samples += 1;
            let arm = match controller {
                Some(name) => record.arms.iter().find(|arm| arm.controller == name),
                None => record.arms.last(),
            };
            let Some(Err(failure)) = arm.map(|arm| &arm.result) else { continue };
            found
                .get_or_insert_with(|| Self {
                    errors: 0,
                    samples: 0,
                    scenario: record.scenario.clone(),
                    first: record.sample,
                    message: failure.message.clone(),
                })
                .errors += 1;
        }
        Ok(found.map(|errors| Self { samples, ..errors }))
    }
}

/// Writes `3 of 40 samples ended in an error, and may fail or not; first sample 7 of
/// low-thw-overtake: the process ended`.
impl fmt::Display for SampleErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { errors, samples, scenario, first, message } = self;
        let samples = counted(*samples, "sample");
        write!(
            f,
            "{errors} of {samples} ended in an error, and may fail or not; first sample {first} of {scenario}: {message}"
        )
    }
}
