//! One scan of the rear LiDAR, kept small: a run has a thousand of them.

use closecall_sensors::Detection;
use closecall_sensors::Perception;

/// Steps of a kept coordinate in a metre. A power of two leaves most bits of a float zero, which packs well; 1/64 m is
/// a fraction of the noise of a range.
const STEPS_PER_M: f32 = 64.0;
/// The cluster of a point that belongs to none.
pub(crate) const NO_CLUSTER: u8 = u8::MAX;

/// The points of a scan in E's frame, and the boxes that were found in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scan {
    points: Vec<[i16; 3]>,
    /// Intensity of each point, 1 as 255; stronger ones are cut off.
    pub(crate) intensities: Vec<u8>,
    /// The box that each point belongs to, or [`NO_CLUSTER`].
    pub(crate) clusters: Vec<u8>,
    pub(crate) boxes: Vec<Detection>,
}

impl Scan {
    /// The latest scan of these sensors; nothing where they have no LiDAR.
    pub(super) fn of(perception: &dyn Perception) -> Option<Self> {
        let lidar = perception.rear_lidar()?;
        let scan = lidar.latest();
        let points = scan.x_m.iter().zip(&scan.y_m).zip(&scan.z_m);
        let mut clusters = vec![NO_CLUSTER; scan.len()];
        for detection in 0..lidar.detections().len() {
            let name = u8::try_from(detection % usize::from(NO_CLUSTER)).unwrap_or(0);
            for &point in lidar.points_of(detection) {
                clusters[point as usize] = name;
            }
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
        Some(Self {
            points: points.map(|((x, y), z)| [x, y, z].map(|at| (at * STEPS_PER_M) as i16)).collect(),
            intensities: scan.intensity.iter().map(|intensity| (intensity * 255.0) as u8).collect(),
            clusters,
            boxes: perception.rear_detections().to_vec(),
        })
    }

    /// The points [m].
    pub(crate) fn points_m(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.points.iter().map(|point| point.map(|at| f32::from(at) / STEPS_PER_M))
    }
}
