//! The scanner's output: a scan, and separately the ground truth of each of its points.

use closecall_traffic::Time;
use serde::{Deserialize, Serialize};

use super::Material;
use super::kind::Resolution;

/// The side of the two-sided mirror that deflects the beams of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MirrorSide {
    /// The side that raises the layers: + in the pattern's formula.
    #[default]
    Plus,
    /// The side that lowers the layers: − in the pattern's formula.
    Minus,
}

/// A LiDAR scan as a structure of arrays. All arrays have the same length: one entry for each
/// return.
///
/// Coordinates are in the ego's vehicle frame *at the scan's end*: the ego's motion during the
/// sweep and its measured pitch are compensated. The motion of other vehicles is not: a point lies
/// where its target was when the point was measured. A beam that is split by an edge gives two
/// returns, the nearer one first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LidarScan {
    /// Time at which the first column was measured.
    pub start: Time,
    /// Time at which the last column was measured. The coordinates refer to the ego's pose at this
    /// time.
    pub end: Time,
    /// Side of the mirror that deflected this scan.
    pub mirror_side: MirrorSide,
    /// Longitudinal position of the sensor in the ego's frame (m): negative, because it is in the
    /// rear bumper.
    pub sensor_x_m: f32,
    /// Lateral position of the sensor in the ego's frame, positive to the left (m).
    pub sensor_y_m: f32,
    /// Azimuth of the sensor's axis (rad): 0 is straight behind, positive to the ego's left.
    pub axis_azimuth_rad: f64,
    /// Columns and layers of the pattern.
    pub(crate) resolution: Resolution,
    /// Longitudinal position of each point (m), negative behind the ego's origin.
    pub x_m: Vec<f32>,
    /// Lateral position of each point (m), positive to the left.
    pub y_m: Vec<f32>,
    /// Height of each point above the ground (m).
    pub z_m: Vec<f32>,
    /// Intensity of each point: received power × range², scaled to the reflectivity of a target
    /// that faces the sensor and fills the beam, as if the window were clean.
    pub intensity: Vec<f32>,
    /// Time of measurement of each point after `start` (ns).
    pub offset_ns: Vec<u32>,
    /// Beam of each point, as column · layers + layer.
    pub beam: Vec<u16>,
    /// What the sensor reports of the echo of each point. Empty unless the scan is complete (see
    /// [`RearLidar::completed`](super::RearLidar::completed)): the processing chain does not read
    /// it.
    pub echoes: ScanEchoes,
}

/// What a sensor reports of the echoes of a complete scan: one entry for each return.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanEchoes {
    /// Whether the entries are written.
    pub(crate) are_noted: bool,
    /// Echo pulse width of each point: the time for which its echo exceeds the detection threshold
    /// (ns).
    pub pulse_width_ns: Vec<f32>,
    /// Intensity of each point as a sensor reports it that does not know the state of its window:
    /// the two-way transmission of the window is in it.
    pub intensity: Vec<f32>,
}

impl ScanEchoes {
    /// Appends the echo of a point, by its width (ns) and its intensity, if entries are written.
    #[inline(always)]
    pub(crate) fn note(&mut self, echo: impl FnOnce() -> [f32; 2]) {
        if self.are_noted {
            let [width_ns, intensity] = echo();
            self.pulse_width_ns.push(width_ns);
            self.intensity.push(intensity);
        }
    }

    /// Copies the entry of the point `from` to the point `to`.
    pub(crate) fn copy(&mut self, from: usize, to: usize) {
        if self.are_noted {
            self.pulse_width_ns[to] = self.pulse_width_ns[from];
            self.intensity[to] = self.intensity[from];
        }
    }

    /// Keeps the first entries alone.
    pub(crate) fn truncate(&mut self, points: usize) {
        self.pulse_width_ns.truncate(points);
        self.intensity.truncate(points);
    }
}

impl LidarScan {
    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.x_m.len()
    }

    /// Returns true if the scan has no points.
    pub fn is_empty(&self) -> bool {
        self.x_m.is_empty()
    }

    /// Creates a scan without points, with memory for so many.
    pub(crate) fn with_capacity(points: usize) -> Self {
        let [x_m, y_m, z_m, intensity] = std::array::from_fn(|_| Vec::with_capacity(points));
        let (offset_ns, beam) = (Vec::with_capacity(points), Vec::with_capacity(points));
        Self { x_m, y_m, z_m, intensity, offset_ns, beam, ..Self::default() }
    }

    /// Removes all points but keeps the allocated memory.
    pub(crate) fn clear(&mut self) {
        self.x_m.clear();
        self.y_m.clear();
        self.z_m.clear();
        self.intensity.clear();
        self.offset_ns.clear();
        self.beam.clear();
        self.echoes.truncate(0);
    }
}

/// The object that a point originates from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointSource {
    /// A vehicle, given by its index in the scenario's list of actors.
    Actor(usize),
    /// The road's surface.
    Ground,
    /// A guard rail or one of its posts.
    GuardRail,
    /// A sign, a gantry or a tree beside the road.
    Roadside,
    /// Spray behind a vehicle.
    Spray,
    /// Droplets of fog or rain.
    Fog,
    /// Nothing: a false alarm, or a fault of the sensor.
    False,
}

impl PointSource {
    /// Returns the name of the kind of object.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Actor(_) => "actor",
            Self::Ground => "ground",
            Self::GuardRail => "guard-rail",
            Self::Roadside => "roadside",
            Self::Spray => "spray",
            Self::Fog => "fog",
            Self::False => "false",
        }
    }
}

/// The beam of a point, and the measurement of the sensor along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointBeam {
    /// Index of the column, in the order of the sweep.
    pub column: u16,
    /// Index of the layer, from the lowest.
    pub layer: u16,
    /// Azimuth of the beam's centre about the sensor's vertical axis, from its viewing axis,
    /// counter-clockwise seen from above (rad).
    pub azimuth_rad: f64,
    /// Elevation of the beam's centre (rad).
    pub elevation_rad: f64,
    /// Measured range (m).
    pub range_m: f32,
}

/// The ground truth of one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTruth {
    /// Object that the point originates from.
    pub source: PointSource,
    /// Material of the surface.
    pub material: Material,
    /// True distance from the sensor, without noise (m).
    pub range_m: f32,
}

/// The ground truth of the points of a scan, in the same order. The processing chain has no access
/// to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanTruth {
    /// Ground truth of each point.
    pub points: Vec<PointTruth>,
}
