//! The acceleration lane of a ramp: a lane on which vehicles enter the road, and which ends.
//!
//! ```text
//!   through lane     ── ── ── ── ── ── ── ── ── ── ── ── ── ── ── ── ── ── ── ── ──
//!                    ───────────────┬─ ── ── ── ── ── ── ── ┬─ ── ── ___________________
//!   entry lane         ramp         │    acceleration lane  │ taper /    paved shoulder
//!                    ───────────────┴───────────────────────┴──────/
//!                                from_m                   to_m   taper_end_m        s ──▶
//! ```
//!
//! It is one of the lanes of the road, at the edge opposite to the overtaking side. Before `from_m`
//! it is the ramp, which no vehicle leaves. A real ramp comes from the side; this one runs beside
//! the road. Behind `to_m` the lane narrows linearly, and a paved shoulder of the same width takes
//! its place. Guard rails and signs therefore stand in one line. The ground in the camera's images
//! has the markings of a full lane everywhere: a simplification.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Check, ConfigError, Num, Parameters, Range};

/// The acceleration lane of a ramp as a scenario file describes it: one of the lanes of the road, at
/// the edge opposite to the overtaking side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct AccelerationLaneConfig {
    /// Position along the road at which it begins (m). Before it, the lane is the ramp, which no
    /// vehicle leaves.
    pub from_m: Num,
    /// Length with the full width (m). Drivers leave the lane before its end, or stop there.
    pub length_m: Num,
    /// Length behind it over which the lane narrows to nothing (m).
    pub taper_m: Num,
}

/// A checked acceleration lane. The positions increase in the direction of traffic; on a reversed
/// road they decrease.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerationLane {
    /// Position at which the ramp ends, and from which vehicles may leave the lane (m).
    pub from_m: f64,
    /// Position at which the full width ends (m). No driver stays in the lane beyond it.
    pub to_m: f64,
    /// Position at which the lane has no width any more (m).
    pub taper_end_m: f64,
}

impl Check for AccelerationLaneConfig {
    type Checked = AccelerationLane;

    fn check(&self, parameters: &Parameters) -> Result<AccelerationLane, ConfigError> {
        let from_m = parameters.number(&self.from_m, "from-m", Range::closed(-10_000.0, 100_000.0))?;
        let to_m = from_m + parameters.number(&self.length_m, "length-m", AccelerationLane::LENGTH_M)?;
        let taper_m = parameters.number(&self.taper_m, "taper-m", AccelerationLane::TAPER_M)?;
        Ok(AccelerationLane { from_m, to_m, taper_end_m: to_m + taper_m })
    }
}

impl AccelerationLane {
    /// Lengths with the full width (m).
    pub const LENGTH_M: Range = Range::closed(50.0, 5_000.0);
    /// Lengths over which the lane narrows (m).
    pub const TAPER_M: Range = Range::closed(20.0, 1_000.0);

    /// Returns the share of its full width that the lane has at `s_m` (0 to 1).
    pub fn width_share(&self, s_m: f64) -> f64 {
        ((self.taper_end_m - s_m) / (self.taper_end_m - self.to_m)).clamp(0.0, 1.0)
    }

    /// Returns the same lane with other positions along the road (m).
    pub(crate) fn moved(self, to: impl Fn(f64) -> f64) -> Self {
        Self { from_m: to(self.from_m), to_m: to(self.to_m), taper_end_m: to(self.taper_end_m) }
    }
}
