//! Perception with the full rear chain (scan, boxes, classes, tracks), and object-level sensors ahead and to the sides.
//!
//! ```text
//!   step k:   Scene ─▶ scan ─▶ boxes ─▶ (classes from the camera) ─▶ queue ─┐
//!                                                                           │ L steps later
//!              tracks of step k + L ◀─ prediction by L steps ◀─ tracker ◀───┘
//! ```
//!
//! The processing latency is L whole control steps. The tracks are predicted by the latency to the present. The ego's
//! own motion is known without error, unless the scenario gives it one ([`crate::faults`]).

use std::collections::VecDeque;

use rand::RngExt;

use closecall_traffic::{Environment, Road, Stream, Time, Track, VehicleState};

use crate::alterations::give_true_boxes;
use crate::faults::{Belief, FaultList, Faults, LidarFault, NOTICED_AFTER_SCANS};
use crate::lidar::{HALF_FIELD_TAN, Lidar, RearLidar};
use crate::object::{DEGRADED_SHARE, NoiseKey, ObjectSensor, ObjectSensorModel, ScanInput, range_in_weather_m};
use crate::perception::FieldOfView;
use crate::surroundings::{OtherVehicle, transform_scene};
use crate::{Alterations, Detection, Health, Perception, Scene, SensorError, SensorHealth};
use closecall_tracking::{RearView, TrackList, Tracker, TrackerModel, TrackerScan};

/// A classifier that assigns class scores to detections from the measurements of another sensor.
pub trait DetectionClassifier: Send {
    /// Replaces the class scores of each detection of the scan that ended at the scene's time.
    ///
    /// # Errors
    /// Returns [`SensorError::Classifier`] if the classifier cannot be run.
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError>;

    /// Returns the health of that sensor.
    fn health(&self) -> Health {
        Health::Ok
    }
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
    /// Number of the step from which on the tracker may have the scan.
    due_step: u64,
    /// Whether the tracker has had it.
    is_processed: bool,
    /// Whether no scan has arrived: nothing could be detected.
    is_missing: bool,
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
    /// Number of latest successive scans with the same points.
    frozen_scans: u32,
    /// Number of the next step.
    step: u64,
    faults: FaultList<LidarFault>,
    /// Whether scans are lost and late, drawn in each step if the LiDAR has faults.
    fault_rng: Stream,
    belief: Belief,
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
            frozen_scans: 0,
            step: 0,
            faults: FaultList::default(),
            fault_rng: key.stream("rear-lidar-fault"),
            belief: Belief::default(),
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

    /// Returns the same sensors with faults.
    #[must_use]
    pub(crate) fn with_faults(self, faults: &Faults) -> Self {
        Self {
            front: self.front.with_faults(faults.front_radar),
            surround: self.surround.with_faults(faults.surround),
            faults: faults.rear_lidar,
            belief: Belief::new(faults.odometry),
            ..self
        }
    }

    /// Returns the fault of the LiDAR in this step, in which a lost scan counts as that of a dead sensor, and the number of steps
    /// by which the scan is late.
    fn fault_now(&mut self, time: Time) -> (Option<LidarFault>, u64) {
        if self.faults.is_empty() {
            return (None, 0);
        }
        let [lost, late]: [f64; 2] = self.fault_rng.random();
        let fault = self
            .faults
            .at(time)
            .map(|fault| LidarFault { is_dead: fault.is_dead || lost < fault.lost_frames, ..fault });
        (fault, fault.map_or(0, |fault| fault.delay_steps(late)))
    }

    /// Scans the scene and appends its detections to the queue of pending scans.
    ///
    /// `believed` is the scene as the ego believes it to be.
    fn detect(&mut self, scene: &Scene<'_>, believed: &Scene<'_>) -> Result<(), SensorError> {
        let (fault, late_steps) = self.fault_now(scene.time);
        let seen = match self.altered.has_true_points {
            true => &Scene { environment: &Environment::CLEAR_DAY, ..*scene },
            false => scene,
        };
        self.lidar.scan_with([seen, believed], &mut self.rng, fault.as_ref());
        let is_frozen = fault.is_some_and(|fault| fault.is_frozen && !fault.is_dead);
        // The noise of a working sensor never repeats, so that a monitor finds a frozen one by comparing two scans.
        self.frozen_scans = if is_frozen { self.frozen_scans.saturating_add(1) } else { 0 };
        self.empty_scans = if self.lidar.is_dark() { self.empty_scans.saturating_add(1) } else { 0 };
        self.health = self.judge_health(scene, fault.as_ref());
        let has_true_clusters = self.altered.has_true_clusters;
        let found = if has_true_clusters { self.lidar.detect_by_truth()? } else { self.lidar.detect()? };
        // Reuses the memory of a scan that the tracker has processed.
        let mut detections = Vec::new();
        while let Some(scan) = self.pending.pop_front_if(|scan| scan.is_processed) {
            detections = scan.detections;
        }
        detections.clear();
        detections.extend_from_slice(found);
        if has_true_clusters {
            give_true_boxes(&mut detections, &self.others, believed);
        }
        if let Some(classifier) = &mut self.classifier {
            classifier.classify(believed, &mut detections)?;
        }
        let mut scan = PendingScan {
            time: scene.time,
            road: *scene.road,
            ego: believed.ego.state,
            detections,
            // Scans arrive in their order.
            due_step: (self.step + self.latency_steps as u64 + late_steps)
                .max(self.pending.back().map_or(0, |scan| scan.due_step)),
            is_processed: false,
            is_missing: fault.is_some_and(|fault| fault.is_dead),
        };
        if let Some(offset_s) = fault.map(|fault| fault.clock_offset_s).filter(|offset_s| *offset_s != 0.0) {
            scan.misdate(offset_s);
        }
        self.pending.push_back(scan);
        Ok(())
    }

