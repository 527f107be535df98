//! The faults of the rear corner radars as a scenario file describes them.
//!
//! They are the faults of an object-level sensor that a sensor that delivers single detections can
//! have. For their sources see [`ObjectFaultConfig`](super::ObjectFaultConfig).

use closecall_traffic::{ConfigError, Num, Parameters, Range, Side};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::config::{SHARE, either, without_effect};
use super::list::{Combine, FaultList, check_span};
use super::sector::{MAX_SECTORS, Sectors, add_sectors, check_sector};

/// Azimuths of a blocked sector (deg): all directions.
const AZIMUTH_DEG: Range = Range::closed(-180.0, 180.0);
/// Share of the range that is left (-). A sensor without any is dead.
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
}

impl Default for RadarFault {
    fn default() -> Self {
        Self { side: None, is_dead: false, dropout: 0.0, blocked_deg: [None; MAX_SECTORS], range_share: 1.0 }
    }
}

impl RadarFault {
    /// Returns whether the radar sees nothing at this azimuth (deg).
    pub(crate) fn hides(&self, azimuth_deg: f64) -> bool {
        self.blocked_deg.iter().flatten().any(|[from, to]| (*from..=*to).contains(&azimuth_deg))
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
            // Of several entries, the entries of one radar hold together.
            side: self.side.or(other.side),
            is_dead: self.is_dead || other.is_dead,
            dropout: either(self.dropout, other.dropout),
            blocked_deg: add_sectors(self.blocked_deg, other.blocked_deg),
            range_share: self.range_share * other.range_share,
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
        FaultList::check(key, entries, |entry| entry.check(parameters))
    }

    fn check(&self, parameters: &Parameters) -> Result<(RadarFault, [f64; 2]), ConfigError> {
        let sector = [&self.blocked_from_deg, &self.blocked_to_deg];
        let fault = RadarFault {
            side: None,
            is_dead: self.dead,
            dropout: parameters.number_or(self.dropout.as_ref(), "dropout", SHARE, 0.0)?,
            blocked_deg: check_sector(sector, AZIMUTH_DEG, parameters)?,
            range_share: parameters.number_or(self.range_share.as_ref(), "range-share", RANGE_SHARE, 1.0)?,
        };
        let has_numbers = self.dropout.is_some() || self.range_share.is_some();
        if fault == RadarFault::default() && !has_numbers {
            return Err(without_effect());
        }
        Ok((RadarFault { side: self.side, ..fault }, check_span([&self.from_s, &self.until_s], parameters)?))
    }
}
