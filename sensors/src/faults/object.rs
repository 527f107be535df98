//! The faults of the object-level sensors as a scenario file describes them.
//!
//! They are the faults of a LiDAR that a sensor that delivers tracks can have. Sources: dirt, ice
//! or a film of water on a radar attenuates each way, and by the radar equation the range is
//! proportional to the fourth root of the power: 6 dB each way halve it. For the angle of the
//! mounting see [`LidarFaultConfig`](super::LidarFaultConfig). All magnitudes are the scenario's
//! choice.

use closecall_traffic::{ConfigError, Num, Parameters, Problem, Range, maths};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::config::{ANGLE_DEG, CLOCK_OFFSET_S, MAX_DELAY_S, SHARE, either, without_effect};
use super::list::{Combine, FaultList, check_span};
use super::sector::{MAX_SECTORS, Sectors, add_sectors, check_sector};

/// Azimuths of a blocked sector (deg): all directions.
const AZIMUTH_DEG: Range = Range::closed(-180.0, 180.0);
/// Share of the range that is left (-). A sensor without any is dead.
const RANGE_SHARE: Range = Range::above(0.0, 1.0);
/// Standard deviations of additional errors of a position (m) and a speed (m/s).
const NOISE_M: Range = Range::closed(0.0, 5.0);
const NOISE_MPS: Range = Range::closed(0.0, 10.0);

/// A fault of an object-level sensor. It holds from `from-s` to `until-s`, with all effects that it
/// names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct ObjectFaultConfig {
    /// Time at which the fault begins (s). Default: before the start of the run.
    pub from_s: Option<Num>,
    /// Time at which the fault ends (s). Default: the end of the run.
    pub until_s: Option<Num>,
    /// The sensor delivers nothing.
    pub dead: bool,
    /// The sensor delivers its latest tracks again and again, with new time stamps.
    pub frozen: bool,
    /// Share of scans that do not arrive (-): no vehicle is measured in them. Default: 0.
    pub lost_frames: Option<Num>,
    /// Share of the measurements of visible vehicles that are lost (-), in addition to the sensor's
    /// own `dropout`. Default: 0.
    pub dropout: Option<Num>,
    /// Azimuth at which a blocked sector begins (deg), within the sensor's field of view: 0 is
    /// straight ahead for the front radar, and straight behind for the other sensors; positive is
    /// to the ego's left. A vehicle is hidden if less than a quarter of it is free.
    pub blocked_from_deg: Option<Num>,
    /// Azimuth at which the blocked sector ends (deg).
    pub blocked_to_deg: Option<Num>,
    /// Share of the range that dirt, ice or a film of water leaves (-). By the radar equation, 6 dB
    /// each way leave a half. Default: 1.
    pub range_share: Option<Num>,
    /// Additional latency (s). No sensor is later than 0.4 s. Default: 0.
    pub delay_s: Option<Num>,
    /// Greatest further latency of a scan, drawn anew for each (s). Scans arrive in their order.
    /// Default: 0.
    pub jitter_s: Option<Num>,
    /// Error of the time stamps (s): positive if a scan counts as measured later than it was.
    /// Default: 0.
    pub clock_offset_s: Option<Num>,
    /// Error of the mounting, unknown to the ego: rotation of the sensor about the vertical axis,
    /// to the left seen from above (deg). It moves what is seen; the field of view stays. Default:
    /// 0.
    pub yaw_deg: Option<Num>,
    /// Standard deviation of an additional error of each measured position along the road (m).
    /// Default: 0.
    pub range_noise_m: Option<Num>,
    /// Standard deviation of an additional error of each measured position across the road (m).
    /// Default: 0.
    pub lateral_noise_m: Option<Num>,
    /// Standard deviation of an additional error of each measured speed (m/s), of a sensor that
    /// measures speed. Default: 0.
    pub speed_noise_mps: Option<Num>,
    /// Distance of a track without a vehicle, in the ego's lane, when the fault begins (m): ahead
    /// of the ego for the front radar, behind it for the other sensors.
    pub ghost_gap_m: Option<Num>,
    /// Speed at which that track approaches the ego (m/s). Default: 0.
    pub ghost_closing_mps: Option<Num>,
}

/// Checks gap (m) and closing speed (m/s) of a ghost: a vehicle that does not exist.
pub(super) fn check_ghost(
    [gap, closing]: [&Option<Num>; 2],
    parameters: &Parameters,
) -> Result<Option<[f64; 2]>, ConfigError> {
    let closing_mps = parameters.number_or(closing.as_ref(), "ghost-closing-mps", Range::closed(-30.0, 30.0), 0.0)?;
    match gap {
        Some(gap) => Ok(Some([parameters.number(gap, "ghost-gap-m", Range::closed(0.0, 200.0))?, closing_mps])),
        None if closing.is_some() => {
            let problem = Problem::Missing { needed: "the gap of the track that approaches" };
            Err(ConfigError::new("ghost-gap-m", problem))
        }
        None => Ok(None),
    }
}

