//! The faults of the LiDARs and the rear camera as a scenario file describes them, and the table of
//! all faults.
//!
//! Sources: the yaw of a mounted LiDAR can be measured to 0.1° in production (Kim et al. 2020,
//! arXiv 2008.10542), so a fault of the mounting means a residual of some tenths of a degree. All
//! other magnitudes are the scenario's choice.

use closecall_traffic::{CONTROL_STEP, ConfigError, Num, Parameters, Problem, Range, maths};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::list::{Combine, FaultList, check_span};
use super::object::ObjectFaultConfig;
use super::radar::RadarFaultConfig;
use super::sector::{MAX_SECTORS, Sectors, add_sectors, check_sector};
use crate::camera::CameraFault;
use crate::kept::kept;
use crate::lidar::MAX_HALF_FIELD_DEG;

/// Longest additional latency (s).
pub(super) const MAX_DELAY_S: f64 = 0.4;
/// Greatest share of measurements that can be lost.
pub(super) const SHARE: Range = Range::closed(0.0, 1.0);
/// Errors of the clock (s) and of the mounting (deg, m) that the model covers: of one entry, and of
/// the sum of all entries that hold at once.
pub(super) const CLOCK_OFFSET_S: Range = Range::closed(-0.2, 0.2);
pub(super) const ANGLE_DEG: Range = Range::closed(-5.0, 5.0);
const HEIGHT_M: Range = Range::closed(-0.2, 0.5);
/// Stray light in a camera relative to that in a healthy young eye: up to a hundred times, at which
/// one source veils the whole image.
const GLARE: Range = Range::closed(0.0, 100.0);

/// A fault of a LiDAR. It holds from `from-s` to `until-s`, with all effects that it names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct LidarFaultConfig {
    /// Time at which the fault begins (s). Default: before the start of the run.
    pub from_s: Option<Num>,
    /// Time at which the fault ends (s). Default: the end of the run.
    pub until_s: Option<Num>,
    /// Name of the LiDAR that has the fault. Default: each rear LiDAR, or the one that looks ahead.
    pub sensor: Option<String>,
    /// The sensor delivers nothing.
    pub dead: bool,
    /// The sensor delivers the points of its latest scan again and again, with new time stamps.
    pub frozen: bool,
    /// Share of scans that do not arrive (-).
    pub lost_frames: Option<Num>,
    /// Share of points that are lost, regardless of their power (-), in addition to the sensor's
    /// own `dropout`. Default: 0.
    pub dropout: Option<Num>,
    /// Azimuth at which a blocked sector begins (deg), within the LiDAR's field of view: 0 is
    /// straight behind, or straight ahead for the LiDAR that looks ahead; positive is to the ego's
    /// left.
    pub blocked_from_deg: Option<Num>,
    /// Azimuth at which the blocked sector ends (deg).
    pub blocked_to_deg: Option<Num>,
    /// Share of the light that dirt on the window transmits each way (-), in addition to the
    /// sensor's own `window-transmission`.
    pub window_transmission: Option<Num>,
    /// Additional latency of each scan (s).
    pub delay_s: Option<Num>,
    /// Greatest further latency of a scan, drawn anew for each (s). Scans arrive in their order.
    pub jitter_s: Option<Num>,
    /// Error of the time stamps (s): positive if a scan counts as measured later than it was.
    pub clock_offset_s: Option<Num>,
    /// Error of the mounting, unknown to the ego: rotation of the sensor about the vertical axis,
    /// to the left seen from above (deg). After calibration some tenths of a degree remain.
    pub yaw_deg: Option<Num>,
    /// Error of the mounting: upward tilt of the sensor's axis (deg).
    pub pitch_deg: Option<Num>,
    /// Error of the mounting: height of the sensor above the place at which the ego believes it
    /// (m).
    pub height_m: Option<Num>,
    /// Standard deviation of an additional error of each range (m).
    pub range_noise_m: Option<Num>,
    /// Share of the points on vehicles that return a second time as a mirror image behind a guard
    /// rail (-). It needs `guard-rails`. The images appear in the scan; the detector drops them,
    /// unless the map is wrong about where the road ends.
    pub rail_ghosts: Option<Num>,
    /// Mean number of bursts of false points in a scan, as pulses of another LiDAR cause them (-).
    pub crosstalk: Option<Num>,
    /// Half-width of the halo of false points around a saturated return of a registration plate
    /// (deg).
    pub blooming_deg: Option<Num>,
}

