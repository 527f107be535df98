//! The plan of a campaign as its journal must follow it: which record comes next, and how many are
//! missing.

use std::path::Path;

use closecall_scenarios::ScenarioFile;

use crate::identity::Identity;
use crate::ledger::Inference;
use crate::manifest::Manifest;
use crate::partition::{Partition, samples_in};
use crate::record::Record;
use crate::sampling::Sampling;
use crate::saved::scenario_files;
use crate::saved_error::SavedError;

/// What the lines of a journal must be, one after the other: the plan of its manifest.
pub(crate) struct JournalPlan {
    files: Vec<ScenarioFile>,
    names: Vec<String>,
    sampling: Sampling,
    partition: Option<Partition>,
    inference: Inference,
    /// The next sample that may be in the plan.
    next: Position,
    /// The last record: its scenario and sample.
    last: Option<(String, u64)>,
}

/// A sample of the plan.
#[derive(Clone, Copy, Debug, Default)]
struct Position {
    /// The index of its scenario.
    work: usize,
    /// The number of the sample.
    sample: u64,
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
            next: Position::default(),
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
        if let Some(Position { work, .. }) = expected
            && self.inference == Inference::Sequential
            && self.files[work].config().name != record.scenario
            && self.next.sample > 0
        {
            self.next = Position { work: work + 1, sample: 0 };
            expected = self.expected();
        }
        let Position { work, sample } = expected.ok_or_else(out_of_order)?;
        if (&self.files[work].config().name, sample) != (&record.scenario, record.sample) {
            return Err(out_of_order());
        }
        let names = self.names.iter().map(String::as_str);
        Identity { file: &self.files[work], sampling: self.sampling, arms: names }.check(record, sample)?;
        self.next = Position { work, sample: sample + 1 };
        self.last = Some((record.scenario.clone(), record.sample));
        Ok(())
    }

    /// Returns true if a record is of the same sample as the last one.
    fn is_last(&self, record: &Record) -> bool {
        self.last.as_ref().is_some_and(|(scenario, sample)| (scenario, *sample) == (&record.scenario, record.sample))
    }

    /// Returns the place of a record in the plan: the index of its scenario, and its number. `None`
    /// for a scenario that the plan does not have.
    pub(crate) fn place(&self, record: &Record) -> Option<(usize, u64)> {
        let work = self.files.iter().position(|file| file.config().name == record.scenario)?;
        Some((work, record.sample))
    }

    /// Returns the next sample of the plan.
    fn expected(&self) -> Option<Position> {
        let Position { mut work, sample: mut first } = self.next;
        loop {
            let file = self.files.get(work)?;
            let count = file.space().samples(self.sampling.design, self.sampling.samples);
            let mut numbers = first..count;
            match numbers.find(|&sample| self.partition.is_none_or(|part| part.contains(sample))) {
                Some(sample) => return Some(Position { work, sample }),
                None => (work, first) = (work + 1, 0),
            }
        }
    }

    /// Returns the number of records that the plan has beyond those checked so far. The outcomes
    /// may determine the number of samples: then there may be none.
    pub(crate) fn missing(&self) -> u64 {
        if self.inference == Inference::Sequential && self.last.is_some() {
            return 0;
        }
        let Position { work: current, sample: first } = self.next;
        let rest = self.files.iter().enumerate().skip(current).map(|(work, file)| {
            let count = file.space().samples(self.sampling.design, self.sampling.samples);
            samples_in(self.partition, (if work == current { first } else { 0 })..count)
        });
        rest.fold(0, u64::saturating_add)
    }
}
