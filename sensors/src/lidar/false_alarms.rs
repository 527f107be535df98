//! False alarms: points where there is nothing, because the receiver's noise alone exceeds the detection threshold.
//!
//! Noise has no preferred time: within the time in which the receiver listens, every range is as likely as another. The power of a
//! false alarm is that of the threshold, so that its intensity grows with the square of its range.

use super::noise::{Noise, Purpose};
use super::pattern::Pattern;
use super::receiver::{MAX_INTENSITY, SensorPoseEstimate};
use super::{LidarScan, Material, PointSource, PointTruth, ScanTruth};

/// Least range of a false alarm (m).
const NEAREST_M: f32 = 0.5;

/// The receiver of a scan whose noise exceeds its threshold in some beams.
pub(super) struct FalseAlarms<'a> {
    /// Probability of a false alarm in a beam.
    pub(super) rate: f32,
    /// Range up to which the receiver listens (m).
    pub(super) reach_m: f32,
    /// Received power for ρ·cos γ·f = 1 at 1 m (thresholds · m²).
    pub(super) gain_m2: f32,
    pub(super) noise: Noise,
    pub(super) pattern: &'a Pattern,
}

impl FalseAlarms<'_> {
    /// Appends the false alarms to the scan and to its ground truth. `pose_at` returns the pose of the sensor at the time of a column.
    #[expect(clippy::cast_possible_truncation, reason = "a pattern has at most 65,535 beams")]
    pub(super) fn append(
        &self,
        pose_at: impl Fn(u32) -> SensorPoseEstimate,
        (scan, truth): (&mut LidarScan, &mut ScanTruth),
    ) {
        for (index, column) in self.pattern.columns.iter().enumerate() {
            let elevations = self.pattern.elevations(scan.mirror_side, index);
            for (layer, elevation) in elevations.iter().enumerate() {
                let beam = index * elevations.len() + layer;
                if self.noise.uniform(beam, Purpose::Detection) >= self.rate {
                    continue;
                }
                let range_m = NEAREST_M + self.noise.uniform(beam, Purpose::Range) * (self.reach_m - NEAREST_M);
                let [cos, sin] = column.centre[elevation.group];
                let [tan, cosine] = elevation.centre;
                let level = range_m * cosine;
                let [x, y, z] = pose_at(column.offset_ns).ego_frame_point_m([level * cos, level * sin, level * tan]);
                scan.x_m.push(x);
                scan.y_m.push(y);
                scan.z_m.push(z);
                scan.intensity.push((range_m * range_m / self.gain_m2).min(MAX_INTENSITY));
                scan.offset_ns.push(column.offset_ns);
                scan.beam.push(beam as u16);
                truth.points.push(PointTruth { source: PointSource::False, material: Material::Water, range_m });
            }
        }
    }
}
