//! The rear LiDAR's configuration: the text of a scenario file, and the checked value that it
//! becomes.

use closecall_traffic::{Check, Choice, ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::NOMINAL_RANGE_M;
use super::material::{DIRTY_PLATE, PLATE};
use super::{ClusteringCheck, ClusteringModel, LidarKind, LidarKindConfig, LidarModel};
use crate::faults::LidarFault;
use crate::sensor_name::{Named, checked_name};

/// The state of the registration plates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Plates {
    /// As on vehicles in use.
    InUse,
    /// Covered with road dirt, which takes four fifths of the light.
    Dirty,
    /// Not mounted at the front, as some states and vehicles allow: the paint is seen in its place.
    None,
}

impl Plates {
    /// Returns the equivalent Lambertian reflectivity; `None` if there is no plate.
    fn reflectivity(self) -> Option<f64> {
        match self {
            Self::InUse => Some(PLATE),
            Self::Dirty => Some(DIRTY_PLATE),
            Self::None => None,
        }
    }
}

/// The rear LiDAR as described in a scenario file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct LidarConfig {
    /// Name of the sensor in faults, recordings and tables: lower-case letters, digits and hyphens.
    /// Each of `additional-rear-lidars` needs one. Default: `rear-lidar` or `front-lidar`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Model of the LiDAR, whose pattern and range ship with Closecall; `pattern-file` replaces
    /// them.
    pub model: Choice<LidarModel>,
    /// File with the pattern and the range of another LiDAR, relative to the scenario file. Its
    /// contents become `pattern` when the scenario is read. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern_file: Option<String>,
    /// Pattern and range of another LiDAR, with the keys of its file. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<LidarKindConfig>,
    /// Height of the sensor's centre above the ground (m).
    pub mount_height_m: Num,
    /// Upward tilt of the sensor's axis relative to the ego's body (rad).
    pub tilt_rad: Num,
    /// Distance of the sensor from the bumper towards the ego's middle (m). The ego's own body
    /// hides nothing. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub inset_m: Num,
    /// Distance of the sensor from the ego's centre line to the left (m). Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub left_m: Num,
    /// Azimuth of the sensor's axis (deg): 0 is straight behind, or straight ahead for the LiDAR
    /// that looks ahead; positive is to the ego's left. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub azimuth_deg: Num,
    /// Rotation of the sensor about its axis, clockwise as it sees it (deg). Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub roll_deg: Num,
    /// Nominal range (m): the range at which a target of 50 % reflectivity that fills the beam is
    /// detected with probability 0.5, in air that does not attenuate. Default: the range of the
    /// LiDAR's pattern; 200 for `scala-2`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal_range_m: Option<Num>,
    /// Share of returns (0 to 1) that are lost regardless of their power.
    pub dropout: Num,
    /// Probability (0 to 0.01) that a beam gives a point in a scan although there is nothing: noise
    /// of the receiver above its threshold. Makers specify their ranges at 0.0001 (data sheet of
    /// the Ouster OS1, manual of the LeddarTech Pixell). Default: 0.0001.
    #[serde(skip_serializing_if = "is_usual_rate")]
    pub false_alarm_rate: Num,
    /// Standard deviation of the error of the pitch angle that the ego uses to level its points
    /// (rad).
    pub levelling_sd_rad: Num,
    /// Share of the light (0 to 1) that the sensor's window transmits each way: 1 if clean, 0 if
    /// blocked by snow or mud.
    pub window_transmission: Num,
    /// State of the registration plates of the vehicles behind. Their plates are retro-reflectors,
    /// which carry the detection of dark cars.
    pub plates: Choice<Plates>,
}

fn is_zero(number: &Num) -> bool {
    *number == Num::Fixed(0.0)
}

/// Probability of a false alarm in a beam, per scan: the rate at which makers specify the range of
/// their LiDARs (data sheet of the Ouster OS1: "false positive rate of 1/10,000"; manual of the
/// LeddarTech Pixell: "0.0001 false alarm rate"). No source gives the rate of the SCALA 2.
const FALSE_ALARM_RATE: f64 = 1e-4;

fn is_usual_rate(number: &Num) -> bool {
    *number == Num::Fixed(FALSE_ALARM_RATE)
}

