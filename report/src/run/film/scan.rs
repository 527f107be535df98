//! One scan of a LiDAR as it was measured, with the boxes fitted to its clusters.

use closecall_sensors::Detection;
use closecall_sensors::lidar::{LidarScan, RearLidar};

/// Cluster number of a point that belongs to no cluster.
pub(crate) const NO_CLUSTER: u8 = u8::MAX;

/// The points of a scan in the ego frame, and the boxes fitted to its clusters.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scan {
    /// The points with intensity, beam and time, to the bit as they were measured.
    pub(crate) points: LidarScan,
    /// Index of the box that each point belongs to, or [`NO_CLUSTER`].
    pub(crate) clusters: Vec<u8>,
    pub(crate) boxes: Vec<Detection>,
}

impl Scan {
    /// Returns the latest scan of the LiDAR with all its points.
    pub(super) fn completed(lidar: &RearLidar, boxes: &[Detection]) -> Option<Self> {
        // The scan of the simulation has clustered without an error before, and so does the
        // complete scan.
        Some(Self::of(&lidar.completed().ok()?, boxes))
    }

    /// Returns the latest scan of the LiDAR. It lacks most points of the bare road, which the
    /// detector discards.
    pub(super) fn of(lidar: &RearLidar, boxes: &[Detection]) -> Self {
        let points = lidar.latest().clone();
        let mut clusters = vec![NO_CLUSTER; points.len()];
        for detection in 0..lidar.detections().len() {
            let cluster = u8::try_from(detection % usize::from(NO_CLUSTER)).unwrap_or(0);
            for &point in lidar.point_indices_of(detection) {
                clusters[point as usize] = cluster;
            }
        }
        Self { points, clusters, boxes: boxes.to_vec() }
    }

    /// Returns the same scan in the ego's frame. The LiDAR may look ahead.
    pub(super) fn in_ego_frame(mut self, looks_ahead: bool) -> Self {
        if looks_ahead {
            let LidarScan { x_m, y_m, .. } = &mut self.points;
            x_m.iter_mut().chain(y_m).for_each(|at_m| *at_m = -*at_m);
            for detection in &mut self.boxes {
                (detection.face_x_m, detection.face_y_m) = (-detection.face_x_m, -detection.face_y_m);
            }
        }
        self
    }

    /// Returns the coordinates of the points (m).
    pub(crate) fn points_m(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        let LidarScan { x_m, y_m, z_m, .. } = &self.points;
        x_m.iter().zip(y_m).zip(z_m).map(|((x, y), z)| [*x, *y, *z])
    }

    /// Returns the intensity of a point as a byte: 255 stands for 1 and for all larger values.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
    pub(crate) fn shade(&self, point: usize) -> u8 {
        (self.points.intensity[point] * 255.0) as u8
    }
}
