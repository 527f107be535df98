//! Perception with the full rear chain (scan, boxes, classes, tracks), and object-level sensors ahead and to the sides.
//!
//! ```text
//!   step k:   Scene ─▶ scan ─▶ boxes ─▶ (classes from the camera) ─▶ queue ─┐
//!                                                                           │ L steps later
//!              tracks of step k + L ◀─ prediction by L steps ◀─ tracker ◀───┘
//! ```
//!
//! The processing latency is L whole control steps. The tracks are predicted by the latency to the present. The ego's
//! own motion is known without error.

use std::collections::VecDeque;

use closecall_traffic::{Environment, Road, Stream, Time, Track, VehicleState};

use crate::alterations::give_true_boxes;
use crate::lidar::{HALF_FIELD_TAN, Lidar, RearLidar};
use crate::object::{DEGRADED_SHARE, NoiseKey, ObjectSensor, ObjectSensorModel, ScanInput, range_in_weather_m};
use crate::perception::FieldOfView;
use crate::surroundings::{OtherVehicle, transform_scene};
use crate::{Alterations, Detection, Health, Perception, Scene, SensorError, SensorHealth};
use closecall_tracking::{RearView, TrackList, Tracker, TrackerModel, TrackerScan};

/// Number of successive scans without a single point, not even from the road, after which the LiDAR counts as blocked:
/// 1 s.
const BLOCKED_AFTER_SCANS: u32 = 25;

/// A classifier that assigns class scores to detections from the measurements of another sensor.
pub trait DetectionClassifier: Send {
    /// Replaces the class scores of each detection of the scan that ended at the scene's time.
    ///
    /// # Errors
    /// Returns [`SensorError::Classifier`] if the classifier cannot be run.
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError>;
}

/// The sensor and tracker models of the full chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullModel {
    /// The radar that looks ahead.
    pub front_radar: ObjectSensorModel,
    /// The short-range sensors around the ego.
    pub surround: ObjectSensorModel,
    /// The rear LiDAR.
    pub rear_lidar: Lidar,
    /// The tracker that processes the boxes of the rear LiDAR.
    pub tracker: TrackerModel,
}

/// One scan whose processing latency has not elapsed.
#[derive(Clone, Debug)]
struct PendingScan {
    time: Time,
    road: Road,
    ego: VehicleState,
    detections: Vec<Detection>,
}

/// Perception by LiDAR point clouds behind the ego, and by object-level sensors in the other directions.
pub struct FullPerception {
    front: ObjectSensor,
    surround: ObjectSensor,
    lidar: RearLidar,
    nominal_range_m: f64,
    /// The nominal range times the transmission of the sensor's window (m).
    clear_range_m: f64,
    /// Number of latest successive scans without a point.
    empty_scans: u32,
    health: Health,
    rng: Stream,
    classifier: Option<Box<dyn DetectionClassifier>>,
    latency_steps: usize,
    pending: VecDeque<PendingScan>,
    altered: Alterations,
    tracker: Tracker,
    others: Vec<OtherVehicle>,
    list: TrackList,
}

impl FullPerception {
    /// Creates the sensors before their first step, with random streams keyed by `key`.
    pub fn new(model: &FullModel, key: &NoiseKey) -> Self {
        Self {
            front: ObjectSensor::front_radar(model.front_radar, key),
            surround: ObjectSensor::surround(model.surround, key),
            lidar: RearLidar::new(model.rear_lidar),
            nominal_range_m: model.rear_lidar.nominal_range_m,
            clear_range_m: model.rear_lidar.nominal_range_m * model.rear_lidar.window_transmission,
            empty_scans: 0,
            health: Health::Ok,
            rng: key.stream("rear-lidar"),
            classifier: None,
            latency_steps: model.tracker.latency_steps(),
            pending: VecDeque::new(),
            altered: Alterations::default(),
            tracker: Tracker::new(model.tracker),
            others: Vec::new(),
            list: TrackList::default(),
        }
    }

