//! One campaign against an earlier one, sample by sample: what newly fails, what is fixed, and how the margins moved.
//!
//! Both ran the same samples, each in its own arm under test. No statistics are needed to say that a sample that passed
//! now fails: it can be replayed in both folders.

use std::path::{Path, PathBuf};

use closecall_traffic::Measured;

use super::folder::{Folder, FolderError};
use super::record::{ArmRecord, Record};
use closecall_simulation::outcome::Margins;

/// Two campaigns that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A folder cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// They did not run the same samples.
    #[error("failed to compare {} with {}: {what}", one.display(), other.display())]
    Different {
        /// The baseline's folder.
        one: PathBuf,
        /// The other folder.
        other: PathBuf,
        /// What is different.
        what: String,
    },
    /// A sample of the same number was sampled from something else.
    #[error("failed to compare: sample {sample} of `{scenario}` is another encounter in {} than in {}: {parameter} differs", one.display(), other.display())]
    OtherSample {
        /// The baseline's folder.
        one: PathBuf,
        /// The other folder.
        other: PathBuf,
        /// The scenario.
        scenario: String,
        /// The sample.
        sample: u64,
        /// A parameter with another value.
        parameter: String,
    },
}

/// The margins that are compared: the key in reports, and where it lies. Less is closer to a collision.
type Margin = (&'static str, fn(&Margins) -> Measured);
const MARGINS: [Margin; 5] = [
    ("min_thw_front_s", |margins| margins.min_thw_front_s),
    ("min_thw_rear_s", |margins| margins.min_thw_rear_s),
    ("min_gap_front_m", |margins| margins.min_gap_front_m),
    ("min_gap_rear_m", |margins| margins.min_gap_rear_m),
    ("min_ttc_rear_s", |margins| margins.min_ttc_rear_s),
];

/// How one margin moved, over the samples that have it in both campaigns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarginMove {
    /// Its key in reports; the unit is its end.
    pub key: &'static str,
    /// Samples that have it in both.
    pub samples: u64,
    /// Sum over these samples in the baseline.
    baseline: f64,
    /// Sum over these samples now.
    now: f64,
    /// The sample that lost most, and how much it changed.
    pub worst: Option<(u64, f64)>,
}

impl MarginMove {
    /// Mean in the baseline, and now; nothing of no samples.
    pub fn means(&self) -> Option<[f64; 2]> {
        (self.samples > 0).then(|| [self.baseline, self.now].map(|sum| sum / self.samples as f64))
    }

    fn push(&mut self, sample: u64, baseline: f64, now: f64) {
        self.samples += 1;
        self.baseline += baseline;
        self.now += now;
        let change = now - baseline;
        if self.worst.is_none_or(|(_, worst)| !(change >= worst)) {
            self.worst = Some((sample, change));
        }
    }
}

/// What changed in one scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenarioComparison {
    /// Its name.
    pub scenario: String,
    /// Samples that both campaigns have.
    pub samples: u64,
    /// Samples with the same outcome to the last bit, but for the controller's name.
    pub same: u64,
    /// Samples in which E collides now, and did not.
    pub newly_failing: Vec<u64>,
    /// Samples in which E collided, and does not now.
    pub fixed: Vec<u64>,
    /// Samples in which E collides in both.
    pub still_failing: u64,
    /// Samples that are an error now, and were not.
    pub newly_in_error: Vec<u64>,
    /// Samples that were an error, and are not now.
    pub no_longer_in_error: Vec<u64>,
    /// How the margins moved.
    pub margins: Vec<MarginMove>,
}

impl ScenarioComparison {
    fn new(scenario: &str) -> Self {
        let unmoved = |(key, _): Margin| MarginMove { key, samples: 0, baseline: 0.0, now: 0.0, worst: None };
        Self {
            scenario: scenario.to_owned(),
            samples: 0,
            same: 0,
            newly_failing: Vec::new(),
            fixed: Vec::new(),
            still_failing: 0,
            newly_in_error: Vec::new(),
            no_longer_in_error: Vec::new(),
            margins: MARGINS.map(unmoved).to_vec(),
        }
    }

