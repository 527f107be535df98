//! The chain behind a LiDAR: scan, boxes, queue, tracker.
//!
//! ```text
//!   step k:   Scene ─▶ scan ─▶ boxes ─▶ (classes from the camera) ─▶ queue ─┐
//!                                                                           │ L steps later
//!              tracks of step k + L ◀─ prediction by L steps ◀─ tracker ◀───┘
//! ```
//!
//! The processing latency is L whole control steps. The tracks are predicted by the latency to the present. A sensor whose rate is
//! below that of the control loop scans in some of the steps only; in the others its tracks are predicted further.

use std::collections::VecDeque;

use rand::RngExt;

use closecall_tracking::{RearView, TrackList, Tracker, TrackerModel, TrackerScan};
use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{CONTROL_STEP, Environment, Road, Stream, Time, VehicleState};

use crate::alterations::give_true_boxes;
use crate::faults::{FaultList, LidarFault, NOTICED_AFTER_SCANS};
use crate::full::DetectionClassifier;
use crate::lidar::{Lidar, LidarKind, RearLidar};
use crate::object::{DEGRADED_SHARE, NoiseKey, range_in_weather_m};
use crate::perception::FieldOfView;
use crate::surroundings::OtherVehicle;
use crate::{Alterations, Detection, Health, Scene, SensorError};

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

/// What a chain sees in one step.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a> {
    /// The scene.
    pub(crate) scene: &'a Scene<'a>,
    /// The scene as the ego believes it to be.
    pub(crate) believed: &'a Scene<'a>,
    /// The other vehicles of the latter.
    pub(crate) others: &'a [OtherVehicle],
    /// What of the chain is replaced by the truth.
    pub(crate) altered: &'a Alterations,
}

/// A LiDAR with its processing, from the scene to the tracks.
pub(crate) struct LidarChain {
    pub(crate) lidar: RearLidar,
    /// Scan pattern and range of the LiDAR.
    kind: &'static LidarKind,
    nominal_range_m: f64,
    /// Range up to which vehicles are expected (m).
    reach_m: f64,
    /// The nominal range times the transmission of the sensor's window (m).
    clear_range_m: f64,
    /// Number of latest successive scans without a point.
    empty_scans: u32,
    /// Number of latest successive scans with the same points.
    frozen_scans: u32,
    /// Number of such scans from which the ego counts the sensor as failed.
    noticed_after_scans: u32,
    /// Number of the next step.
    step: u64,
    faults: FaultList<LidarFault>,
    /// Whether scans are lost and late, drawn with each scan if the LiDAR has faults.
    fault_rng: Stream,
    pub(crate) health: Health,
    rng: Stream,
    latency_steps: usize,
    pending: VecDeque<PendingScan>,
    tracker: Tracker,
}

impl LidarChain {
    /// Creates the chain before its first step, with random streams keyed by `key` and `channel`.
    pub(crate) fn new(lidar: Lidar, tracker: TrackerModel, key: &NoiseKey, channel: [&str; 2]) -> Self {
        let period_s = lidar.kind.period_s();
        Self {
            lidar: RearLidar::new(lidar),
            kind: lidar.kind,
            nominal_range_m: lidar.nominal_range_m,
            reach_m: lidar.reach_m(),
            clear_range_m: lidar.nominal_range_m * lidar.window_transmission,
            empty_scans: 0,
            frozen_scans: 0,
            noticed_after_scans: scans_in(f64::from(NOTICED_AFTER_SCANS) * CONTROL_STEP.s(), period_s),
            step: 0,
            faults: FaultList::default(),
            fault_rng: key.stream(channel[1]),
            health: Health::Ok,
            rng: key.stream(channel[0]),
            latency_steps: tracker.latency_steps(),
            pending: VecDeque::new(),
            tracker: Tracker::new(tracker.with_scan_period_s(period_s)),
        }
    }

    /// Returns the same chain with faults of the sensor.
    pub(crate) fn with_faults(self, faults: FaultList<LidarFault>) -> Self {
        Self { faults, ..self }
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

    /// Scans the scene, if a scan is due, and appends its detections to the queue of pending scans.
    ///
    /// # Errors
    /// [`SensorError`] if a model fails.
    pub(crate) fn detect(
        &mut self,
        Seen { scene, believed, others, altered }: Seen<'_>,
        classifier: Option<&mut Box<dyn DetectionClassifier>>,
    ) -> Result<(), SensorError> {
        if !self.kind.is_due(scene.time) {
            return Ok(());
        }
        let (fault, late_steps) = self.fault_now(scene.time);
        let seen = match altered.has_true_points {
            true => &Scene { environment: &Environment::CLEAR_DAY, ..*scene },
            false => scene,
        };
        self.lidar.scan_with([seen, believed], &mut self.rng, fault.as_ref());
        let is_frozen = fault.is_some_and(|fault| fault.is_frozen && !fault.is_dead);
        // The noise of a working sensor never repeats, so that a monitor finds a frozen one by comparing two scans.
        self.frozen_scans = if is_frozen { self.frozen_scans.saturating_add(1) } else { 0 };
        self.empty_scans = if self.lidar.is_dark() { self.empty_scans.saturating_add(1) } else { 0 };
        self.health = self.judge_health(scene, fault.as_ref());
        let has_true_clusters = altered.has_true_clusters;
        let found = if has_true_clusters { self.lidar.detect_by_truth()? } else { self.lidar.detect()? };
        // Reuses the memory of a scan that the tracker has processed.
        let mut detections = Vec::new();
        while let Some(scan) = self.pending.pop_front_if(|scan| scan.is_processed) {
            detections = scan.detections;
        }
        detections.clear();
        detections.extend_from_slice(found);
        if has_true_clusters {
            give_true_boxes(&mut detections, others, believed);
        }
        if let Some(classifier) = classifier {
            classifier.classify(believed, &mut detections)?;
            detections.extend_from_slice(classifier.seen_alone());
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
        if self.empty_scans.max(self.frozen_scans) >= self.noticed_after_scans {
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
    pub(crate) fn update_tracker(&mut self, sensor_x_m: f64, list: &mut TrackList) {
        let due = self.pending.iter_mut().filter(|scan| !scan.is_processed && scan.due_step <= self.step);
        for scan in due {
            scan.is_processed = true;
            let range_m = if scan.is_missing { 0.0 } else { self.reach_m };
            let view = RearView { half_angle_tan: self.kind.half_field_tan, range_m, sensor_x_m };
            let scan =
                TrackerScan { time: scan.time, road: &scan.road, ego: scan.ego, view, detections: &scan.detections };
            self.tracker.update(&scan, list);
        }
        self.step += 1;
    }

    /// Appends the tracks at `time`, in the ego's frame, to `list`.
    pub(crate) fn report(&self, time: Time, frame: &EgoFrame<'_>, list: &mut TrackList) {
        self.tracker.report(time, frame, list);
    }

    /// Returns the boxes of the latest scan.
    pub(crate) fn detections(&self) -> &[Detection] {
        self.pending.back().map_or(&[], |scan| &scan.detections)
    }

    /// Returns the field of view.
    pub(crate) fn field(&self) -> FieldOfView {
        FieldOfView { half_angle_tan: self.kind.half_field_tan, range_m: self.reach_m }
    }
}

/// Returns the number of scans in a time, one at least.
fn scans_in(time_s: f64, period_s: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a second has 25 scans at most")]
    let scans = (time_s / period_s).round() as u32;
    scans.max(1)
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
