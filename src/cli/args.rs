//! Arguments that several commands share.

use std::path::Path;

use clap::{Args, ValueEnum};
use closecall_sensors::SensorMode;

use crate::controller::BuiltIn;
use crate::scenario::{ScenarioError, ScenarioFile, Setting};
use crate::simulation::Arm;

/// For whom output is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// For people
    #[default]
    Human,
    /// For programs: one JSON value, documented and stable
    Json,
}

/// How much of the sensors is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Sensing {
    /// Point cloud, clustering, tracking
    Full,
    /// Objects with range, noise, delay
    Object,
    /// Perfect tracks
    GroundTruth,
}

impl Sensing {
    pub(super) const fn mode(self) -> SensorMode {
        match self {
            Self::Full => SensorMode::Full,
            Self::Object => SensorMode::Object,
            Self::GroundTruth => SensorMode::GroundTruth,
        }
    }

    /// The name on the command line and in a manifest.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Object => "object",
            Self::GroundTruth => "ground-truth",
        }
    }

    pub(super) fn from_name(name: &str) -> Option<Self> {
        [Self::Full, Self::Object, Self::GroundTruth].into_iter().find(|sensing| sensing.name() == name)
    }
}

/// Who controls E, and what it perceives with.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct ArmArgs {
    /// Controller of the ego vehicle
    #[arg(long, value_enum, default_value_t = BuiltIn::Mis)]
    pub(super) controller: BuiltIn,
    /// Depth of the sensor simulation; the scenario's own where absent
    #[arg(long, value_enum)]
    pub(super) sensors: Option<Sensing>,
}

impl ArmArgs {
    pub(super) fn arm(&self) -> Arm {
        arm(self.controller, self.sensors)
    }
}

/// An arm of a built-in controller.
pub(super) fn arm(controller: BuiltIn, sensors: Option<Sensing>) -> Arm {
    Arm { controller: controller.factory(), sensors: sensors.map(Sensing::mode) }
}

/// Changes of single values.
#[derive(Clone, Debug, Args)]
pub(super) struct SetArgs {
    /// Change a value of the scenario: a path of keys (`actor.rear.start.behind.gap-m=90`), or a parameter's name
    /// (`brake-mps2=6`); may be given more than once
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) settings: Vec<Setting>,
}

impl SetArgs {
    /// Reads a scenario with these changes, and checks it.
    pub(super) fn load(&self, path: &Path) -> Result<ScenarioFile, ScenarioError> {
        let file = ScenarioFile::load(path, &self.settings)?;
        for name in file.unused_parameters() {
            super::output::complain(format_args!(
                "warning: {}: the parameter `{name}` is sampled but used nowhere: write \"${name}\" where its value \
                 belongs, or remove it\n",
                path.display()
            ));
        }
        file.check()?;
        Ok(file)
    }
}

/// A finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a number above 0")),
    }
}
