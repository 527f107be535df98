//! The whole chain behind E: scan, boxes, classes, tracks; ahead and to the sides the object-level sensors.
//!
//! ```text
//!   step k:   Scene ─▶ scan ─▶ boxes ─▶ (classes from the camera) ─▶ queue ─┐
//!                                                            L steps later  ▼
//!                                        tracks predicted to now ◀── tracker ◀┘
//! ```
//!
//! The processing takes whole control steps; what it has found by then is predicted to the present. E's own motion is
//! known without error.

use std::collections::VecDeque;

use closecall_traffic::{Road, Stream, Time, Track, VehicleState};

use crate::lidar::{Lidar, RearLidar};
use crate::object::{DEGRADED_SHARE, NoiseKey, ObjectSensor, ObjectSensorModel, ScanView, range_in_weather_m};
use crate::perception::FieldOfView;
use crate::surroundings::{Other, survey};
use crate::tracking::{RearView, TrackList, Tracker, TrackerModel, TrackerScan};
use crate::{Detection, Health, Perception, Scene, SensorError, SensorHealth};

/// Tangent of half of the LiDAR's field of view, 66.5° (Valeo SCALA Gen 2).
const HALF_FIELD_TAN: f64 = 2.2998;
/// Scans in a row without a single point, not even from the road, after which the LiDAR counts as blocked: 1 s.
const DARK_SCANS: u32 = 25;

/// Gives detections the classes that another sensor sees.
pub trait DetectionClassifier: Send {
    /// Looks at each detection of a scan that ended at the scene's time, and replaces its class scores by ones that take
    /// in what was seen.
    ///
    /// # Errors
    /// [`SensorError::Classifier`] where the classifier could not be run.
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError>;
}

/// The models that the full chain is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullModel {
    /// The radar that looks ahead.
    pub front_radar: ObjectSensorModel,
    /// The short-range sensors all round.
    pub surround: ObjectSensorModel,
    /// The rear LiDAR.
    pub rear_lidar: Lidar,
    /// The tracker behind it.
    pub tracker: TrackerModel,
}

/// One scan that waits for its processing to end.
#[derive(Clone, Debug)]
struct Pending {
    time: Time,
    road: Road,
    ego: VehicleState,
    detections: Vec<Detection>,
}

/// Perception by point clouds behind E, and by object-level sensors elsewhere.
pub struct FullPerception {
    front: ObjectSensor,
    surround: ObjectSensor,
    lidar: RearLidar,
    reach_m: f64,
    /// The nominal range with what the window lets through [m].
    clear_m: f64,
    /// Latest scans in a row without a point.
    dark_scans: u32,
    health: Health,
    rng: Stream,
    classifier: Option<Box<dyn DetectionClassifier>>,
    latency_steps: usize,
    pending: VecDeque<Pending>,
    tracker: Tracker,
    others: Vec<Other>,
    list: TrackList,
}

impl FullPerception {
    /// All sensors at rest, with streams of their own under `key`.
    pub fn new(model: &FullModel, key: &NoiseKey) -> Self {
        Self {
            front: ObjectSensor::front_radar(model.front_radar, key),
            surround: ObjectSensor::surround(model.surround, key),
            lidar: RearLidar::new(model.rear_lidar),
            reach_m: model.rear_lidar.nominal_range_m,
            clear_m: model.rear_lidar.nominal_range_m * model.rear_lidar.window_transmission,
            dark_scans: 0,
            health: Health::Ok,
            rng: key.stream("rear-lidar"),
            classifier: None,
            latency_steps: model.tracker.latency_steps(),
            pending: VecDeque::new(),
            tracker: Tracker::new(model.tracker),
            others: Vec::new(),
            list: TrackList::default(),
        }
    }

    /// The same sensors with `classifier` looking at each detection.
    #[must_use]
    pub fn with_classifier(self, classifier: Box<dyn DetectionClassifier>) -> Self {
        Self { classifier: Some(classifier), ..self }
    }

    /// Scans the scene and lines its detections up behind those that are still being processed.
    fn detect(&mut self, scene: &Scene<'_>) -> Result<(), SensorError> {
        let is_dark = self.lidar.scan(scene, &mut self.rng).is_empty();
        self.dark_scans = if is_dark { self.dark_scans.saturating_add(1) } else { 0 };
        self.health = self.judged(scene);
        let found = self.lidar.detect()?;
        // The memory of a scan that has been processed is used again.
        let mut detections = match self.pending.len() > self.latency_steps {
            true => self.pending.pop_front().map(|scan| scan.detections).unwrap_or_default(),
            false => Vec::new(),
        };
        detections.clear();
        detections.extend_from_slice(found);
        if let Some(classifier) = &mut self.classifier {
            classifier.classify(scene, &mut detections)?;
        }
        self.pending.push_back(Pending { time: scene.time, road: *scene.road, ego: scene.ego.state, detections });
        Ok(())
    }

    /// Blocked where nothing comes back for a while, degraded where weather or dirt cost more than half of the range.
    fn judged(&self, scene: &Scene<'_>) -> Health {
        let least_m = DEGRADED_SHARE * self.reach_m;
        if self.dark_scans >= DARK_SCANS {
            Health::Failed
        } else if self.clear_m < least_m || range_in_weather_m(self.clear_m, scene.environment) < least_m {
            Health::Degraded
        } else {
            Health::Ok
        }
    }

    /// Hands the scan whose processing ends now to the tracker.
    fn follow(&mut self, sensor_x_m: f64) {
        if self.pending.len() <= self.latency_steps {
            return;
        }
        if let Some(scan) = self.pending.front() {
            let view = RearView { half_angle_tan: HALF_FIELD_TAN, range_m: self.reach_m, sensor_x_m };
            let scan =
                TrackerScan { time: scan.time, road: &scan.road, ego: scan.ego, view, detections: &scan.detections };
            self.tracker.update(&scan, &mut self.list);
        }
    }
}

impl Perception for FullPerception {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let frame = survey(scene, &mut self.others)?;
        self.list.tracks.clear();
        let view = ScanView { scene, frame: &frame, others: &self.others };
        self.front.scan(&view, &mut self.list);
        self.surround.scan(&view, &mut self.list);
        self.detect(scene)?;
        self.follow(-0.5 * scene.ego.vehicle.dimensions.length_m);
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
        Some(FieldOfView { half_angle_tan: HALF_FIELD_TAN, range_m: self.reach_m })
    }
}
