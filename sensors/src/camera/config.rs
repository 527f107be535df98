//! The rear camera as a scenario file describes it, and checked.

use closecall_traffic::{Check, Choice, ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is done with the camera's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pipeline {
    /// A network classifies the part of the image in which each LiDAR cluster lies.
    CropClassifier,
    /// Nothing: class scores come from the clusters' shapes alone.
    Off,
}

/// Where the sun stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct SunConfig {
    /// Direction to the sun over ground, counter-clockwise from the road's direction at s = 0 [rad].
    pub azimuth_rad: Num,
    /// Height of the sun above the horizon [rad].
    pub elevation_rad: Num,
}

impl Default for SunConfig {
    /// A forenoon's sun, ahead and to the left: not in the rear camera's view.
    fn default() -> Self {
        Self { azimuth_rad: Num::Fixed(0.9), elevation_rad: Num::Fixed(0.7) }
    }
}

/// The rear camera as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct CameraConfig {
    /// What is done with the image.
    pub pipeline: Choice<Pipeline>,
    /// Height of the lens above the ground [m].
    pub mount_height_m: Num,
    /// How far the lens lies ahead of E's rear bumper [m].
    pub mount_from_rear_m: Num,
    /// Pitch of the camera in E, positive looking down [rad].
    pub pitch_rad: Num,
    /// Root mean square of the angular rate of the camera's vibration [rad/s], which blurs long exposures.
    pub vibration_radps: Num,
    /// Share of the window that is soiled [1].
    pub dirt: Num,
    /// Brighter than the automatic exposure by this power of two [1].
    pub exposure_ev: Num,
    /// Where the sun stands.
    pub sun: SunConfig,
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self {
            pipeline: Choice::Fixed(Pipeline::CropClassifier),
            mount_height_m: Num::Fixed(1.2),
            mount_from_rear_m: Num::Fixed(0.6),
            pitch_rad: Num::Fixed(0.03),
            vibration_radps: Num::Fixed(0.05),
            dirt: Num::Fixed(0.05),
            exposure_ev: Num::Fixed(0.0),
            sun: SunConfig::default(),
        }
    }
}

/// Where the sun stands, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Direction to the sun over ground, counter-clockwise from the road's direction at s = 0 [rad].
    pub azimuth_rad: f64,
    /// Height of the sun above the horizon [rad].
    pub elevation_rad: f64,
}

/// A checked rear camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// What is done with the image.
    pub pipeline: Pipeline,
    /// Height of the lens above the ground [m].
    pub mount_height_m: f64,
    /// How far the lens lies ahead of E's rear bumper [m].
    pub mount_from_rear_m: f64,
    /// Pitch of the camera in E, positive looking down [rad].
    pub pitch_rad: f64,
    /// Root mean square of the angular rate of the camera's vibration [rad/s].
    pub vibration_radps: f64,
    /// Share of the window that is soiled [1].
    pub dirt: f64,
    /// Brighter than the automatic exposure by this power of two [1].
    pub exposure_ev: f64,
    /// Where the sun stands.
    pub sun: Sun,
}

impl Check for CameraConfig {
    type Checked = Camera;

    fn check(&self, parameters: &Parameters) -> Result<Camera, ConfigError> {
        let number = |num, key, low, high| parameters.number(num, key, Range::closed(low, high));
        let half_turn = std::f64::consts::PI;
        let sun = |error: ConfigError| error.within("sun");
        Ok(Camera {
            pipeline: parameters.word(&self.pipeline, "pipeline")?,
            mount_height_m: number(&self.mount_height_m, "mount-height-m", 0.4, 3.5)?,
            mount_from_rear_m: number(&self.mount_from_rear_m, "mount-from-rear-m", 0.0, 3.0)?,
            pitch_rad: number(&self.pitch_rad, "pitch-rad", -0.2, 0.3)?,
            vibration_radps: number(&self.vibration_radps, "vibration-radps", 0.0, 1.0)?,
            dirt: parameters.number(&self.dirt, "dirt", Range::UNIT)?,
            exposure_ev: number(&self.exposure_ev, "exposure-ev", -3.0, 3.0)?,
            sun: Sun {
                azimuth_rad: number(&self.sun.azimuth_rad, "azimuth-rad", -half_turn, half_turn).map_err(sun)?,
                elevation_rad: number(&self.sun.elevation_rad, "elevation-rad", 0.0, half_turn / 2.0).map_err(sun)?,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_headline_configuration_is_the_default() {
        let config: CameraConfig = serde_json::from_str(r#"{ "pipeline": "crop-classifier" }"#).unwrap();
        assert_eq!(config, CameraConfig::default());
        assert_eq!(config.check(&Parameters::default()).unwrap().pipeline, Pipeline::CropClassifier);
    }

    #[test]
    fn a_wrong_sun_is_named_with_its_path() {
        let sun = SunConfig { elevation_rad: Num::Fixed(2.0), ..SunConfig::default() };
        let error = CameraConfig { sun, ..CameraConfig::default() }.check(&Parameters::default()).unwrap_err();
        assert!(error.to_string().starts_with("`sun.elevation-rad` is 2"), "{error}");
    }
}
