//! The configuration of the rear camera: the text in a scenario file, and its checked form.

use closecall_traffic::{Check, Choice, ConfigError, Num, Parameters, Problem, Range, maths};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::mask_rcnn_config::{MaskRcnn, MaskRcnnConfig};
use super::optics::{LensConfig, Optics};
use super::picture::{FIELD_OF_VIEW_RAD, FOCAL_PX, Resolution, ResolutionConfig};
use crate::kept::kept;
use crate::sensor_name::{Named, checked_name};

/// Name of the first rear camera if the scenario gives it none.
const REAR_CAMERA_NAME: &str = "rear-camera";
/// Horizontal field of view of the usual camera (deg), with which the networks were trained.
const FIELD_OF_VIEW_DEG: f64 = 60.0;
/// Largest angle from straight behind at which the image ends (deg): what stands beside the ego is
/// rendered behind the lens only.
const WIDEST_DEG: f64 = 85.0;
/// Difference from it that is due to rounding (deg).
const ROUNDING_DEG: f64 = 1e-9;

fn is_usual_field(number: &Num) -> bool {
    *number == Num::Fixed(FIELD_OF_VIEW_DEG)
}

fn is_zero(number: &Num) -> bool {
    *number == Num::Fixed(0.0)
}

fn is_usual_resolution(resolution: &ResolutionConfig) -> bool {
    *resolution == ResolutionConfig::default()
}

/// The processing of the camera's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pipeline {
    /// A neural network classifies the part of the image that shows each LiDAR cluster.
    CropClassifier,
    /// A Mask R-CNN finds vehicles in the whole image, which are then associated with the LiDAR
    /// clusters. Needs ONNX Runtime.
    MaskRcnn,
    /// The image is not used: class scores come from the shapes of the LiDAR clusters alone.
    Off,
}

/// The position of the sun as a scenario file describes it. Only `rear-camera` has this table: all
/// cameras are under the same sky.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct SunConfig {
    /// Azimuth of the sun, counter-clockwise from the road's direction at s = 0 (rad).
    pub azimuth_rad: Num,
    /// Elevation of the sun above the horizon (rad).
    pub elevation_rad: Num,
}

impl Default for SunConfig {
    /// Returns a sun ahead of the ego vehicle and to its left, outside the view of the rear camera.
    fn default() -> Self {
        Self { azimuth_rad: Num::Fixed(0.9), elevation_rad: Num::Fixed(0.7) }
    }
}

