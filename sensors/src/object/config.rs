//! The parameters of one object-level sensor: the text configuration and the checked model.
//!
//! Every key is optional. The table lists each sensor's default values with their sources.
//!
//! | key | front radar | surround | rear object |
//! |---|---|---|---|
//! | `range-m` | 150 | 14 (b) | 128.8 (c) |
//! | `half-angle-deg` | 45 (a) | all directions | 66.5 (c) |
//! | `range-sd-m` | 0.1 (a) | 0.1 (b) | by vehicle (c) |
//! | `lateral-sd-m` | 0.3 | 0.15 | by vehicle (c) |
//! | `drift-sd-m` | 0.1 | 0.05 | by vehicle (c) |
//! | `drift-time-s` | 1.0 | 1.0 | by vehicle (c) |
//! | `speed-sd-mps` | 0.1 (a) | not measured | not measured |
//! | `latency-s` | 0.08 (a) | 0.04 | 0.08 |
//! | `dropout` | 0.02 | 0.02 | by vehicle (c) |
//!
//! - (a) Of the order of long-range radars such as Continental's ARS 408-21, with its 72 ms cycle;
//!   the half-angle is the half-angle of its near scan.
//! - (b) Autoliv's 24 GHz short-range module NB24G1V2 (user's manual, blind spot mode): 0.5 to 14
//!   m, error ±0.2 m, interpreted as two standard deviations.
//! - (c) This sensor replaces the rear LiDAR with its tracker. The field of view is Valeo SCALA Gen
//!   2's. The other values come from the fit to the full chain ([`RearFit`]). The range is the
//!   range for a usual car, and each vehicle has the errors of its class and paint in this weather.
//!
//! All other values are assumptions.

use closecall_traffic::{CONTROL_STEP, ConfigError, Num, Parameters, Problem, Range, maths};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::errors::{Given, decay};
use super::fit::{ByClass, RearFit};
use super::{ErrorGrids, FittedErrors};
use crate::Alterations;
use crate::lidar::HALF_FIELD_DEG;
use crate::tracking::DETECTION_PROBABILITY;
use crate::tracking::lifecycle::{LifecycleRules, MAX_WINDOW};

/// Maximum latency in control steps: 0.4 s.
pub(super) const MAX_LATENCY_STEPS: usize = 10;

/// Probability that clutter gives a wrong track a measurement in one scan; an assumption that
/// enters the existence probability.
const CLUTTER_PROBABILITY: f64 = 0.05;

/// An object-level sensor as a scenario file describes it. Absent keys have the sensor's default
/// values.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ObjectSensorConfig {
    /// Distance from the bumper to a vehicle's nearest face up to which the vehicle is seen on a
    /// clear day (m). Behind the ego, this is the range for a usual car; the ranges of other
    /// paints, plates, shapes and classes are relative to it.
    pub range_m: Option<Num>,
    /// Half of the horizontal field of view (deg); not allowed for the surround sensors, which see
    /// in all directions.
    pub half_angle_deg: Option<Num>,
    /// Standard deviation of the white error of each measured position along the road (m). Behind
    /// the ego, an absent key means the errors of the fit, by class, paint and weather.
    pub range_sd_m: Option<Num>,
    /// Standard deviation of the white error of each measured position across the road (m). Behind
    /// the ego, an absent key means the value of the fit.
    pub lateral_sd_m: Option<Num>,
    /// Standard deviation of the slowly varying part of the position error, along and across the
    /// road (m). Behind the ego, an absent key means the value of the fit.
    pub drift_sd_m: Option<Num>,
    /// Correlation time of the slowly varying part of the position error (s). Behind the ego, an
    /// absent key means the value of the fit.
    pub drift_time_s: Option<Num>,
    /// Standard deviation of each measured speed along the road (m/s). If absent, the front radar
    /// has 0.1, and the other sensors do not measure speed.
    pub speed_sd_mps: Option<Num>,
    /// Age of a measurement when the controller receives it (s), rounded to whole control steps of
    /// 40 ms.
    pub latency_s: Option<Num>,
    /// Probability that a measurement of a visible vehicle is lost. Behind the ego, an absent key
    /// means the losses of the fit, which depend on the distance.
    pub dropout: Option<Num>,
    /// Number of measurements in the latest `confirm-window` scans that confirm a track.
    pub confirm_hits: Option<u8>,
    /// Number of latest scans in which `confirm-hits` are counted: 1 to 16.
    pub confirm_window: Option<u8>,
    /// Time for which a confirmed track is kept without further measurements (s).
    pub coast_s: Option<Num>,
    /// Probability that the reported class scores assign to the true class.
    pub class_confidence: Option<Num>,
}

