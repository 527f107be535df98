//! Effects of the LiDAR's faults on the points of a scan: losses, noise, and points without an
//! object.
//!
//! The sweep itself knows no faults. A fault spoils a scan after the scanner has measured it, so a
//! scan without a fault costs nothing. Every random number is addressed by the scan's key, a beam
//! and a purpose.
//!
//! - *Mirror images behind a guard rail.* A beam that a rail deflects to a vehicle and back
//!   measures the whole path. The point appears behind the rail, at the mirror image of the
//!   vehicle. The model treats a rail as a plane mirror. The region of interest ends short of the
//!   rails on the map. The detector therefore drops these points, as it drops the points of the
//!   rails.
//! - *Crosstalk.* The pulses of another LiDAR that arrive within the listening time count as
//!   returns. Two scanners with nearly the same pulse rate give bursts: neighbouring columns, whose
//!   false ranges drift (the mechanism of mutual interference: Remote Sensing 14 (2022) 1129).
//!   Length and drift of a burst are assumptions.
//! - *Blooming.* A retro-reflector that saturates the receiver is also seen by beams that only
//!   graze it. The halo has the range of the plate, and fades to its edge.

use super::noise::{Noise, Purpose};
use super::pattern::{Elevation, Pattern};
use super::power::LinkBudget;
use super::power::MAX_INTENSITY;
use super::pulse;
use super::receiver::SensorPoseEstimate;
use super::{LaneGeometry, LidarScan, Material, MirrorSide, PointSource, PointTruth, ScanTruth};
use crate::faults::LidarFault;
use closecall_traffic::guard_rail::{LEFT_OFFSET_M, RIGHT_OFFSET_M};
use closecall_traffic::maths;

/// Number of columns of a burst, from the fewest to the most.
const BURST_COLUMNS: [usize; 2] = [3, 10];
/// Number of adjacent layers of a burst: the layers of a group of detector cells of the SCALA (an
/// assumption for other sensors).
const BURST_LAYERS: usize = 4;
/// Least and greatest range of the first point of a burst (m).
const BURST_RANGE_M: [f32; 2] = [3.0, 150.0];
/// Greatest change of the range from column to column of a burst (m).
const BURST_DRIFT_M: f32 = 0.5;
/// Intensity of a false point, as a reflectivity (assumption: a usual surface).
const FALSE_INTENSITY: f32 = 0.3;
/// Least square of a distance for which a power is computed (m²).
const LEAST_SQUARE_M2: f32 = 0.01;
/// Standard deviation of the range of a point of a halo (m).
const HALO_RANGE_SD_M: f32 = 0.1;
/// Share of a plate's saturated returns that have a halo point at its centre; it falls linearly to
/// zero at the edge.
const HALO_SHARE: f64 = 0.8;

/// Returns the lateral positions of the two rails at a longitudinal position (m).
fn rails_y_m(lane: &LaneGeometry, x_m: f64) -> [f64; 2] {
    let [left_m, right_m] = lane.edges_m;
    [left_m + LEFT_OFFSET_M, right_m - RIGHT_OFFSET_M].map(|offset_m| lane.path_y_m(x_m) + offset_m)
}

/// The sensor of a scan that is spoilt.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spoiler<'a> {
    pub(super) fault: &'a LidarFault,
    pub(super) noise: Noise,
    pub(super) pose: &'a SensorPoseEstimate,
    pub(super) link: &'a LinkBudget,
    pub(super) pattern: &'a Pattern,
    pub(super) mirror_side: MirrorSide,
    /// The road as seen from the ego, if guard rails stand along it.
    pub(super) rails: Option<&'a LaneGeometry>,
}

/// A point that a fault adds.
#[derive(Clone, Debug)]
pub(super) struct Added {
    at_m: [f32; 3],
    intensity: f32,
    offset_ns: u32,
    beam: u16,
    truth: PointTruth,
}