/// A rear camera as a scenario file describes it. `rear-camera` is the first one, and
/// `additional-rear-cameras` lists up to three others, each with a name, a place and a direction of
/// its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct CameraConfig {
    /// Name of the camera in faults, recordings and messages: lower-case letters, digits and
    /// hyphens. Each of `additional-rear-cameras` needs one. Default: `rear-camera`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Processing of the image.
    pub pipeline: Choice<Pipeline>,
    /// ONNX file of another network for the pipeline `crop-classifier`, relative to the working
    /// directory: it takes 1 × 3 × 32 × 32 pixel values from 0 to 255 (RGB), and returns the
    /// probabilities of car, truck, motorcycle and background. Default: none; the one that ships with
    /// Closecall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// The Mask R-CNN of the pipeline `mask-rcnn`.
    pub mask_rcnn: MaskRcnnConfig,
    /// Height of the lens above the ground (m).
    pub mount_height_m: Num,
    /// Distance of the lens ahead of the ego's rear bumper (m).
    pub mount_from_rear_m: Num,
    /// Distance of the lens from the ego's centre line to the left (m). Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub left_m: Num,
    /// Pitch of the camera relative to the ego's body, positive if it looks down (rad).
    pub pitch_rad: Num,
    /// Yaw of the camera's axis from straight behind (deg), positive if it looks to the ego's left.
    /// All columns of the image look backward, at most 85° from straight behind: with a field of
    /// view of 60°, the yaw is -55 to 55. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub yaw_deg: Num,
    /// Horizontal field of view (deg) of all columns of the image. The networks that ship were
    /// trained with 60°. Default: 60.
    #[serde(skip_serializing_if = "is_usual_field")]
    pub field_of_view_deg: Num,
    /// Size of the image. Pixels are square: the number of rows gives the vertical field of view.
    /// The networks that ship were trained with 1280 × 800 pixels, and the pipeline `mask-rcnn`
    /// needs this size. Default: 1280 × 800 pixels.
    #[serde(skip_serializing_if = "is_usual_resolution")]
    pub resolution: ResolutionConfig,
    /// Root mean square of the angular rate of the camera's vibration (rad/s). Vibration blurs long
    /// exposures.
    pub vibration_radps: Num,
    /// Share of the rear window that is soiled (0 to 1).
    pub dirt: Num,
    /// Exposure compensation (EV): each unit doubles the brightness relative to the automatic
    /// exposure.
    pub exposure_ev: Num,
    /// Position of the sun; a further camera has the first one's.
    pub sun: SunConfig,
    /// The lens.
    pub lens: LensConfig,
    /// Time between the readings of the first and of the last row of the image (s): 0 for a global
    /// shutter, 0.01 to 0.03 for a rolling one.
    pub readout_s: Num,
    /// Brightness of the night sky, relative to the sky over a town, which the default shows (0 to
    /// 1). Far from towns it is about 0.03: 0.2 instead of 7 mcd/m². A further camera has the first
    /// one's.
    pub night_sky: Num,
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self {
            name: None,
            pipeline: Choice::Fixed(Pipeline::CropClassifier),
            model: None,
            mask_rcnn: MaskRcnnConfig::default(),
            mount_height_m: Num::Fixed(1.2),
            mount_from_rear_m: Num::Fixed(0.6),
            left_m: Num::Fixed(0.0),
            pitch_rad: Num::Fixed(0.03),
            yaw_deg: Num::Fixed(0.0),
            field_of_view_deg: Num::Fixed(FIELD_OF_VIEW_DEG),
            resolution: ResolutionConfig::default(),
            vibration_radps: Num::Fixed(0.05),
            dirt: Num::Fixed(0.05),
            exposure_ev: Num::Fixed(0.0),
            sun: SunConfig::default(),
            lens: LensConfig::default(),
            readout_s: Num::Fixed(0.0),
            night_sky: Num::Fixed(1.0),
        }
    }
}

/// The checked position of the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Azimuth of the sun, counter-clockwise from the road's direction at s = 0 (rad).
    pub azimuth_rad: f64,
    /// Elevation of the sun above the horizon (rad).
    pub elevation_rad: f64,
}

/// The checked configuration of the rear camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Name in faults, recordings and messages.
    pub name: &'static str,
    /// Processing of the image.
    pub pipeline: Pipeline,
    /// ONNX file of another network for the crops.
    pub model: Option<&'static str>,
    /// The Mask R-CNN of the pipeline `mask-rcnn`.
    pub mask_rcnn: MaskRcnn,
    /// Height of the lens above the ground (m).
    pub mount_height_m: f64,
    /// Distance of the lens ahead of the ego's rear bumper (m).
    pub mount_from_rear_m: f64,
    /// Distance of the lens from the ego's centre line to the left (m).
    pub left_m: f64,
    /// Pitch of the camera relative to the ego's body, positive if it looks down (rad).
    pub pitch_rad: f64,
    /// Yaw of the optical axis from straight behind, positive if it looks to the ego's left (rad).
    pub yaw_rad: f64,
    /// Horizontal field of view (rad).
    pub field_of_view_rad: f64,
    /// Size of the image.
    pub resolution: Resolution,
    /// Focal length (px): half of the width of the image over the tangent of half of the field of
    /// view.
    pub focal_px: f64,
    /// Root mean square of the angular rate of the camera's vibration (rad/s).
    pub vibration_radps: f64,
    /// Share of the rear window that is soiled (0 to 1).
    pub dirt: f64,
    /// Exposure compensation (EV): each unit doubles the brightness relative to the automatic
    /// exposure.
    pub exposure_ev: f64,
    /// Position of the sun.
    pub sun: Sun,
    /// The lens.
    pub optics: Optics,
    /// Time between the readings of the first and of the last row of the image (s).
    pub readout_s: f64,
    /// Brightness of the night sky, relative to the sky over a town (0 to 1): a natural sky has
    /// 0.17 to 0.25 mcd/m² (F. Falchi et al., *The new world atlas of artificial night sky
    /// brightness*, Science Advances 2016; A. Jechow et al., arXiv:1807.10593), and that over a
    /// town 7 mcd/m² and more, the end of the scale of that atlas.
    pub night_sky: f64,
}

