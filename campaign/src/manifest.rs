//! What a campaign's folder says about how it was made: all that a replay needs, and all that its outcomes follow from.

use std::fs::File;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::ledger::Inference;
use super::partition::Partition;
use super::runner::Sampling;
use super::validity::CheckPlan;
use closecall_sensors::SensorMode;
use closecall_simulation::Arm;
use closecall_simulation::controller::ControllerChoice;

/// The layout of a campaign's folder.
pub const MANIFEST_VERSION: u32 = 2;

/// Hexadecimal digits of the executable's hash in a version.
const HASH_DIGITS: usize = 16;

/// Returns the version of this very program. Two builds of one release may differ, so the executable's own hash is part
/// of it.
pub fn version() -> String {
    let release = env!("CARGO_PKG_VERSION");
    match std::env::current_exe().and_then(|path| file_hash(&path)) {
        Ok(hash) => format!("{release}+{}", &hash.to_hex()[..HASH_DIGITS]),
        Err(_) => release.to_owned(),
    }
}

/// Returns the BLAKE3 hash of a file, which is not held in memory.
pub(crate) fn file_hash(path: &Path) -> io::Result<blake3::Hash> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path)?)?;
    Ok(hasher.finalize())
}

/// One scenario of a campaign.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManifestScenario {
    /// Its name.
    pub name: String,
    /// The file it was read from.
    pub path: String,
    /// BLAKE3 of the text.
    pub blake3: String,
    /// The text itself, all settings applied.
    pub text: String,
}

/// A network that the sensors use.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ManifestModel {
    /// Its name.
    pub name: String,
    /// BLAKE3 of its file.
    pub blake3: String,
    /// What runs it.
    pub backend: String,
}

/// How a campaign was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of this layout.
    pub manifest_version: u32,
    /// Version of the program.
    pub closecall_version: String,
    /// The scenarios.
    pub scenarios: Vec<ManifestScenario>,
    /// How the samples are drawn.
    pub sampling: Sampling,
    /// Which part of the samples this folder is for; all of them where absent.
    pub partition: Option<Partition>,
    /// The controllers, the baseline first where the campaign is paired.
    pub arms: Vec<ControllerChoice>,
    /// The sensors; those of each scenario if `None`.
    pub sensors: Option<SensorMode>,
    /// Which samples are checked.
    pub checks: CheckPlan,
    /// What the number of samples comes from.
    pub inference: Inference,
    /// The networks that the sensors use.
    pub models: Vec<ManifestModel>,
    /// Longest wall time of a sample in one arm [s].
    pub sample_timeout_s: f64,
    /// The command line.
    pub command: Vec<String>,
}

/// What outcomes do not follow from.
const INCIDENTAL: [&str; 2] = ["command", "path"];

impl Manifest {
    /// What the two differ in, in words; nothing where both describe the same samples, so that their outcomes are the
    /// same to the last bit.
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut differences = Vec::new();
        match (serde_json::to_value(self), serde_json::to_value(other)) {
            (Ok(there), Ok(here)) => compare("", &there, &here, &mut differences),
            // Nothing in a manifest cannot be written; were it so, nothing is known of the two.
            _ => differences.push("the manifest cannot be compared".to_owned()),
        }
        differences
    }

    /// Returns the arms, the baseline first.
    pub fn arms(&self) -> Vec<Arm> {
        let arm = |controller: &ControllerChoice| Arm { controller: controller.factory(), sensors: self.sensors };
        self.arms.iter().map(arm).collect()
    }

    /// The same campaign, not shared out.
    pub fn whole(&self) -> Self {
        Self { partition: None, ..self.clone() }
    }
}

fn compare(key: &str, there: &Value, here: &Value, differences: &mut Vec<String>) {
    let within = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match (there, here) {
        (Value::Object(one), Value::Object(other)) => {
            let names = one.keys().chain(other.keys().filter(|name| !one.contains_key(*name)));
            for name in names.filter(|name| !INCIDENTAL.contains(&name.as_str())) {
                let part = |of: &serde_json::Map<String, Value>| of.get(name).cloned().unwrap_or(Value::Null);
                compare(&within(name), &part(one), &part(other), differences);
            }
        }
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            for (place, (there, here)) in one.iter().zip(other).enumerate() {
                let name = there.get("name").and_then(Value::as_str).map_or_else(|| place.to_string(), str::to_owned);
                compare(&within(&name), there, here, differences);
            }
        }
        (Value::String(one), Value::String(other)) if one.contains('\n') || other.contains('\n') => {
            if let Some(line) = first_difference(one, other) {
                differences.push(format!("{key}: {line}"));
            }
        }
        _ if there == here => {}
        _ => differences.push(format!("{key}: {there} there, {here} here")),
    }
}

/// Where two texts begin to differ.
fn first_difference(there: &str, here: &str) -> Option<String> {
    let (mut one, mut other) = (there.lines(), here.lines());
    let mut line = 0;
    loop {
        line += 1;
        match (one.next(), other.next()) {
            (None, None) => return (there != here).then(|| "the ends of the texts differ".to_owned()),
            (there, here) if there == here => {}
            (there, here) => {
                let shown = |text: Option<&str>| text.map_or_else(|| "nothing".to_owned(), |text| format!("`{text}`"));
                return Some(format!("line {line} is {} there, {} here", shown(there), shown(here)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_scenarios::sampling::Design;

    use super::*;

    fn manifest() -> Manifest {
        Manifest {
            manifest_version: MANIFEST_VERSION,
            closecall_version: "0.1.0+00".to_owned(),
            scenarios: vec![ManifestScenario {
                name: "headline".to_owned(),
                path: "a.toml".to_owned(),
                blake3: "11".to_owned(),
                text: "one\ntwo\n".to_owned(),
            }],
            sampling: Sampling { seed: 1, design: Design::Random, samples: 10 },
            partition: None,
            arms: vec![ControllerChoice::Mis],
            sensors: None,
            checks: CheckPlan::default(),
            inference: Inference::default(),
            models: Vec::new(),
            sample_timeout_s: 300.0,
            command: vec!["closecall".to_owned()],
        }
    }

    #[test]
    fn what_outcomes_do_not_follow_from_is_no_difference() {
        let mut other = manifest();
        other.command.push("--jobs=2".to_owned());
        other.scenarios[0].path = "b.toml".to_owned();
        assert_eq!(manifest().differences(&other), Vec::<String>::new());
    }

    #[test]
    fn every_difference_is_named_with_both_values() {
        let mut other = manifest();
        other.closecall_version = "0.1.0+01".to_owned();
        other.sampling.seed = 2;
        other.partition = Some("1/3".parse().unwrap());
        other.arms = vec![ControllerChoice::Acc, ControllerChoice::Mis];
        other.sensors = Some("full".to_owned());
        other.sample_timeout_s = 10.0;
        other.scenarios[0].text = "one\nthree\n".to_owned();
        let mut differences = manifest().differences(&other);
        differences.sort();
        assert_eq!(
            differences,
            [
                "arms: [\"mis\"] there, [\"acc\",\"mis\"] here",
                "closecall_version: \"0.1.0+00\" there, \"0.1.0+01\" here",
                "partition: null there, \"1/3\" here",
                "sample_timeout_s: 300.0 there, 10.0 here",
                "sampling.seed: 1 there, 2 here",
                "scenarios.headline.text: line 2 is `two` there, `three` here",
                "sensors: null there, \"full\" here",
            ]
        );
    }
}
