//! Compares a campaign with an earlier one, sample by sample: new failures, fixed failures, and
//! changes of the margins.
//!
//! Both campaigns ran the same samples, each in its own arm under test. If a sample passed and now
//! fails, no statistics are needed to show it: the sample can be replayed from both folders.

use std::fmt;
use std::path::PathBuf;

use closecall_scenarios::ScenarioFile;
use closecall_sensors::SensorMode;
use toml::{Table, Value};

use super::belief::Belief;
use super::folder::{Folder, FolderError};
use super::margins::{MARGINS, Margin, MarginRegression, cannot_regress, quantiles, regressions};
use super::record::{ArmRecord, Record};
use super::saved::scenario_files;

/// The reason for which two campaigns cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A folder cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The campaigns did not run the same samples.
    #[error("failed to compare {} with {}: {difference}", baseline.display(), current.display())]
    Different {
        /// The folder of the earlier campaign.
        baseline: PathBuf,
        /// The folder of the later campaign.
        current: PathBuf,
        /// The first difference.
        difference: String,
    },
    /// The sampled parameters of a sample differ.
    #[error("failed to compare: sample {sample} of `{scenario}` is another encounter in {} than in {}: {parameter} differs", baseline.display(), current.display())]
    OtherSample {
        /// The folder of the earlier campaign.
        baseline: PathBuf,
        /// The folder of the later campaign.
        current: PathBuf,
        /// The scenario.
        scenario: String,
        /// The sample.
        sample: u64,
        /// The first parameter whose values differ.
        parameter: String,
    },
}

/// The change of one margin, over the samples that have it in both campaigns.
#[derive(Clone, Debug, PartialEq)]
pub struct MarginChange {
    /// The key in reports. It ends with the unit.
    pub key: &'static str,
    /// Number of samples that have the margin in both campaigns.
    pub samples: u64,
    /// The values of these samples in the baseline.
    baseline: Vec<f64>,
    /// The values of these samples in the later campaign.
    current: Vec<f64>,
    /// The sample whose margin shrank most.
    pub worst: Option<SampleChange>,
}

/// The change of a margin in one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleChange {
    /// The sample's number.
    pub sample: u64,
    /// The margin in the later campaign minus the margin in the baseline, in the unit of the
    /// margin.
    pub change: f64,
}

/// The means of a margin, in the unit of the margin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Means {
    /// The mean in the baseline.
    pub baseline: f64,
    /// The mean in the later campaign.
    pub current: f64,
}

impl MarginChange {
    /// Returns the means in both campaigns; `None` if no sample has the margin in both.
    pub fn means(&self) -> Option<Means> {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / self.samples as f64;
        (self.samples > 0).then(|| Means { baseline: mean(&self.baseline), current: mean(&self.current) })
    }

    fn regressions(&self, tolerance: f64) -> Vec<MarginRegression> {
        let quantiles_of = |values: &[f64]| quantiles(&mut values.to_vec());
        regressions(self.key, &quantiles_of(&self.baseline), &quantiles_of(&self.current), tolerance)
    }

    fn cannot_regress(&self, tolerance: f64) -> bool {
        cannot_regress(&quantiles(&mut self.baseline.clone()), tolerance)
    }

    fn push(&mut self, sample: u64, baseline: f64, current: f64) {
        self.samples += 1;
        self.baseline.push(baseline);
        self.current.push(current);
        let change = current - baseline;
        if self.worst.is_none_or(|worst| !(change >= worst.change)) {
            self.worst = Some(SampleChange { sample, change });
        }
    }
}

/// The changes in one scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenarioComparison {
    /// The scenario's name.
    pub scenario: String,
    /// Number of samples.
    pub samples: u64,
    /// Number of samples that have an outcome in the later campaign.
    pub outcomes: u64,
    /// Number of samples whose outcomes agree to the last bit, the controller's name aside.
    pub same: u64,
    /// Samples in which vehicles collide in the later campaign and not in the baseline. A controller
    /// that protects the ego at the expense of others gains nothing.
    pub newly_failing: Vec<u64>,
    /// Samples in which vehicles collide in the baseline and not in the later campaign.
    pub fixed: Vec<u64>,
    /// Number of samples in which vehicles collide in both campaigns.
    pub still_failing: u64,
    /// Samples that end in an error in the later campaign and not in the baseline.
    pub newly_in_error: Vec<u64>,
    /// Samples that end in an error in the baseline and not in the later campaign.
    pub no_longer_in_error: Vec<u64>,
    /// Samples that end in an error in both campaigns.
    pub still_in_error: Vec<u64>,
    /// The changes of the margins.
    pub margins: Vec<MarginChange>,
}