impl Named for Camera {
    const KIND: &'static str = "camera";

    fn name(&self) -> &'static str {
        self.name
    }
}

impl Camera {
    /// Returns whether the sun is in front of the lens while the ego drives along a straight road.
    pub fn faces_sun(&self) -> bool {
        let Sun { azimuth_rad, elevation_rad } = self.sun;
        let behind = -maths::cos(elevation_rad) * maths::cos(azimuth_rad + self.yaw_rad);
        maths::cos(self.pitch_rad) * behind - maths::sin(self.pitch_rad) * maths::sin(elevation_rad) > 0.0
    }
}

impl Check for CameraConfig {
    type Checked = Camera;

    fn check(&self, parameters: &Parameters) -> Result<Camera, ConfigError> {
        self.check_named(Some(REAR_CAMERA_NAME), parameters)
    }
}

impl CameraConfig {
    /// Checks the keys of a further camera, which needs a name, and lies under the sky of the first:
    /// there is one.
    pub(crate) fn check_further(&self, first: &Camera, parameters: &Parameters) -> Result<Camera, ConfigError> {
        let usual = Self::default();
        let own = [
            (self.sun != usual.sun, "sun", "rear-camera.sun"),
            (self.night_sky != usual.night_sky, "night-sky", "rear-camera.night-sky"),
        ];
        if let Some((_, key, other)) = own.into_iter().find(|(is_own, ..)| *is_own) {
            let rule = "all cameras are under the same sky, which the first camera's keys give".to_owned();
            return Err(ConfigError::new(key, Problem::Contradiction { other, rule }));
        }
        let camera = self.check_named(None, parameters)?;
        Ok(Camera { sun: first.sun, night_sky: first.night_sky, ..camera })
    }

