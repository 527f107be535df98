//! The rear LiDAR's configuration: from text to something that cannot be invalid.

use closecall_traffic::{Check, Choice, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The scanners that are modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum LidarModel {
    /// Valeo SCALA, second generation.
    #[serde(rename = "scala-2")]
    Scala2,
}

/// The rear LiDAR as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct LidarConfig {
    /// Which scanner.
    pub model: Choice<LidarModel>,
    /// Height of its centre above the ground (m).
    pub mount_height_m: Num,
    /// Upward tilt of its axis against E's body (rad).
    pub tilt_rad: Num,
    /// Range at which a target of 50 % reflectivity that fills the beam is detected with probability 0.5, in air
    /// that does not attenuate (m).
    pub nominal_range_m: Num,
    /// Share of returns that are lost whatever their power (dimensionless).
    pub dropout: Num,
    /// Standard deviation of the pitch by which E levels its points (rad).
    pub levelling_sd_rad: Num,
    /// Share of the light that the sensor's window lets through each way (dimensionless): 1 clean, 0 blocked by snow or mud.
    pub window_transmission: Num,
}

impl Default for LidarConfig {
    /// In the rear bumper. No tilt: at 100 m the two layers next to the axis, one on each mirror side, then lie at
    /// −0.24° and +0.24°, which are the two halves of a car's painted front as seen from 0.6 m.
    fn default() -> Self {
        Self {
            model: Choice::Fixed(LidarModel::Scala2),
            mount_height_m: Num::Fixed(0.6),
            tilt_rad: Num::Fixed(0.0),
            nominal_range_m: Num::Fixed(200.0),
            dropout: Num::Fixed(0.01),
            levelling_sd_rad: Num::Fixed(0.0005),
            window_transmission: Num::Fixed(1.0),
        }
    }
}

/// A checked rear LiDAR.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lidar {
    pub(crate) model: LidarModel,
    pub(crate) mount_height_m: f64,
    pub(crate) tilt_rad: f64,
    pub(crate) nominal_range_m: f64,
    pub(crate) dropout: f64,
    pub(crate) levelling_sd_rad: f64,
    pub(crate) window_transmission: f64,
}

impl Check for LidarConfig {
    type Checked = Lidar;

    fn check(&self, parameters: &Parameters) -> Result<Lidar, ConfigError> {
        let number = |num, key, range| parameters.number(num, key, range);
        Ok(Lidar {
            model: parameters.word(&self.model, "model")?,
            mount_height_m: number(&self.mount_height_m, "mount-height-m", Range::closed(0.2, 2.5))?,
            tilt_rad: number(&self.tilt_rad, "tilt-rad", Range::closed(-0.1, 0.1))?,
            nominal_range_m: number(&self.nominal_range_m, "nominal-range-m", Range::closed(10.0, 500.0))?,
            dropout: number(&self.dropout, "dropout", Range::closed(0.0, 0.5))?,
            levelling_sd_rad: number(&self.levelling_sd_rad, "levelling-sd-rad", Range::closed(0.0, 0.02))?,
            window_transmission: number(&self.window_transmission, "window-transmission", Range::closed(0.0, 1.0))?,
        })
    }
}

impl Default for Lidar {
    /// What an empty table gives.
    fn default() -> Self {
        Self {
            model: LidarModel::Scala2,
            mount_height_m: 0.6,
            tilt_rad: 0.0,
            nominal_range_m: 200.0,
            dropout: 0.01,
            levelling_sd_rad: 0.0005,
            window_transmission: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_table_gives_the_default() {
        assert_eq!(LidarConfig::default().check(&Parameters::default()), Ok(Lidar::default()));
    }

    #[test]
    fn a_wrong_value_is_named_with_its_key() {
        let config = LidarConfig { mount_height_m: Num::Fixed(f64::NAN), ..LidarConfig::default() };
        let error = config.check(&Parameters::default()).unwrap_err();
        assert_eq!(error.to_string(), "`mount-height-m` is NaN, but a number from 0.2 to 2.5 is needed");
    }

    #[test]
    fn the_model_is_written_as_in_the_scenario_file() {
        let config: LidarConfig = toml::from_str("model = \"scala-2\"\nmount-height-m = 0.7").unwrap();
        assert_eq!(config, LidarConfig { mount_height_m: Num::Fixed(0.7), ..LidarConfig::default() });
    }
}
