//! What a campaign's folder says about how it was made: all that a replay needs.

use serde::{Deserialize, Serialize};

use super::runner::Sampling;
use crate::controller::BuiltIn;

/// The layout of a campaign's folder.
pub const MANIFEST_VERSION: u32 = 1;

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

/// How a campaign was made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of this layout.
    pub manifest_version: u32,
    /// Version of the program.
    pub closecall_version: String,
    /// The scenarios.
    pub scenarios: Vec<ManifestScenario>,
    /// How the samples are drawn.
    pub sampling: Sampling,
    /// The controllers, the baseline first where the campaign is paired.
    pub arms: Vec<BuiltIn>,
    /// The sensors, where the command line named them.
    pub sensors: Option<String>,
    /// The command line.
    pub command: Vec<String>,
}

impl Manifest {
    /// True where both describe the same samples, so that their outcomes are the same to the last bit.
    pub fn has_same_outcomes(&self, other: &Self) -> bool {
        let by_text = |manifest: &Self| -> Vec<(String, String)> {
            manifest.scenarios.iter().map(|scenario| (scenario.name.clone(), scenario.blake3.clone())).collect()
        };
        self.manifest_version == other.manifest_version
            && self.closecall_version == other.closecall_version
            && by_text(self) == by_text(other)
            && self.sampling == other.sampling
            && self.arms == other.arms
            && self.sensors == other.sensors
    }
}
