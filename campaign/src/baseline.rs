//! The baseline of a repository: a small file with the results of a campaign, against which later
//! campaigns are compared.
//!
//! ```text
//!  campaign's folder ─▶ Baseline ─▶ baseline.json, committed with the scenarios
//!                                        │
//!  later campaign's folder ─▶ Baseline ──┴─▶ BaselineComparison: newly failing, fixed, margins that shrank
//! ```
//!
//! The file holds counts, the numbers of the failing samples, and quantiles of the margins, so that
//! it stays small and its changes can be reviewed. [`compare`](mod@crate::compare) compares two
//! whole folders instead, bit for bit.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::input::read_text;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::belief::Belief;
use crate::compare::Regression;
use crate::folder::{Folder, FolderError};
use crate::folder_error::json_fault;
use crate::margins::{MARGINS, Margin, MarginRegression, Quantiles, SMALLEST, cannot_regress, quantiles, regressions};
use crate::record::ArmRecord;

/// The version of the layout of a baseline file.
const BASELINE_VERSION: u32 = 5;

/// The results of a campaign that a repository keeps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// Version of the layout of the file.
    pub schema_version: u32,
    /// Version of the program that ran the campaign.
    pub closecall_version: String,
    /// The campaign's seed.
    pub seed: u64,
    /// The sampling design.
    pub design: Design,
    /// The controller under test.
    pub controller: String,
    /// The sensors; `None` for the sensors of each scenario.
    pub sensors: Option<SensorMode>,
    /// The results of each scenario, by its name.
    pub scenarios: BTreeMap<String, ScenarioBaseline>,
    /// BLAKE3 hash of all other fields, as JSON. The hash shows an edit. It does not prevent
    /// anybody from writing another file.
    pub content_blake3: String,
}

/// The results of one scenario.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioBaseline {
    /// BLAKE3 hash of the scenario's text.
    pub blake3: String,
    /// Number of samples.
    pub samples: u64,
    /// Number of samples in which the ego collides.
    pub collisions: u64,
    /// Number of samples that end in an error.
    pub errors: u64,
    /// The samples in which vehicles collide or that end in an error, in ascending order.
    pub failing: Vec<u64>,
    /// The samples that end in an error, in ascending order.
    pub in_error: Vec<u64>,
    /// Quantiles of each margin, over the samples that have it (s or m).
    pub margins: BTreeMap<String, Quantiles>,
}

impl ScenarioBaseline {
    /// Returns true if vehicles collide in the sample.
    fn has_collision(&self, sample: u64) -> bool {
        self.failing.contains(&sample) && !self.in_error.contains(&sample)
    }

    /// Returns true if no later campaign can be worse: each sample fails, and no margin can shrink
    /// by more than the tolerance.
    fn cannot_become_worse(&self, tolerance: f64) -> bool {
        self.failing.len() as u64 == self.samples
            && self.margins.values().all(|quantiles| cannot_regress(quantiles, tolerance))
    }
}

/// The reason for which a campaign cannot be compared with a baseline.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BaselineError {
    /// The campaign and the baseline did not run the same samples.
    #[error(
        "failed to compare with the baseline: {subject} is {baseline} in the baseline, {current} in the campaign; save a new baseline"
    )]
    Different {
        /// What differs.
        subject: String,
        /// The value in the baseline.
        baseline: String,
        /// The value in the campaign.
        current: String,
    },
}

impl Baseline {
    /// Returns the results of the arm under test of a campaign. `max_flip_rate` is the share of
    /// checked verdicts that may flip at half the time step (-).
    ///
    /// # Errors
    /// [`FolderError`] if the folder cannot be read, or its results cannot be believed.
    pub fn of(folder: &Folder, max_flip_rate: f64) -> Result<Self, FolderError> {
        let manifest = folder.manifest()?;
        let mut belief = Belief::of(folder, max_flip_rate)?;
        let mut collected: BTreeMap<String, Collected> = manifest
            .scenarios
            .iter()
            .map(|scenario| (scenario.name.clone(), Collected::new(scenario.blake3.clone())))
            .collect();
        for record in folder.complete_records()? {
            let record = record?;
            belief.push(&record);
            if let (Some(scenario), Some(arm)) = (collected.get_mut(&record.scenario), record.arms.last()) {
                scenario.push(record.sample, arm);
            }
        }
        belief.check()?;
        let baseline = Self {
            content_blake3: String::new(),
            schema_version: BASELINE_VERSION,
            closecall_version: manifest.closecall_version.clone(),
            seed: manifest.sampling.seed,
            design: manifest.sampling.design,
            controller: manifest.arms.last().map(ToString::to_string).unwrap_or_default(),
            sensors: manifest.sensors,
            scenarios: collected.into_iter().map(|(name, scenario)| (name, scenario.finish())).collect(),
        };
        Ok(baseline.signed())
    }

