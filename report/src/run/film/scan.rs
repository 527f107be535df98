//! One scan of the rear LiDAR in a compact form, since a run has about a thousand of them.

use closecall_sensors::lidar::RearLidar;
use closecall_sensors::{Detection, Perception};

/// Quantization steps of a stored coordinate per metre. With a power of two most bits of the resulting float are zero,
/// which compresses well. 1/64 m is a fraction of the range noise.
const STEPS_PER_M: f32 = 64.0;
/// Cluster number of a point that belongs to no cluster.
pub(crate) const NO_CLUSTER: u8 = u8::MAX;

/// The points of a scan in the ego frame, and the boxes fitted to its clusters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scan {
    /// Coordinates of each point, in steps of 1 / [`STEPS_PER_M`] m.
    points: Vec<[i16; 3]>,
    /// Intensity of each point: 255 stands for 1 and for all larger values.
    pub(crate) intensities: Vec<u8>,
    /// Index of the box that each point belongs to, or [`NO_CLUSTER`].
    pub(crate) clusters: Vec<u8>,
    pub(crate) boxes: Vec<Detection>,
}

impl Scan {
    /// Returns the latest scan of these sensors, or `None` if they have no rear LiDAR. It lacks most points of the bare
    /// road, which the detector discards.
    pub(super) fn latest(perception: &dyn Perception) -> Option<Self> {
        Some(Self::of(perception.rear_lidar()?, perception.rear_detections()))
    }

    /// Returns the latest scan of these sensors with all its points, or `None` if they have no rear LiDAR.
    pub(super) fn complete(perception: &dyn Perception) -> Option<Self> {
        Self::completed(perception.rear_lidar()?, perception.rear_detections())
    }

    /// Returns the latest scan of the LiDAR with all its points.
    pub(super) fn completed(lidar: &RearLidar, boxes: &[Detection]) -> Option<Self> {
        // The scan of the simulation has clustered without an error before, and so does the complete one.
        Some(Self::of(&lidar.completed().ok()?, boxes))
    }

    fn of(lidar: &RearLidar, boxes: &[Detection]) -> Self {
        let scan = lidar.latest();
        let points = scan.x_m.iter().zip(&scan.y_m).zip(&scan.z_m);
        let mut clusters = vec![NO_CLUSTER; scan.len()];
        for detection in 0..lidar.detections().len() {
            let cluster = u8::try_from(detection % usize::from(NO_CLUSTER)).unwrap_or(0);
            for &point in lidar.point_indices_of(detection) {
                clusters[point as usize] = cluster;
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
        Self {
            points: points.map(|((x, y), z)| [x, y, z].map(|value_m| (value_m * STEPS_PER_M) as i16)).collect(),
            intensities: scan.intensity.iter().map(|intensity| (intensity * 255.0) as u8).collect(),
            clusters,
            boxes: boxes.to_vec(),
        }
    }

    /// Returns the coordinates of the points (m).
    pub(crate) fn points_m(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.points.iter().map(|point| point.map(|steps| f32::from(steps) / STEPS_PER_M))
    }
}
