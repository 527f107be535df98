//! The fit of a box to each cluster, based on the faces that the sensor sees.
//!
//! ```text
//!            ┌ ─ ─ ─ ─ ─ ─ ─ ─ ─ ┐              u: along the vehicle, forward
//!            :                   ┃ front face   v: across the vehicle, to its left
//!            :                   ┃ (seen)
//!            └━━━━━━━━━━━━━━━━━━━┛ ─▶ u         ━ seen,  ─ assumed from the class's typical size
//!              side face (seen if the vehicle is beside the sensor's axis)
//! ```
//!
//! The heading of a box is the direction of the road, which the ego knows and which vehicles on a
//! motorway follow. If enough of a side is seen, the heading is refined about that direction by the
//! closeness criterion of L-shape fitting (Zhang, Xu, Dong and Dolan 2017, "Efficient L-shape
//! fitting for vehicle detection using laser scanners").

use crate::tracking::MAX_SIDE_AZIMUTH_RAD;
use closecall_traffic::maths;

use super::edges::{Edges, edges};
use super::kind::Resolution;
use super::power::MAX_INTENSITY;
use super::{LaneGeometry, LidarScan};

const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// One point in this many may lie ahead of the front face because of noise.
const POINTS_PER_STRAY: usize = 20;
/// Depth within which points count as lying on the front face (m).
const FACE_DEPTH_M: f64 = 0.2;
/// Margin for rounding (m).
const ROUNDING_M: f64 = 1e-6;
/// Length of the visible side from which the heading is refined (m).
const REFINE_LENGTH_M: f64 = 2.5;
/// Number of points from which the heading is refined.
const REFINE_POINTS: usize = 30;
/// Number of headings that are tried on each side of the road's direction.
const HEADINGS: i32 = 6;
/// Spacing of these headings (rad).
const HEADING_STEP_RAD: f64 = 1.0 * DEGREE;
/// Standard deviation of headings about the road's direction (rad; assumption). A lateral speed of
/// 3.5 m/s at 100 km/h, for comparison, is 7°.
const HEADING_SD_RAD: f64 = 2.5 * DEGREE;
/// Maximum distance from a side that counts in the closeness criterion (m). Points farther away
/// carry no information.
const MAX_CLOSENESS_M: f64 = 0.5;
/// Azimuth from straight behind beyond which a cluster seen by a turned sensor may extend past the
/// selected points (rad): 2° less than the azimuth of the selection.
const SIDE_EDGE_RAD: f64 = MAX_SIDE_AZIMUTH_RAD - 2.0 * DEGREE;
/// Spacing of columns up to which the edges need not be found within a column (m): then they are
/// known to a millimetre or two.
const FINE_SPACING_M: f64 = 0.01;
/// Maximum number of points that are used to try headings.
const REFINE_MAX_POINTS: usize = 80;

/// The visible extent of a cluster, in the frame of its own box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoxFit {
    /// Heading of the box relative to the ego's heading (rad).
    pub(crate) heading_rad: f64,
    /// Position u of the front face along the box's heading, from the ego's origin (m).
    pub(crate) front_u_m: f64,
    /// Least position u of the points (m): the rearmost point of the vehicle that is seen.
    pub(crate) rear_u_m: f64,
    /// Least and greatest position v across the box's heading (m).
    pub(crate) across_m: [f64; 2],
    /// Where the edges lie within their columns, if the powers of the beams tell it.
    pub(crate) edges: Option<Edges>,
    /// Least and greatest position v of the points on a retro-reflector (m), which saturate the
    /// receiver; `None` if there is none.
    pub(crate) plate_m: Option<[f64; 2]>,
    /// Height of the highest point (m).
    pub(crate) top_m: f64,
    /// Height of the lowest point (m).
    pub(crate) bottom_m: f64,
    /// Height of the lowest point on the front face (m).
    pub(crate) front_bottom_m: f64,
    /// Mean intensity of the points, as a reflectivity.
    pub(crate) intensity: f64,
    /// Number of points.
    pub(crate) points: usize,
    /// Number of points on the front face.
    pub(crate) front_points: usize,
    /// Mean time of measurement of the points after the scan's start (ns).
    pub(crate) offset_ns: f64,
    /// Horizontal distance of the nearest point from the sensor (m).
    pub(crate) range_m: f64,
    /// Spacing of columns at that distance, across the line of sight (m).
    pub(crate) spacing_m: f64,
    /// Width of a beam's footprint (columns).
    pub(crate) footprint_columns: f64,
    /// Height up to which the sensor sees at that distance (m).
    pub(crate) in_view_m: f64,
    /// Standard deviation of the range of a usual point (m).
    pub(crate) point_sd_m: f64,
    /// Spacing of layers, and height of a footprint (rad).
    pub(crate) vertical_rad: [f64; 2],
    /// Position of the sensor to the left of the ego's centre line (m).
    pub(crate) sensor_y_m: f64,
    /// Least and greatest azimuth of the points from straight behind the sensor, positive to the
    /// ego's left (rad).
    pub(crate) azimuth_rad: [f64; 2],
    /// Whether the right and the left edge of the cluster are truncated by the field of view.
    ///
    /// This follows from the columns of the points. The azimuth would be wrong: the ego moves on
    /// after it measures a column. At the scan's end, the azimuth of a near point differs from the
    /// azimuth of its beam.
    pub(crate) truncated: [bool; 2],
}

