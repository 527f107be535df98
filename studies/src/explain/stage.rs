//! The stages of the chain, and how each is replaced by the truth.

use closecall_scenarios::{EffectConfig, ScenarioFile};
use closecall_sensors::SensorMode;
use serde::{Deserialize, Serialize};

/// A stage of the chain from the sensors of the ego to the drivers of the other vehicles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// The points of the rear LiDAR.
    Points,
    /// The clusters of points and their boxes.
    Clusters,
    /// The class of vehicles behind the ego.
    Class,
    /// The tracks of all sensors.
    Tracks,
    /// The latency of sensors and trackers.
    Timing,
    /// The actuators of the ego.
    Actuation,
    /// The reaction of drivers behind the ego.
    RearReaction,
    /// The braking of vehicles ahead of the ego.
    LeadBraking,
}

impl Stage {
    /// All stages in the order of the chain.
    pub const ALL: [Self; 8] = [
        Self::Points,
        Self::Clusters,
        Self::Class,
        Self::Tracks,
        Self::Timing,
        Self::Actuation,
        Self::RearReaction,
        Self::LeadBraking,
    ];

    /// Returns the name in reports, which is also the key in the table `ideal` of a scenario.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Clusters => "clusters",
            Self::Class => "class",
            Self::Tracks => "tracks",
            Self::Timing => "timing",
            Self::Actuation => "actuation",
            Self::RearReaction => "rear-reaction",
            Self::LeadBraking => "lead-braking",
        }
    }

    /// Returns the replacement of the stage, as words after "with".
    pub const fn replacement(self) -> &'static str {
        match self {
            Self::Points => "exact points of the rear LiDAR",
            Self::Clusters => "true clusters and boxes",
            Self::Class => "the true class of every vehicle behind the ego",
            Self::Tracks => "true tracks, as late as the sensors' tracks",
            Self::Timing => "sensors and trackers that need no time",
            Self::Actuation => "actuators of the ego that follow at once",
            Self::RearReaction => "a rear driver who reacts at once",
            Self::LeadBraking => "a lead vehicle that does not brake",
        }
    }

    /// Returns the setting that replaces the stage, as `key=value`.
    pub fn setting_text(self) -> String {
        format!("ideal.{}=true", self.name())
    }

    /// Returns why the stage does not exist in a run; `None` if it exists.
    pub fn missing(self, sensors: SensorMode, file: &ScenarioFile) -> Option<&'static str> {
        match (self, sensors) {
            (Self::Points | Self::Clusters, SensorMode::Object) => {
                Some("object-level sensors have no points and no clusters: their tracks stand for the whole chain")
            }
            (Self::Points | Self::Clusters | Self::Class | Self::Tracks | Self::Timing, SensorMode::GroundTruth) => {
                Some("the tracks are the truth already")
            }
            (Self::LeadBraking, _) => {
                let mut events = file.config().actors.iter().flat_map(|actor| &actor.events);
                let brakes = events.any(|event| matches!(event.then, EffectConfig::Brake(_)));
                (!brakes).then_some("no vehicle brakes by an event")
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stage_has_a_setting_that_the_scenarios_of_the_library_accept() {
        for stage in Stage::ALL {
            let setting = stage.setting_text().parse().unwrap();
            let path = std::path::Path::new("low-thw-overtake");
            let file = closecall_scenarios::source::load(path, &[setting]).unwrap();
            file.check().unwrap();
            assert_ne!(file.config().ideal, closecall_scenarios::IdealConfig::default(), "{stage:?}");
        }
    }
}