    /// Reads a file that [`Baseline::write`] has written.
    ///
    /// # Errors
    /// [`FolderError`] if the file cannot be read, has another version of the layout, or was
    /// edited.
    pub fn read(path: &Path) -> Result<Self, FolderError> {
        let text = read_text(path).map_err(|source| {
            let is_folder = source.kind() == io::ErrorKind::IsADirectory;
            let source = match is_folder {
                true => io::Error::new(source.kind(), "it is a folder, and the file of a baseline is needed"),
                false => source,
            };
            FolderError::Read { path: path.to_owned(), source }
        })?;
        let content = |line, message| FolderError::Content { path: path.to_owned(), line, message };
        // The version comes first: another layout has other keys.
        let value: Value = serde_json::from_str(&text).map_err(|error| {
            content(error.line(), format!("the file is not a baseline: {}", json_fault(&text, &error)))
        })?;
        if value["schema_version"] != BASELINE_VERSION {
            return Err(content(1, format!("the file is not a baseline of version {BASELINE_VERSION}")));
        }
        let baseline: Self = serde_json::from_value(value).map_err(|error| content(1, error.to_string()))?;
        if baseline.content_blake3 != baseline.hash() {
            let message = "the file was edited: its content does not have the hash that it states; save a new baseline";
            return Err(content(1, message.to_owned()));
        }
        Ok(baseline)
    }

    /// Returns the same baseline with the hash of its content.
    fn signed(self) -> Self {
        Self { content_blake3: self.hash(), ..self }
    }

    /// Returns the hash of the content.
    fn hash(&self) -> String {
        let content = Self { content_blake3: String::new(), ..self.clone() };
        // Numbers are written so that they read back to the bit. A value that cannot be written has
        // no hash that a file could state.
        serde_json::to_vec(&content).map_or_else(|error| error.to_string(), |bytes| blake3::hash(&bytes).to_string())
    }

    /// Writes the baseline as a JSON file. An existing file is replaced.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be written; a file of that name is then unchanged.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_file(path, |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            out.write_all(b"\n")
        })
    }

    /// Compares a later campaign with this baseline. A margin regresses if one of its quantiles
    /// falls by more than the share `tolerance` of its value, and by more than 0.01 (s or m).
    ///
    /// # Errors
    /// [`BaselineError`] if the campaigns did not run the same samples.
    pub fn compare(&self, current: &Self, tolerance: f64) -> Result<BaselineComparison, BaselineError> {
        let same = |subject: &str, baseline: String, current: String| match baseline == current {
            true => Ok(()),
            false => Err(BaselineError::Different { subject: subject.to_owned(), baseline, current }),
        };
        same("the version of the layout", self.schema_version.to_string(), current.schema_version.to_string())?;
        same("the seed", self.seed.to_string(), current.seed.to_string())?;
        same("the sampling design", self.design.to_string(), current.design.to_string())?;
        // Without errors of perception fewer samples fail.
        let sensors = |mode: Option<SensorMode>| mode.map_or("as in the scenario", SensorMode::name).to_owned();
        same("the sensor mode", sensors(self.sensors), sensors(current.sensors))?;
        let mut compared = Vec::new();
        for (name, before) in &self.scenarios {
            let missing = || BaselineError::Different {
                subject: format!("the scenario `{name}`"),
                baseline: "included".to_owned(),
                current: "missing".to_owned(),
            };
            let after = current.scenarios.get(name).ok_or_else(missing)?;
            same(&format!("the hash of `{name}`"), before.blake3.clone(), after.blake3.clone())?;
            let samples = format!("the number of samples of `{name}`");
            same(&samples, before.samples.to_string(), after.samples.to_string())?;
            compared.push(compare(name, before, after, tolerance));
        }
        let is_new = |name: &&String| !self.scenarios.contains_key(*name);
        let new_scenarios = current.scenarios.keys().filter(is_new).cloned().collect();
        let errors = |(name, before): (&String, &ScenarioBaseline)| SampleErrors {
            scenario: name.clone(),
            samples: before.samples,
            baseline: before.errors,
            current: current.scenarios.get(name).map_or(0, |after| after.errors),
        };
        let not_compared = self.scenarios.iter().map(errors).filter(SampleErrors::hide_a_sample).collect();
        let holds_always = self.scenarios.values().all(|before| before.cannot_become_worse(tolerance));
        Ok(BaselineComparison { scenarios: compared, new_scenarios, not_compared, holds_always })
    }
}

