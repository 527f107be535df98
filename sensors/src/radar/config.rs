//! The rear radars' configuration: the text of a scenario file, and the checked value that it
//! becomes.
//!
//! Sources of the default values:
//! - Field of view and range: the rear mid-range radar of Bosch has an aperture of 150° and a range
//!   of 90 m (Bosch, press release *Mid-range radar enters series production for rear-end
//!   applications*, 2014).
//! - Errors: the rear radar NB24G1V2 of Autoliv, as a lane change assistant, has ±0.5 m, ±2° and ±2
//!   km/h (Autoliv ASP, *User's manual NB24G1V2*, FCC, page 5). The limits count as two standard
//!   deviations (assumption).
//! - Rate: the LRR3 of Bosch measures every 80 ms (F. de Ponte Müller 2017, *Survey on ranging
//!   sensors and cooperative techniques for relative positioning of vehicles*, table of radars).

use closecall_traffic::{CONTROL_STEP, Check, ConfigError, Num, Parameters, Range, Side, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measure::Mount;
use crate::external::RadarMount;

/// Distance of each radar from the centre line of the ego (m; assumption): behind the bumper, near
/// the corners of a car. Plausible: 0.5 to 0.9.
const LEFT_M: f64 = 0.7;
/// Angle between straight behind and the axis of each radar, outward (deg; assumption): the field
/// then reaches 15° ahead of the side, and each radar sees the lane of the ego. Plausible: 20 to
/// 50.
const YAW_DEG: f64 = 30.0;
/// Probability that a scan detects a vehicle in view (-; assumption). Plausible: 0.7 to 0.99.
const DETECTION_PROBABILITY: f64 = 0.9;
/// Probability that a guard rail shows the mirror image of a vehicle in a scan (-; assumption).
/// Plausible: 0 to 0.5.
const GHOST_PROBABILITY: f64 = 0.1;
/// Half of the horizontal field of view (deg).
const HALF_FIELD_DEG: f64 = 75.0;
/// Range (m).
const RANGE_M: f64 = 90.0;
/// Scans per second (Hz).
const RATE_HZ: f64 = 12.5;
/// Standard deviations of the range (m), of the azimuth (deg) and of the radial speed (m/s).
const RANGE_SD_M: f64 = 0.25;
const AZIMUTH_SD_DEG: f64 = 1.0;
const SPEED_SD_MPS: f64 = 0.28;

/// The pair of rear corner radars as described in a scenario file. Both have the same values, and
/// lie and look symmetrically to the centre line of the ego.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct RearRadarConfig {
    /// Distance of each radar from the ego's centre line (m). Default: 0.7.
    pub left_m: Num,
    /// Distance of the radars from the bumper towards the ego's middle (m). Default: 0.
    pub inset_m: Num,
    /// Angle of the axis of each radar from straight behind, outward (deg). Default: 30.
    pub yaw_deg: Num,
    /// Half of the horizontal field of view (deg). Default: 75.
    pub half_field_deg: Num,
    /// Range up to which vehicles are detected in dry air (m). Default: 90.
    pub range_m: Num,
    /// Scans per second (Hz). Default: 12.5.
    pub rate_hz: Num,
    /// Standard deviation of the error of each range (m). Default: 0.25.
    pub range_sd_m: Num,
    /// Standard deviation of the error of each azimuth (deg). Default: 1.
    pub azimuth_sd_deg: Num,
    /// Standard deviation of the error of each radial speed (m/s). Default: 0.28.
    pub speed_sd_mps: Num,
    /// Probability (0 to 1) that a scan detects a vehicle in view. Default: 0.9.
    pub detection_probability: Num,
    /// Probability (0 to 1) that a guard rail shows the mirror image of a vehicle in a scan; the
    /// image is detected with `detection-probability`. Default: 0.1.
    pub ghost_probability: Num,
}

impl Default for RearRadarConfig {
    fn default() -> Self {
        Self {
            left_m: Num::Fixed(LEFT_M),
            inset_m: Num::Fixed(0.0),
            yaw_deg: Num::Fixed(YAW_DEG),
            half_field_deg: Num::Fixed(HALF_FIELD_DEG),
            range_m: Num::Fixed(RANGE_M),
            rate_hz: Num::Fixed(RATE_HZ),
            range_sd_m: Num::Fixed(RANGE_SD_M),
            azimuth_sd_deg: Num::Fixed(AZIMUTH_SD_DEG),
            speed_sd_mps: Num::Fixed(SPEED_SD_MPS),
            detection_probability: Num::Fixed(DETECTION_PROBABILITY),
            ghost_probability: Num::Fixed(GHOST_PROBABILITY),
        }
    }
}

/// The checked pair of rear corner radars.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RearRadar {
    /// Distances from the centre line, and from the bumper towards the ego's middle (m).
    left_m: f64,
    inset_m: f64,
    /// Angle of the axis from straight behind, outward (rad).
    yaw_rad: f64,
    half_field_rad: f64,
    pub(super) range_m: f64,
    /// Time from a scan to the next (ns).
    period_ns: i64,
    pub(super) range_sd_m: f64,
    pub(super) azimuth_sd_rad: f64,
    pub(super) speed_sd_mps: f64,
    pub(super) detection_probability: f64,
    pub(super) ghost_probability: f64,
}