    /// Returns the same sensors with `classifier` applied to the detections of each scan.
    #[must_use]
    pub fn with_classifier(self, classifier: Box<dyn DetectionClassifier>) -> Self {
        Self { classifier: Some(classifier), ..self }
    }

    /// Returns the same sensors with parts of the rear LiDAR's chain replaced by the truth.
    #[must_use]
    pub(crate) fn altered(self, altered: Alterations) -> Self {
        Self { altered, ..self }
    }

    /// Scans the scene and appends its detections to the queue of pending scans.
    fn detect(&mut self, scene: &Scene<'_>) -> Result<(), SensorError> {
        let seen = match self.altered.has_true_points {
            true => &Scene { environment: &Environment::CLEAR_DAY, ..*scene },
            false => scene,
        };
        self.lidar.scan(seen, &mut self.rng);
        self.empty_scans = if self.lidar.is_dark() { self.empty_scans.saturating_add(1) } else { 0 };
        self.health = self.judge_health(scene);
        let has_true_clusters = self.altered.has_true_clusters;
        let found = if has_true_clusters { self.lidar.detect_by_truth()? } else { self.lidar.detect()? };
        // Reuses the memory of a scan that the tracker has processed.
        let mut detections = match self.pending.len() > self.latency_steps {
            true => self.pending.pop_front().map(|scan| scan.detections).unwrap_or_default(),
            false => Vec::new(),
        };
        detections.clear();
        detections.extend_from_slice(found);
        if has_true_clusters {
            give_true_boxes(&mut detections, &self.others, scene);
        }
        if let Some(classifier) = &mut self.classifier {
            classifier.classify(scene, &mut detections)?;
        }
        self.pending.push_back(PendingScan { time: scene.time, road: *scene.road, ego: scene.ego.state, detections });
        Ok(())
    }

    /// Returns the LiDAR's health: failed if no point has returned for a while, degraded if weather or dirt cost more
    /// than half of the range.
    fn judge_health(&self, scene: &Scene<'_>) -> Health {
        let degraded_below_m = DEGRADED_SHARE * self.nominal_range_m;
        if self.empty_scans >= BLOCKED_AFTER_SCANS {
            Health::Failed
        } else if self.clear_range_m < degraded_below_m
            || range_in_weather_m(self.clear_range_m, scene.environment) < degraded_below_m
        {
            Health::Degraded
        } else {
            Health::Ok
        }
    }

    /// Passes the scan whose latency elapses in this step to the tracker.
    fn update_tracker(&mut self, sensor_x_m: f64) {
        if self.pending.len() <= self.latency_steps {
            return;
        }
        if let Some(scan) = self.pending.front() {
            let view = RearView { half_angle_tan: HALF_FIELD_TAN, range_m: self.nominal_range_m, sensor_x_m };
            let scan =
                TrackerScan { time: scan.time, road: &scan.road, ego: scan.ego, view, detections: &scan.detections };
            self.tracker.update(&scan, &mut self.list);
        }
    }
}

impl Perception for FullPerception {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let frame = transform_scene(scene, &mut self.others)?;
        self.list.tracks.clear();
        let input = ScanInput { scene, frame: &frame, others: &self.others };
        self.front.scan(&input, &mut self.list);
        self.surround.scan(&input, &mut self.list);
        self.detect(scene)?;
        self.update_tracker(-0.5 * scene.ego.vehicle.dimensions.length_m);
        self.tracker.report(scene.time, &frame, &mut self.list);
        Ok(&self.list.tracks)
    }

    fn health(&self) -> SensorHealth {
        SensorHealth { front: self.front.health(), surround: self.surround.health(), rear: self.health }
    }

    fn rear_lidar(&self) -> Option<&RearLidar> {
        Some(&self.lidar)
    }

    fn rear_detections(&self) -> &[Detection] {
        self.pending.back().map_or(&[], |scan| &scan.detections)
    }

    fn rear_field(&self) -> Option<FieldOfView> {
        Some(FieldOfView { half_angle_tan: HALF_FIELD_TAN, range_m: self.nominal_range_m })
    }
}
