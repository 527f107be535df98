//! The kinds of LiDAR. A file describes the scan pattern, the rate, the footprint and the range of
//! each.
//!
//! The shipped kinds are the files in `sensors/lidars`. A scenario names one of them by its
//! `model`, or a file of its own by `pattern-file`. A LiDAR that does not scan a raster has a table
//! of beams in place of layers and columns ([`super::beam_table`]).
//!
//! The range of a target of reflectivity ρ that fills the beam follows from one published range R
//! at the reflectivity ρ₀, which the sensor reaches with the probability p: the received power is
//! then P = 1 + Φ⁻¹(p)/T thresholds (see [`super::power`]). The nominal range of the model, at ρ =
//! 0.5 with probability 0.5, is R·√(P·0.5/ρ₀).

use std::f64::consts::SQRT_2;
use std::sync::{Mutex, PoisonError};

use closecall_traffic::statistics::normal::erfc_inv;
use closecall_traffic::{CONTROL_STEP, Check, ConfigError, KeyPath, Num, Parameters, Problem, Range, Time, maths};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::beam_table::{self, BeamFileError, BeamLimits, BeamTable, MAX_BEAMS, MAX_ELEVATION_DEG};
use super::pattern::{GROUPS, mirror_bounds_deg};
use super::{LidarModel, MirrorSide};

/// Default height of a sensor (m): in the bumper.
const MOUNT_HEIGHT_M: f64 = 0.6;
/// Default distance up to which the road may give returns to a sensor (m).
const GROUND_REACH_M: f32 = 40.0;
/// Power of a usual return from a vehicle (detection thresholds): an assumption. It is the power
/// from a grey car that fills the beam at 130 m. The range of such a point of the SCALA has a
/// standard deviation of 0.05 m.
const USUAL_POWER: f64 = 2.25;
/// Decimals to which that standard deviation is rounded, as a factor.
const SD_DECIMALS: f64 = 1e4;
/// Greatest number of layers.
pub(super) const MAX_LAYERS: usize = 128;
/// Greatest difference from a whole number of azimuth steps (steps).
const STEP_TOLERANCE: f64 = 1e-6;
/// Number of columns at either end of the field of view. A cluster with a point in one of them may
/// extend beyond the field of view.
const EDGE_COLUMNS: u8 = 4;
/// Azimuth steps that the model covers (°).
const AZIMUTH_STEP_DEG: Range = Range::closed(0.02, 2.0);
/// Greatest half of the horizontal field of view (°).
pub(crate) const MAX_HALF_FIELD_DEG: f64 = 85.0;
/// Nominal ranges that the model covers (m).
pub(crate) const NOMINAL_RANGE_M: Range = Range::closed(10.0, 500.0);
/// Decimals to which the tangent of the highest elevation that is in view is rounded, as a factor.
const HIGHEST_DECIMALS: f64 = 1e3;
/// Decimals to which the tangent of half of the field of view is rounded, as a factor.
const TANGENT_DECIMALS: f64 = 1e4;