/// The effects of faults of a LiDAR at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LidarFault {
    /// Name of the sensor; `None` if each has the fault.
    pub(crate) sensor: Option<&'static str>,
    pub(crate) is_dead: bool,
    pub(crate) is_frozen: bool,
    pub(crate) lost_frames: f64,
    pub(crate) dropout: f64,
    /// Azimuths of blocked sectors, from the right to the left (deg).
    pub(crate) blocked_deg: Sectors,
    pub(crate) window_transmission: f64,
    pub(crate) delay_s: f64,
    pub(crate) jitter_s: f64,
    pub(crate) clock_offset_s: f64,
    pub(crate) yaw_rad: f64,
    pub(crate) pitch_rad: f64,
    pub(crate) height_m: f64,
    pub(crate) range_noise_m: f64,
    pub(crate) rail_ghosts: f64,
    pub(crate) crosstalk: f64,
    pub(crate) blooming_deg: f64,
}

impl Default for LidarFault {
    fn default() -> Self {
        Self {
            sensor: None,
            is_dead: false,
            is_frozen: false,
            lost_frames: 0.0,
            dropout: 0.0,
            blocked_deg: [None; MAX_SECTORS],
            window_transmission: 1.0,
            delay_s: 0.0,
            jitter_s: 0.0,
            clock_offset_s: 0.0,
            yaw_rad: 0.0,
            pitch_rad: 0.0,
            height_m: 0.0,
            range_noise_m: 0.0,
            rail_ghosts: 0.0,
            crosstalk: 0.0,
            blooming_deg: 0.0,
        }
    }
}

/// Returns the share that two independent losses cause together.
pub(super) fn either(a: f64, b: f64) -> f64 {
    1.0 - (1.0 - a) * (1.0 - b)
}

impl Combine for LidarFault {
    fn and(self, other: Self) -> Self {
        Self {
            // Only entries of the same sensor are combined; one of them may name the sensor.
            sensor: self.sensor.or(other.sensor),
            is_dead: self.is_dead || other.is_dead,
            is_frozen: self.is_frozen || other.is_frozen,
            lost_frames: either(self.lost_frames, other.lost_frames),
            dropout: either(self.dropout, other.dropout),
            blocked_deg: add_sectors(self.blocked_deg, other.blocked_deg),
            window_transmission: self.window_transmission * other.window_transmission,
            delay_s: self.delay_s + other.delay_s,
            jitter_s: self.jitter_s + other.jitter_s,
            clock_offset_s: self.clock_offset_s + other.clock_offset_s,
            yaw_rad: self.yaw_rad + other.yaw_rad,
            pitch_rad: self.pitch_rad + other.pitch_rad,
            height_m: self.height_m + other.height_m,
            range_noise_m: maths::hypot(self.range_noise_m, other.range_noise_m),
            rail_ghosts: either(self.rail_ghosts, other.rail_ghosts),
            crosstalk: self.crosstalk + other.crosstalk,
            blooming_deg: self.blooming_deg.max(other.blooming_deg),
        }
    }
}

impl LidarFault {
    /// Returns the fault in a scene turned by half a turn, in which the ego's left is on its right.
    /// Rotations keep their sense.
    pub(crate) fn turned(self) -> Self {
        Self { blocked_deg: self.blocked_deg.map(|sector| sector.map(|[from, to]| [-to, -from])), ..self }
    }

    /// Returns the additional latency in control steps, for a uniform random number of this scan.
    pub(crate) fn delay_steps(&self, uniform: f64) -> u64 {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to be at most some seconds"
        )]
        let steps = ((self.delay_s + uniform * self.jitter_s) / CONTROL_STEP.s()).round() as u64;
        steps
    }

    /// Returns whether the points of a scan differ from the points of a sensor without faults,
    /// apart from power and pose.
    pub(crate) fn changes_points(&self) -> bool {
        let amounts = [self.dropout, self.range_noise_m, self.rail_ghosts, self.crosstalk, self.blooming_deg];
        amounts.iter().any(|amount| *amount > 0.0) || self.blocked_deg.iter().any(Option::is_some)
    }
}

/// Returns the error of an entry that names no effect.
pub(super) fn without_effect() -> ConfigError {
    ConfigError::new("dead", Problem::Missing { needed: "an effect of the fault, such as `dead = true`" })
}