impl ScenarioComparison {
    fn new(scenario: &str) -> Self {
        let unchanged = |Margin { key, .. }: Margin| MarginChange {
            key,
            samples: 0,
            baseline: Vec::new(),
            current: Vec::new(),
            worst: None,
        };
        Self {
            scenario: scenario.to_owned(),
            samples: 0,
            outcomes: 0,
            same: 0,
            newly_failing: Vec::new(),
            fixed: Vec::new(),
            still_failing: 0,
            newly_in_error: Vec::new(),
            no_longer_in_error: Vec::new(),
            still_in_error: Vec::new(),
            margins: MARGINS.map(unchanged).to_vec(),
        }
    }

    /// Returns the quantiles of margins that fall by more than the share `tolerance` of their
    /// value, and by more than 0.01 (s or m).
    pub fn margin_regressions(&self, tolerance: f64) -> Vec<MarginRegression> {
        self.margins.iter().flat_map(|margin| margin.regressions(tolerance)).collect()
    }

    /// Returns true if a sample has an outcome in both campaigns, and each sample has one in the
    /// later campaign.
    fn is_compared(&self) -> bool {
        self.outcomes == self.samples && (self.no_longer_in_error.len() as u64) < self.samples
    }

    /// Returns the number of samples in which no vehicle collides in the baseline: more cannot newly
    /// fail.
    const fn passing_before(&self) -> u64 {
        self.samples - self.fixed.len() as u64 - self.still_failing
    }

    fn push(&mut self, sample: u64, baseline: &ArmRecord, current: &ArmRecord) {
        self.samples += 1;
        self.outcomes += u64::from(current.result.is_ok());
        self.same += u64::from(is_same(baseline, current));
        match (&baseline.result, &current.result) {
            (Ok(before), Ok(after)) => {
                match (before.any_collided(), after.any_collided()) {
                    (false, true) => self.newly_failing.push(sample),
                    (true, false) => self.fixed.push(sample),
                    (true, true) => self.still_failing += 1,
                    (false, false) => {}
                }
                for (change, Margin { value, .. }) in self.margins.iter_mut().zip(MARGINS) {
                    if let (Ok(before), Ok(after)) = (value(&before.margins), value(&after.margins)) {
                        change.push(sample, before, after);
                    }
                }
            }
            (Ok(_), Err(_)) => self.newly_in_error.push(sample),
            (Err(_), Ok(after)) => {
                self.no_longer_in_error.push(sample);
                // Without an outcome in the baseline, a collision counts as new.
                if after.any_collided() {
                    self.newly_failing.push(sample);
                }
            }
            (Err(_), Err(_)) => self.still_in_error.push(sample),
        }
    }
}

fn is_same(baseline: &ArmRecord, current: &ArmRecord) -> bool {
    match (&baseline.result, &current.result) {
        (Ok(before), Ok(after)) => {
            let mut before = before.clone();
            before.controller.clone_from(&after.controller);
            before.has_same_bits(after)
        }
        (before, after) => before == after,
    }
}

/// Whether a campaign is worse than an earlier one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regression {
    /// The campaign is not worse.
    None,
    /// Samples end in an error that had an outcome. This takes precedence over [`Self::Worse`].
    NewErrors,
    /// Some samples end in an error, as in the earlier campaign: they are not compared.
    NotCompared,
    /// More samples fail than allowed, or a margin has shrunk.
    Worse,
    /// The campaign would not be worse whatever happened in its samples, so that nothing is judged:
    /// as many samples may newly fail as there are, and each margin may fall to 0.
    HoldsAlways,
}

impl Regression {
    /// Judges a comparison. Up to `max_newly_failing` samples may newly fail. A quantile of a
    /// margin may fall by the share `tolerance`.
    pub fn of(scenarios: &[ScenarioComparison], max_newly_failing: u64, tolerance: f64) -> Self {
        let newly_failing: usize = scenarios.iter().map(|scenario| scenario.newly_failing.len()).sum();
        let passing_before: u64 = scenarios.iter().map(ScenarioComparison::passing_before).sum();
        let has_lost_margin = scenarios.iter().any(|scenario| !scenario.margin_regressions(tolerance).is_empty());
        let mut margins = scenarios.iter().flat_map(|scenario| &scenario.margins);
        if scenarios.iter().any(|scenario| !scenario.newly_in_error.is_empty()) {
            Self::NewErrors
        } else if newly_failing as u64 > max_newly_failing || has_lost_margin {
            Self::Worse
        } else if scenarios.is_empty() || !scenarios.iter().all(ScenarioComparison::is_compared) {
            Self::NotCompared
        } else if passing_before <= max_newly_failing && margins.all(|margin| margin.cannot_regress(tolerance)) {
            Self::HoldsAlways
        } else {
            Self::None
        }
    }

