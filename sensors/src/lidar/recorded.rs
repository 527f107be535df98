//! The points of a recorded scan, as the processing chain takes them.
//!
//! ```text
//!  points in the sensor's frame ─▶ mounting ─▶ motion of the ego ─┐
//!  points in the ego's frame ─────────────────────────────────────┴─▶ beams, times ─▶ LidarScan
//! ```
//!
//! The recording of a run states every value, so that the scan has the same bits as the simulated
//! one. What the recording of a real sensor lacks follows from the pattern of the scenario's LiDAR:
//! the beam from the direction of the point, and the time from the azimuth.

use closecall_traffic::{Time, maths};
use nalgebra::{Rotation3, Vector3};

use super::ground::ground_reach_m;
use super::pattern::Pattern;
use super::power::LinkBudget;
use super::power::MAX_INTENSITY;
use super::viewpoint::{deskew, sensor_position_m, turned_axes};
use super::{Lidar, LidarScan, MirrorSide, ScanEchoes};
use closecall_traffic::Environment;

/// Distance from which on no LiDAR has a return (m): the largest `max-range-m` of a pattern.
const FARTHEST_M: f64 = 500.0;

/// Intensity of the points of a sensor that records none (assumption): neither a droplet nor a
/// registration plate.
const UNKNOWN_INTENSITY: f32 = 0.3;
/// Time before the end of a scan at which a point may have been measured, at most (s): the period
/// of the slowest sensor that the model covers.
const LONGEST_SCAN_S: f64 = 1.0;
/// Time by which a point may be measured after the end of its scan (s): the rounding of a stamp.
const STAMP_ROUNDING_S: f64 = 1e-3;
/// Distance by which the pitch of the ego moves a sensor along, at most (m). Assumption: a pitch of
/// 0.3 rad at 3 m above the ground.
const LARGEST_PITCH_SHIFT_M: f32 = 1.0;
/// Number of columns on either side that are compared with the direction of a point, because the
/// groups of layers are shifted.
const SHIFTED_COLUMNS: usize = 4;
const NS_PER_S: f64 = 1e9;

/// The frame of recorded points, in metres. Both have x ahead, y to the left and z up (REP 103 of
/// ROS).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointFrame {
    /// The ego's: the origin is on the ground below the ego's centre, at the end of the scan. The
    /// motion of the ego within the scan is compensated.
    #[default]
    Ego,
    /// The sensor's: x is its viewing axis. The origin moves with the sensor.
    Sensor,
}

/// The times at which the points of a scan were measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum PointTimes {
    /// The recording does not say.
    #[default]
    Unknown,
    /// Times after the start of the sweep (ns).
    SinceStart(Vec<u32>),
    /// Times on the clock of the recording (s).
    Absolute(Vec<f64>),
}

/// The points of a recorded scan. All lists have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedPoints {
    /// Time at which the scan ends.
    pub end: Time,
    /// Side of the mirror that deflected the scan.
    pub mirror_side: MirrorSide,
    /// Positions x, y and z (m).
    pub at_m: [Vec<f32>; 3],
    /// Intensities, as reflectivities; `None` if the sensor records none.
    pub intensity: Option<Vec<f32>>,
    /// Times of measurement.
    pub times: PointTimes,
    /// Beams, as column · layers + layer; `None` if the recording does not say.
    pub beam: Option<Vec<u16>>,
    /// Position of the sensor ahead of the ego's centre (m) by the measured pitch of the ego;
    /// `None` for a level ego.
    pub sensor_x_m: Option<f32>,
}