impl LidarFaultConfig {
    /// Checks the entries of `[[fault.rear-lidar]]` or `[[fault.front-lidar]]`.
    pub(crate) fn check_all(
        key: &str,
        entries: &[Self],
        parameters: &Parameters,
    ) -> Result<FaultList<LidarFault>, ConfigError> {
        let list = FaultList::check(key, entries, |entry| entry.check(parameters))?;
        // Entries of different sensors do not add up. Entries without a sensor add up with the
        // entries of each sensor. No sensor has the empty name: here it means all sensors that no
        // entry names.
        let lists = list.sensors().chain([""]).map(|sensor| list.of_sensor(sensor));
        for (index, sum) in lists.flat_map(|list| list.combinations().collect::<Vec<_>>()) {
            // A sum of allowed values may exceed its limit by rounding.
            let check = |value: f64, key, range: Range| range.check((1e9 * value).round() / 1e9, key).map(|_| ());
            check(sum.clock_offset_s, "clock-offset-s", CLOCK_OFFSET_S)
                .and_then(|()| check(sum.yaw_rad.to_degrees(), "yaw-deg", ANGLE_DEG))
                .and_then(|()| check(sum.pitch_rad.to_degrees(), "pitch-deg", ANGLE_DEG))
                .and_then(|()| check(sum.height_m, "height-m", HEIGHT_M))
                .map_err(|error| error.within_index(index).within(key))?;
        }
        Ok(list)
    }

    fn check(&self, parameters: &Parameters) -> Result<(LidarFault, [f64; 2]), ConfigError> {
        let number = |num: &Option<Num>, key, range| parameters.number_or(num.as_ref(), key, range, 0.0);
        let azimuth_deg = Range::closed(-MAX_HALF_FIELD_DEG, MAX_HALF_FIELD_DEG);
        let transmission =
            parameters.number_or(self.window_transmission.as_ref(), "window-transmission", SHARE, 1.0)?;
        let fault = LidarFault {
            sensor: None,
            is_dead: self.dead,
            is_frozen: self.frozen,
            lost_frames: number(&self.lost_frames, "lost-frames", SHARE)?,
            dropout: number(&self.dropout, "dropout", SHARE)?,
            blocked_deg: check_sector([&self.blocked_from_deg, &self.blocked_to_deg], azimuth_deg, parameters)?,
            window_transmission: transmission,
            delay_s: number(&self.delay_s, "delay-s", Range::closed(0.0, MAX_DELAY_S))?,
            jitter_s: number(&self.jitter_s, "jitter-s", Range::closed(0.0, MAX_DELAY_S))?,
            clock_offset_s: number(&self.clock_offset_s, "clock-offset-s", CLOCK_OFFSET_S)?,
            yaw_rad: number(&self.yaw_deg, "yaw-deg", ANGLE_DEG)?.to_radians(),
            pitch_rad: number(&self.pitch_deg, "pitch-deg", ANGLE_DEG)?.to_radians(),
            height_m: number(&self.height_m, "height-m", HEIGHT_M)?,
            range_noise_m: number(&self.range_noise_m, "range-noise-m", Range::closed(0.0, 5.0))?,
            rail_ghosts: number(&self.rail_ghosts, "rail-ghosts", SHARE)?,
            crosstalk: number(&self.crosstalk, "crosstalk", Range::closed(0.0, 50.0))?,
            blooming_deg: number(&self.blooming_deg, "blooming-deg", Range::closed(0.0, 5.0))?,
        };
        let Self { from_s, until_s, sensor, .. } = self.clone();
        if *self == (Self { from_s, until_s, sensor, ..Self::default() }) {
            return Err(without_effect());
        }
        let fault = LidarFault { sensor: self.sensor.as_deref().map(kept), ..fault };
        Ok((fault, check_span([&self.from_s, &self.until_s], parameters)?))
    }
}

/// A fault of a rear camera. It holds from `from-s` to `until-s`, with all effects that it names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct CameraFaultConfig {
    /// Time at which the fault begins (s). Default: before the start of the run.
    pub from_s: Option<Num>,
    /// Time at which the fault ends (s). Default: the end of the run.
    pub until_s: Option<Num>,
    /// Name of the camera that has the fault. Default: each rear camera.
    pub sensor: Option<String>,
    /// The camera delivers no image.
    pub dead: bool,
    /// The camera delivers its latest image again and again.
    pub frozen: bool,
    /// Stray light of the sun in the lens and on its window, relative to that in a healthy young
    /// eye (-): a veil that falls with the square of the angle to the sun
    /// (`sensors.rear-camera.sun`), and saturates the pixels near it. At 1, that is 4° around a sun
    /// on a clear day; at 3, 7°.
    pub sun_glare: Option<Num>,
    /// The same for the main beam of the nearest vehicle behind, at dusk and at night (-). At 1,
    /// the veil of a car's headlamps saturates 2.6 m to either side of them at night, at any
    /// distance up to 150 m.
    pub main_beam_glare: Option<Num>,
    /// Share of the lens that opaque dirt covers, in blots (-).
    pub dirt: Option<Num>,
    /// Standard deviation of the blur of an image that is out of focus (px).
    pub blur_px: Option<Num>,
}