    /// Returns the verdict for programs.
    pub const fn verdict(self) -> &'static str {
        match self {
            Self::None => "PASS",
            Self::NewErrors | Self::NotCompared | Self::Worse => "FAIL",
            Self::HoldsAlways => "NOT JUDGED",
        }
    }
}

impl fmt::Display for Regression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "NO REGRESSION",
            Self::NewErrors => "NEW ERRORS",
            Self::NotCompared => "NOT COMPARED",
            Self::Worse => "REGRESSION",
            Self::HoldsAlways => {
                "NOT JUDGED: the limits hold whatever happens in these samples: set one that can be missed"
            }
        })
    }
}

/// Compares the arms under test of two campaigns. `max_flip_rate` is the share of checked verdicts
/// that may flip at half the time step (-).
///
/// # Errors
/// [`CompareError`] if a folder cannot be read, its results cannot be believed, or the campaigns did
/// not run the same samples.
pub fn compare(
    baseline: &Folder,
    current: &Folder,
    max_flip_rate: f64,
) -> Result<Vec<ScenarioComparison>, CompareError> {
    let different = |difference: String| CompareError::Different {
        baseline: baseline.path().to_owned(),
        current: current.path().to_owned(),
        difference,
    };
    let mut scenarios: Vec<ScenarioComparison> = Vec::new();
    let (mut earlier, mut later) = (baseline.complete_records()?, current.complete_records()?);
    let mut beliefs = [Belief::of(baseline, max_flip_rate)?, Belief::of(current, max_flip_rate)?];
    // Without errors of perception fewer samples fail.
    let [before, after] = [baseline.manifest()?.sensors, current.manifest()?.sensors];
    if before != after {
        let named = |mode: Option<SensorMode>| mode.map_or("the sensors of the scenario", SensorMode::name);
        return Err(different(format!("the first ran with {}, the second with {}", named(before), named(after))));
    }
    let [earlier_files, later_files] = [files(baseline)?, files(current)?];
    for (before, after) in earlier_files.iter().flat_map(|one| later_files.iter().map(move |other| (one, other))) {
        let (name, keys) = (&before.config().name, other_encounter(before, after));
        if *name == after.config().name && !keys.is_empty() {
            return Err(different(format!("the scenario `{name}` differs in {}", keys.join(", "))));
        }
    }
    loop {
        let (before, after) = match (earlier.next().transpose()?, later.next().transpose()?) {
            (None, None) => {
                beliefs.into_iter().try_for_each(Belief::check)?;
                return Ok(scenarios);
            }
            (Some(before), Some(after)) => (before, after),
            (Some(more), None) => return Err(different(format!("only the first has {}", named(&more)))),
            (None, Some(more)) => return Err(different(format!("only the second has {}", named(&more)))),
        };
        beliefs.iter_mut().zip([&before, &after]).for_each(|(belief, record)| belief.push(record));
        if (&before.scenario, before.sample) != (&after.scenario, after.sample) {
            let (first, second) = (named(&before), named(&after));
            return Err(different(format!("the first has {first}, the second has {second} in its place")));
        }
        if let Some(parameter) = differing_parameter(&before, &after) {
            return Err(CompareError::OtherSample {
                baseline: baseline.path().to_owned(),
                current: current.path().to_owned(),
                scenario: before.scenario,
                sample: before.sample,
                parameter,
            });
        }
        if scenarios.last().is_none_or(|last| last.scenario != before.scenario) {
            scenarios.push(ScenarioComparison::new(&before.scenario));
        }
        if let (Some(scenario), Some(old), Some(new)) = (scenarios.last_mut(), before.arms.last(), after.arms.last()) {
            scenario.push(before.sample, old, new);
        }
    }
}

fn files(folder: &Folder) -> Result<Vec<ScenarioFile>, FolderError> {
    scenario_files(folder.path(), &folder.manifest()?).map_err(|error| folder.of_manifest(error))
}

