//! What the scanner delivers, and, apart from it, the truth behind each point.

use closecall_traffic::Time;

use super::Material;

/// The side of the two-sided mirror that deflects a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MirrorSide {
    /// The side that lifts the layers: + in the pattern's formula.
    #[default]
    Plus,
    /// The side that lowers them.
    Minus,
}

/// One scan as a structure of arrays, all of the same length; one entry for each return.
///
/// Coordinates are in E's vehicle frame *at the scan's end*: E's own motion during the sweep, and its measured pitch,
/// are compensated. Others have moved meanwhile: a point is where its target was when it was measured.
/// A beam that is split gives two returns, the nearer first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LidarScan {
    /// When the first column was measured.
    pub start: Time,
    /// When the last column was measured; the coordinates hold for E's pose at this time.
    pub end: Time,
    /// Side of the mirror.
    pub mirror_side: MirrorSide,
    /// Where the sensor is, ahead of E's origin (m); negative, at the rear bumper.
    pub sensor_x_m: f32,
    /// Ahead of E (m); negative behind.
    pub x_m: Vec<f32>,
    /// To the left of E (m).
    pub y_m: Vec<f32>,
    /// Above the ground (m).
    pub z_m: Vec<f32>,
    /// Received power × range², as the reflectivity of a target that faces the sensor and fills the beam (dimensionless).
    pub intensity: Vec<f32>,
    /// Time of measurement after `start` (ns).
    pub offset_ns: Vec<u32>,
    /// Beam: column · 16 + layer.
    pub beam: Vec<u16>,
}

impl LidarScan {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.x_m.len()
    }

    /// True for a scan without a point.
    pub fn is_empty(&self) -> bool {
        self.x_m.is_empty()
    }

    /// Removes every point, keeping the memory.
    pub(crate) fn clear(&mut self) {
        self.x_m.clear();
        self.y_m.clear();
        self.z_m.clear();
        self.intensity.clear();
        self.offset_ns.clear();
        self.beam.clear();
    }
}

/// What a point truly comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointSource {
    /// A vehicle: its place in the scenario's list of actors.
    Actor(usize),
    /// The road's surface.
    Ground,
    /// A guard rail or one of its posts.
    GuardRail,
    /// Spray behind a vehicle.
    Spray,
    /// Droplets of fog or rain.
    Fog,
}

/// The truth of one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTruth {
    /// What it comes from.
    pub source: PointSource,
    /// What the surface is made of.
    pub material: Material,
    /// Distance from the sensor without noise (m).
    pub range_m: f32,
}

/// The truth behind each point of a scan, in the same order. No perception sees it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanTruth {
    /// One entry for each point.
    pub points: Vec<PointTruth>,
}