/// The scan pattern and the range of a kind of LiDAR, as a file describes them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LidarKindConfig {
    /// Name of the sensor.
    pub name: String,
    /// Where the numbers are published.
    pub source: String,
    /// Elevations of the layers at azimuth 0, without the mirror's contribution (deg): 1 to 128,
    /// from the lowest to the highest. Default: none; `beams` then gives the pattern.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers_deg: Vec<f64>,
    /// CSV file with the directions and times of all beams of a scan, in place of `layers-deg`, for
    /// a LiDAR that does not scan a raster; relative to the file with this key. Its first line is
    /// `azimuth_deg,elevation_deg,time_offset_us`. The azimuth is about the sensor's axis, positive
    /// to its left as it looks. The time counts from the beginning of the scan. Its contents become
    /// `beams` when the scenario is read. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beams_file: Option<String>,
    /// Rows of such a file: azimuth (deg), elevation (deg) and time (µs) of each beam. Default:
    /// none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beams: Option<Vec<[f64; 3]>>,
    /// Number of successive layers that share an azimuth shift: a divisor of the number of layers,
    /// which makes 4 groups or fewer. Default: all layers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers_per_group: Option<usize>,
    /// Azimuth shift between successive groups (deg). Default: 0.
    #[serde(default)]
    pub group_shift_deg: f64,
    /// Coefficients of 1, φ, φ² and φ³ of the elevation that one side of a two-sided mirror adds
    /// and the other subtracts (deg, with the azimuth φ in deg). Default: the sensor has no such
    /// mirror.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mirror_cubic_deg: Option<[f64; 4]>,
    /// Half of the horizontal field of view (deg): a whole number of azimuth steps, unless `beams`
    /// gives the pattern.
    pub half_field_deg: f64,
    /// Azimuth step (deg). With `beams`, the usual distance of beams that lie side by side: the
    /// processing derives from it what a beam may have missed.
    pub azimuth_step_deg: f64,
    /// Half of the field about the axis in which the steps are finer (deg). Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fine_half_field_deg: Option<f64>,
    /// Azimuth step in that field (deg). Default: `azimuth-step-deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fine_azimuth_step_deg: Option<f64>,
    /// Width of a beam's footprint (deg).
    pub beam_width_deg: f64,
    /// Height of a beam's footprint (deg).
    pub beam_height_deg: f64,
    /// Spacing of the layers near the horizon (deg). The processing derives from it what a beam may
    /// have missed.
    pub layer_spacing_deg: f64,
    /// Scans per second (Hz), at most 25. A rate that does not divide 25 gives scans at alternating
    /// distances of whole control steps of 40 ms.
    pub rate_hz: f64,
    /// Share of the period in which the field of view is swept (-). Default: the share of a head or
    /// a mirror that passes 360° of azimuth in each period.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep_share: Option<f64>,
    /// Range at which a target of `range-reflectivity` is detected with `range-probability` (m).
    pub range_m: f64,
    /// Reflectivity of that target (-).
    pub range_reflectivity: f64,
    /// Probability of its detection in one scan by a beam that it fills (-).
    pub range_probability: f64,
    /// Range beyond which nothing is reported (m). Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_range_m: Option<f64>,
    /// Standard deviation of the range of a strong return (m).
    pub range_sd_m: f64,
    /// Additional standard deviation of the range at the detection threshold (m).
    pub range_sd_at_threshold_m: f64,
}

/// The resolution of a scan, which the processing knows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resolution {
    pub(crate) columns: usize,
    pub(crate) layers: usize,
    /// Whether neighbouring columns lie side by side.
    pub(crate) is_raster: bool,
    /// Number of the first and of the last columns that lie at an end of the field of view.
    pub(crate) edge_columns: [usize; 2],
    /// Azimuth step outside of the fine field (rad).
    pub(crate) step_rad: f64,
    /// Half of the fine field (rad), and the step in it (rad).
    pub(crate) fine_rad: [f64; 2],
    /// Spacing of layers (rad).
    pub(crate) layer_rad: f64,
    /// Width and height of a footprint (rad).
    pub(crate) footprint_rad: [f64; 2],
    /// Tangent of the elevation up to which both mirror sides see.
    pub(crate) highest_tan: f64,
    /// Standard deviation of the range of a usual point (m).
    pub(crate) point_sd_m: f64,
    /// Height of the sensor's centre above the ground (m).
    pub(crate) mount_height_m: f64,
    /// Distance up to which the road may give returns (m).
    pub(crate) ground_reach_m: f32,
    /// Intensity of a return at the detection threshold from 1 m (1/m²). The intensity at the
    /// threshold grows with the square of the range.
    pub(crate) threshold_per_m2: f64,
}

impl Default for Resolution {
    /// Returns the resolution of the SCALA.
    fn default() -> Self {
        LidarModel::Scala2.kind().resolution
    }
}

