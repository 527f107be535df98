//! Whether a record belongs to its sample: scenario, seed, sample, arms and parameters must equal
//! the plan.
//!
//! ```text
//!  plan ─▶ scenario, sample, names of the arms, seed, drawn values
//!            ║ must equal
//!  line ─▶ record: scenario, sample, arms ─▶ outcome of each arm: scenario, seed, sample, controller, parameters
//! ```
//!
//! A checksum shows that a line is whole, not that it is the right one. So a record is checked
//! wherever it arrives: from a worker process, from another machine, and from a journal.

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::Outcome;
use closecall_traffic::Parameters;

use crate::record::{ArmRecord, Record};
use crate::sampling::Sampling;

/// The properties that the records of one scenario must have.
#[derive(Clone, Copy)]
pub(crate) struct Identity<'a, Names> {
    pub(crate) file: &'a ScenarioFile,
    pub(crate) sampling: Sampling,
    /// Returns the names of the arms.
    pub(crate) arms: Names,
}

impl<'a, Names: Iterator<Item = &'a str> + Clone> Identity<'_, Names> {
    /// Checks that a record belongs to the sample.
    ///
    /// # Errors
    /// What differs, in words.
    pub(crate) fn check(&self, record: &Record, sample: u64) -> Result<(), String> {
        let scenario = &self.file.config().name;
        if record.scenario != *scenario || record.sample != sample {
            let (there, number) = (&record.scenario, record.sample);
            return Err(format!("there is sample {number} of `{there}` instead of {sample} of `{scenario}`"));
        }
        if !record.arms.iter().map(|arm| arm.controller.as_str()).eq(self.arms.clone()) {
            let names: Vec<&str> = self.arms.clone().collect();
            return Err(format!("sample {sample} was not run with {}", names.join(" and ")));
        }
        let mut drawn = None;
        record.arms.iter().try_for_each(|arm| self.check_arm(arm, sample, &mut drawn))
    }

    /// Checks that the outcome of an arm, if there is one, belongs to the sample. `drawn` keeps the
    /// values of the sample from arm to arm.
    ///
    /// # Errors
    /// What differs, in words.
    pub(crate) fn check_arm(&self, arm: &ArmRecord, sample: u64, drawn: &mut Option<Parameters>) -> Result<(), String> {
        let Ok(outcome) = &arm.result else { return Ok(()) };
        let (scenario, Sampling { seed, design, samples }) = (&self.file.config().name, self.sampling);
        let Outcome { scenario: there, seed: other, sample: number, .. } = outcome;
        if there != scenario {
            return Err(format!("sample {sample} of `{scenario}` has an outcome of `{there}`"));
        }
        if *other != seed {
            let of_sample = if *number == sample { String::new() } else { format!("sample {number} of ") };
            return Err(format!(
                "sample {sample} has an outcome of {of_sample}the seed {other}, and the campaign has the seed {seed}"
            ));
        }
        if *number != sample {
            return Err(format!("sample {sample} has the outcome of sample {number}"));
        }
        if outcome.controller != arm.controller {
            let (there, here) = (&outcome.controller, &arm.controller);
            return Err(format!("sample {sample} has an outcome of the controller `{there}` in the arm `{here}`"));
        }
        let values = drawn.get_or_insert_with(|| self.file.space().sample(design, seed, sample, samples));
        if outcome.parameters != *values {
            return Err(format!("sample {sample} has other values than the seed {seed} draws"));
        }
        Ok(())
    }
}
