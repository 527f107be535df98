//! What one scan yields: boxes, each fitted to one cluster of points.
//!
//! The LiDAR looks back, so it sees the *front* face of a vehicle that follows in the lane, and one side of a vehicle
//! in a neighbouring lane. Faces that are not seen are filled in from the class's usual size: the faces that *are*
//! seen are what the tracker may trust, so a detection says which they are.

use closecall_traffic::{ClassScores, Time};

/// How far a face of a fitted box can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Both ends were seen: the extent is measured.
    Seen,
    /// Not wholly seen: the extent is filled in from usual sizes, and is at least what was seen.
    Assumed,
}

/// A box fitted to one cluster, in E's vehicle frame at the end of the scan: where the target was at `time`, seen from
/// where E is at the scan's end.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// The time that the position holds for: the points' mean time of measurement, E's motion compensated.
    pub time: Time,
    /// Middle of the box's face that is nearest to E, ahead of E [m]; negative behind.
    pub face_x_m: f64,
    /// Middle of that face, to the left of E [m].
    pub face_y_m: f64,
    /// Standard deviation of the face's position along the line of sight [m].
    pub range_sd_m: f64,
    /// Standard deviation of the face's position across the line of sight [m].
    pub lateral_sd_m: f64,
    /// Direction in which the vehicle points, relative to E's heading [rad], in ±π/2: E's own direction of travel.
    pub heading_rad: f64,
    /// Length of the box [m].
    pub length_m: f64,
    /// Whether the length was seen.
    pub length: Extent,
    /// Width of the box [m].
    pub width_m: f64,
    /// Whether the width was seen.
    pub width: Extent,
    /// Height of the highest point above the ground [m].
    pub top_m: f64,
    /// Number of points in the cluster.
    pub points: usize,
    /// Class scores from shape alone, or from the camera where one has looked.
    pub class: ClassScores,
}

impl Detection {
    /// The box's centre (x, y) in E's vehicle frame [m]: half a length behind the face that E sees, for one behind E.
    pub fn centre_m(&self) -> (f64, f64) {
        let away = if self.face_x_m < 0.0 { -0.5 } else { 0.5 } * self.length_m;
        let (sin, cos) = self.heading_rad.sin_cos();
        (self.face_x_m + away * cos, self.face_y_m + away * sin)
    }
}