    fn push(&mut self, sample: u64, baseline: &ArmRecord, now: &ArmRecord) {
        self.samples += 1;
        self.same += u64::from(is_same(baseline, now));
        match (&baseline.result, &now.result) {
            (Ok(before), Ok(after)) => {
                match (before.ego_collided(), after.ego_collided()) {
                    (false, true) => self.newly_failing.push(sample),
                    (true, false) => self.fixed.push(sample),
                    (true, true) => self.still_failing += 1,
                    (false, false) => {}
                }
                for (moved, (_, of)) in self.margins.iter_mut().zip(MARGINS) {
                    if let (Ok(before), Ok(after)) = (of(&before.margins), of(&after.margins)) {
                        moved.push(sample, before, after);
                    }
                }
            }
            (Ok(_), Err(_)) => self.newly_in_error.push(sample),
            (Err(_), Ok(after)) => {
                self.no_longer_in_error.push(sample);
                // What the baseline cannot vouch for is new.
                if after.ego_collided() {
                    self.newly_failing.push(sample);
                }
            }
            (Err(_), Err(_)) => {}
        }
    }
}

fn is_same(baseline: &ArmRecord, now: &ArmRecord) -> bool {
    match (&baseline.result, &now.result) {
        (Ok(before), Ok(after)) => {
            let mut before = before.clone();
            before.controller.clone_from(&after.controller);
            before.has_same_bits(after)
        }
        (before, after) => before == after,
    }
}

/// Compares the arms under test of two campaigns.
///
/// # Errors
/// [`CompareError`] where a folder cannot be read, or the two did not run the same samples.
pub fn compare(baseline: &Folder, now: &Folder) -> Result<Vec<ScenarioComparison>, CompareError> {
    let different =
        |what: String| CompareError::Different { one: baseline.path().to_owned(), other: now.path().to_owned(), what };
    let mut found: Vec<ScenarioComparison> = Vec::new();
    let (mut before, mut after) = (baseline.records()?, now.records()?);
    loop {
        let (one, other) = match (before.next().transpose()?, after.next().transpose()?) {
            (None, None) => return Ok(found),
            (Some(one), Some(other)) => (one, other),
            (Some(more), None) => return Err(different(format!("only the first has {}", named(&more)))),
            (None, Some(more)) => return Err(different(format!("only the second has {}", named(&more)))),
        };
        if (&one.scenario, one.sample) != (&other.scenario, other.sample) {
            return Err(different(format!("where one has {}, the other has {}", named(&one), named(&other))));
        }
        check_same_encounter([baseline.path(), now.path()], &one, &other)?;
        if found.last().is_none_or(|last| last.scenario != one.scenario) {
            found.push(ScenarioComparison::new(&one.scenario));
        }
        if let (Some(scenario), Some(baseline), Some(now)) = (found.last_mut(), one.arms.last(), other.arms.last()) {
            scenario.push(one.sample, baseline, now);
        }
    }
}

fn named(record: &Record) -> String {
    format!("sample {} of `{}`", record.sample, record.scenario)
}

fn check_same_encounter(folders: [&Path; 2], one: &Record, other: &Record) -> Result<(), CompareError> {
    let parameters = |record: &Record| {
        record.arms.iter().find_map(|arm| arm.result.as_ref().ok().map(|outcome| outcome.parameters.clone()))
    };
    let (Some(before), Some(after)) = (parameters(one), parameters(other)) else { return Ok(()) };
    let names = before.iter().chain(after.iter()).map(|(name, _)| name);
    let differing = names.into_iter().find(|name| before.get(name) != after.get(name));
    match differing {
        None => Ok(()),
        Some(parameter) => Err(CompareError::OtherSample {
            one: folders[0].to_owned(),
            other: folders[1].to_owned(),
            scenario: one.scenario.clone(),
            sample: one.sample,
            parameter: parameter.to_string(),
        }),
    }
}