    /// Checks the keys of a camera that has this name if the scenario gives it none.
    fn check_named(&self, default_name: Option<&'static str>, parameters: &Parameters) -> Result<Camera, ConfigError> {
        let number = |num, key, low, high| parameters.number(num, key, Range::closed(low, high));
        let half_turn = std::f64::consts::PI;
        let sun = |error: ConfigError| error.within("sun");
        let resolution = self.resolution.check(parameters).map_err(|error| error.within("resolution"))?;
        let field_deg = number(&self.field_of_view_deg, "field-of-view-deg", 20.0, 120.0)?;
        let (field_of_view_rad, focal_px) = match (field_deg - FIELD_OF_VIEW_DEG).abs() <= ROUNDING_DEG {
            true => (FIELD_OF_VIEW_RAD, FOCAL_PX * resolution.scale()),
            false => {
                let field_rad = field_deg.to_radians();
                (field_rad, f64::from(resolution.width_px) / 2.0 / maths::tan(field_rad / 2.0))
            }
        };
        let widest_deg = WIDEST_DEG - 0.5 * field_deg;
        let yaw_deg = number(&self.yaw_deg, "yaw-deg", -widest_deg, widest_deg)?;
        let pipeline = parameters.word(&self.pipeline, "pipeline")?;
        if pipeline == Pipeline::MaskRcnn && resolution != Resolution::USUAL {
            let Resolution { width_px, height_px } = Resolution::USUAL;
            let rule = format!("the pipeline `mask-rcnn` reads images of {width_px} × {height_px} pixels only");
            return Err(ConfigError::new("resolution", Problem::Contradiction { other: "pipeline", rule }));
        }
        Ok(Camera {
            name: checked_name(self.name.as_ref(), default_name)?,
            pipeline,
            model: self.model.as_deref().map(kept),
            mask_rcnn: self.mask_rcnn.check(parameters).map_err(|error| error.within("mask-rcnn"))?,
            mount_height_m: number(&self.mount_height_m, "mount-height-m", 0.4, 3.5)?,
            mount_from_rear_m: number(&self.mount_from_rear_m, "mount-from-rear-m", 0.0, 3.0)?,
            left_m: number(&self.left_m, "left-m", -1.3, 1.3)?,
            pitch_rad: number(&self.pitch_rad, "pitch-rad", -0.2, 0.3)?,
            yaw_rad: yaw_deg.to_radians(),
            field_of_view_rad,
            resolution,
            focal_px,
            vibration_radps: number(&self.vibration_radps, "vibration-radps", 0.0, 1.0)?,
            dirt: parameters.number(&self.dirt, "dirt", Range::UNIT)?,
            exposure_ev: number(&self.exposure_ev, "exposure-ev", -3.0, 3.0)?,
            sun: Sun {
                azimuth_rad: number(&self.sun.azimuth_rad, "azimuth-rad", -half_turn, half_turn).map_err(sun)?,
                elevation_rad: number(&self.sun.elevation_rad, "elevation-rad", 0.0, half_turn / 2.0).map_err(sun)?,
            },
            optics: self.lens.check(parameters).map_err(|error| error.within("lens"))?,
            readout_s: number(&self.readout_s, "readout-s", 0.0, 0.1)?,
            night_sky: parameters.number(&self.night_sky, "night-sky", Range::UNIT)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn naming_only_the_pipeline_gives_the_default_configuration() {
        let config: CameraConfig = serde_json::from_str(r#"{ "pipeline": "crop-classifier" }"#).unwrap();
        assert_eq!(config, CameraConfig::default());
        assert_eq!(config.check(&Parameters::default()).unwrap().pipeline, Pipeline::CropClassifier);
    }

    #[test]
    fn an_invalid_sun_elevation_is_reported_with_its_key_path() {
        let sun = SunConfig { elevation_rad: Num::Fixed(2.0), ..SunConfig::default() };
        let error = CameraConfig { sun, ..CameraConfig::default() }.check(&Parameters::default()).unwrap_err();
        assert!(error.to_string().starts_with("`sun.elevation-rad` is 2"), "{error}");
    }

    #[test]
    fn a_yaw_at_which_the_image_would_not_look_backward_is_refused_with_the_allowed_range() {
        let check = |text: &str| toml::from_str::<CameraConfig>(text).unwrap().check(&Parameters::default());
        let refused = |text: &str| check(text).unwrap_err().to_string();
        assert_eq!(refused("yaw-deg = 56"), "`yaw-deg` is 56, but a number from -55 to 55 is needed");
        assert_eq!(refused("yaw-deg = -180"), "`yaw-deg` is -180, but a number from -55 to 55 is needed");
        // A wider image has less room to turn.
        let wide = "field-of-view-deg = 120\nyaw-deg = 26";
        assert_eq!(refused(wide), "`yaw-deg` is 26, but a number from -25 to 25 is needed");
        let narrow = check("field-of-view-deg = 20\nyaw-deg = -75").unwrap();
        assert!((narrow.yaw_rad.to_degrees() + 75.0).abs() < 1e-12);
        assert!(
            !serde_json::to_string(&CameraConfig::default()).unwrap().contains("yaw"),
            "the default is not written"
        );
    }

    #[test]
    fn the_default_size_is_not_written_and_another_size_is_read_again() {
        let text = serde_json::to_string(&CameraConfig::default()).unwrap();
        assert!(!text.contains("resolution"), "{text}");
        let other: CameraConfig = toml::from_str("resolution = { width-px = 1920, height-px = 1208 }").unwrap();
        assert_eq!(serde_json::from_value::<CameraConfig>(serde_json::to_value(&other).unwrap()).unwrap(), other);
        let camera = other.check(&Parameters::default()).unwrap();
        assert_eq!((camera.resolution.width_px, camera.resolution.height_px), (1_920, 1_208));
        // As many pixels per tangent as columns: the field of view stays.
        assert!((camera.focal_px - 1.5 * FOCAL_PX).abs() < 1e-9, "{}", camera.focal_px);
    }

    #[test]
    fn a_wrong_size_is_reported_with_its_key_path_and_the_mask_rcnn_has_one_size() {
        let refused = |text: &str| {
            toml::from_str::<CameraConfig>(text).unwrap().check(&Parameters::default()).unwrap_err().to_string()
        };
        let error = refused("resolution.width-px = 0");
        assert_eq!(error, "`resolution.width-px` is 0, but a number of columns from 640 to 3848 is needed");
        let error = refused("pipeline = 'mask-rcnn'\nresolution = { width-px = 1920, height-px = 1208 }");
        assert!(error.starts_with("`resolution` contradicts `pipeline`: "), "{error}");
        assert!(error.contains("1280 × 800 pixels only"), "{error}");
        let usual: CameraConfig =
            toml::from_str("pipeline = 'mask-rcnn'\nresolution = { width-px = 1280, height-px = 800 }").unwrap();
        assert!(usual.check(&Parameters::default()).is_ok());
    }
}