impl CameraFaultConfig {
    /// Checks the entries of `[[fault.rear-camera]]`.
    pub(crate) fn check_all(
        key: &str,
        entries: &[Self],
        parameters: &Parameters,
    ) -> Result<FaultList<CameraFault>, ConfigError> {
        FaultList::check(key, entries, |entry| entry.check(parameters))
    }

    fn check(&self, parameters: &Parameters) -> Result<(CameraFault, [f64; 2]), ConfigError> {
        let number = |num: &Option<Num>, key, range| parameters.number_or(num.as_ref(), key, range, 0.0);
        let fault = CameraFault {
            sensor: self.sensor.as_deref().map(kept),
            is_dead: self.dead,
            is_frozen: self.frozen,
            sun_glare: number(&self.sun_glare, "sun-glare", GLARE)?,
            main_beam_glare: number(&self.main_beam_glare, "main-beam-glare", GLARE)?,
            dirt: number(&self.dirt, "dirt", SHARE)?,
            blur_px: number(&self.blur_px, "blur-px", Range::closed(0.0, 50.0))?,
        };
        let Self { from_s, until_s, sensor, .. } = self.clone();
        if *self == (Self { from_s, until_s, sensor, ..Self::default() }) {
            return Err(without_effect());
        }
        Ok((fault, check_span([&self.from_s, &self.until_s], parameters)?))
    }
}

impl Combine for CameraFault {
    fn and(self, other: Self) -> Self {
        Self {
            // As for LiDARs, only entries of the same sensor are combined.
            sensor: self.sensor.or(other.sensor),
            is_dead: self.is_dead || other.is_dead,
            is_frozen: self.is_frozen || other.is_frozen,
            sun_glare: self.sun_glare + other.sun_glare,
            main_beam_glare: self.main_beam_glare + other.main_beam_glare,
            dirt: either(self.dirt, other.dirt),
            blur_px: maths::hypot(self.blur_px, other.blur_px),
        }
    }
}

/// The lists of a scenario's table `[fault]` that concern the sensors.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaultEntries<'a> {
    /// `[[fault.rear-lidar]]`
    pub rear_lidar: &'a [LidarFaultConfig],
    /// `[[fault.front-lidar]]`
    pub front_lidar: &'a [LidarFaultConfig],
    /// `[[fault.rear-camera]]`
    pub rear_camera: &'a [CameraFaultConfig],
    /// `[[fault.front-radar]]`, `[[fault.surround]]` and `[[fault.rear-object]]`
    pub object: [&'a [ObjectFaultConfig]; 3],
    /// `[[fault.rear-radar]]`
    pub rear_radar: &'a [RadarFaultConfig],
    /// `[fault.odometry]`
    pub odometry: Option<&'a super::OdometryErrorConfig>,
}

impl FaultEntries<'_> {
    /// Checks all entries.
    ///
    /// # Errors
    /// [`ConfigError`] with the entry's key, if a value is out of its range, an entry names no
    /// effect, or there are more than four entries for a sensor.
    pub fn check(&self, parameters: &Parameters) -> Result<super::Faults, ConfigError> {
        let [front, surround, rear] = self.object;
        Ok(super::Faults {
            rear_lidar: LidarFaultConfig::check_all("rear-lidar", self.rear_lidar, parameters)?,
            front_lidar: LidarFaultConfig::check_all("front-lidar", self.front_lidar, parameters)?,
            rear_camera: CameraFaultConfig::check_all("rear-camera", self.rear_camera, parameters)?,
            front_radar: ObjectFaultConfig::check_all("front-radar", front, parameters)?,
            surround: ObjectFaultConfig::check_all("surround", surround, parameters)?,
            rear_object: ObjectFaultConfig::check_all("rear-object", rear, parameters)?,
            rear_radar: RadarFaultConfig::check_all("rear-radar", self.rear_radar, parameters)?,
            odometry: match self.odometry {
                Some(odometry) => odometry.check(parameters).map_err(|error| error.within("odometry"))?,
                None => super::OdometryErrors::default(),
            },
        })
    }
}