fn compare(
    name: &str,
    before: &ScenarioBaseline,
    after: &ScenarioBaseline,
    tolerance: f64,
) -> ScenarioBaselineComparison {
    let of = |samples: &[u64], is_meant: &dyn Fn(u64) -> bool| -> Vec<u64> {
        samples.iter().copied().filter(|&sample| is_meant(sample)).collect()
    };
    let mut margins = Vec::new();
    for (margin, quantiles) in before.margins.iter().filter(|_| before.errors == 0) {
        if let Some(now) = after.margins.get(margin) {
            // The quantiles of fewer samples are others, but more samples do not raise the smallest
            // value.
            let is_comparable = |regression: &MarginRegression| after.errors == 0 || regression.quantile == SMALLEST;
            margins.extend(regressions(margin, quantiles, now, tolerance).into_iter().filter(is_comparable));
        }
    }
    ScenarioBaselineComparison {
        scenario: name.to_owned(),
        // Without an outcome in the baseline, a collision counts as new.
        newly_failing: of(&after.failing, &|sample| after.has_collision(sample) && !before.has_collision(sample)),
        fixed: of(&before.failing, &|sample| before.has_collision(sample) && !after.failing.contains(&sample)),
        newly_in_error: of(&after.in_error, &|sample| !before.in_error.contains(&sample)),
        margins,
    }
}

/// A later campaign compared with a baseline.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaselineComparison {
    /// The scenarios of the baseline.
    pub scenarios: Vec<ScenarioBaselineComparison>,
    /// The scenarios that the baseline does not have.
    pub new_scenarios: Vec<String>,
    /// Scenarios with samples that end in an error, in the baseline or in the later campaign. These
    /// samples are not compared.
    pub not_compared: Vec<SampleErrors>,
    /// True if no campaign could be worse than the baseline, so that nothing is judged.
    #[serde(skip)]
    pub holds_always: bool,
}

/// The samples of a scenario that end in an error and are not compared.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SampleErrors {
    /// The scenario's name.
    pub scenario: String,
    /// Number of samples.
    pub samples: u64,
    /// Number of samples that end in an error in the baseline.
    pub baseline: u64,
    /// Number of samples that end in an error in the later campaign.
    pub current: u64,
}

impl SampleErrors {
    /// Returns true if some sample is not compared.
    const fn hide_a_sample(&self) -> bool {
        self.baseline > 0 || self.current > 0 || self.samples == 0
    }
}

impl BaselineComparison {
    /// Returns whether the later campaign is worse.
    pub fn regression(&self) -> Regression {
        if self.scenarios.iter().any(|scenario| !scenario.newly_in_error.is_empty()) {
            Regression::NewErrors
        } else if self.is_regression() {
            Regression::Worse
        } else if !self.is_compared() {
            Regression::NotCompared
        } else if self.holds_always {
            Regression::HoldsAlways
        } else {
            Regression::None
        }
    }

    /// Returns true if a sample newly fails or a margin regresses.
    pub fn is_regression(&self) -> bool {
        self.scenarios.iter().any(|scenario| !scenario.newly_failing.is_empty() || !scenario.margins.is_empty())
    }

    /// Returns true if all samples of the baseline's scenarios have an outcome in both campaigns,
    /// and the baseline has a scenario. A sample without an outcome is no evidence.
    pub fn is_compared(&self) -> bool {
        self.not_compared.is_empty() && !self.scenarios.is_empty()
    }

