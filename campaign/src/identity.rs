//! Whether a record belongs to its sample: scenario, seed, sample, arms and parameters must equal the plan.
//!
//! ```text
//!  plan ─▶ scenario, sample, names of the arms, seed, drawn values
//!            ║ must equal
//!  line ─▶ record: scenario, sample, arms ─▶ outcome of each arm: scenario, seed, sample, controller, parameters
//! ```
//!
//! A checksum shows that a line is whole, not that it is the right one. So a record is checked wherever it arrives: from a worker
//! process, from another machine, and from a journal.

use std::path::Path;

use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::Outcome;
use closecall_traffic::Parameters;

use crate::ledger::Inference;
use crate::manifest::Manifest;
use crate::partition::Partition;
use crate::record::{ArmRecord, Record};
use crate::runner::{Sampling, Work};
use crate::saved::{SavedError, scenario_files};

/// What the records of one scenario must be.
#[derive(Clone, Copy)]
pub(crate) struct Identity<'a, Names> {
    pub(crate) file: &'a ScenarioFile,
    pub(crate) sampling: Sampling,
    /// Returns the names of the arms.
    pub(crate) arms: Names,
}

/// Returns what the records of a scenario with its arms must be.
pub(crate) fn of_work(work: &Work) -> Identity<'_, impl Iterator<Item = &str> + Clone> {
    let arms = work.arms.iter().map(|arm| arm.controller.name());
    Identity { file: &work.file, sampling: work.sampling, arms }
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

    /// Checks that the outcome of an arm, if there is one, belongs to the sample. `drawn` keeps the values of the sample from arm to arm.
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
        if (*other, *number) != (seed, sample) {
            return Err(format!("sample {sample} is sample {number} of the seed {other}, not of {seed}"));
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

/// What the lines of a journal must be, one after the other: the plan of its manifest.
pub(crate) struct JournalPlan {
    files: Vec<ScenarioFile>,
    names: Vec<String>,
    sampling: Sampling,
    partition: Option<Partition>,
    inference: Inference,
    /// Index of the current scenario, and the next number that may be in the plan.
    next: (usize, u64),
    /// The last record: its scenario and sample.
    last: Option<(String, u64)>,
}

impl JournalPlan {
    /// Returns the plan of a manifest. `folder` appears in messages only.
    ///
    /// # Errors
    /// [`SavedError`] if a scenario of the manifest cannot be used.
    pub(crate) fn new(folder: &Path, manifest: &Manifest) -> Result<Self, SavedError> {
        Ok(Self {
            files: scenario_files(folder, manifest)?,
            names: manifest.arm_names(),
            sampling: manifest.sampling,
            partition: manifest.partition,
            inference: manifest.inference,
            next: (0, 0),
            last: None,
        })
    }

    /// Checks that a record is the next one of the plan.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub(crate) fn check(&mut self, record: &Record) -> Result<(), String> {
        if self.is_last(record) {
            let (sample, scenario) = (record.sample, &record.scenario);
            return Err(format!(
                "sample {sample} of `{scenario}` is there twice; a campaign that is resumed removes a repeated line"
            ));
        }
        let out_of_order =
            || format!("sample {} of `{}` is not the next sample of the campaign", record.sample, record.scenario);
        let mut expected = self.expected();
        // The outcomes may have ended the scenario before its last sample.
        if let Some((work, _)) = expected
            && self.inference == Inference::Sequential
            && self.files[work].config().name != record.scenario
            && self.next.1 > 0
        {
            self.next = (work + 1, 0);
            expected = self.expected();
        }
        let (work, sample) = expected.ok_or_else(out_of_order)?;
        if (&self.files[work].config().name, sample) != (&record.scenario, record.sample) {
            return Err(out_of_order());
        }
        let names = self.names.iter().map(String::as_str);
        Identity { file: &self.files[work], sampling: self.sampling, arms: names }.check(record, sample)?;
        self.next = (work, sample + 1);
        self.last = Some((record.scenario.clone(), record.sample));
        Ok(())
    }

    /// Returns true if a record is of the same sample as the last one.
    pub(crate) fn is_last(&self, record: &Record) -> bool {
        self.last.as_ref().is_some_and(|(scenario, sample)| (scenario, *sample) == (&record.scenario, record.sample))
    }

    /// Returns the next sample of the plan: the index of its scenario, and its number.
    fn expected(&self) -> Option<(usize, u64)> {
        let (mut work, mut first) = self.next;
        loop {
            let file = self.files.get(work)?;
            let count = file.space().samples(self.sampling.design, self.sampling.samples);
            let mut numbers = first..count;
            match numbers.find(|&sample| self.partition.is_none_or(|part| part.contains(sample))) {
                Some(sample) => return Some((work, sample)),
                None => (work, first) = (work + 1, 0),
            }
        }
    }

    /// Returns the number of records that the plan has beyond those checked so far. The outcomes may determine the number of samples:
    /// then there may be none.
    pub(crate) fn missing(&self) -> u64 {
        if self.inference == Inference::Sequential && self.last.is_some() {
            return 0;
        }
        let (current, first) = self.next;
        let rest = self.files.iter().enumerate().skip(current).map(|(work, file)| {
            let count = file.space().samples(self.sampling.design, self.sampling.samples);
            let numbers = (if work == current { first } else { 0 })..count;
            numbers.filter(|&sample| self.partition.is_none_or(|part| part.contains(sample))).count() as u64
        });
        rest.sum()
    }
}