/// A point that cannot be used. Points are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PointError {
    /// A value is not finite.
    #[error("point {point} has {quantity} = {value}, but a finite number is needed")]
    NotFinite {
        /// The point.
        point: usize,
        /// The quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// An intensity is negative.
    #[error("point {point} has intensity = {value}, but a number of 0 or more is needed")]
    Intensity {
        /// The point.
        point: usize,
        /// Its intensity.
        value: f32,
    },
    /// The LiDAR of the scenario has no such beam.
    #[error(
        "point {point} has the beam {beam}, but the LiDAR `{lidar}` of the scenario has the beams 0 to {last}: name the \
         scenario whose LiDAR has recorded the scan"
    )]
    Beam {
        /// The point.
        point: usize,
        /// Its beam.
        beam: u16,
        /// Name of the LiDAR.
        lidar: &'static str,
        /// The last beam of its pattern.
        last: usize,
    },
    /// Most points lie where the LiDAR cannot see: their frame or their unit is another.
    #[error(
        "{unseen} of {points} points lie behind the LiDAR `{lidar}` of the scenario, or more than {FARTHEST_M} m from it: metres \
         are needed, in the frame of the ego or else of the sensor"
    )]
    Frame {
        /// Number of these points.
        unseen: usize,
        /// Number of all points of the scan.
        points: usize,
        /// Name of the LiDAR.
        lidar: &'static str,
    },
    /// A point was measured outside of its scan.
    #[error(
        "point {point} was measured {before_s} s before the end of its scan, but a time from 0 to 1 s before it is needed"
    )]
    Time {
        /// The point.
        point: usize,
        /// Time from the point to the end of the scan (s).
        before_s: f64,
    },
    /// The recording and the scenario have the sensor at two places.
    #[error(
        "`sensor_x_m` is {sensor_x_m}, but the LiDAR `{lidar}` of the scenario is at {mounted_x_m} m: name the scenario whose \
         LiDAR has recorded the scan"
    )]
    SensorPlace {
        /// Place of the sensor ahead of the ego's centre in the recording (m).
        sensor_x_m: f32,
        /// The same in the scenario (m).
        mounted_x_m: f32,
        /// Name of the LiDAR.
        lidar: &'static str,
    },
}

/// The motion of the ego at the end of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScanMotion {
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Yaw rate, positive to the left (rad/s).
    pub yaw_rate_radps: f64,
}

/// The place of a LiDAR on an ego.
#[derive(Clone, Copy, Debug)]
struct Mounting {
    sensor_m: Vector3<f64>,
    sensor_from_ego: Rotation3<f64>,
}

impl Mounting {
    fn new(lidar: &Lidar, ego_length_m: f64) -> Self {
        let back_m = 0.5 * ego_length_m - lidar.inset_m;
        Self {
            sensor_m: sensor_position_m([back_m, lidar.left_m, lidar.mount_height_m], 0.0),
            sensor_from_ego: turned_axes(lidar, 0.0),
        }
    }
}

