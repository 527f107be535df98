//! The samples that failed in an earlier campaign, to be run first in a later one.
//!
//! ```text
//!  folder of a campaign ─┐
//!                        ├─▶ EarlierFailures ─▶ what a later campaign runs first
//!  baseline file        ─┘
//! ```
//!
//! A sample that has failed fails again more often than another one. The order decides when a
//! failure is seen, and no result. A changed scenario or controller is therefore no obstacle. With
//! another seed or design, however, a number names another sample.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use closecall_scenarios::sampling::Design;

use crate::ahead::{self, SampleKey};
use crate::baseline::Baseline;
use crate::folder::{AHEAD, Folder, FolderError};
use crate::record::Record;
use crate::sampling::Sampling;

/// The reason for which the failures of an earlier campaign cannot run first.
#[derive(Debug, thiserror::Error)]
pub enum EarlierError {
    /// The folder or the file cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The numbers of the earlier campaign name other samples.
    #[error(
        "failed to run the failures of {} first: {subject} is {earlier} there and {current} here, so its numbers name other samples",
        path.display()
    )]
    Different {
        /// The folder or the file.
        path: PathBuf,
        /// What differs.
        subject: &'static str,
        /// The value in the earlier campaign.
        earlier: String,
        /// The value in this campaign.
        current: String,
    },
    /// The earlier campaign ran other scenarios.
    #[error("failed to run the failures of {} first: it has no scenario of this campaign", path.display())]
    NoScenario {
        /// The folder or the file.
        path: PathBuf,
    },
}

/// The samples that failed in an earlier campaign: the ego collided in the arm under test, or an
/// arm ended in an error.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EarlierFailures {
    path: PathBuf,
    seed: u64,
    design: Design,
    /// The numbers of the samples of each scenario, in ascending order.
    samples: BTreeMap<String, Vec<u64>>,
}

impl EarlierFailures {
    /// Reads the folder of a campaign, which may be a part or have ended early, or a baseline file.
    ///
    /// # Errors
    /// [`FolderError`] if it cannot be read.
    pub fn read(path: &Path) -> Result<Self, FolderError> {
        if path.is_dir() { Self::of_folder(path) } else { Ok(Self::of_baseline(path, Baseline::read(path)?)) }
    }

    fn of_folder(path: &Path) -> Result<Self, FolderError> {
        let folder = Folder::open(path);
        let manifest = folder.manifest()?;
        let mut samples: BTreeMap<String, Vec<u64>> =
            manifest.scenarios.iter().map(|scenario| (scenario.name.clone(), Vec::new())).collect();
        let mut push = |record: &Record| {
            if let Some(numbers) = samples.get_mut(&record.scenario).filter(|_| has_failed(record)) {
                numbers.push(record.sample);
            }
        };
        for record in folder.records()? {
            push(&record?);
        }
        // A campaign that has ended at a failure that came first has it here, and not in its
        // journal.
        let waiting = folder.file(AHEAD);
        let place = |record: &Record| {
            let work = manifest.scenarios.iter().position(|scenario| scenario.name == record.scenario)?;
            Some(SampleKey { work, sample: record.sample })
        };
        let kept =
            ahead::read(&waiting, place).map_err(|source| FolderError::Read { path: waiting.clone(), source })?;
        kept.ahead.waiting().for_each(push);
        for numbers in samples.values_mut() {
            numbers.sort_unstable();
            numbers.dedup();
        }
        let sampling = manifest.sampling;
        Ok(Self { path: path.to_owned(), seed: sampling.seed, design: sampling.design, samples })
    }

    fn of_baseline(path: &Path, baseline: Baseline) -> Self {
        let samples = baseline.scenarios.into_iter().map(|(name, scenario)| (name, scenario.failing)).collect();
        Self { path: path.to_owned(), seed: baseline.seed, design: baseline.design, samples }
    }

    /// Checks that the numbers name samples of a campaign with this sampling and these scenarios.
    ///
    /// # Errors
    /// [`EarlierError`] with what differs.
    pub fn check<'a>(
        &self,
        sampling: Sampling,
        scenarios: impl IntoIterator<Item = &'a str>,
    ) -> Result<(), EarlierError> {
        let different = |subject, earlier: &dyn ToString, current: &dyn ToString| EarlierError::Different {
            path: self.path.clone(),
            subject,
            earlier: earlier.to_string(),
            current: current.to_string(),
        };
        if self.seed != sampling.seed {
            return Err(different("the seed", &self.seed, &sampling.seed));
        }
        if self.design != sampling.design {
            return Err(different("the sampling design", &self.design, &sampling.design));
        }
        match scenarios.into_iter().any(|name| self.samples.contains_key(name)) {
            true => Ok(()),
            false => Err(EarlierError::NoScenario { path: self.path.clone() }),
        }
    }

    /// Returns the numbers of the samples of a scenario that failed, in ascending order.
    pub fn of(&self, scenario: &str) -> &[u64] {
        self.samples.get(scenario).map_or(&[], Vec::as_slice)
    }

    /// Returns true if no sample failed.
    pub fn is_empty(&self) -> bool {
        self.samples.values().all(Vec::is_empty)
    }
}

/// Returns true if the ego collided in the arm under test, or an arm ended in an error.
fn has_failed(record: &Record) -> bool {
    let collided = record.tallies().last().is_some_and(|tested| tested.collided == Some(true));
    collided || record.arms.iter().any(|arm| arm.result.is_err())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_another_seed_design_or_scenario_are_refused() {
        let samples = BTreeMap::from([("headline".to_owned(), vec![3, 8])]);
        let failures = EarlierFailures { path: "b.json".into(), seed: 1, design: Design::Random, samples };
        let sampling = Sampling { seed: 1, design: Design::Random, samples: 10 };
        assert!(failures.check(sampling, ["another", "headline"]).is_ok());
        assert_eq!((failures.of("headline"), failures.of("another")), (&[3, 8][..], &[][..]));
        for (sampling, scenario, said) in [
            (Sampling { seed: 2, ..sampling }, "headline", "the seed is 1 there and 2 here"),
            (Sampling { design: Design::Sobol, ..sampling }, "headline", "the sampling design is random there"),
            (sampling, "another", "no scenario of this campaign"),
        ] {
            let error = failures.check(sampling, [scenario]).unwrap_err().to_string();
            assert!(error.contains(said) && error.contains("b.json"), "{error}");
        }
    }
}