impl BoxFit {
    /// Fits a box to the points of a cluster. `members` are their indices in the scan, at least
    /// one.
    pub(crate) fn new(members: &[u32], scan: &LidarScan, lane: &LaneGeometry) -> Self {
        let (empty, mean_x) = Self::without_extent(members, scan);
        let road_rad = lane.direction_rad(mean_x);
        let refined = || empty.with_heading(refined_heading_rad(road_rad, members, scan), members, scan);
        let has_many = members.len() >= REFINE_POINTS;
        if has_many && has_long_side(road_rad, members, scan) {
            return refined();
        }
        let fit = empty.with_heading(road_rad, members, scan);
        let side_seen = fit.front_u_m - fit.rear_u_m > REFINE_LENGTH_M;
        if side_seen && has_many { refined() } else { fit }
    }

    /// Returns true if the box is so far to one side of the sensor's axis that one of its sides is
    /// visible.
    pub(super) fn sees_side(&self) -> bool {
        self.azimuth_rad[0] > 0.0 || self.azimuth_rad[1] < 0.0
    }

    /// Returns true if a side of the box faces the sensor: its outermost points then do not belong
    /// to the front.
    fn shows_flank(&self) -> bool {
        self.azimuth_rad[0] > -self.heading_rad || self.azimuth_rad[1] < -self.heading_rad
    }

    /// Returns the box with a given heading, from the values that do not depend on it.
    fn with_heading(self, heading_rad: f64, members: &[u32], scan: &LidarScan) -> Self {
        let (sin, cos) = maths::sin_cos(heading_rad);
        let mut fit = Self { heading_rad, ..self };
        let (sensor_x, sensor_y) = (f64::from(scan.sensor_x_m), f64::from(scan.sensor_y_m));
        let mut nearest = LargestValues::default();
        let (mut far, mut squares) = (f64::INFINITY, f64::INFINITY);
        let mut slopes = [f64::INFINITY, f64::NEG_INFINITY];
        for &member in members {
            let [x, y, z] = point(scan, member);
            let (u, v) = (x * cos + y * sin, y * cos - x * sin);
            nearest.insert(u, members.len() / POINTS_PER_STRAY);
            far = lesser(far, u);
            fit.across_m = [lesser(fit.across_m[0], v), greater(fit.across_m[1], v)];
            if scan.intensity[member as usize] >= MAX_INTENSITY {
                let [right, left] = fit.plate_m.unwrap_or([v; 2]);
                fit.plate_m = Some([right.min(v), left.max(v)]);
            }
            fit.top_m = greater(fit.top_m, z);
            fit.bottom_m = lesser(fit.bottom_m, z);
            // All points are behind the sensor, so the slope increases with the azimuth.
            let slope = (y - sensor_y) / (sensor_x - x);
            slopes = [lesser(slopes[0], slope), greater(slopes[1], slope)];
            squares = lesser(squares, (sensor_x - x).powi(2) + (y - sensor_y) * (y - sensor_y));
        }
        fit.azimuth_rad = slopes.map(maths::atan);
        fit.rear_u_m = far;
        fit.range_m = squares.sqrt();
        fit.in_view_m = scan.resolution.mount_height_m + fit.range_m * scan.resolution.highest_tan;
        let from_axis_rad = 0.5 * (fit.azimuth_rad[0] + fit.azimuth_rad[1]) - scan.axis_azimuth_rad;
        fit.spacing_m = fit.range_m * column_step_rad(&scan.resolution, from_axis_rad);
        if scan.axis_azimuth_rad != 0.0 {
            // The selection of points ends at a side, as the field of view does.
            fit.truncated[0] |= fit.azimuth_rad[0] < -SIDE_EDGE_RAD;
            fit.truncated[1] |= fit.azimuth_rad[1] > SIDE_EDGE_RAD;
        }
        fit.locate_front(nearest.value(), [sin, cos], members, scan);
        fit.footprint_columns = scan.resolution.footprint_rad[0] * fit.range_m / fit.spacing_m;
        let steps =
            fit.azimuth_rad.map(|azimuth_rad| column_step_rad(&scan.resolution, azimuth_rad - scan.axis_azimuth_rad));
        if !fit.shows_flank()
            && steps == [column_step_rad(&scan.resolution, from_axis_rad); 2]
            && fit.spacing_m > FINE_SPACING_M
        {
            fit.edges = edges(&fit, [sin, cos], members, scan);
        }
        fit
    }

