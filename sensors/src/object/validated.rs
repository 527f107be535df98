//! Comparison of the object-level sensor's tracks with the tracks of the full chain that it is
//! fitted to.
//!
//! The figures are in `data/rear-object.toml`, beside the parameters. No sensor reads them: they
//! state how accurate the sensor is, and the tests of `perception` measure them again.

use closecall_traffic::VehicleClass;
use serde::{Deserialize, Serialize};

use super::fit::Origin;

/// The figures of both sensors over class, paint and weather.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Validation {
    /// Where the figures come from.
    pub origin: Origin,
    /// Reflectivities of the paint (-): the rows of each figure.
    pub paints: Vec<f64>,
    /// Visibility in each weather (m): the columns of each figure.
    pub visibilities_m: Vec<f64>,
    /// Rain in each weather (mm/h).
    pub rain_mm_per_h: Vec<f64>,
    /// The figures of each class and sensor.
    pub figures: Vec<ValidationFigures>,
}

/// Which sensor figures belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Chain {
    /// LiDAR, camera and tracker.
    Full,
    /// The object-level sensor.
    Object,
}

/// The figures of one class, of the object-level sensor or of the full chain. Each has a row for
/// each paint, and in it a number for each weather.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ValidationFigures {
    /// The class.
    pub class: VehicleClass,
    /// The sensor.
    pub chain: Chain,
    /// Root mean square error of the position along the road (m).
    pub along_sd_m: Vec<Vec<f64>>,
    /// Root mean square error of the position across the road (m).
    pub across_sd_m: Vec<Vec<f64>>,
    /// Root mean square error of the speed (m/s).
    pub speed_sd_mps: Vec<Vec<f64>>,
    /// Correlation time of the error along the road (s).
    pub along_time_s: Vec<Vec<f64>>,
    /// Correlation time of the error across the road (s).
    pub across_time_s: Vec<Vec<f64>>,
    /// Correlation time of the error of the speed (s).
    pub speed_time_s: Vec<Vec<f64>>,
    /// Time from the appearance of a vehicle 40 m behind the ego until its track is confirmed (s);
    /// infinite if it is not within 4 s.
    pub confirmed_after_s: Vec<Vec<f64>>,
    /// Time until it is classified as a vehicle, too (s).
    pub classified_after_s: Vec<Vec<f64>>,
    /// Share of the steps after the first confirmation in which no track is reported (-).
    pub missed: Vec<Vec<f64>>,
    /// Longest time without a track after the first confirmation (s).
    pub longest_gap_s: Vec<Vec<f64>>,
    /// Share of the steps with a track in which the latest scan has not detected the vehicle (-).
    pub coasting: Vec<Vec<f64>>,
    /// Time by which the track of a braking vehicle slows down later than the vehicle (s).
    pub braking_lag_s: Vec<Vec<f64>>,
    /// Time by which the track of a vehicle that changes lanes moves later than the vehicle (s).
    pub lateral_lag_s: Vec<Vec<f64>>,
}

impl ValidationFigures {
    /// Returns the figures with their names, in the order of the file.
    pub fn named(&self) -> [(&'static str, &Vec<Vec<f64>>); 13] {
        [
            ("along-sd-m", &self.along_sd_m),
            ("across-sd-m", &self.across_sd_m),
            ("speed-sd-mps", &self.speed_sd_mps),
            ("along-time-s", &self.along_time_s),
            ("across-time-s", &self.across_time_s),
            ("speed-time-s", &self.speed_time_s),
            ("confirmed-after-s", &self.confirmed_after_s),
            ("classified-after-s", &self.classified_after_s),
            ("missed", &self.missed),
            ("longest-gap-s", &self.longest_gap_s),
            ("coasting", &self.coasting),
            ("braking-lag-s", &self.braking_lag_s),
            ("lateral-lag-s", &self.lateral_lag_s),
        ]
    }
}

impl Validation {
    /// Checks that each figure has a number for each paint and weather.
    ///
    /// # Errors
    /// The key, and what is needed.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.visibilities_m.len() != self.rain_mm_per_h.len() {
            return Err("`validation.rain-mm-per-h` needs a number for each of `visibilities-m`".to_owned());
        }
        for (index, figures) in self.figures.iter().enumerate() {
            for (name, rows) in figures.named() {
                let is_whole = rows.len() == self.paints.len()
                    && rows
                        .iter()
                        .all(|row| row.len() == self.visibilities_m.len() && !row.iter().any(|value| value.is_nan()));
                if !is_whole {
                    let key = format!("validation.figures[{index}].{name}");
                    return Err(format!(
                        "`{key}` needs a row for each of `paints` with a number for each of `visibilities-m`"
                    ));
                }
            }
        }
        Ok(())
    }
}
