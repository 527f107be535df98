//! The numbers of one object-level sensor, as text and checked.
//!
//! Every key may be left out; each sensor has its own usual values, given in the table below with where they come from.
//!
//! | key | front radar | surround | rear object |
//! |---|---|---|---|
//! | `range-m` | 150 | 14 [2] | 120 [3] |
//! | `half-angle-deg` | 45 [1] | all round | 66.5 [3] |
//! | `range-sd-m` | 0.1 [1] | 0.1 [2] | 0.1 [3] |
//! | `lateral-sd-m` | 0.3 | 0.15 | 0.15 |
//! | `drift-sd-m` | 0.1 | 0.05 | 0.1 |
//! | `drift-time-s` | 1.0 | 1.0 | 1.0 |
//! | `speed-sd-mps` | 0.1 [1] | not measured | not measured |
//! | `latency-s` | 0.08 [1] | 0.04 | 0.08 |
//! | `dropout` | 0.02 | 0.02 | 0.05 |
//!
//! [1] of the order of long-range radars such as Continental's ARS 408-21, with its 72 ms cycle; the half-angle is that
//! of its near scan. [2] Autoliv's 24 GHz short-range module NB24G1V2 (user's manual, blind spot mode): 0.5 to 14 m, error
//! ±0.2 m, taken as two standard deviations. [3] a stand-in for the rear LiDAR with its tracker: the field of view is
//! Valeo SCALA Gen 2's, the range that at which a usual car is confirmed. All others are assumptions.

use closecall_traffic::{ConfigError, Num, Parameters, Problem, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::SCAN_PERIOD;
use crate::tracking::lifecycle::{LifecycleRules, MAX_WINDOW};

/// Longest latency that is simulated, in control steps: 0.4 s.
pub(super) const MAX_LATENCY_STEPS: usize = 10;

/// Probability that clutter confirms a wrong track in one scan, assumed for the existence probability.
const CLUTTER_PROBABILITY: f64 = 0.05;

/// An object-level sensor as a scenario file describes it. Keys left out have the sensor's usual values.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ObjectSensorConfig {
    /// Distance from the bumper up to which the nearest face of a vehicle is seen on a clear day [m].
    pub range_m: Option<Num>,
    /// Half of the horizontal field of view [deg]; not for the surround sensors, which look all round.
    pub half_angle_deg: Option<Num>,
    /// Standard deviation of each measured position along the road [m].
    pub range_sd_m: Option<Num>,
    /// Standard deviation of each measured position across the road [m].
    pub lateral_sd_m: Option<Num>,
    /// Standard deviation of the slowly varying part of the position error, along and across [m].
    pub drift_sd_m: Option<Num>,
    /// Correlation time of that part [s].
    pub drift_time_s: Option<Num>,
    /// Standard deviation of each measured speed along the road [m/s]; where absent, front: 0.1, others: not measured.
    pub speed_sd_mps: Option<Num>,
    /// Age of a measurement when the controller gets it [s]; rounded to whole control steps of 40 ms.
    pub latency_s: Option<Num>,
    /// Probability that a measurement of a visible vehicle is lost [1].
    pub dropout: Option<Num>,
    /// Measurements that confirm a track, out of the latest `confirm-window`.
    pub confirm_hits: Option<u8>,
    /// See `confirm-hits`; 1 to 16.
    pub confirm_window: Option<u8>,
    /// Time for which a confirmed track that is no longer measured is kept [s].
    pub coast_s: Option<Num>,
    /// Probability that the reported class gives to the true one [1].
    pub class_confidence: Option<Num>,
}

/// A checked object-level sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSensorModel {
    pub(super) range_m: f64,
    /// Tangent of half of the field of view; infinite for all round.
    pub(super) half_angle_tan: f64,
    /// White noise along and across the road [m].
    pub(super) white_sd_m: [f64; 2],
    pub(super) drift_sd_m: f64,
    /// Share of the drift that is left after one scan [1].
    pub(super) drift_decay: f64,
    /// `None` where speed is not measured [m/s].
    pub(super) speed_sd_mps: Option<f64>,
    pub(super) latency_steps: usize,
    pub(super) dropout: f64,
    pub(super) rules: LifecycleRules,
    pub(super) class_confidence: f64,
}

/// The usual values of one sensor, in the units of the configuration.
struct Usual {
    range_m: f64,
    half_angle_deg: Option<f64>,
    range_sd_m: f64,
    lateral_sd_m: f64,
    drift_sd_m: f64,
    speed_sd_mps: Option<f64>,
    latency_s: f64,
    dropout: f64,
    confirm: (u8, u8),
    coast_s: f64,
}

const DRIFT_TIME_S: f64 = 1.0;
const CLASS_CONFIDENCE: f64 = 0.97;

const FRONT_RADAR: Usual = Usual {
    range_m: 150.0,
    half_angle_deg: Some(45.0),
    range_sd_m: 0.1,
    lateral_sd_m: 0.3,
    drift_sd_m: 0.1,
    speed_sd_mps: Some(0.1),
    latency_s: 0.08,
    dropout: 0.02,
    confirm: (3, 5),
    coast_s: 0.6,
};