impl RecordedPoints {
    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.at_m[0].len()
    }

    /// Returns true if the scan has no points.
    pub fn is_empty(&self) -> bool {
        self.at_m[0].is_empty()
    }

    /// Removes the points for which `is_kept` is false.
    pub fn retain(&mut self, is_kept: &[bool]) {
        fn keep<T>(values: &mut Vec<T>, is_kept: &[bool]) {
            let mut flags = is_kept.iter();
            values.retain(|_| flags.next().copied().unwrap_or(true));
        }
        self.at_m.iter_mut().for_each(|values| keep(values, is_kept));
        if let Some(values) = &mut self.intensity {
            keep(values, is_kept);
        }
        if let Some(values) = &mut self.beam {
            keep(values, is_kept);
        }
        match &mut self.times {
            PointTimes::Unknown => {}
            PointTimes::SinceStart(values) => keep(values, is_kept),
            PointTimes::Absolute(values) => keep(values, is_kept),
        }
    }

    /// Returns the scan that this LiDAR has recorded on an ego of a length (m), and the number of
    /// points that lie outside of its field of view and are left out. There are none of these if
    /// the recording states the beams.
    ///
    /// # Errors
    /// [`PointError`] for the first point that cannot be used.
    pub(crate) fn into_scan(
        mut self,
        lidar: &Lidar,
        frame: PointFrame,
        ego_length_m: f64,
        motion: ScanMotion,
    ) -> Result<(LidarScan, usize), PointError> {
        self.check(lidar)?;
        let mounting = Mounting::new(lidar, ego_length_m);
        let pattern = Pattern::shared(lidar.kind);
        let mut outside = 0;
        let seen_m = |point: usize| {
            let at_m = Vector3::from(std::array::from_fn(|axis| f64::from(self.at_m[axis][point])));
            match frame {
                PointFrame::Sensor => at_m,
                PointFrame::Ego => mounting.sensor_from_ego * (at_m - mounting.sensor_m),
            }
        };
        let is_unseen = |at_m: &Vector3<f64>| at_m.x < 0.0 || at_m.norm() > FARTHEST_M;
        let unseen = (0..self.len()).map(seen_m).filter(is_unseen).count();
        if 2 * unseen > self.len() {
            return Err(PointError::Frame { unseen, points: self.len(), lidar: lidar.name() });
        }
        if self.beam.is_none() {
            let towards = |point: usize| beam_towards(&seen_m(point), pattern, self.mirror_side);
            let beams: Vec<Option<u16>> = (0..self.len()).map(towards).collect();
            let is_seen: Vec<bool> = beams.iter().map(Option::is_some).collect();
            outside = beams.len() - beams.iter().flatten().count();
            self.retain(&is_seen);
            self.beam = Some(beams.into_iter().flatten().collect());
        }
        let beam = self.beam.take().unwrap_or_default();
        let (start, offset_ns) = self.start_and_offsets(lidar, pattern, &beam);
        if frame == PointFrame::Sensor {
            self.turn_to_ego_frame(&mounting, motion, start, &offset_ns);
        }
        let mut resolution = lidar.kind.resolution;
        resolution.mount_height_m = lidar.mount_height_m;
        resolution.ground_reach_m = ground_reach_m(lidar);
        resolution.threshold_per_m2 = match &self.intensity {
            Some(_) => 1.0 / f64::from(LinkBudget::new(lidar, &Environment::CLEAR_DAY).gain_m2),
            // No intensity tells where an edge lies within a beam.
            None => f64::INFINITY,
        };
        let count = self.len();
        #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
        let sensor_m = [mounting.sensor_m.x as f32, mounting.sensor_m.y as f32];
        let sensor_x_m = self.sensor_x_m.unwrap_or(sensor_m[0]);
        if !((sensor_x_m - sensor_m[0]).abs() <= LARGEST_PITCH_SHIFT_M) {
            return Err(PointError::SensorPlace { sensor_x_m, mounted_x_m: sensor_m[0], lidar: lidar.name() });
        }
        let [x_m, y_m, z_m] = self.at_m;
        let scan = LidarScan {
            start,
            end: self.end,
            mirror_side: self.mirror_side,
            sensor_x_m,
            sensor_y_m: sensor_m[1],
            axis_azimuth_rad: lidar.azimuth_rad,
            resolution,
            x_m,
            y_m,
            z_m,
            intensity: match self.intensity {
                Some(values) => behind_clean_window(values, lidar.window_transmission),
                None => vec![UNKNOWN_INTENSITY; count],
            },
            offset_ns,
            beam,
            echoes: ScanEchoes::default(),
        };
        Ok((scan, outside))
    }

    fn check(&self, lidar: &Lidar) -> Result<(), PointError> {
        let named = ["x", "y", "z"].into_iter().zip(&self.at_m);
        for (quantity, values) in named.chain(self.intensity.as_ref().map(|values| ("intensity", values))) {
            if let Some((point, value)) = values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
                return Err(PointError::NotFinite { point, quantity, value: f64::from(*value) });
            }
        }
        let negative = self.intensity.iter().flatten().enumerate().find(|(_, value)| **value < 0.0);
        if let Some((point, &value)) = negative {
            return Err(PointError::Intensity { point, value });
        }
        let last = lidar.kind.beams() - 1;
        let wrong = self.beam.iter().flatten().enumerate().find(|(_, beam)| usize::from(**beam) > last);
        if let Some((point, &beam)) = wrong {
            return Err(PointError::Beam { point, beam, lidar: lidar.name(), last });
        }
        let sweep_s = lidar.kind.sweep_ns / NS_PER_S;
        let before_s: Vec<f64> = match &self.times {
            PointTimes::Unknown => Vec::new(),
            PointTimes::SinceStart(offset_ns) => {
                offset_ns.iter().map(|&ns| sweep_s - f64::from(ns) / NS_PER_S).collect()
            }
            PointTimes::Absolute(times_s) => times_s.iter().map(|time_s| self.end.s() - time_s).collect(),
        };
        let is_outside = |before_s: &f64| !(-STAMP_ROUNDING_S..=LONGEST_SCAN_S).contains(before_s);
        match before_s.iter().position(is_outside) {
            Some(point) => Err(PointError::Time { point, before_s: before_s[point] }),
            None => Ok(()),
        }
    }

    /// Returns the start of the scan and the time of each point after it (ns). A sweep of the
    /// pattern ends with the scan; a point before it makes the scan longer.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1 s")]
    fn start_and_offsets(&mut self, lidar: &Lidar, pattern: &Pattern, beam: &[u16]) -> (Time, Vec<u32>) {
        let start = self.end - Time::from_ns(lidar.kind.sweep_ns as i64);
        match std::mem::take(&mut self.times) {
            PointTimes::SinceStart(offset_ns) => (start, offset_ns),
            PointTimes::Unknown => {
                let columns = beam.iter().map(|&beam| usize::from(beam) / lidar.kind.layers());
                (start, columns.map(|column| pattern.columns[column].offset_ns).collect())
            }
            PointTimes::Absolute(times_s) => {
                let since_ns = |start: Time, time_s: f64| ((time_s - start.s()) * NS_PER_S).round();
                let earliest_ns = times_s.iter().map(|&time_s| since_ns(start, time_s)).fold(0.0, f64::min);
                let start = start + Time::from_ns(earliest_ns as i64);
                (start, times_s.iter().map(|&time_s| since_ns(start, time_s).max(0.0) as u32).collect())
            }
        }
    }

    /// Moves the points from the sensor's frame when they were measured to the ego's frame at the
    /// end of the scan.
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    fn turn_to_ego_frame(&mut self, mounting: &Mounting, motion: ScanMotion, start: Time, offset_ns: &[u32]) {
        let ego_from_sensor = mounting.sensor_from_ego.inverse();
        for (point, &offset_ns) in offset_ns.iter().enumerate() {
            let seen_m = Vector3::from(std::array::from_fn(|axis| f64::from(self.at_m[axis][point])));
            let then_m = ego_from_sensor * seen_m + mounting.sensor_m;
            let before_end_s = (self.end - start).s() - f64::from(offset_ns) / NS_PER_S;
            let to = deskew([motion.speed_mps, motion.yaw_rate_radps], before_end_s);
            let now_m = [
                to.cos * then_m.x - to.sin * then_m.y + to.x_m,
                to.sin * then_m.x + to.cos * then_m.y + to.y_m,
                then_m.z,
            ];
            for (axis, at_m) in now_m.into_iter().enumerate() {
                self.at_m[axis][point] = at_m as f32;
            }
        }
    }
}