    /// Returns a fit whose extents are empty, with the values that do not depend on the heading,
    /// and the mean of x (m).
    fn without_extent(members: &[u32], scan: &LidarScan) -> (Self, f64) {
        let (mut x_m, mut intensity, mut offset_ns) = (0.0, 0.0, 0.0);
        let mut beams = [u16::MAX, 0];
        for &member in members {
            let index = member as usize;
            x_m += f64::from(scan.x_m[index]);
            intensity += f64::from(scan.intensity[index]);
            offset_ns += f64::from(scan.offset_ns[index]);
            beams = [beams[0].min(scan.beam[index]), beams[1].max(scan.beam[index])];
        }
        let count = members.len() as f64;
        let empty = Self {
            heading_rad: 0.0,
            front_u_m: 0.0,
            rear_u_m: 0.0,
            across_m: [f64::INFINITY, f64::NEG_INFINITY],
            edges: None,
            plate_m: None,
            top_m: f64::NEG_INFINITY,
            bottom_m: f64::INFINITY,
            front_bottom_m: f64::INFINITY,
            intensity: intensity / count,
            points: members.len(),
            front_points: 0,
            offset_ns: offset_ns / count,
            range_m: 0.0,
            spacing_m: 0.0,
            footprint_columns: 0.0,
            in_view_m: 0.0,
            point_sd_m: scan.resolution.point_sd_m,
            vertical_rad: [scan.resolution.layer_rad, scan.resolution.footprint_rad[1]],
            azimuth_rad: [0.0; 2],
            sensor_y_m: scan.sensor_y_m.into(),
            truncated: truncated_edges(beams, scan),
        };
        (empty, x_m / count)
    }

    /// Sets the front face to the mean position of the points on it.
    ///
    /// `edge_m` is the position u of the foremost point that does not count as noise.
    fn locate_front(&mut self, edge_m: f64, [sin, cos]: [f64; 2], members: &[u32], scan: &LidarScan) {
        let (mut sum, mut count) = (0.0, 0_usize);
        for &member in members {
            let [x, y, z] = point(scan, member);
            let u = x * cos + y * sin;
            if u >= edge_m - FACE_DEPTH_M {
                sum += u;
                count += 1;
                self.front_bottom_m = self.front_bottom_m.min(z);
            }
        }
        self.front_points = count;
        self.front_u_m = if count > 0 { sum / count as f64 } else { edge_m };
    }

    /// Returns the visible width (m).
    pub(crate) fn width_m(&self) -> f64 {
        self.across_m[1] - self.across_m[0]
    }

    /// Returns the visible length (m).
    pub(crate) fn length_m(&self) -> f64 {
        (self.front_u_m - self.rear_u_m).max(0.0)
    }

    /// Returns the spacing of layers at this distance (m).
    pub(crate) fn layer_m(&self) -> f64 {
        self.range_m * self.vertical_rad[0]
    }

    /// Returns the height of a footprint at this distance (m).
    pub(crate) fn footprint_m(&self) -> f64 {
        self.range_m * self.vertical_rad[1]
    }

    /// Returns true if the field of view truncates the cluster.
    pub(crate) fn is_truncated(&self) -> bool {
        self.truncated[0] || self.truncated[1]
    }
}

