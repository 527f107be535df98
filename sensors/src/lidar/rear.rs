//! The rear LiDAR as the simulation loop uses it: one call turns a scene into points, another turns
//! points into boxes.

use closecall_traffic::{Environment, Stream};

use super::{ClusteredPoints, Detector, LaneGeometry, Lidar, LidarScan, PointBeam, ScanTruth, Scanner};
use crate::faults::LidarFault;
use crate::monitors::RoadBeam;
use crate::{Detection, Scene, SensorError};

/// The rear LiDAR: its scanner and its processing chain.
#[derive(Clone, Debug)]
pub struct RearLidar {
    scanner: Scanner,
    detector: Detector,
    lane: Option<LaneGeometry>,
}

impl RearLidar {
    /// Creates a rear LiDAR with this configuration.
    pub fn new(lidar: Lidar) -> Self {
        let detector = Detector::with_capacity(lidar.kind.beams());
        let detector = detector.with_clustering(lidar.clustering, lidar.clustering_check);
        Self { scanner: Scanner::new(lidar), detector, lane: None }
    }

    /// Scans the scene. The scan ends at the scene's time. Draws exactly one number from `rng`.
    pub fn scan(&mut self, scene: &Scene<'_>, rng: &mut Stream) -> &LidarScan {
        self.lane = Some(LaneGeometry::from_scene(scene));
        self.scanner.scan(scene, rng)
    }

    /// Scans `scene` with a fault of the sensor. The processing assumes the road of `believed`, the
    /// scene as the ego believes it to be. Draws exactly one number from `rng`.
    pub(crate) fn scan_with(
        &mut self,
        [scene, believed]: [&Scene<'_>; 2],
        rng: &mut Stream,
        fault: Option<&LidarFault>,
    ) {
        let lane = *self.lane.insert(LaneGeometry::from_scene(believed));
        match fault {
            Some(fault) if fault.is_dead => self.scanner.blank(scene.time, rng),
            Some(fault) if fault.is_frozen => self.scanner.hold(scene.time, rng),
            _ => {
                self.scanner.scan_with((scene, &lane), rng, fault);
            }
        }
    }

    /// Detects boxes in the latest scan. Returns no boxes before the first scan.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub fn detect(&mut self) -> Result<&[Detection], SensorError> {
        match &self.lane {
            Some(lane) => self.detector.detect(self.scanner.latest(), lane),
            None => Ok(&[]),
        }
    }

    /// Detects boxes in a recorded scan.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub(crate) fn detect_recorded(
        &mut self,
        scan: &LidarScan,
        lane: &LaneGeometry,
    ) -> Result<&[Detection], SensorError> {
        self.detector.detect(scan, lane)
    }

    /// Detects boxes in the latest scan, with the points of each vehicle as one cluster.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub(crate) fn detect_by_truth(&mut self) -> Result<&[Detection], SensorError> {
        let scan = (self.scanner.latest(), self.scanner.truth());
        self.lane.as_ref().map_or(Ok(&[]), |lane| self.detector.detect_by_truth(scan, lane))
    }

    /// Returns true if the latest scan has no point, not even one of the road.
    pub fn is_dark(&mut self) -> bool {
        self.scanner.is_dark()
    }

    /// Writes the beams of these columns of the latest scan that see the road into `beams`, the
    /// same number for each column: see [`Scanner::probe`].
    pub(crate) fn look_at_road(&mut self, columns: &[usize], environment: &Environment, beams: &mut Vec<RoadBeam>) {
        self.scanner.probe(columns, environment, beams);
    }

    /// Returns this LiDAR with the complete latest scan: with the points of the bare road, which
    /// the simulation leaves out because the detector discards them, and with
    /// [`LidarScan::echoes`]. The detections are the same.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub fn completed(&self) -> Result<Self, SensorError> {
        let mut completed = self.clone();
        completed.scanner.complete();
        completed.detect()?;
        Ok(completed)
    }

    /// Returns the complete latest scan, as [`RearLidar::completed`] has it.
    pub(crate) fn complete_scan(&self) -> LidarScan {
        let mut scanner = self.scanner.clone();
        scanner.complete();
        scanner.latest().clone()
    }

    /// Returns the latest scan, without the points of the bare road that the detector discards; see
    /// [`RearLidar::completed`].
    pub fn latest(&self) -> &LidarScan {
        self.scanner.latest()
    }

    /// Clusters the latest scan once more, and returns what DBSCAN has made of it. Returns no
    /// points before the first scan.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub fn clustered(&self) -> Result<ClusteredPoints, SensorError> {
        let mut detector = self.detector.alike();
        if let Some(lane) = &self.lane {
            detector.cluster(self.scanner.latest(), lane)?;
        }
        Ok(detector.clustered())
    }

    /// Clusters the latest scan once more, and returns the points of each cluster by their indices
    /// in the scan, as DBSCAN gives them: before clusters of the same vehicle are merged. Returns
    /// none before the first scan.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub fn clusters(&self) -> Result<Vec<Vec<u32>>, SensorError> {
        let mut detector = self.detector.alike();
        if let Some(lane) = &self.lane {
            detector.cluster(self.scanner.latest(), lane)?;
        }
        Ok(detector.clusters())
    }

    /// Returns the ground truth of the points of [`RearLidar::latest`].
    pub fn truth(&self) -> &ScanTruth {
        self.scanner.truth()
    }

    /// Returns the boxes detected in the latest scan.
    pub fn detections(&self) -> &[Detection] {
        self.detector.latest()
    }

    /// Returns the indices of one detection's points in the latest scan.
    pub fn point_indices_of(&self, detection: usize) -> &[u32] {
        self.detector.point_indices_of(detection)
    }

    /// Returns the beam of a point of the latest scan, and the range that was measured along it.
    pub fn point_beam(&self, point: usize) -> PointBeam {
        self.scanner.point_beam(point)
    }

    /// Returns true if the sensor has a mirror with two sides, which deflect the scans in turn.
    pub fn has_mirror_sides(&self) -> bool {
        self.scanner.has_mirror_sides()
    }
}