/// A checked kind of LiDAR.
#[derive(Clone, Debug, PartialEq)]
pub struct LidarKind {
    /// Name of the sensor.
    pub name: String,
    pub(crate) layers_deg: Vec<f64>,
    pub(crate) layers_per_group: usize,
    pub(crate) group_shift_deg: f64,
    pub(crate) mirror_cubic_deg: Option<[f64; 4]>,
    /// Azimuth of each column (°).
    pub(crate) azimuths_deg: Vec<f64>,
    /// The beams of a LiDAR that does not scan a raster: each is a column of one layer.
    pub(super) table: Option<BeamTable>,
    pub(crate) half_field_deg: f64,
    /// Finest azimuth step (°).
    pub(crate) finest_step_deg: f64,
    /// Tangent of half of the field of view.
    pub(crate) half_field_tan: f64,
    pub(crate) beam_width_deg: f64,
    pub(crate) beam_height_deg: f64,
    /// Time from a scan to the next (ns).
    period_ns: i64,
    /// Duration of a sweep over the field of view (ns).
    pub(crate) sweep_ns: f64,
    /// Range at reflectivity 0.5 and probability 0.5 (m).
    pub(crate) nominal_range_m: f64,
    /// Range beyond which nothing is reported (m); infinite if there is no such bound.
    pub(crate) max_range_m: f32,
    /// Standard deviation of the range of a strong return, and what is added at the threshold (m).
    pub(crate) range_sd_m: [f32; 2],
    pub(crate) resolution: Resolution,
}

impl LidarKind {
    /// Returns the number of layers.
    pub(crate) fn layers(&self) -> usize {
        self.layers_deg.len()
    }

    /// Returns the number of groups of layers.
    pub(crate) fn groups(&self) -> usize {
        self.layers() / self.layers_per_group
    }

    /// Returns the number of beams in a scan.
    pub(crate) fn beams(&self) -> usize {
        self.azimuths_deg.len() * self.layers()
    }

    /// Returns the time from a scan to the next (s).
    pub(crate) fn period_s(&self) -> f64 {
        Time::from_ns(self.period_ns).s()
    }

    /// Returns whether a scan ends at the control step of `time`: whether a period has ended since
    /// the previous step.
    pub(crate) fn is_due(&self, time: Time) -> bool {
        let periods_at = |time_ns: i64| time_ns.div_euclid(self.period_ns);
        periods_at(time.ns()) != periods_at(time.ns() - CONTROL_STEP.ns())
    }

    /// Returns the mirror side of the scan that ends at `time`. The sides alternate from scan to
    /// scan.
    pub(crate) fn mirror_side_at(&self, time: Time) -> MirrorSide {
        if time.ns().div_euclid(self.period_ns) % 2 == 0 { MirrorSide::Plus } else { MirrorSide::Minus }
    }

    /// Returns the time after the scan's start at which a column at this azimuth is measured (s),
    /// clamped to the sweep. Without a raster, it is the mean time of the beams near this azimuth.
    pub(crate) fn sweep_offset_s(&self, azimuth_deg: f64) -> f64 {
        if let Some(table) = &self.table {
            return table.mean_offset_s(azimuth_deg);
        }
        let share = ((azimuth_deg + self.half_field_deg) / (2.0 * self.half_field_deg)).clamp(0.0, 1.0);
        share * self.sweep_ns * 1e-9
    }
}

impl LidarKindConfig {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// The message of the TOML reader.
    pub fn parse(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }

    /// Returns the same pattern with the table of beams that the text of its `beams-file` holds.
    ///
    /// # Errors
    /// [`BeamFileError`] with the line and the column that are wrong, and the allowed range.
    pub fn with_beams(self, text: &str) -> Result<Self, BeamFileError> {
        let beams = beam_table::read(text, self.beam_limits())?;
        Ok(Self { beams_file: None, beams: Some(beams), ..self })
    }