    /// Returns the LiDAR's health: failed if no point has returned for a while, or the same ones again and again; degraded if weather or dirt cost more
    /// than half of the range.
    fn judge_health(&self, scene: &Scene<'_>, fault: Option<&LidarFault>) -> Health {
        let degraded_below_m = DEGRADED_SHARE * self.nominal_range_m;
        let clear_range_m = fault.map_or(self.clear_range_m, |fault| self.clear_range_m * fault.window_transmission);
        if self.empty_scans >= NOTICED_AFTER_SCANS || self.frozen_scans >= NOTICED_AFTER_SCANS {
            Health::Failed
        } else if clear_range_m < degraded_below_m
            || range_in_weather_m(clear_range_m, scene.environment) < degraded_below_m
        {
            Health::Degraded
        } else {
            Health::Ok
        }
    }

    /// Passes the scans whose latency has elapsed to the tracker: one in each step, if no fault delays them.
    fn update_tracker(&mut self, sensor_x_m: f64) {
        let due = self.pending.iter_mut().filter(|scan| !scan.is_processed && scan.due_step <= self.step);
        for scan in due {
            scan.is_processed = true;
            let range_m = if scan.is_missing { 0.0 } else { self.nominal_range_m };
            let view = RearView { half_angle_tan: HALF_FIELD_TAN, range_m, sensor_x_m };
            let scan =
                TrackerScan { time: scan.time, road: &scan.road, ego: scan.ego, view, detections: &scan.detections };
            self.tracker.update(&scan, &mut self.list);
        }
    }
}

impl FullPerception {
    /// Measures `scene`, which the ego believes to be `believed`, and lists the tracks.
    fn perceive(&mut self, scene: &Scene<'_>, believed: &Scene<'_>) -> Result<(), SensorError> {
        let frame = transform_scene(believed, &mut self.others)?;
        self.list.tracks.clear();
        let input = ScanInput { scene: believed, frame: &frame, others: &self.others };
        self.front.scan(&input, &mut self.list);
        self.surround.scan(&input, &mut self.list);
        self.detect(scene, believed)?;
        self.update_tracker(-0.5 * scene.ego.vehicle.dimensions.length_m);
        self.tracker.report(scene.time, &frame, &mut self.list);
        self.step += 1;
        Ok(())
    }

    /// Returns the worse of the health of the LiDAR and of the camera.
    fn rear_health(&self) -> Health {
        match self.classifier.as_ref().map_or(Health::Ok, |classifier| classifier.health()) {
            Health::Ok => self.health,
            Health::Failed => Health::Failed,
            Health::Degraded if self.health == Health::Failed => Health::Failed,
            Health::Degraded => Health::Degraded,
        }
    }
}

impl PendingScan {
    /// Dates the scan `offset_s` later than it was measured: the ego then takes itself to have measured it from where it was
    /// at that time.
    fn misdate(&mut self, offset_s: f64) {
        #[expect(clippy::cast_possible_truncation, reason = "some milliseconds")]
        let offset = Time::from_ns((offset_s * 1e9).round() as i64);
        self.time += offset;
        self.ego.s_m += self.ego.speed_mps * self.ego.heading_rad.cos() * offset_s;
        self.ego.d_m += self.ego.speed_mps * self.ego.heading_rad.sin() * offset_s;
        self.detections.iter_mut().for_each(|detection| detection.time += offset);
    }
}

impl Perception for FullPerception {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let mut belief = std::mem::take(&mut self.belief);
        let result = self.perceive(scene, &belief.of(scene));
        self.belief = belief;
        result.map(|()| &*self.list.tracks)
    }

    fn health(&self) -> SensorHealth {
        SensorHealth { front: self.front.health(), surround: self.surround.health(), rear: self.rear_health() }
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
