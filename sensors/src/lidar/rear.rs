//! The rear LiDAR as the loop uses it: one call from the scene to the points, one from the points to boxes.

use closecall_traffic::Stream;

use super::{Detector, LaneGeometry, Lidar, LidarScan, ScanTruth, Scanner, SegmentationReport};
use crate::{Detection, Scene, SensorError};

/// Scanner and processing of the rear LiDAR.
#[derive(Clone, Debug)]
pub struct RearLidar {
    scanner: Scanner,
    detector: Detector,
    lane: Option<LaneGeometry>,
}

impl RearLidar {
    /// A rear LiDAR of this kind.
    pub fn new(lidar: Lidar) -> Self {
        Self { scanner: Scanner::new(lidar), detector: Detector::default(), lane: None }
    }

    /// Scans the scene; the scan ends at the scene's time. Draws exactly one number from `rng`.
    pub fn scan(&mut self, scene: &Scene<'_>, rng: &mut Stream) -> &LidarScan {
        self.lane = Some(LaneGeometry::from_scene(scene));
        self.scanner.scan(scene, rng)
    }

    /// Finds boxes in the latest scan; none before the first.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn detect(&mut self) -> Result<&[Detection], SensorError> {
        match &self.lane {
            Some(lane) => self.detector.detect(self.scanner.latest(), lane),
            None => Ok(&[]),
        }
    }

    /// The latest scan.
    pub fn latest(&self) -> &LidarScan {
        self.scanner.latest()
    }

    /// The truth behind the latest scan.
    pub fn truth(&self) -> &ScanTruth {
        self.scanner.truth()
    }

    /// The boxes found in the latest scan.
    pub fn detections(&self) -> &[Detection] {
        self.detector.latest()
    }

    /// The places in the latest scan of the points of one detection.
    pub fn points_of(&self, detection: usize) -> &[u32] {
        self.detector.points_of(detection)
    }

    /// Adds the latest scan to a report on the clusters.
    pub fn report(&self, report: &mut SegmentationReport) {
        let clusters = (0..self.detector.latest().len()).map(|detection| self.detector.points_of(detection));
        report.observe(self.scanner.truth(), clusters);
    }
}