/// Returns the intensities that a clean window would give. The scenario states the share of the
/// light that the window of the sensor transmits each way.
#[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
fn behind_clean_window(mut intensities: Vec<f32>, window_transmission: f64) -> Vec<f32> {
    if window_transmission > 0.0 && window_transmission < 1.0 {
        let share = (window_transmission * window_transmission) as f32;
        intensities.iter_mut().for_each(|value| *value = (*value / share).min(MAX_INTENSITY));
    }
    intensities
}

/// Returns the beam whose centre is nearest to a direction in the sensor's frame; `None` if the
/// direction is outside of the field of view.
fn beam_towards(seen_m: &Vector3<f64>, pattern: &Pattern, mirror_side: MirrorSide) -> Option<u16> {
    let (kind, layers) = (pattern.kind(), pattern.kind().layers());
    let azimuth_deg = maths::atan2(seen_m.y, seen_m.x).to_degrees();
    let elevation_rad = maths::atan2(seen_m.z, maths::hypot(seen_m.x, seen_m.y));
    let shift_deg = kind.group_shift_deg * (kind.groups() - 1) as f64;
    if !(azimuth_deg >= -kind.half_field_deg - kind.finest_step_deg
        && azimuth_deg <= kind.half_field_deg + shift_deg + kind.finest_step_deg)
    {
        return None;
    }
    if let Some(table) = &kind.table {
        return table.nearest([azimuth_deg, elevation_rad.to_degrees()]);
    }
    let columns = &kind.azimuths_deg;
    let near = columns.partition_point(|column_deg| *column_deg < azimuth_deg).min(columns.len() - 1);
    let beam_of = |column: usize, layer: usize| u16::try_from(column * layers + layer).ok();
    let direction_rad = |column: usize, layer: usize| match beam_of(column, layer) {
        Some(beam) => pattern.direction_rad(mirror_side, beam),
        None => (f64::INFINITY, f64::INFINITY),
    };
    let elevation_error = |layer: usize| (direction_rad(near, layer).1 - elevation_rad).abs();
    let layer = (0..layers).min_by(|&a, &b| elevation_error(a).total_cmp(&elevation_error(b)))?;
    let azimuth_error = |column: usize| (direction_rad(column, layer).0 - azimuth_deg.to_radians()).abs();
    let columns = near.saturating_sub(SHIFTED_COLUMNS + 1)..(near + SHIFTED_COLUMNS).min(columns.len());
    let column = columns.min_by(|&a, &b| azimuth_error(a).total_cmp(&azimuth_error(b)))?;
    beam_of(column, layer)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scan of three points of the standard LiDAR, in its own frame: 20 m away, ahead of it, to
    /// its left, and out of its field of view.
    fn points() -> RecordedPoints {
        let (sin, cos) = maths::sin_cos(0.5_f64);
        #[expect(clippy::cast_possible_truncation, reason = "a test")]
        let at_m = [vec![20.0, (20.0 * cos) as f32, 0.0], vec![0.0, (20.0 * sin) as f32, 20.0], vec![0.1; 3]];
        RecordedPoints { end: Time::from_ms(120), at_m, ..RecordedPoints::default() }
    }

    #[test]
    fn a_point_in_the_sensor_s_frame_is_behind_the_ego_and_has_the_beam_of_its_direction() {
        let lidar = Lidar::default();
        let (scan, outside) = points().into_scan(&lidar, PointFrame::Sensor, 4.6, ScanMotion::default()).unwrap();
        assert_eq!((scan.len(), outside), (2, 1));
        assert!((scan.x_m[0] + 22.3).abs() < 1e-5 && scan.y_m[0].abs() < 1e-5 && (scan.z_m[0] - 0.7).abs() < 1e-5);
        // The left of a sensor that looks back is the right of the ego.
        assert!(scan.y_m[1] < -9.0);
        let pattern = Pattern::shared(lidar.kind);
        for (point, azimuth_rad) in [(0, 0.0), (1, 0.5)] {
            let (of_beam_rad, _) = pattern.direction_rad(MirrorSide::Plus, scan.beam[point]);
            assert!((of_beam_rad - azimuth_rad).abs() <= lidar.kind.finest_step_deg.to_radians(), "{of_beam_rad}");
        }
        assert!(scan.offset_ns[0] < scan.offset_ns[1], "the sweep goes to the ego's right");
        assert!(scan.resolution.threshold_per_m2.is_infinite(), "no intensity tells where an edge lies");
    }

    #[test]
    fn the_motion_of_the_ego_moves_a_point_by_its_age() {
        let times = PointTimes::Absolute(vec![0.02, 0.12, 0.12]);
        let moving = ScanMotion { speed_mps: 30.0, yaw_rate_radps: 0.0 };
        let (scan, _) =
            RecordedPoints { times, ..points() }.into_scan(&Lidar::default(), PointFrame::Sensor, 4.6, moving).unwrap();
        // In 0.1 s the ego has driven 3 m away from the first point.
        assert!((scan.x_m[0] + 25.3).abs() < 1e-4, "{}", scan.x_m[0]);
        assert_eq!((scan.start, scan.offset_ns[0]), (Time::from_ms(20), 0));
    }

    #[test]
    fn a_scan_in_another_frame_or_unit_is_refused() {
        let lidar = Lidar::default();
        let scan = |at_m: [[f32; 2]; 3], frame| {
            let points =
                RecordedPoints { at_m: at_m.map(Vec::from), beam: Some(vec![0, 1]), intensity: None, ..points() };
            points.into_scan(&lidar, frame, 4.6, ScanMotion::default()).map(|(scan, _)| scan.len())
        };
        let behind = [[-20.0, -30.0], [0.0, 1.0], [0.5, 0.5]];
        let ahead = [[20.0, 30.0], [0.0, 1.0], [0.0, 0.0]];
        assert_eq!(scan(behind, PointFrame::Ego), Ok(2));
        assert_eq!(scan(ahead, PointFrame::Sensor), Ok(2));
        let millimetres = behind.map(|values| values.map(|value| 1000.0 * value));
        let half = [[20.0, -30.0], [0.0, 1.0], [0.5, 0.5]];
        assert_eq!(scan(half, PointFrame::Ego), Ok(2));
        for (at_m, frame) in [(behind, PointFrame::Sensor), (ahead, PointFrame::Ego), (millimetres, PointFrame::Ego)] {
            let message = scan(at_m, frame).unwrap_err().to_string();
            assert!(message.starts_with("2 of 2 points lie behind the LiDAR `rear-lidar`"), "{message}");
        }
    }

    #[test]
    fn a_value_that_is_not_finite_a_foreign_beam_and_a_time_outside_of_the_scan_are_refused() {
        let refused = |points: RecordedPoints| {
            let result = points.into_scan(&Lidar::default(), PointFrame::Ego, 4.6, ScanMotion::default());
            result.map(drop).unwrap_err().to_string()
        };
        let mut wrong = points();
        wrong.at_m[1][2] = f32::NAN;
        assert!(refused(wrong).starts_with("point 2 has y = NaN, but"));
        let error = refused(RecordedPoints { beam: Some(vec![0, 65_000, 0]), ..points() });
        assert!(error.starts_with("point 1 has the beam 65000, but the LiDAR `rear-lidar`"), "{error}");
        let error = refused(RecordedPoints { times: PointTimes::Absolute(vec![0.1, 0.2, 0.1]), ..points() });
        assert!(error.starts_with("point 1 was measured -0.08") && error.contains("0 to 1 s"), "{error}");
        let error = refused(RecordedPoints { times: PointTimes::SinceStart(vec![0, 0, 1_000_000_000]), ..points() });
        assert!(error.starts_with("point 2 was measured -0.9"), "{error}");
    }

    #[test]
    fn a_sensor_that_is_not_where_the_scenario_has_it_is_refused() {
        let placed = |sensor_x_m: f32| {
            let points = RecordedPoints { sensor_x_m: Some(sensor_x_m), ..points() };
            points.into_scan(&Lidar::default(), PointFrame::Sensor, 4.6, ScanMotion::default()).map(drop)
        };
        assert_eq!(placed(-2.28), Ok(()));
        for wrong in [f32::NAN, f32::INFINITY, -2000.0, 2.3] {
            let error = placed(wrong).unwrap_err().to_string();
            assert!(error.contains("`sensor_x_m`") && error.contains("of the scenario is at -2.3 m"), "{error}");
        }
    }
}
