//! A detection: a box fitted to one cluster of points of one scan.
//!
//! The LiDAR looks back, so it sees the *front* face of a vehicle that follows in the lane, and one
//! side of a vehicle in a neighbouring lane. The extent of a face that is not seen is assumed from
//! the class's usual size. The tracker may trust measured extents only, so a detection says which
//! extents are measured.

use closecall_traffic::{ClassScores, Time, maths};

/// Distance by which mirrors and wheels may protrude from a vehicle's side (m).
pub const SIDE_PROTRUSION_M: f64 = 0.25;

/// Origin of one extent (length or width) of a fitted box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Measured: both ends are seen.
    Seen,
    /// Assumed: not both ends are seen. The extent is the class's usual one, or the seen part if
    /// that is larger.
    Assumed,
}

/// The part of a vehicle that a scan shows, relative to the middle of the detection's face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPart {
    /// Whether the field of view cuts off the vehicle's side, so that its nearest face is out of
    /// view. The face of the detection is then an assumption.
    pub is_cut: bool,
    /// Distances along the box's heading of the rearmost and of the foremost point (m), positive
    /// ahead of the face.
    pub along_m: [f64; 2],
    /// Distances across the box's heading of the rightmost and of the leftmost point (m), positive
    /// to the left.
    pub across_m: [f64; 2],
    /// Spacing of the columns on the side at the rearmost and at the foremost point (m), infinite
    /// if no side is seen.
    pub spacing_m: [f64; 2],
    /// The fronts of its wheels.
    pub wheels: WheelFronts,
}

/// The fronts of the wheels of a vehicle that a scan shows, from the first axle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelFronts {
    /// Distances along the box's heading ahead of the face (m).
    along_m: [f64; Self::MOST],
    count: usize,
}

impl WheelFronts {
    /// Greatest number of fronts: more are left out.
    pub const MOST: usize = 8;
    /// No wheels.
    pub(crate) const NONE: Self = Self { along_m: [0.0; Self::MOST], count: 0 };

    /// Adds the front of a wheel behind the others.
    pub(crate) fn add(&mut self, along_m: f64) {
        if let Some(free_m) = self.along_m.get_mut(self.count) {
            *free_m = along_m;
            self.count += 1;
        }
    }

    /// Returns the distances along the box's heading ahead of the face (m).
    pub fn along_m(&self) -> &[f64] {
        &self.along_m[..self.count]
    }

    /// Returns the same fronts, as distances from another point: `offset_m` is added to each.
    pub(crate) fn shifted(mut self, offset_m: f64) -> Self {
        self.along_m[..self.count].iter_mut().for_each(|along_m| *along_m += offset_m);
        self
    }
}

impl SeenPart {
    /// A face of unknown extent.
    pub const FACE: Self = Self {
        is_cut: false,
        along_m: [0.0; 2],
        across_m: [0.0; 2],
        spacing_m: [f64::INFINITY; 2],
        wheels: WheelFronts::NONE,
    };
}

/// The sensor that found a detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeenBy {
    /// The LiDAR, whose clusters confirm tracks.
    Lidar,
    /// The camera without the LiDAR. Such a detection keeps a track and corrects it, but counts
    /// towards no confirmation: its distance rests on a flat road.
    CameraAlone,
}

/// A box fitted to one cluster, in the ego's vehicle frame at the end of the scan.
///
/// The box shows where the target was at `time`, relative to where the ego is at the end of the
/// scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Time at which the position holds: the mean measurement time of the points, compensated for
    /// the ego's motion.
    pub time: Time,
    /// Position ahead of the ego of the middle of the box's nearest face (m); negative behind the
    /// ego.
    pub face_x_m: f64,
    /// Position to the left of the ego of the middle of that face (m).
    pub face_y_m: f64,
    /// Standard deviation of the face's position along the line of sight (m).
    pub range_sd_m: f64,
    /// Standard deviation of the face's position across the line of sight (m).
    pub lateral_sd_m: f64,
    /// Heading of the vehicle relative to the ego's (rad), within ±π/2: it is taken to travel in
    /// the ego's direction.
    pub heading_rad: f64,
    /// Length of the box (m).
    pub length_m: f64,
    /// Whether the length is measured or assumed.
    pub length: Extent,
    /// Width of the box (m).
    pub width_m: f64,
    /// Whether the width is measured or assumed.
    pub width: Extent,
    /// Height of the highest point above the ground (m).
    pub top_m: f64,
    /// The sensor that found it.
    pub seen_by: SeenBy,
    /// Number of points in the cluster.
    pub points: usize,
    /// Whether the seen parts are symmetric about the middle of the vehicle, as a plate or both
    /// headlamps are. Otherwise, a few points may be a part off the middle.
    pub is_centred: bool,
    /// The part of the vehicle that is seen.
    pub seen: SeenPart,
    /// Class scores from the box's shape, or from the camera if it has classified the box.
    pub class: ClassScores,
}

impl Detection {
    /// Returns the box's centre (x, y) in the ego's vehicle frame (m).
    ///
    /// The centre lies half a length farther from the ego than the nearest face.
    pub fn centre_m(&self) -> (f64, f64) {
        let away = if self.face_x_m < 0.0 { -0.5 } else { 0.5 } * self.length_m;
        let (sin, cos) = maths::sin_cos(self.heading_rad);
        (self.face_x_m + away * cos, self.face_y_m + away * sin)
    }
}