    /// Returns true if a sample fails in the baseline and passes in the later campaign.
    pub fn has_fixed(&self) -> bool {
        self.scenarios.iter().any(|scenario| !scenario.fixed.is_empty())
    }
}

/// One scenario of a later campaign compared with a baseline.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenarioBaselineComparison {
    /// The scenario's name.
    pub scenario: String,
    /// Samples in which vehicles collide in the later campaign and not in the baseline.
    pub newly_failing: Vec<u64>,
    /// Samples in which vehicles collide in the baseline, and that pass in the later campaign.
    pub fixed: Vec<u64>,
    /// Samples that end in an error in the later campaign and not in the baseline.
    pub newly_in_error: Vec<u64>,
    /// The quantiles of margins that fell by more than the tolerance. If a sample ends in an error,
    /// the quantiles are over other samples: none then, or the smallest value if the baseline has
    /// no errors.
    pub margins: Vec<MarginRegression>,
}

/// The samples of one scenario while a folder is read.
#[derive(Debug)]
struct Collected {
    result: ScenarioBaseline,
    values: [Vec<f64>; MARGINS.len()],
}

impl Collected {
    fn new(blake3: String) -> Self {
        Self { result: ScenarioBaseline { blake3, ..ScenarioBaseline::default() }, values: Default::default() }
    }

    fn push(&mut self, sample: u64, arm: &ArmRecord) {
        let result = &mut self.result;
        result.samples += 1;
        match &arm.result {
            Ok(outcome) => {
                result.collisions += u64::from(outcome.ego_collided());
                if outcome.any_collided() {
                    result.failing.push(sample);
                }
                for (values, Margin { value, .. }) in self.values.iter_mut().zip(MARGINS) {
                    values.extend(value(&outcome.margins).ok());
                }
            }
            Err(_) => {
                result.errors += 1;
                result.failing.push(sample);
                result.in_error.push(sample);
            }
        }
    }