impl Spoiler<'_> {
    /// Spoils the scan and its ground truth. `added` is memory that the next call may reuse.
    pub(super) fn spoil(&self, scan: &mut LidarScan, truth: &mut ScanTruth, added: &mut Vec<Added>) {
        added.clear();
        if self.fault.blooming_deg > 0.0 {
            self.bloom(scan, truth, added);
        }
        if let Some(lane) = self.rails.filter(|_| self.fault.rail_ghosts > 0.0) {
            self.mirror(lane, scan, truth, added);
        }
        if self.fault.crosstalk > 0.0 {
            self.interfere(added);
        }
        for point in added.drain(..) {
            scan.x_m.push(point.at_m[0]);
            scan.y_m.push(point.at_m[1]);
            scan.z_m.push(point.at_m[2]);
            scan.intensity.push(point.intensity);
            scan.echoes.note(|| self.echo(&point));
            scan.offset_ns.push(point.offset_ns);
            scan.beam.push(point.beam);
            truth.points.push(point.truth);
        }
        if self.fault.range_noise_m > 0.0 {
            self.blur_ranges(scan);
        }
        self.lose(scan, truth);
    }

    /// Returns a uniform random number for the point with this index and its beam.
    fn uniform(&self, index: usize, beam: u16, purpose: Purpose) -> f64 {
        // Two returns of a beam are neighbours in the scan, so that the parity of the index tells
        // them apart.
        f64::from(self.noise.uniform((index % 2) * self.pattern.kind().beams() + usize::from(beam), purpose))
    }

    /// Returns the echo pulse width (ns) and the reported intensity of an added point: as for the
    /// surface whose intensity it has, behind the same window.
    fn echo(&self, point: &Added) -> [f32; 2] {
        let square_m2: f32 = point.at_m.iter().zip(self.sensor_m()).map(|(at, sensor)| (at - sensor).powi(2)).sum();
        let power = point.intensity * self.link.gain_m2 / square_m2.max(LEAST_SQUARE_M2);
        [pulse::width_ns(power, 0.0), point.intensity * (self.link.gain_m2 / self.link.clean_gain_m2)]
    }

    /// Returns the position of the sensor (m).
    fn sensor_m(&self) -> [f32; 3] {
        [self.pose.sensor_x_m(), self.pose.sensor_y_m(), self.pose.sensor_z_m()]
    }

    /// Adds the halos of saturated plates.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a few degrees in steps of at least 0.02"
    )]
    fn bloom(&self, scan: &LidarScan, truth: &ScanTruth, added: &mut Vec<Added>) {
        let step_deg = self.pattern.kind().finest_step_deg;
        let steps = (self.fault.blooming_deg / step_deg).floor() as usize;
        for index in 0..scan.len() {
            let point = truth.points[index];
            if point.material != Material::Plate || scan.intensity[index] < MAX_INTENSITY {
                continue;
            }
            for step in 1..=steps {
                for side in [-1.0, 1.0] {
                    let beam = scan.beam[index];
                    let address = step * 2 + usize::from(side > 0.0);
                    let share = HALO_SHARE * (1.0 - step as f64 / (steps + 1) as f64);
                    let row = address * self.pattern.kind().beams() + usize::from(beam);
                    if f64::from(self.noise.uniform(row, Purpose::Dropout)) >= share {
                        continue;
                    }
                    let angle = (side * step as f64 * step_deg).to_radians();
                    let longer =
                        1.0 + HALO_RANGE_SD_M * self.noise.normal(row, Purpose::Range) / point.range_m.max(1.0);
                    added.push(Added {
                        at_m: self.turned([scan.x_m[index], scan.y_m[index], scan.z_m[index]], angle as f32, longer),
                        intensity: FALSE_INTENSITY,
                        offset_ns: scan.offset_ns[index],
                        beam,
                        truth: PointTruth { source: PointSource::False, ..point },
                    });
                }
            }
        }
    }

    /// Turns a point about the sensor's vertical axis, and changes its distance by a factor.
    fn turned(&self, at_m: [f32; 3], angle_rad: f32, factor: f32) -> [f32; 3] {
        let sensor = self.sensor_m();
        let [x, y, z] = std::array::from_fn(|axis| (at_m[axis] - sensor[axis]) * factor);
        let (sin, cos) = maths::sin_cos(angle_rad);
        [sensor[0] + cos * x - sin * y, sensor[1] + sin * x + cos * y, sensor[2] + z]
    }

    /// Adds the mirror images of vehicles behind the guard rails.
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    fn mirror(&self, lane: &LaneGeometry, scan: &LidarScan, truth: &ScanTruth, added: &mut Vec<Added>) {
        for index in 0..scan.len() {
            let point = truth.points[index];
            if !matches!(point.source, PointSource::Actor(_)) {
                continue;
            }
            for (side, rail_y_m) in rails_y_m(lane, f64::from(scan.x_m[index])).into_iter().enumerate() {
                let row = (2 + side) * self.pattern.kind().beams() + usize::from(scan.beam[index]);
                if f64::from(self.noise.uniform(row, Purpose::Depth)) >= self.fault.rail_ghosts {
                    continue;
                }
                added.push(Added {
                    at_m: [scan.x_m[index], (2.0 * rail_y_m) as f32 - scan.y_m[index], scan.z_m[index]],
                    intensity: FALSE_INTENSITY * scan.intensity[index].min(1.0),
                    offset_ns: scan.offset_ns[index],
                    beam: scan.beam[index],
                    truth: PointTruth { source: PointSource::False, ..point },
                });
            }
        }
    }

    /// Adds the bursts of another LiDAR.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "some bursts, and indices of the pattern"
    )]
    fn interfere(&self, added: &mut Vec<Added>) {
        let uniform = |burst: usize, draw: usize| self.noise.uniform((burst + 1) * 8 + draw, Purpose::FogClump);
        let bursts = (self.fault.crosstalk + f64::from(uniform(0, 0))).floor() as usize;
        let kind = self.pattern.kind();
        let elevations_of = |column| self.pattern.elevations(self.mirror_side, column);
        for burst in 1..=bursts {
            let [fewest, most] = BURST_COLUMNS;
            let length = fewest + (uniform(burst, 1) * (most - fewest + 1) as f32) as usize;
            let length = length.min(self.pattern.columns.len());
            let first = (uniform(burst, 2) * (self.pattern.columns.len() - length) as f32) as usize;
            let lowest = BURST_LAYERS * (uniform(burst, 3) * kind.layers().div_ceil(BURST_LAYERS) as f32) as usize;
            let mut range_m = BURST_RANGE_M[0] + uniform(burst, 4) * (BURST_RANGE_M[1] - BURST_RANGE_M[0]);
            let drift_m = (2.0 * uniform(burst, 5) - 1.0) * BURST_DRIFT_M;
            for column in first..first + length {
                for layer in lowest..kind.layers().min(lowest + BURST_LAYERS) {
                    let Elevation { group, centre: [tan, cosine], .. } = elevations_of(column)[layer];
                    let [cos, sin] = self.pattern.columns[column].centre[group];
                    let level = range_m * cosine;
                    added.push(Added {
                        at_m: self.pose.ego_frame_point_m([level * cos, level * sin, level * tan]),
                        intensity: FALSE_INTENSITY,
                        offset_ns: self.pattern.columns[column].offset_ns,
                        beam: (column * kind.layers() + layer) as u16,
                        truth: PointTruth { source: PointSource::False, material: Material::Water, range_m },
                    });
                }
                range_m = (range_m + drift_m).max(1.0);
            }
        }
    }

    /// Adds an error to the range of each point.
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    fn blur_ranges(&self, scan: &mut LidarScan) {
        let sensor = self.sensor_m();
        let sd_m = self.fault.range_noise_m as f32;
        for index in 0..scan.len() {
            let at_m = [scan.x_m[index], scan.y_m[index], scan.z_m[index]];
            let range_m = (0..3).map(|axis| (at_m[axis] - sensor[axis]).powi(2)).sum::<f32>().sqrt().max(0.1);
            let row = (index % 2) * self.pattern.kind().beams() + usize::from(scan.beam[index]);
            let factor = ((range_m + sd_m * self.noise.normal(row, Purpose::FogDepth)) / range_m).max(0.0);
            [scan.x_m[index], scan.y_m[index], scan.z_m[index]] = self.turned(at_m, 0.0, factor);
        }
    }

    /// Removes the lost points, and the points in blocked sectors.
    fn lose(&self, scan: &mut LidarScan, truth: &mut ScanTruth) {
        let (sensor, axis_deg) = (self.sensor_m(), scan.axis_azimuth_rad.to_degrees());
        let is_blocked = |x_m: f32, y_m: f32| {
            let azimuth_deg = f64::from(maths::atan2(y_m - sensor[1], sensor[0] - x_m)).to_degrees() - axis_deg;
            self.fault.blocked_deg.iter().flatten().any(|[from, to]| (*from..=*to).contains(&azimuth_deg))
        };
        let mut kept = 0;
        for index in 0..scan.len() {
            let is_lost = self.uniform(index, scan.beam[index], Purpose::Plume) < self.fault.dropout;
            if is_lost || is_blocked(scan.x_m[index], scan.y_m[index]) {
                continue;
            }
            scan.x_m[kept] = scan.x_m[index];
            scan.y_m[kept] = scan.y_m[index];
            scan.z_m[kept] = scan.z_m[index];
            scan.intensity[kept] = scan.intensity[index];
            scan.echoes.copy(index, kept);
            scan.offset_ns[kept] = scan.offset_ns[index];
            scan.beam[kept] = scan.beam[index];
            truth.points[kept] = truth.points[index];
            kept += 1;
        }
        scan.x_m.truncate(kept);
        scan.y_m.truncate(kept);
        scan.z_m.truncate(kept);
        scan.intensity.truncate(kept);
        scan.echoes.truncate(kept);
        scan.offset_ns.truncate(kept);
        scan.beam.truncate(kept);
        truth.points.truncate(kept);
    }
}