/// The keys of a scenario that say what happens to the ego. Its parameters are compared as drawn.
const ENCOUNTER: [&str; 8] =
    ["duration-s", "road", "environment", "actor", "traffic", "random-numbers", "ideal", "fault"];

/// Returns the keys in which two scenarios are another encounter. The settings of the ego stack do
/// not count: they belong to the system under test, as controller and perception do.
fn other_encounter(before: &ScenarioFile, after: &ScenarioFile) -> Vec<&'static str> {
    let [before, after] = [before, after].map(|file| {
        let mut table = Table::try_from(file.config()).unwrap_or_default();
        let actors = table.get_mut("actor").and_then(Value::as_array_mut).into_iter().flatten();
        for driver in actors.filter_map(|actor| actor.get_mut("driver")?.as_table_mut()) {
            driver.remove("ego-stack");
        }
        table
    });
    ENCOUNTER.into_iter().filter(|key| before.get(*key) != after.get(*key)).collect()
}

fn named(record: &Record) -> String {
    format!("sample {} of `{}`", record.sample, record.scenario)
}

/// Returns the first parameter whose values differ; `None` if all agree, or if a record has no
/// outcome.
fn differing_parameter(before: &Record, after: &Record) -> Option<String> {
    let parameters = |record: &Record| {
        record.arms.iter().find_map(|arm| arm.result.as_ref().ok().map(|outcome| outcome.parameters.clone()))
    };
    let (before, after) = (parameters(before)?, parameters(after)?);
    let mut names = before.iter().chain(after.iter()).map(|(name, _)| name);
    names.find(|name| before.get(name) != after.get(name)).map(ToString::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::SampleFailure;

    #[test]
    fn samples_without_an_outcome_in_either_campaign_are_no_evidence() {
        let failure = SampleFailure { kind: "controller".to_owned(), message: "it ended".to_owned() };
        let failed = ArmRecord::new("own".to_owned(), Err(failure));
        let mut scenario = ScenarioComparison::new("close");
        (0..4).for_each(|sample| scenario.push(sample, &failed, &failed));
        assert_eq!((scenario.outcomes, scenario.same), (0, 4));
        assert_eq!(Regression::of(&[scenario.clone()], 0, 0.05), Regression::NotCompared);
        assert_eq!(scenario.still_in_error, [0, 1, 2, 3]);
        let in_part = ScenarioComparison { outcomes: 3, ..scenario.clone() };
        assert_eq!(Regression::of(&[in_part], 0, 0.05), Regression::NotCompared);
        let compared = ScenarioComparison { outcomes: 4, ..scenario.clone() };
        assert_eq!(Regression::of(std::slice::from_ref(&compared), 0, 0.05), Regression::None);
        assert_eq!(Regression::of(&[compared, scenario], 0, 0.05), Regression::NotCompared);
        assert_eq!(Regression::of(&[], 0, 0.05), Regression::NotCompared);
        let recovered: Vec<u64> = (0..4).collect();
        let nothing_in_both =
            ScenarioComparison { outcomes: 4, no_longer_in_error: recovered, ..ScenarioComparison::new("close") };
        let nothing_in_both = ScenarioComparison { samples: 4, ..nothing_in_both };
        assert_eq!(Regression::of(&[nothing_in_both], 0, 0.05), Regression::NotCompared);
    }

    #[test]
    fn limits_that_no_sample_can_miss_judge_nothing() {
        let with_gap = |gap_m: f64, still_failing: u64| {
            let mut scenario =
                ScenarioComparison { samples: 4, outcomes: 4, still_failing, ..ScenarioComparison::new("close") };
            scenario.margins[0].push(0, gap_m, gap_m);
            scenario
        };
        let judged = |scenario: ScenarioComparison, most, tolerance| Regression::of(&[scenario], most, tolerance);
        assert_eq!(judged(with_gap(3.0, 0), 4, 1.0), Regression::HoldsAlways);
        assert_eq!(judged(with_gap(3.0, 0), 3, 1.0), Regression::None, "all four may newly fail");
        assert_eq!(judged(with_gap(3.0, 1), 3, 1.0), Regression::HoldsAlways, "one of four has failed before");
        assert_eq!(judged(with_gap(3.0, 0), 1000, 0.9), Regression::None, "the margin may shrink");
        assert_eq!(judged(with_gap(0.0, 4), 0, 0.05), Regression::HoldsAlways, "nothing can become worse");
        let mut worse = with_gap(3.0, 0);
        worse.newly_failing = vec![1, 2];
        assert_eq!(judged(worse, 1, 1.0), Regression::Worse);
    }
}