    fn finish(mut self) -> ScenarioBaseline {
        for (values, Margin { key, .. }) in self.values.iter_mut().zip(MARGINS) {
            if !values.is_empty() {
                self.result.margins.insert(key.to_owned(), quantiles(values));
            }
        }
        self.result.failing.sort_unstable();
        self.result.in_error.sort_unstable();
        self.result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn baseline(failing: &[u64], gap_m: f64) -> Baseline {
        let margins = BTreeMap::from([("min_gap_rear_m".to_owned(), BTreeMap::from([("p05".to_owned(), gap_m)]))]);
        let scenario = ScenarioBaseline {
            blake3: "11".to_owned(),
            samples: 10,
            collisions: failing.len() as u64,
            failing: failing.to_vec(),
            margins,
            ..ScenarioBaseline::default()
        };
        Baseline {
            schema_version: BASELINE_VERSION,
            closecall_version: "0.1.0".to_owned(),
            seed: 1,
            design: Design::Random,
            controller: "mis".to_owned(),
            sensors: None,
            scenarios: BTreeMap::from([("headline".to_owned(), scenario)]),
            content_blake3: String::new(),
        }
        .signed()
    }

    #[test]
    fn newly_failing_and_fixed_samples_are_named() {
        let comparison = baseline(&[2, 5], 4.0).compare(&baseline(&[5, 7], 4.0), 0.05).unwrap();
        assert_eq!(
            (&comparison.scenarios[0].newly_failing[..], &comparison.scenarios[0].fixed[..]),
            (&[7][..], &[2][..])
        );
        assert!(comparison.is_regression() && comparison.has_fixed());
        assert!(!baseline(&[2], 4.0).compare(&baseline(&[2], 4.0), 0.0).unwrap().is_regression());
    }

    #[test]
    fn samples_that_end_in_an_error_on_either_side_are_not_compared() {
        let with_errors = |errors: u64| {
            let in_error: Vec<u64> = (10 - errors..10).collect();
            let mut baseline = baseline(&[&[0, 1, 2], &in_error[..]].concat(), 4.0);
            let scenario = baseline.scenarios.get_mut("headline").unwrap();
            (scenario.errors, scenario.in_error) = (errors, in_error);
            baseline
        };
        assert!(with_errors(0).compare(&with_errors(0), 0.05).unwrap().is_compared());
        for [before, after] in [[1, 1], [0, 1], [1, 0], [10, 10]] {
            let comparison = with_errors(before).compare(&with_errors(after), 0.05).unwrap();
            assert!(!comparison.is_regression() && !comparison.is_compared(), "{before} and {after} errors");
            let [errors] = &comparison.not_compared[..] else { panic!("{comparison:?}") };
            assert_eq!((errors.scenario.as_str(), errors.baseline, errors.current), ("headline", before, after));
            let expected = if after > before { Regression::NewErrors } else { Regression::NotCompared };
            assert_eq!(comparison.regression(), expected);
        }
        let empty = Baseline { scenarios: BTreeMap::new(), ..with_errors(0) };
        assert!(!empty.compare(&with_errors(0), 0.05).unwrap().is_compared(), "a baseline without a scenario");
    }

    #[test]
    fn samples_in_error_are_neither_newly_failing_nor_fixed_and_their_margins_are_not_compared() {
        let with_errors = |failing: &[u64], in_error: &[u64], gap_m: f64| {
            let mut baseline = baseline(failing, gap_m);
            let scenario = baseline.scenarios.get_mut("headline").unwrap();
            (scenario.errors, scenario.in_error) = (in_error.len() as u64, in_error.to_vec());
            baseline
        };
        let compare = |before: &Baseline, after: &Baseline| before.compare(after, 0.05).unwrap();
        let (fine, worse) = (with_errors(&[2], &[], 4.0), with_errors(&[2, 5, 7], &[5, 7], 1.0));
        let comparison = compare(&fine, &worse);
        assert_eq!(comparison.regression(), Regression::NewErrors);
        assert!(!comparison.is_regression(), "{comparison:?}");
        let comparison = compare(&worse, &with_errors(&[2], &[], 0.5));
        assert_eq!(comparison.regression(), Regression::NotCompared);
        assert!(!comparison.is_regression() && !comparison.has_fixed(), "{comparison:?}");
        // A collision beside the same errors is a regression, and new errors come first.
        let collides = with_errors(&[2, 3, 5, 7], &[5, 7], 1.0);
        let comparison = compare(&worse, &collides);
        assert_eq!(comparison.scenarios[0].newly_failing, [3]);
        assert_eq!(comparison.regression(), Regression::Worse);
        assert_eq!(compare(&fine, &collides).regression(), Regression::NewErrors);
        let comparison = compare(&collides, &worse);
        assert_eq!(comparison.regression(), Regression::NotCompared);
        assert_eq!(comparison.scenarios[0].fixed, [3], "a sample that is fixed beside errors is named");
        // As many errors as before, in another sample.
        let comparison = compare(&worse, &with_errors(&[2, 5, 8], &[5, 8], 1.0));
        assert_eq!(comparison.scenarios[0].newly_in_error, [8]);
        assert_eq!(comparison.regression(), Regression::NewErrors);
        let comparison = compare(&worse, &with_errors(&[2, 5], &[], 4.0));
        assert_eq!(comparison.scenarios[0].newly_failing, [5], "without an outcome before, a collision is new");
        assert_eq!(comparison.regression(), Regression::Worse);
    }

    #[test]
    fn the_smallest_margin_of_fewer_samples_regresses_and_their_other_quantiles_are_not_compared() {
        let with_quantiles = |gap_m: f64, in_error: &[u64]| {
            let mut baseline = baseline(in_error, gap_m);
            let scenario = baseline.scenarios.get_mut("headline").unwrap();
            (scenario.errors, scenario.in_error) = (in_error.len() as u64, in_error.to_vec());
            for quantiles in scenario.margins.values_mut() {
                quantiles.insert(SMALLEST.to_owned(), gap_m);
            }
            baseline
        };
        let shrunk = |before: &[u64], after: &[u64]| {
            let comparison = with_quantiles(4.0, before).compare(&with_quantiles(1.0, after), 0.05).unwrap();
            comparison.scenarios[0].margins.iter().map(|margin| margin.quantile.clone()).collect::<Vec<_>>()
        };
        assert_eq!(shrunk(&[], &[]), ["min", "p05"]);
        assert_eq!(shrunk(&[], &[5]), ["min"], "a sample that is there shows it");
        assert!(shrunk(&[5], &[5]).is_empty(), "the sample may have been as small before");
    }

    #[test]
    fn a_comparison_in_which_nothing_can_become_worse_judges_nothing() {
        let all: Vec<u64> = (0..10).collect();
        let judged = |failing: &[u64], gap_m: f64, tolerance: f64| {
            let baseline = baseline(failing, gap_m);
            baseline.compare(&baseline, tolerance).unwrap().regression()
        };
        assert_eq!(judged(&all, 4.0, 1.0), Regression::HoldsAlways);
        assert_eq!(judged(&all, 0.0, 0.05), Regression::HoldsAlways);
        assert_eq!(judged(&all, 4.0, 0.05), Regression::None, "the margin may shrink");
        assert_eq!(judged(&all[1..], 4.0, 1.0), Regression::None, "the sample 0 may newly fail");
    }

    #[test]
    fn a_margin_regresses_only_beyond_the_tolerance() {
        let regresses = |before, after, tolerance| {
            baseline(&[], before).compare(&baseline(&[], after), tolerance).unwrap().is_regression()
        };
        assert!(regresses(4.0, 3.7, 0.05));
        assert!(!regresses(4.0, 3.9, 0.05));
        assert!(!regresses(4.0, 5.0, 0.0));
        assert!(!regresses(0.005, 0.0, 0.0), "a change that no report shows is no regression");
        assert!(regresses(0.0, -1.0, 0.5), "a baseline of zero leaves no share");
    }

    #[test]
    fn other_samples_cannot_be_compared() {
        let before = baseline(&[], 4.0);
        let changes: [fn(&mut Baseline); 5] = [
            |other| other.sensors = Some(SensorMode::GroundTruth),
            |other| other.seed = 2,
            |other| other.design = Design::Sobol,
            |other| other.scenarios.clear(),
            |other| other.scenarios.values_mut().for_each(|scenario| scenario.blake3 = "22".to_owned()),
        ];
        for change in changes {
            let mut other = before.clone();
            change(&mut other);
            assert!(before.compare(&other, 0.05).is_err());
        }
        let mut more = before.clone();
        more.scenarios.insert("another".to_owned(), ScenarioBaseline::default());
        assert_eq!(before.compare(&more, 0.05).unwrap().new_scenarios, ["another"]);
    }

    #[test]
    fn an_edited_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("baseline.json");
        baseline(&[3], 4.0).write(&path).unwrap();
        assert_eq!(Baseline::read(&path).unwrap(), baseline(&[3], 4.0));
        let text = std::fs::read_to_string(&path).unwrap();
        for (written, edited) in
            [("\"p05\": 4.0", "\"p05\": 1.0"), ("\"collisions\": 1", "\"collisions\": 0"), ("\"mis\"", "\"acc\"")]
        {
            assert!(text.contains(written), "{text}");
            std::fs::write(&path, text.replace(written, edited)).unwrap();
            let error = Baseline::read(&path).unwrap_err().to_string();
            assert!(error.contains("the file was edited"), "{edited}: {error}");
        }
        let more = text.replace("\n        3\n", "\n        3,\n        5\n");
        assert_ne!(more, text);
        std::fs::write(&path, more).unwrap();
        assert!(Baseline::read(&path).is_err(), "a failing sample that is added hides a regression");
        // Only the layout of the text may change.
        std::fs::write(&path, text.replace('\n', "").replace("  ", "")).unwrap();
        assert!(Baseline::read(&path).is_ok());
    }

    #[test]
    fn another_file_is_said_to_be_no_baseline() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("baseline.json");
        let cases =
            [("", "it is empty"), ("{\"a\": 1}", "of version 5"), ("a = 1", "is not a baseline: expected value")];
        for (text, expected) in cases {
            std::fs::write(&path, text).unwrap();
            let error = Baseline::read(&path).unwrap_err().to_string();
            assert!(error.contains("baseline.json:1: the file is not a baseline"), "{error}");
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_baseline_reads_back() {
        let written = serde_json::to_string_pretty(&baseline(&[3], 4.0)).unwrap();
        assert_eq!(serde_json::from_str::<Baseline>(&written).unwrap(), baseline(&[3], 4.0));
    }
}