/// The checked parameters of an object-level sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSensorModel {
    pub(super) range_m: f64,
    /// Tangent of half of the field of view; infinite if the sensor sees in all directions.
    pub(super) half_angle_tan: f64,
    /// Standard deviations of the white noise along and across the road (m).
    pub(super) white_sd_m: [f64; 2],
    pub(super) drift_sd_m: f64,
    /// Share of the drift that remains after one scan.
    pub(super) drift_decay: f64,
    /// Standard deviation of the measured speed (m/s); `None` if speed is not measured.
    pub(super) speed_sd_mps: Option<f64>,
    pub(super) latency_steps: usize,
    pub(super) dropout: f64,
    /// Which of the errors above hold for all vehicles, in place of the errors of the fit.
    pub(super) given: Given,
    /// Errors of all vehicles, in place of the errors of the fit.
    pub(super) fixed_errors: Option<FittedErrors>,
    pub(super) rules: LifecycleRules,
    /// Score of the true class.
    pub(super) class_confidence: ByClass,
    /// Distance up to which classes are known (m), in place of the distance of the fit.
    pub(super) class_range_m: Option<f64>,
    /// The fit to the full chain that ranges come from; `None` for a sensor with one range for all
    /// vehicles.
    pub(super) fit: Option<&'static RearFit>,
    /// Whether every vehicle is classified as background.
    pub(super) is_class_background: bool,
}

impl ObjectSensorModel {
    /// Returns the latency in control steps.
    pub(crate) fn latency_steps(&self) -> usize {
        self.latency_steps
    }

    /// Returns half of the field of view (deg); `None` if the sensor sees in all directions.
    pub fn half_angle_deg(&self) -> Option<f64> {
        // Up to rounding, the value of the configuration.
        let rounded_deg = (1e9 * maths::atan(self.half_angle_tan).to_degrees()).round() / 1e9;
        self.half_angle_tan.is_finite().then_some(rounded_deg)
    }

    /// Returns whether the sensor measures speed.
    pub fn measures_speed(&self) -> bool {
        self.speed_sd_mps.is_some()
    }

    /// Returns the same sensor with one range for all vehicles, which the weather shortens by a
    /// power law, and with classes that are known up to `class_range_m` (m).
    pub(crate) fn without_fit(self, class_range_m: f64) -> Self {
        Self { fit: None, class_range_m: Some(class_range_m), ..self }
    }

    /// Returns the same sensor with these errors for all vehicles, in place of the errors of the
    /// fit.
    pub(crate) fn with_errors(self, errors: FittedErrors) -> Self {
        Self { fixed_errors: Some(errors), ..self }
    }

    /// Returns the same sensor with another fit. The fit gives its ranges, its class scores, and
    /// the errors that the scenario does not give.
    pub(crate) fn with_fit(self, fit: &'static RearFit) -> Self {
        Self { range_m: fit.usual_m(), class_confidence: fit.class_confidence, fit: Some(fit), ..self }
    }

    /// Returns whether ranges depend on the pitch of the ego.
    pub(super) fn is_range_pitched(&self) -> bool {
        self.fit.is_some_and(|fit| !fit.pitched.is_empty())
    }

    /// Returns the errors of a vehicle that the scenario does not give: from the fit, or the errors
    /// of all vehicles.
    pub(super) fn fitted_errors(&self, at: impl FnOnce(&ErrorGrids) -> FittedErrors) -> Option<FittedErrors> {
        self.fixed_errors.or_else(|| self.fit.map(|fit| at(&fit.errors)))
    }

    /// Returns the same sensor with the altered latency and, if it looks back, the altered class.
    pub(crate) fn altered(self, altered: &Alterations, looks_back: bool) -> Self {
        Self {
            latency_steps: altered.latency_steps(self.latency_steps, MAX_LATENCY_STEPS),
            class_confidence: match altered.has_true_class && looks_back {
                true => ByClass { car: 1.0, truck: 1.0, motorcycle: 1.0 },
                false => self.class_confidence,
            },
            class_range_m: match altered.has_true_class && looks_back {
                true => Some(f64::INFINITY),
                false => self.class_range_m,
            },
            is_class_background: altered.is_class_background && !altered.has_true_class && looks_back,
            ..self
        }
    }
}