impl Default for LidarConfig {
    /// Returns a sensor in the rear bumper without tilt. On each mirror side, one layer then lies
    /// next to the axis, at −0.24° or +0.24°. At 100 m these two elevations meet the two halves of
    /// a car's painted front as seen from 0.6 m.
    fn default() -> Self {
        Self {
            name: None,
            model: Choice::Fixed(LidarModel::Scala2),
            pattern_file: None,
            pattern: None,
            mount_height_m: Num::Fixed(0.6),
            tilt_rad: Num::Fixed(0.0),
            inset_m: Num::Fixed(0.0),
            left_m: Num::Fixed(0.0),
            azimuth_deg: Num::Fixed(0.0),
            roll_deg: Num::Fixed(0.0),
            nominal_range_m: None,
            dropout: Num::Fixed(0.01),
            false_alarm_rate: Num::Fixed(FALSE_ALARM_RATE),
            levelling_sd_rad: Num::Fixed(0.0005),
            window_transmission: Num::Fixed(1.0),
            plates: Choice::Fixed(Plates::InUse),
        }
    }
}

/// A checked rear LiDAR configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lidar {
    /// Name in faults, recordings and tables.
    pub(crate) name: &'static str,
    /// Scan pattern and range.
    pub(crate) kind: &'static LidarKind,
    pub(crate) mount_height_m: f64,
    pub(crate) tilt_rad: f64,
    /// Distance from the bumper towards the ego's middle, and from its centre line to the left (m).
    pub(crate) inset_m: f64,
    pub(crate) left_m: f64,
    /// Azimuth of the axis, positive to the ego's left, and rotation about the axis, clockwise as
    /// the sensor sees it (rad).
    pub(crate) azimuth_rad: f64,
    pub(crate) roll_rad: f64,
    pub(crate) nominal_range_m: f64,
    pub(crate) dropout: f64,
    pub(crate) false_alarm_rate: f64,
    pub(crate) levelling_sd_rad: f64,
    pub(crate) window_transmission: f64,
    /// Reflectivity of registration plates; `None` if vehicles have none.
    pub(crate) plate_reflectivity: Option<f64>,
    /// Rotation of the sensor about the vertical axis (rad): an error of the mounting.
    pub(crate) yaw_rad: f64,
    /// Whether the points are the truth: no noise, no loss, no weather.
    pub(crate) is_exact: bool,
    /// The parameters of DBSCAN that clusters the points.
    pub(crate) clustering: ClusteringModel,
    /// Whether each clustering is compared with the clustering of another implementation.
    pub(crate) clustering_check: Option<ClusteringCheck>,
}

/// Range of a LiDAR whose points are the truth (m): more than the range of the region of interest.
const EXACT_RANGE_M: f64 = 500.0;

impl Lidar {
    /// Returns the name in faults, recordings and tables.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns true if the axis does not point straight behind, or the sensor is turned about it.
    pub(crate) fn is_turned(&self) -> bool {
        self.azimuth_rad != 0.0 || self.roll_rad != 0.0
    }

    /// Returns the sensor in a scene turned by half a turn, in which the ego's left is on its
    /// right.
    pub(crate) fn half_turned(self) -> Self {
        Self { left_m: -self.left_m, azimuth_rad: -self.azimuth_rad, ..self }
    }

    /// Returns half of the horizontal field of view (deg).
    pub fn half_field_deg(&self) -> f64 {
        self.kind.half_field_deg
    }

    /// Returns the range up to which the processing expects vehicles (m): beyond it no point is
    /// reported or used.
    pub(crate) fn reach_m(&self) -> f64 {
        let max_range_m = if self.is_exact { f64::INFINITY } else { self.kind.max_range_m.into() };
        self.nominal_range_m.min(max_range_m).min(REACH_M.into())
    }

    /// Returns the LiDAR as it is with this fault. The ego does not know the fault.
    pub(crate) fn with_fault(self, fault: &LidarFault) -> Self {
        Self {
            mount_height_m: self.mount_height_m + fault.height_m,
            tilt_rad: self.tilt_rad + fault.pitch_rad,
            yaw_rad: self.yaw_rad + fault.yaw_rad,
            window_transmission: self.window_transmission * fault.window_transmission,
            ..self
        }
    }

    /// Returns the same LiDAR without noise and losses.
    pub(crate) fn exact(self) -> Self {
        let (dropout, false_alarm_rate, levelling_sd_rad, window_transmission) = (0.0, 0.0, 0.0, 1.0);
        let nominal_range_m = EXACT_RANGE_M;
        Self {
            nominal_range_m,
            dropout,
            false_alarm_rate,
            levelling_sd_rad,
            window_transmission,
            is_exact: true,
            ..self
        }
    }
}

impl LidarConfig {
    /// Returns the scan pattern and the range.
    fn kind(&self, parameters: &Parameters) -> Result<&'static LidarKind, ConfigError> {
        let model = parameters.word(&self.model, "model")?;
        if self.pattern_file.is_some() {
            let needed =
                "the contents of the file that `pattern-file` names, which a scenario that is read from a file has";
            return Err(ConfigError::new("pattern", Problem::Missing { needed }));
        }
        match &self.pattern {
            Some(pattern) => pattern.kind().map_err(|error| error.within("pattern")),
            None => Ok(model.kind()),
        }
    }
}

