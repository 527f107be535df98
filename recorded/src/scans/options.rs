//! How a recording is read, and a scan of it.

use closecall_sensors::lidar::{MirrorSide, PointTimes, RecordedPoints};
use closecall_traffic::Time;

use super::error::{Origin, ScanFileProblem};

pub(super) const NS_PER_S: f64 = 1e9;

/// How a recording is read.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanOptions {
    /// The names of the LiDARs that look back.
    pub lidars: Vec<&'static str>,
    /// The name of the LiDAR that looks ahead, whose scans are left out.
    pub front: Option<&'static str>,
    /// Factor from the recorded intensities to reflectivities.
    pub intensity_scale: f32,
    /// Whether points are left out whose position is not finite or the origin: beams without a
    /// return.
    pub drops_invalid: bool,
    /// Whether the stamp of a scan is its start instead of its end.
    pub stamp_is_start: bool,
}

impl Default for ScanOptions {
    fn default() -> Self {
        Self { lidars: Vec::new(), front: None, intensity_scale: 1.0, drops_invalid: false, stamp_is_start: false }
    }
}

impl ScanOptions {
    /// Returns the number of the LiDAR with this name; `None` if it looks ahead.
    pub(super) fn sensor(&self, name: &str) -> Result<Option<usize>, ScanFileProblem> {
        match self.lidars.iter().position(|lidar| *lidar == name) {
            Some(sensor) => Ok(Some(sensor)),
            None if self.front == Some(name) => Ok(None),
            None => {
                let names: Vec<String> = self.lidars.iter().map(|lidar| format!("`{lidar}`")).collect();
                let allowed = format!("the LiDARs of the scenario, {},", names.join(", "));
                Err(ScanFileProblem::UnknownWord { text: name.to_owned(), allowed })
            }
        }
    }

    /// Returns the number of the only LiDAR, for a recording that names none.
    pub(super) fn only_sensor(&self) -> Result<usize, ScanFileProblem> {
        match &self.lidars[..] {
            [_] => Ok(0),
            several => {
                let needed = format!("`sensor`, with one of {}", several.join(", "));
                Err(ScanFileProblem::MissingColumn { name: "sensor", needed })
            }
        }
    }

    /// Returns the points with reflectivities, without those that have no return, and with the end
    /// of their scan if its stamp is the start.
    pub(super) fn prepared(&self, mut points: RecordedPoints) -> Result<RecordedPoints, ScanFileProblem> {
        points.intensity.iter_mut().flatten().for_each(|value| *value *= self.intensity_scale);
        if self.drops_invalid {
            let is_point = |point: usize| {
                let at_m = [0, 1, 2].map(|axis| points.at_m[axis][point]);
                at_m.iter().all(|value| value.is_finite()) && at_m.iter().any(|value| *value != 0.0)
            };
            let is_kept: Vec<bool> = (0..points.len()).map(is_point).collect();
            points.retain(&is_kept);
        }
        if self.stamp_is_start {
            let start_s = points.end.s();
            if let PointTimes::SinceStart(offset_ns) = &points.times {
                points.times =
                    PointTimes::Absolute(offset_ns.iter().map(|ns| start_s + f64::from(*ns) / NS_PER_S).collect());
            }
            let PointTimes::Absolute(times_s) = &points.times else { return Err(ScanFileProblem::NoEnd) };
            points.end = times_s.iter().map(|time_s| Time::from_s(*time_s)).max().unwrap_or(points.end);
        }
        Ok(points)
    }
}

/// Returns the side of a mirror from its name.
pub(super) fn mirror_side(name: Option<&str>) -> Result<MirrorSide, ScanFileProblem> {
    match name {
        None | Some("plus") => Ok(MirrorSide::Plus),
        Some("minus") => Ok(MirrorSide::Minus),
        Some(text) => {
            Err(ScanFileProblem::UnknownWord { text: text.to_owned(), allowed: "`plus` and `minus`".to_owned() })
        }
    }
}

/// A scan of a recording.
#[derive(Clone, Debug)]
pub struct TakenScan {
    /// Number of the LiDAR.
    pub sensor: usize,
    /// The place of the scan in the recording.
    pub origin: Origin,
    /// The points of the scan.
    pub points: RecordedPoints,
}