/// The effects of faults of an object-level sensor at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ObjectFault {
    pub(crate) is_dead: bool,
    pub(crate) is_frozen: bool,
    pub(crate) lost_frames: f64,
    pub(crate) dropout: f64,
    /// Azimuths of blocked sectors, from the right to the left (deg).
    pub(crate) blocked_deg: Sectors,
    pub(crate) range_share: f64,
    pub(crate) delay_s: f64,
    pub(crate) jitter_s: f64,
    pub(crate) clock_offset_s: f64,
    pub(crate) yaw_rad: f64,
    /// Standard deviations of the additional noise of a position along and across the road (m).
    pub(crate) noise_m: [f64; 2],
    pub(crate) speed_noise_mps: f64,
    /// Gap of the ghost when its fault begins (m), and the speed at which the gap closes (m/s).
    pub(crate) ghost: Option<[f64; 2]>,
}

impl Default for ObjectFault {
    fn default() -> Self {
        Self {
            is_dead: false,
            is_frozen: false,
            lost_frames: 0.0,
            dropout: 0.0,
            blocked_deg: [None; MAX_SECTORS],
            range_share: 1.0,
            delay_s: 0.0,
            jitter_s: 0.0,
            clock_offset_s: 0.0,
            yaw_rad: 0.0,
            noise_m: [0.0; 2],
            speed_noise_mps: 0.0,
            ghost: None,
        }
    }
}

impl Combine for ObjectFault {
    fn and(self, other: Self) -> Self {
        let [along_m, across_m] = self.noise_m;
        Self {
            is_dead: self.is_dead || other.is_dead,
            is_frozen: self.is_frozen || other.is_frozen,
            lost_frames: either(self.lost_frames, other.lost_frames),
            dropout: either(self.dropout, other.dropout),
            blocked_deg: add_sectors(self.blocked_deg, other.blocked_deg),
            range_share: self.range_share * other.range_share,
            delay_s: self.delay_s + other.delay_s,
            jitter_s: self.jitter_s + other.jitter_s,
            clock_offset_s: self.clock_offset_s + other.clock_offset_s,
            yaw_rad: self.yaw_rad + other.yaw_rad,
            noise_m: [maths::hypot(along_m, other.noise_m[0]), maths::hypot(across_m, other.noise_m[1])],
            speed_noise_mps: maths::hypot(self.speed_noise_mps, other.speed_noise_mps),
            ghost: other.ghost.or(self.ghost),
        }
    }
}

impl ObjectFaultConfig {
    /// Checks the entries of one object-level sensor.
    pub(crate) fn check_all(
        key: &str,
        entries: &[Self],
        parameters: &Parameters,
    ) -> Result<FaultList<ObjectFault>, ConfigError> {
        let list = FaultList::check(key, entries, |entry| entry.check(parameters))?;
        for (index, sum) in list.combinations() {
            // A sum of allowed values may exceed its limit by rounding.
            let check = |value: f64, key, range: Range| range.check((1e9 * value).round() / 1e9, key).map(|_| ());
            check(sum.clock_offset_s, "clock-offset-s", CLOCK_OFFSET_S)
                .and_then(|()| check(sum.yaw_rad.to_degrees(), "yaw-deg", ANGLE_DEG))
                .map_err(|error| error.within_index(index).within(key))?;
        }
        Ok(list)
    }

    fn check(&self, parameters: &Parameters) -> Result<(ObjectFault, [f64; 2]), ConfigError> {
        let number = |num: &Option<Num>, key, range| parameters.number_or(num.as_ref(), key, range, 0.0);
        let fault = ObjectFault {
            is_dead: self.dead,
            is_frozen: self.frozen,
            lost_frames: number(&self.lost_frames, "lost-frames", SHARE)?,
            dropout: number(&self.dropout, "dropout", SHARE)?,
            blocked_deg: check_sector([&self.blocked_from_deg, &self.blocked_to_deg], AZIMUTH_DEG, parameters)?,
            range_share: parameters.number_or(self.range_share.as_ref(), "range-share", RANGE_SHARE, 1.0)?,
            delay_s: number(&self.delay_s, "delay-s", Range::closed(0.0, MAX_DELAY_S))?,
            jitter_s: number(&self.jitter_s, "jitter-s", Range::closed(0.0, MAX_DELAY_S))?,
            clock_offset_s: number(&self.clock_offset_s, "clock-offset-s", CLOCK_OFFSET_S)?,
            yaw_rad: number(&self.yaw_deg, "yaw-deg", ANGLE_DEG)?.to_radians(),
            noise_m: [
                number(&self.range_noise_m, "range-noise-m", NOISE_M)?,
                number(&self.lateral_noise_m, "lateral-noise-m", NOISE_M)?,
            ],
            speed_noise_mps: number(&self.speed_noise_mps, "speed-noise-mps", NOISE_MPS)?,
            ghost: check_ghost([&self.ghost_gap_m, &self.ghost_closing_mps], parameters)?,
        };
        let Self { from_s, until_s, .. } = self.clone();
        if *self == (Self { from_s, until_s, ..Self::default() }) {
            return Err(without_effect());
        }
        Ok((fault, check_span([&self.from_s, &self.until_s], parameters)?))
    }
}