    /// Checks the keys, and returns the kind. The same keys always give the same reference.
    ///
    /// # Errors
    /// [`ConfigError`] for the first wrong key.
    pub fn kind(&self) -> Result<&'static LidarKind, ConfigError> {
        Ok(intern(self.check(&Parameters::default())?))
    }

    /// Returns the azimuths of all columns (°).
    fn azimuths_deg(&self) -> Result<Vec<f64>, ConfigError> {
        let step = number(self.azimuth_step_deg, "azimuth-step-deg", AZIMUTH_STEP_DEG)?;
        let half = self.checked_half_field_deg()?;
        let fine_half =
            number(self.fine_half_field_deg.unwrap_or(0.0), "fine-half-field-deg", Range::closed(0.0, half))?;
        let fine_step =
            number(self.fine_azimuth_step_deg.unwrap_or(step), "fine-azimuth-step-deg", Range::closed(0.02, step))?;
        let coarse = whole_steps(half - fine_half, step, "half-field-deg", "azimuth-step-deg")?;
        let fine = whole_steps(fine_half, fine_step, "fine-half-field-deg", "fine-azimuth-step-deg")?;
        let left = (0..coarse).map(|index| -half + f64::from(index) * step);
        let middle = (-fine..=fine).map(|index| f64::from(index) * fine_step);
        let right = (1..=coarse).map(|index| fine_half + f64::from(index) * step);
        Ok(left.chain(middle).chain(right).collect())
    }

    /// Returns the table of beams, if there is one.
    fn checked_table(&self) -> Result<Option<BeamTable>, ConfigError> {
        if self.beams_file.is_some() {
            let needed =
                "the contents of the file that `beams-file` names, which a scenario that is read from a file has";
            return Err(ConfigError::new("beams", Problem::Missing { needed }));
        }
        let Some(beams) = &self.beams else { return Ok(None) };
        let of_rasters = [
            (!self.layers_deg.is_empty(), "layers-deg"),
            (self.layers_per_group.is_some(), "layers-per-group"),
            (self.group_shift_deg != 0.0, "group-shift-deg"),
            (self.mirror_cubic_deg.is_some(), "mirror-cubic-deg"),
            (self.fine_half_field_deg.is_some(), "fine-half-field-deg"),
            (self.fine_azimuth_step_deg.is_some(), "fine-azimuth-step-deg"),
            (self.sweep_share.is_some(), "sweep-share"),
        ];
        if let Some((_, key)) = of_rasters.into_iter().find(|(is_given, _)| *is_given) {
            let rule = "a table of beams gives all directions and times".to_owned();
            return Err(ConfigError::new(key, Problem::Contradiction { other: "beams", rule }));
        }
        self.checked_half_field_deg()?;
        number(self.azimuth_step_deg, "azimuth-step-deg", AZIMUTH_STEP_DEG)?;
        BeamTable::new(beams, self.beam_limits()).map(Some)
    }

    fn beam_limits(&self) -> BeamLimits {
        BeamLimits { half_field_deg: self.half_field_deg, rate_hz: self.rate_hz }
    }

    fn checked_half_field_deg(&self) -> Result<f64, ConfigError> {
        number(self.half_field_deg, "half-field-deg", Range::closed(5.0, MAX_HALF_FIELD_DEG))
    }

    /// Returns the number of layers of a group.
    fn checked_group(&self) -> Result<usize, ConfigError> {
        let layers = self.layers_deg.len();
        let count = |value: usize, allowed| Problem::WrongCount { value: value as u64, allowed };
        if !(1..=MAX_LAYERS).contains(&layers) {
            return Err(ConfigError::new(
                "layers-deg",
                Problem::WrongLength { value: layers as u64, allowed: "1 to 128" },
            ));
        }
        let mut allowed = Range::closed(-MAX_ELEVATION_DEG, MAX_ELEVATION_DEG);
        for (index, &value) in self.layers_deg.iter().enumerate() {
            if !allowed.contains(value) {
                let problem = Problem::OutOfRange { value, allowed };
                let error = ConfigError { path: KeyPath::default(), problem };
                return Err(error.within_index(index).within("layers-deg"));
            }
            allowed = Range::above(value, MAX_ELEVATION_DEG);
        }
        let group = self.layers_per_group.unwrap_or(layers);
        if group == 0 || !layers.is_multiple_of(group) || layers / group > GROUPS {
            let allowed = "a divisor of the number of layers that makes 1 to 4 groups";
            return Err(ConfigError::new("layers-per-group", count(group, allowed)));
        }
        Ok(group)
    }

    /// Returns the nominal range (m).
    fn nominal_range_m(&self) -> Result<f64, ConfigError> {
        let range_m = number(self.range_m, "range-m", Range::closed(5.0, 500.0))?;
        let reflectivity = number(self.range_reflectivity, "range-reflectivity", Range::closed(0.01, 1.0))?;
        let probability = number(self.range_probability, "range-probability", Range::closed(0.5, 0.99))?;
        let above = match probability {
            0.5 => 0.0,
            _ => -SQRT_2 * erfc_inv(2.0 * probability),
        };
        let power = 1.0 + above / f64::from(THRESHOLD_OVER_NOISE);
        let nominal_m = range_m * (power * (NOMINAL_REFLECTIVITY / reflectivity)).sqrt();
        NOMINAL_RANGE_M.check(nominal_m, "range-m").map_err(|_| {
            let rule = format!("they give a nominal range of {nominal_m:.1} m, but it must be {NOMINAL_RANGE_M}");
            ConfigError::new("range-m", Problem::Contradiction { other: "range-reflectivity", rule })
        })
    }
}