/// The default values of one sensor, in the units of the configuration.
struct Defaults {
    range_m: f64,
    half_angle_deg: Option<f64>,
    range_sd_m: f64,
    lateral_sd_m: f64,
    drift_sd_m: f64,
    drift_time_s: f64,
    speed_sd_mps: Option<f64>,
    latency_s: f64,
    dropout: f64,
    confirm: Confirmation,
    coast_s: f64,
    class_confidence: ByClass,
    fit: Option<&'static RearFit>,
}

/// How a track is confirmed: by `hits` measurements within `window` scans.
struct Confirmation {
    hits: u8,
    window: u8,
}

const DRIFT_TIME_S: f64 = 1.0;
const CLASS_CONFIDENCE: ByClass = ByClass { car: 0.97, truck: 0.97, motorcycle: 0.97 };

const FRONT_RADAR: Defaults = Defaults {
    range_m: 150.0,
    half_angle_deg: Some(45.0),
    range_sd_m: 0.1,
    lateral_sd_m: 0.3,
    drift_sd_m: 0.1,
    drift_time_s: DRIFT_TIME_S,
    speed_sd_mps: Some(0.1),
    latency_s: 0.08,
    dropout: 0.02,
    confirm: Confirmation { hits: 3, window: 5 },
    coast_s: 0.6,
    class_confidence: CLASS_CONFIDENCE,
    fit: None,
};

const SURROUND: Defaults = Defaults {
    range_m: 14.0,
    half_angle_deg: None,
    range_sd_m: 0.1,
    lateral_sd_m: 0.15,
    drift_sd_m: 0.05,
    drift_time_s: DRIFT_TIME_S,
    speed_sd_mps: None,
    latency_s: 0.04,
    dropout: 0.02,
    confirm: Confirmation { hits: 2, window: 4 },
    coast_s: 0.3,
    class_confidence: CLASS_CONFIDENCE,
    fit: None,
};

/// Returns the default values of the sensor that replaces the rear LiDAR and camera: the values of
/// the fit, and as errors of all vehicles the errors of a usual car on a clear day.
fn rear_object(fit: &'static RearFit) -> Defaults {
    let usual = fit.usual_errors();
    Defaults {
        range_m: fit.usual_m(),
        half_angle_deg: Some(HALF_FIELD_DEG),
        range_sd_m: usual.white_sd_m[0],
        lateral_sd_m: usual.white_sd_m[1],
        drift_sd_m: usual.slow_sd_m[0],
        drift_time_s: usual.slow_time_s[0],
        speed_sd_mps: None,
        latency_s: 0.08,
        // The existence of a track counts hits and misses as in the tracker of the full chain.
        dropout: 1.0 - DETECTION_PROBABILITY,
        confirm: Confirmation { hits: 3, window: 5 },
        coast_s: 1.0,
        class_confidence: fit.class_confidence,
        fit: Some(fit),
    }
}

/// Returns the error for a `half-angle-deg` of a sensor that sees in all directions.
fn half_angle_not_allowed() -> ConfigError {
    let rule = "the surround sensors look all round".to_owned();
    ConfigError::new("half-angle-deg", Problem::Contradiction { other: "surround", rule })
}

/// Returns the number of whole control steps nearest to `time_s`, which is from 0 to 10 s.
fn steps(time_s: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be 0 to 10 s")]
    let steps = (time_s / CONTROL_STEP.s()).round() as usize;
    steps
}

impl ObjectSensorConfig {
    pub(crate) fn check_front_radar(&self, parameters: &Parameters) -> Result<ObjectSensorModel, ConfigError> {
        self.check_against(&FRONT_RADAR, parameters)
    }

    pub(crate) fn check_surround(&self, parameters: &Parameters) -> Result<ObjectSensorModel, ConfigError> {
        self.check_against(&SURROUND, parameters)
    }

    pub(crate) fn check_rear_object(&self, parameters: &Parameters) -> Result<ObjectSensorModel, ConfigError> {
        let fit = RearFit::shipped().map_err(|error| {
            ConfigError::new(
                "range-m",
                Problem::UnknownWord { value: error.to_string(), allowed: "the fit that ships".to_owned() },
            )
        })?;
        self.check_against(&rear_object(fit), parameters)
    }