/// Names of the sensors if the scenario gives none.
pub(crate) const REAR_NAME: &str = "rear-lidar";
pub(crate) const FRONT_NAME: &str = "front-lidar";

impl LidarConfig {
    /// Checks the keys of a sensor that has this name if the scenario gives it none.
    pub(crate) fn check_named(
        &self,
        default_name: Option<&'static str>,
        parameters: &Parameters,
    ) -> Result<Lidar, ConfigError> {
        let number = |num, key, range| parameters.number(num, key, range);
        let kind = self.kind(parameters)?;
        let nominal = (self.nominal_range_m.as_ref(), NOMINAL_RANGE_M);
        Ok(Lidar {
            name: checked_name(self.name.as_ref(), default_name)?,
            kind,
            mount_height_m: number(&self.mount_height_m, "mount-height-m", Range::closed(0.2, 2.5))?,
            tilt_rad: number(&self.tilt_rad, "tilt-rad", Range::closed(-0.1, 0.1))?,
            inset_m: number(&self.inset_m, "inset-m", Range::closed(0.0, 3.0))?,
            left_m: number(&self.left_m, "left-m", Range::closed(-1.3, 1.3))?,
            azimuth_rad: number(&self.azimuth_deg, "azimuth-deg", Range::closed(-80.0, 80.0))?.to_radians(),
            roll_rad: number(&self.roll_deg, "roll-deg", Range::closed(-10.0, 10.0))?.to_radians(),
            nominal_range_m: parameters.number_or(nominal.0, "nominal-range-m", nominal.1, kind.nominal_range_m)?,
            dropout: number(&self.dropout, "dropout", Range::closed(0.0, 0.5))?,
            false_alarm_rate: number(&self.false_alarm_rate, "false-alarm-rate", Range::closed(0.0, 0.01))?,
            levelling_sd_rad: number(&self.levelling_sd_rad, "levelling-sd-rad", Range::closed(0.0, 0.02))?,
            window_transmission: number(&self.window_transmission, "window-transmission", Range::closed(0.0, 1.0))?,
            plate_reflectivity: parameters.word(&self.plates, "plates")?.reflectivity(),
            yaw_rad: 0.0,
            is_exact: false,
            clustering: ClusteringModel::default(),
            clustering_check: None,
        })
    }
}

impl Check for LidarConfig {
    type Checked = Lidar;

    fn check(&self, parameters: &Parameters) -> Result<Lidar, ConfigError> {
        self.check_named(Some(REAR_NAME), parameters)
    }
}

impl Named for Lidar {
    const KIND: &'static str = "LiDAR";

    fn name(&self) -> &'static str {
        self.name
    }
}

impl Default for Lidar {
    /// Returns the configuration that an empty table gives.
    fn default() -> Self {
        Self {
            name: REAR_NAME,
            kind: LidarModel::Scala2.kind(),
            mount_height_m: 0.6,
            tilt_rad: 0.0,
            inset_m: 0.0,
            left_m: 0.0,
            azimuth_rad: 0.0,
            roll_rad: 0.0,
            nominal_range_m: 200.0,
            dropout: 0.01,
            false_alarm_rate: FALSE_ALARM_RATE,
            levelling_sd_rad: 0.0005,
            window_transmission: 1.0,
            plate_reflectivity: Plates::InUse.reflectivity(),
            yaw_rad: 0.0,
            is_exact: false,
            clustering: ClusteringModel::default(),
            clustering_check: None,
        }
    }
}

/// Distance behind the sensor beyond which points are not used (m).
pub(crate) const REACH_M: f32 = 200.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_table_gives_the_default() {
        assert_eq!(LidarConfig::default().check(&Parameters::default()), Ok(Lidar::default()));
    }

    #[test]
    fn an_error_names_the_invalid_value_and_its_key() {
        let config = LidarConfig { mount_height_m: Num::Fixed(f64::NAN), ..LidarConfig::default() };
        let error = config.check(&Parameters::default()).unwrap_err();
        assert_eq!(error.to_string(), "`mount-height-m` is NaN, but a number from 0.2 to 2.5 is needed");
    }

    #[test]
    fn the_model_name_is_read_from_a_scenario_file() {
        let config: LidarConfig = toml::from_str("model = \"scala-2\"\nmount-height-m = 0.7").unwrap();
        assert_eq!(config, LidarConfig { mount_height_m: Num::Fixed(0.7), ..LidarConfig::default() });
    }
}