impl RearRadar {
    /// Returns whether a scan ends at the control step of `time`, as a scan of a LiDAR does.
    pub(super) fn is_due(&self, time: Time) -> bool {
        let periods_at = |time_ns: i64| time_ns.div_euclid(self.period_ns);
        periods_at(time.ns()) != periods_at(time.ns() - CONTROL_STEP.ns())
    }

    /// Returns the time from a scan to the next (s).
    pub(super) fn period_s(&self) -> f64 {
        Time::from_ns(self.period_ns).s()
    }

    /// Returns the mounting of the radar on this side of an ego of this length (m).
    pub(super) fn mount(&self, side: Side, ego_length_m: f64) -> Mount {
        let outward = match side {
            Side::Left => 1.0,
            Side::Right => -1.0,
        };
        Mount {
            at_m: [self.inset_m - 0.5 * ego_length_m, outward * self.left_m],
            axis_rad: outward * self.yaw_rad,
            half_field_rad: self.half_field_rad,
        }
    }

    /// Returns the left and the right radar of an ego of this length (m), in the form that a
    /// perception program gets.
    pub fn mounts(&self, ego_length_m: f64) -> [RadarMount; 2] {
        [Side::Left, Side::Right].map(|side| {
            let Mount { at_m: [x_m, y_m], axis_rad, half_field_rad } = self.mount(side, ego_length_m);
            RadarMount {
                side,
                x_m,
                y_m,
                azimuth_rad: axis_rad,
                half_field_rad,
                range_m: self.range_m,
                period_s: self.period_s(),
                range_sd_m: self.range_sd_m,
                azimuth_sd_rad: self.azimuth_sd_rad,
                radial_sd_mps: self.speed_sd_mps,
            }
        })
    }

    /// Returns the azimuths that the two radars see together (deg), from straight behind.
    pub fn azimuths_deg(&self) -> Range {
        // Up to rounding, the sum of the values of the configuration.
        let end_deg = (1e9 * (self.yaw_rad + self.half_field_rad).to_degrees()).round() / 1e9;
        Range::closed(-end_deg, end_deg)
    }
}

impl Check for RearRadarConfig {
    type Checked = RearRadar;

    fn check(&self, parameters: &Parameters) -> Result<RearRadar, ConfigError> {
        let number = |num, key, range| parameters.number(num, key, range);
        let rate_hz = number(&self.rate_hz, "rate-hz", Range::closed(1.0, 1.0 / CONTROL_STEP.s()))?;
        #[expect(clippy::cast_possible_truncation, reason = "at most a second")]
        let period_ns = (1e9 / rate_hz).round() as i64;
        Ok(RearRadar {
            left_m: number(&self.left_m, "left-m", Range::closed(0.0, 1.3))?,
            inset_m: number(&self.inset_m, "inset-m", Range::closed(0.0, 3.0))?,
            yaw_rad: number(&self.yaw_deg, "yaw-deg", Range::closed(0.0, 80.0))?.to_radians(),
            half_field_rad: number(&self.half_field_deg, "half-field-deg", Range::closed(5.0, 85.0))?.to_radians(),
            range_m: number(&self.range_m, "range-m", Range::above(0.0, 300.0))?,
            period_ns,
            range_sd_m: number(&self.range_sd_m, "range-sd-m", Range::closed(0.01, 10.0))?,
            azimuth_sd_rad: number(&self.azimuth_sd_deg, "azimuth-sd-deg", Range::closed(0.01, 20.0))?.to_radians(),
            speed_sd_mps: number(&self.speed_sd_mps, "speed-sd-mps", Range::closed(0.01, 20.0))?,
            detection_probability: number(&self.detection_probability, "detection-probability", Range::UNIT)?,
            ghost_probability: number(&self.ghost_probability, "ghost-probability", Range::UNIT)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str) -> Result<RearRadar, ConfigError> {
        toml::from_str::<RearRadarConfig>(text).unwrap().check(&Parameters::default())
    }

    #[test]
    fn a_wrong_value_is_answered_with_key_and_allowed_range() {
        let refused = |text: &str| check(text).unwrap_err().to_string();
        assert_eq!(refused("range-m = 0"), "`range-m` is 0, but a number above 0 and up to 300 is needed");
        assert_eq!(
            refused("ghost-probability = 1.5"),
            "`ghost-probability` is 1.5, but a number from 0 to 1 is needed"
        );
        assert_eq!(refused("rate-hz = 30"), "`rate-hz` is 30, but a number from 1 to 25 is needed");
        assert!(toml::from_str::<RearRadarConfig>("rnage-m = 1.0").is_err());
    }

    #[test]
    fn the_two_radars_lie_and_look_symmetrically() {
        let radar = check("inset-m = 0.5").unwrap();
        let [left, right] = [Side::Left, Side::Right].map(|side| radar.mount(side, 4.0));
        assert_eq!((left.at_m, right.at_m), ([-1.5, 0.7], [-1.5, -0.7]));
        assert_eq!(left.axis_rad, -right.axis_rad);
        assert!((left.axis_rad.to_degrees() - 30.0).abs() < 1e-9, "to the ego's left");
    }

    #[test]
    fn twelve_and_a_half_scans_a_second_are_every_second_step() {
        let radar = check("").unwrap();
        let due: Vec<bool> = (0..6).map(|step| radar.is_due(CONTROL_STEP * step)).collect();
        assert_eq!(due, [true, false, true, false, true, false]);
    }
}