const SURROUND: Usual = Usual {
    range_m: 14.0,
    half_angle_deg: None,
    range_sd_m: 0.1,
    lateral_sd_m: 0.15,
    drift_sd_m: 0.05,
    speed_sd_mps: None,
    latency_s: 0.04,
    dropout: 0.02,
    confirm: (2, 4),
    coast_s: 0.3,
};

const REAR_OBJECT: Usual = Usual {
    range_m: 120.0,
    half_angle_deg: Some(66.5),
    range_sd_m: 0.1,
    lateral_sd_m: 0.15,
    drift_sd_m: 0.1,
    speed_sd_mps: None,
    latency_s: 0.08,
    dropout: 0.05,
    confirm: (3, 5),
    coast_s: 1.0,
};

fn all_round() -> ConfigError {
    let rule = "the surround sensors look all round".to_owned();
    ConfigError::new("half-angle-deg", Problem::Contradiction { other: "surround", rule })
}

/// The number of whole control steps nearest to `time_s`, which is 0 or more and short.
fn steps(time_s: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be 0 to 10 s")]
    let steps = (time_s / SCAN_PERIOD.s()).round() as usize;
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
        self.check_against(&REAR_OBJECT, parameters)
    }

    fn check_against(&self, usual: &Usual, parameters: &Parameters) -> Result<ObjectSensorModel, ConfigError> {
        let number = |num: &Option<Num>, usual: f64, key: &str, range: Range| match num {
            Some(num) => parameters.number(num, key, range),
            None => Ok(usual),
        };
        let half_angle_tan = match usual.half_angle_deg {
            None if self.half_angle_deg.is_some() => return Err(all_round()),
            None => f64::INFINITY,
            Some(deg) => {
                let deg = number(&self.half_angle_deg, deg, "half-angle-deg", Range::above(0.0, 85.0))?;
                deg.to_radians().tan()
            }
        };
        let white_sd = Range::closed(0.01, 10.0);
        let drift_time_s = number(&self.drift_time_s, DRIFT_TIME_S, "drift-time-s", Range::above(0.0, 100.0))?;
        let speed_sd_mps = match (&self.speed_sd_mps, usual.speed_sd_mps) {
            (Some(num), _) => Some(parameters.number(num, "speed-sd-mps", Range::closed(0.01, 20.0))?),
            (None, usual) => usual,
        };
        let longest_s = MAX_LATENCY_STEPS as f64 * SCAN_PERIOD.s();
        let latency_s = number(&self.latency_s, usual.latency_s, "latency-s", Range::closed(0.0, longest_s))?;
        let dropout = number(&self.dropout, usual.dropout, "dropout", Range::closed(0.0, 0.95))?;
        let coast_s = number(&self.coast_s, usual.coast_s, "coast-s", Range::closed(0.0, 10.0))?;
        let class_confidence = &self.class_confidence;
        let class_confidence =
            number(class_confidence, CLASS_CONFIDENCE, "class-confidence", Range::closed(0.25, 1.0))?;
        Ok(ObjectSensorModel {
            range_m: number(&self.range_m, usual.range_m, "range-m", Range::above(0.0, 500.0))?,
            half_angle_tan,
            white_sd_m: [
                number(&self.range_sd_m, usual.range_sd_m, "range-sd-m", white_sd)?,
                number(&self.lateral_sd_m, usual.lateral_sd_m, "lateral-sd-m", white_sd)?,
            ],
            drift_sd_m: number(&self.drift_sd_m, usual.drift_sd_m, "drift-sd-m", Range::closed(0.0, 10.0))?,
            drift_decay: (-SCAN_PERIOD.s() / drift_time_s).exp(),
            speed_sd_mps,
            latency_steps: steps(latency_s),
            dropout,
            rules: self.rules(usual, dropout, steps(coast_s))?,
            class_confidence,
        })
    }

    fn rules(&self, usual: &Usual, dropout: f64, coast_steps: usize) -> Result<LifecycleRules, ConfigError> {
        let window = self.confirm_window.unwrap_or(usual.confirm.1);
        if !(1..=MAX_WINDOW).contains(&window) {
            let problem = Problem::WrongCount { value: window.into(), allowed: "a number of scans from 1 to 16" };
            return Err(ConfigError::new("confirm-window", problem));
        }
        let hits = self.confirm_hits.unwrap_or(usual.confirm.0);
        if !(1..=window).contains(&hits) {
            let problem = Problem::WrongCount { value: hits.into(), allowed: "a number from 1 to `confirm-window`" };
            return Err(ConfigError::new("confirm-hits", problem));
        }
        Ok(LifecycleRules {
            confirm_hits: hits.into(),
            confirm_window: window.into(),
            // The scan after the time is over deletes the track.
            #[expect(clippy::cast_possible_truncation, reason = "10 s of coasting are 250 scans")]
            lost_after: coast_steps as u32 + 1,
            // A sensor without dropouts may still miss, or one miss would end a track for certain.
            detection_probability: (1.0 - dropout).min(0.99),
            clutter_probability: CLUTTER_PROBABILITY,
        })
    }
}