fn number(value: f64, key: &str, range: Range) -> Result<f64, ConfigError> {
    Parameters::default().number(&Num::Fixed(value), key, range)
}

/// Returns how many steps fit into a field.
fn whole_steps(field_deg: f64, step_deg: f64, key: &str, field_key: &'static str) -> Result<i32, ConfigError> {
    let steps = field_deg / step_deg;
    if (steps - steps.round()).abs() > STEP_TOLERANCE {
        let rule = format!("{field_deg}° must be a whole number of steps of {step_deg}°, not {steps:.3}");
        return Err(ConfigError::new(key, Problem::Contradiction { other: field_key, rule }));
    }
    #[expect(clippy::cast_possible_truncation, reason = "at most 85° in steps of at least 0.02°")]
    Ok(steps.round() as i32)
}

impl Check for LidarKindConfig {
    type Checked = LidarKind;

    fn check(&self, _: &Parameters) -> Result<LidarKind, ConfigError> {
        let rate_hz = number(self.rate_hz, "rate-hz", Range::closed(1.0, 1.0 / CONTROL_STEP.s()))?;
        let table = self.checked_table()?;
        // A beam of a table is a column of one layer.
        let (layers_deg, layers_per_group, azimuths_deg) = match &table {
            Some(table) => (vec![0.0], 1, table.azimuths_deg.clone()),
            None => (self.layers_deg.clone(), self.checked_group()?, self.azimuths_deg()?),
        };
        let beams = azimuths_deg.len() * layers_deg.len();
        if beams > MAX_BEAMS {
            let (layers, columns) = (layers_deg.len(), azimuths_deg.len());
            let rule = format!("{layers} layers of {columns} beams are {beams}, and at most 65,535 are allowed");
            return Err(ConfigError::new("layers-deg", Problem::Contradiction { other: "azimuth-step-deg", rule }));
        }
        for coefficient in self.mirror_cubic_deg.iter().flatten() {
            number(*coefficient, "mirror-cubic-deg", Range::closed(-5.0, 5.0))?;
        }
        let half_field_deg = self.half_field_deg;
        let share = match self.sweep_share {
            Some(share) => number(share, "sweep-share", Range::above(0.0, 1.0))?,
            None => half_field_deg / 180.0,
        };
        #[expect(clippy::cast_possible_truncation, reason = "at most a second")]
        let period_ns = (1e9 / rate_hz).round() as i64;
        let degree = std::f64::consts::PI / 180.0;
        let fine_step_deg = self.fine_azimuth_step_deg.unwrap_or(self.azimuth_step_deg);
        let beam = Range::closed(0.01, 3.0);
        let spacing_deg = number(self.layer_spacing_deg, "layer-spacing-deg", Range::closed(0.02, 10.0))?;
        let [least_deg, most_deg] = mirror_bounds_deg(self.mirror_cubic_deg, &azimuths_deg);
        let top_deg = match &table {
            Some(table) => Some(table.elevation_bounds_deg()[1]),
            None => layers_deg.last().copied(),
        };
        // The other side of the mirror contributes the opposite.
        let highest_deg =
            top_deg.map_or(0.0, |layer_deg| layer_deg + 0.5 * self.beam_height_deg + least_deg.min(-most_deg));
        let edge_columns = match &table {
            Some(table) => table.edge_beams(half_field_deg, f64::from(EDGE_COLUMNS) * self.azimuth_step_deg),
            None => [usize::from(EDGE_COLUMNS); 2],
        };
        let resolution = Resolution {
            columns: azimuths_deg.len(),
            layers: layers_deg.len(),
            is_raster: table.is_none(),
            edge_columns,
            step_rad: self.azimuth_step_deg * degree,
            fine_rad: [self.fine_half_field_deg.unwrap_or(0.0) * degree, fine_step_deg * degree],
            layer_rad: spacing_deg * degree,
            footprint_rad: [self.beam_width_deg * degree, self.beam_height_deg * degree],
            highest_tan: (maths::tan(highest_deg.to_radians()) * HIGHEST_DECIMALS).round() / HIGHEST_DECIMALS,
            point_sd_m: (maths::hypot(self.range_sd_m, self.range_sd_at_threshold_m / USUAL_POWER) * SD_DECIMALS)
                .round()
                / SD_DECIMALS,
            mount_height_m: MOUNT_HEIGHT_M,
            ground_reach_m: GROUND_REACH_M,
            threshold_per_m2: 0.0,
        };
        #[expect(clippy::cast_possible_truncation, reason = "ranges need no more than single precision")]
        let single = |value: f64, key, range| number(value, key, range).map(|value| value as f32);
        Ok(LidarKind {
            name: self.name.clone(),
            layers_deg,
            layers_per_group,
            group_shift_deg: number(self.group_shift_deg, "group-shift-deg", Range::closed(0.0, 1.0))?,
            mirror_cubic_deg: self.mirror_cubic_deg,
            azimuths_deg,
            half_field_deg,
            finest_step_deg: fine_step_deg,
            half_field_tan: (maths::tan(half_field_deg.to_radians()) * TANGENT_DECIMALS).round() / TANGENT_DECIMALS,
            beam_width_deg: number(self.beam_width_deg, "beam-width-deg", beam)?,
            beam_height_deg: number(self.beam_height_deg, "beam-height-deg", beam)?,
            period_ns,
            // At the rate of the control loop, the product is a product of whole numbers.
            sweep_ns: match (&table, self.sweep_share) {
                (Some(table), _) => f64::from(table.duration_ns()),
                (None, None) => period_ns as f64 * half_field_deg / 180.0,
                (None, Some(_)) => period_ns as f64 * share,
            },
            table,
            nominal_range_m: self.nominal_range_m()?,
            max_range_m: match self.max_range_m {
                Some(max_range_m) => single(max_range_m, "max-range-m", Range::closed(5.0, 500.0))?,
                None => f32::INFINITY,
            },
            range_sd_m: [
                single(self.range_sd_m, "range-sd-m", Range::closed(0.0, 0.5))?,
                single(self.range_sd_at_threshold_m, "range-sd-at-threshold-m", Range::closed(0.0, 0.5))?,
            ],
            resolution,
        })
    }
}

/// Returns the one reference to this kind. A process sees few kinds, so that they are never
/// released.
fn intern(kind: LidarKind) -> &'static LidarKind {
    static KINDS: Mutex<Vec<&'static LidarKind>> = Mutex::new(Vec::new());
    let mut kinds = KINDS.lock().unwrap_or_else(PoisonError::into_inner);
    match kinds.iter().find(|interned| ***interned == kind) {
        Some(interned) => interned,
        None => {
            let kind: &'static LidarKind = Box::leak(Box::new(kind));
            kinds.push(kind);
            kind
        }
    }
}

/// Ratio T of the detection threshold to the standard deviation of the receiver's noise.
///
/// With T = 5, a scan of 10⁴ beams with 10² independent range cells each has a false alarm every
/// third time: a rate of 3·10⁻⁵ in each beam. Makers state 10⁻⁴, and that is the rate of
/// `false-alarm-rate`.
pub(crate) const THRESHOLD_OVER_NOISE: f32 = 5.0;

/// Reflectivity of the target that defines the nominal range.
pub(crate) const NOMINAL_REFLECTIVITY: f64 = 0.5;

#[cfg(test)]
mod tests;