/// Returns whether the last of these beams is in the outermost columns on the ego's right, and the
/// first in the outermost columns on its left. The sweep begins on the left.
fn truncated_edges(beams: [u16; 2], scan: &LidarScan) -> [bool; 2] {
    let Resolution { columns: count, layers, edge_columns: [first_edge, last_edge], .. } = scan.resolution;
    let [first, last] = beams.map(|beam| usize::from(beam) / layers);
    [last + last_edge >= count, first < first_edge]
}

/// Returns true if the points surely extend over more than [`REFINE_LENGTH_M`] behind the front
/// face, for this heading. The front face is at most [`FACE_DEPTH_M`] behind the foremost point
/// that does not count as noise.
fn has_long_side(heading_rad: f64, members: &[u32], scan: &LidarScan) -> bool {
    let (sin, cos) = maths::sin_cos(heading_rad);
    let mut nearest = LargestValues::default();
    let mut far = f64::INFINITY;
    for &member in members {
        let [x, y, _] = point(scan, member);
        let u = x * cos + y * sin;
        nearest.insert(u, members.len() / POINTS_PER_STRAY);
        far = lesser(far, u);
    }
    nearest.value() - FACE_DEPTH_M - far > REFINE_LENGTH_M + ROUNDING_M
}

/// The largest of the inserted values, which yield a quantile near the maximum.
#[derive(Clone, Copy, Debug)]
struct LargestValues {
    values: [f64; Self::CAPACITY],
    rank: usize,
}

impl Default for LargestValues {
    fn default() -> Self {
        Self { values: [f64::NEG_INFINITY; Self::CAPACITY], rank: 0 }
    }
}

impl LargestValues {
    const CAPACITY: usize = 6;

    /// Inserts a value. `rank` selects the value that is wanted: 0 for the largest, 5 at most.
    fn insert(&mut self, value: f64, rank: usize) {
        self.rank = rank.min(Self::CAPACITY - 1);
        // Most values are less than all that are kept.
        if !(value > self.values[self.rank]) {
            return;
        }
        let mut value = value;
        for slot in &mut self.values[..=self.rank] {
            if value > *slot {
                std::mem::swap(&mut value, slot);
            }
        }
    }

    /// Returns the value of the selected rank.
    fn value(&self) -> f64 {
        self.values[self.rank]
    }
}

/// Returns the heading near `road_rad` for which the points are closest to the sides of a rectangle
/// (rad).
fn refined_heading_rad(road_rad: f64, members: &[u32], scan: &LidarScan) -> f64 {
    let stride = members.len().div_ceil(REFINE_MAX_POINTS);
    let mut best = (f64::INFINITY, road_rad);
    for step in -HEADINGS..=HEADINGS {
        let turned = f64::from(step) * HEADING_STEP_RAD;
        let (sin, cos) = maths::sin_cos(road_rad + turned);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let rotated = |member: u32| {
            let [x, y, _] = point(scan, member);
            [x * cos + y * sin, y * cos - x * sin]
        };
        for &member in members.iter().step_by(stride) {
            let at = rotated(member);
            for axis in 0..2 {
                low[axis] = lesser(low[axis], at[axis]);
                high[axis] = greater(high[axis], at[axis]);
            }
        }
        let mut cost = 0.5 * (turned / HEADING_SD_RAD).powi(2);
        for &member in members.iter().step_by(stride) {
            let at = rotated(member);
            let side = lesser(at[1] - low[1], high[1] - at[1]);
            let end = lesser(at[0] - low[0], high[0] - at[0]);
            cost += lesser(lesser(side, end), MAX_CLOSENESS_M);
        }
        if cost < best.0 {
            best = (cost, road_rad + turned);
        }
    }
    best.1
}

/// Returns the spacing of columns at an azimuth about the sensor's axis (rad).
fn column_step_rad(resolution: &Resolution, azimuth_rad: f64) -> f64 {
    let [fine_field_rad, fine_step_rad] = resolution.fine_rad;
    if azimuth_rad.abs() < fine_field_rad { fine_step_rad } else { resolution.step_rad }
}

pub(super) fn point(scan: &LidarScan, member: u32) -> [f64; 3] {
    let index = member as usize;
    [scan.x_m[index].into(), scan.y_m[index].into(), scan.z_m[index].into()]
}

/// Returns the lesser of two numbers. Points are finite, so that NaN, which [`f64::min`] tests for,
/// does not occur.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// Returns the greater of two numbers that are not NaN.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
