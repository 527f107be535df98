//! The faults of the rear corner radars as a scenario file describes them.
//!
//! A rear radar has some of the faults of an object-level sensor.
//! [`ObjectFaultConfig`](super::ObjectFaultConfig) states their sources.

use closecall_traffic::{CONTROL_STEP, ConfigError, Num, Parameters, Range, Side};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::config::{ANGLE_DEG, MAX_DELAY_S, SHARE, either, without_effect};
use super::list::{Combine, FaultList, check_span};
use super::object::check_ghost;
use super::sector::{MAX_SECTORS, Sectors, add_sectors, check_sector};

/// Azimuths of a blocked sector (deg): all directions.
const AZIMUTH_DEG: Range = Range::closed(-180.0, 180.0);
/// Share of the range that is left (-). 0 is refused: a sensor without range has the fault `dead`.
const RANGE_SHARE: Range = Range::above(0.0, 1.0);

/// A fault of the rear radars. It holds from `from-s` to `until-s`, with all effects that it names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct RadarFaultConfig {
    /// Time at which the fault begins (s). Default: before the start of the run.
    pub from_s: Option<Num>,
    /// Time at which the fault ends (s). Default: the end of the run.
    pub until_s: Option<Num>,
    /// Side of the radar that has the fault. Default: both radars.
    pub side: Option<Side>,
    /// The radar delivers nothing.
    pub dead: bool,
    /// Share of the detections that are lost (-), in addition to those that
    /// `detection-probability` loses. Default: 0.
    pub dropout: Option<Num>,
    /// Azimuth at which a blocked sector begins (deg), within the field of view of the radars: 0 is
    /// straight behind, positive is to the ego's left.
    pub blocked_from_deg: Option<Num>,
    /// Azimuth at which the blocked sector ends (deg).
    pub blocked_to_deg: Option<Num>,
    /// Share of the range that dirt, ice or a film of water leaves (-). Default: 1.
    pub range_share: Option<Num>,
    /// Additional latency of each scan (s). Default: 0.
    pub delay_s: Option<Num>,
    /// Error of the mounting, unknown to the ego: rotation of the sensor about the vertical axis,
    /// to the left seen from above (deg). It moves what is seen; the field of view stays. Default:
    /// 0.
    pub yaw_deg: Option<Num>,
    /// Distance from the rear bumper of a detection without a vehicle, in the ego's lane, when the
    /// fault begins (m).
    pub ghost_gap_m: Option<Num>,
    /// Speed at which that detection approaches the ego (m/s). Default: 0.
    pub ghost_closing_mps: Option<Num>,
}

/// The effects of faults of a rear radar at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RadarFault {
    /// Side of the radar; `None` if both have the fault.
    pub(crate) side: Option<Side>,
    pub(crate) is_dead: bool,
    pub(crate) dropout: f64,
    /// Azimuths of blocked sectors, from the right to the left (deg).
    pub(crate) blocked_deg: Sectors,
    pub(crate) range_share: f64,
    pub(crate) delay_s: f64,
    pub(crate) yaw_rad: f64,
    /// Gap of the ghost when its fault begins (m), and the speed at which the gap closes (m/s).
    pub(crate) ghost: Option<[f64; 2]>,
}

impl Default for RadarFault {
    fn default() -> Self {
        Self {
            side: None,
            is_dead: false,
            dropout: 0.0,
            blocked_deg: [None; MAX_SECTORS],
            range_share: 1.0,
            delay_s: 0.0,
            yaw_rad: 0.0,
            ghost: None,
        }
    }
}

impl RadarFault {
    /// Returns whether the radar sees nothing at this azimuth (deg).
    pub(crate) fn hides(&self, azimuth_deg: f64) -> bool {
        self.blocked_deg.iter().flatten().any(|[from, to]| (*from..=*to).contains(&azimuth_deg))
    }

    /// Returns the additional latency in control steps.
    pub(crate) fn delay_steps(&self) -> u64 {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be at most some seconds"
        )]
        let steps = (self.delay_s / CONTROL_STEP.s()).round() as u64;
        steps
    }

    /// Returns the same fault with a blocked sector.
    #[cfg(test)]
    pub(crate) fn with_blocked(mut self, from_deg: f64, to_deg: f64) -> Self {
        self.blocked_deg[0] = Some([from_deg, to_deg]);
        self
    }
}

impl Combine for RadarFault {
    fn and(self, other: Self) -> Self {
        Self {
            // Only entries of the same radar are combined; one of them may name the side.
            side: self.side.or(other.side),
            is_dead: self.is_dead || other.is_dead,
            dropout: either(self.dropout, other.dropout),
            blocked_deg: add_sectors(self.blocked_deg, other.blocked_deg),
            range_share: self.range_share * other.range_share,
            delay_s: self.delay_s + other.delay_s,
            yaw_rad: self.yaw_rad + other.yaw_rad,
            ghost: other.ghost.or(self.ghost),
        }
    }
}

impl RadarFaultConfig {
    /// Checks the entries of `[[fault.rear-radar]]`.
    pub(crate) fn check_all(
        key: &str,
        entries: &[Self],
        parameters: &Parameters,
    ) -> Result<FaultList<RadarFault>, ConfigError> {
        let list = FaultList::check(key, entries, |entry| entry.check(parameters))?;
        // Each radar has sums of its own.
        for (index, sum) in
            [Side::Left, Side::Right].into_iter().flat_map(|side| list.of_side(side).combinations().collect::<Vec<_>>())
        {
            // A sum of allowed values may exceed its limit by rounding.
            let yaw_deg = (1e9 * sum.yaw_rad.to_degrees()).round() / 1e9;
            ANGLE_DEG.check(yaw_deg, "yaw-deg").map_err(|error| error.within_index(index).within(key))?;
        }
        Ok(list)
    }

    fn check(&self, parameters: &Parameters) -> Result<(RadarFault, [f64; 2]), ConfigError> {
        let sector = [&self.blocked_from_deg, &self.blocked_to_deg];
        let fault = RadarFault {
            side: None,
            is_dead: self.dead,
            dropout: parameters.number_or(self.dropout.as_ref(), "dropout", SHARE, 0.0)?,
            blocked_deg: check_sector(sector, AZIMUTH_DEG, parameters)?,
            range_share: parameters.number_or(self.range_share.as_ref(), "range-share", RANGE_SHARE, 1.0)?,
            delay_s: parameters.number_or(self.delay_s.as_ref(), "delay-s", Range::closed(0.0, MAX_DELAY_S), 0.0)?,
            yaw_rad: parameters.number_or(self.yaw_deg.as_ref(), "yaw-deg", ANGLE_DEG, 0.0)?.to_radians(),
            ghost: check_ghost([&self.ghost_gap_m, &self.ghost_closing_mps], parameters)?,
        };
        let Self { from_s, until_s, side, .. } = self.clone();
        if *self == (Self { from_s, until_s, side, ..Self::default() }) {
            return Err(without_effect());
        }
        Ok((RadarFault { side: self.side, ..fault }, check_span([&self.from_s, &self.until_s], parameters)?))
    }
}