    fn check_against(&self, defaults: &Defaults, parameters: &Parameters) -> Result<ObjectSensorModel, ConfigError> {
        let number = |num: &Option<Num>, default: f64, key: &str, range: Range| {
            parameters.number_or(num.as_ref(), key, range, default)
        };
        let half_angle_tan = match defaults.half_angle_deg {
            None if self.half_angle_deg.is_some() => return Err(half_angle_not_allowed()),
            None => f64::INFINITY,
            Some(deg) => {
                let deg = number(&self.half_angle_deg, deg, "half-angle-deg", Range::above(0.0, 85.0))?;
                maths::tan(deg.to_radians())
            }
        };
        let white_sd = Range::closed(0.01, 10.0);
        let drift_time_s = number(&self.drift_time_s, defaults.drift_time_s, "drift-time-s", Range::above(0.0, 100.0))?;
        let speed_sd_mps = match (&self.speed_sd_mps, defaults.speed_sd_mps) {
            (Some(num), _) => Some(parameters.number(num, "speed-sd-mps", Range::closed(0.01, 20.0))?),
            (None, default) => default,
        };
        let longest_s = MAX_LATENCY_STEPS as f64 * CONTROL_STEP.s();
        let latency_s = number(&self.latency_s, defaults.latency_s, "latency-s", Range::closed(0.0, longest_s))?;
        let dropout = number(&self.dropout, defaults.dropout, "dropout", Range::closed(0.0, 0.95))?;
        let coast_s = number(&self.coast_s, defaults.coast_s, "coast-s", Range::closed(0.0, 10.0))?;
        let class_confidence = match &self.class_confidence {
            Some(num) => {
                let all = parameters.number(num, "class-confidence", Range::closed(0.25, 1.0))?;
                ByClass { car: all, truck: all, motorcycle: all }
            }
            None => defaults.class_confidence,
        };
        Ok(ObjectSensorModel {
            range_m: number(&self.range_m, defaults.range_m, "range-m", Range::above(0.0, 500.0))?,
            half_angle_tan,
            white_sd_m: [
                number(&self.range_sd_m, defaults.range_sd_m, "range-sd-m", white_sd)?,
                number(&self.lateral_sd_m, defaults.lateral_sd_m, "lateral-sd-m", white_sd)?,
            ],
            drift_sd_m: number(&self.drift_sd_m, defaults.drift_sd_m, "drift-sd-m", Range::closed(0.0, 10.0))?,
            drift_decay: decay(drift_time_s),
            speed_sd_mps,
            latency_steps: steps(latency_s),
            dropout,
            given: match defaults.fit {
                // Without a fit, there is nothing to replace.
                None => Given::default(),
                Some(_) => Given {
                    white: [self.range_sd_m.is_some(), self.lateral_sd_m.is_some()],
                    slow: self.drift_sd_m.is_some(),
                    slow_time: self.drift_time_s.is_some(),
                    dropout: self.dropout.is_some(),
                },
            },
            fixed_errors: None,
            rules: self.rules(defaults, dropout, steps(coast_s))?,
            class_confidence,
            class_range_m: None,
            is_class_background: false,
            fit: defaults.fit,
        })
    }

    fn rules(&self, defaults: &Defaults, dropout: f64, coast_steps: usize) -> Result<LifecycleRules, ConfigError> {
        let window = self.confirm_window.unwrap_or(defaults.confirm.window);
        if !(1..=MAX_WINDOW).contains(&window) {
            let problem = Problem::WrongCount { value: window.into(), allowed: "a number of scans from 1 to 16" };
            return Err(ConfigError::new("confirm-window", problem));
        }
        let hits = self.confirm_hits.unwrap_or(defaults.confirm.hits);
        if !(1..=window).contains(&hits) {
            let problem = Problem::WrongCount { value: hits.into(), allowed: "a number from 1 to `confirm-window`" };
            return Err(ConfigError::new("confirm-hits", problem));
        }
        Ok(LifecycleRules {
            confirm_hits: hits.into(),
            confirm_window: window.into(),
            // The first scan after the coasting time deletes the track.
            #[expect(clippy::cast_possible_truncation, reason = "10 s of coasting are 250 scans")]
            delete_after_misses: coast_steps as u32 + 1,
            // The limit below 1 keeps a single miss from making existence impossible for a sensor
            // without dropouts.
            detection_probability: (1.0 - dropout).min(0.99),
            clutter_probability: CLUTTER_PROBABILITY,
        })
    }
}
