//! One LiDAR of a chain: its scans, its faults, and the boxes that wait for the tracker.

use std::collections::VecDeque;

use rand::RngExt;

use crate::tracking::RearView;
use closecall_traffic::{CONTROL_STEP, Environment, Road, Stream, Time, VehicleState, maths};

use super::Seen;
use super::road_watch::RoadWatch;
use crate::alterations::give_true_boxes;
use crate::external::OutsideScan;
use crate::faults::{FaultList, LidarFault, NOTICED_AFTER_SCANS};
use crate::lidar::{LaneGeometry, Lidar, LidarKind, LidarScan, RESERVED_CLUSTERS, RearLidar};
use crate::monitors::{Alarm, Alarms, Arrival, TransportMonitor};
use crate::object::{DEGRADED_SHARE, NoiseKey, range_in_weather_m};
use crate::perception::FieldOfView;
use crate::{Detection, Health, Scene, SensorError};

/// Number of scans that wait for the tracker, or whose memory does, for which a list is reserved.
/// Late scans may need more.
const RESERVED_SCANS: usize = 8;

/// One scan whose processing latency has not elapsed.
#[derive(Clone, Debug)]
pub(super) struct PendingScan {
    /// Number of the scan.
    pub(super) number: u64,
    pub(super) time: Time,
    pub(super) road: Road,
    pub(super) ego: VehicleState,
    pub(super) detections: Vec<Detection>,
    /// Number of the step from which on the tracker may have the scan.
    pub(super) due_step: u64,
    /// Whether the tracker has had it.
    pub(super) is_processed: bool,
    /// Whether no scan has arrived: nothing could be detected.
    pub(super) is_missing: bool,
    /// Time of arrival less the time stamp and the usual latency (s).
    pub(super) lateness_s: f64,
}

/// A LiDAR with its faults.
pub(super) struct ChainSensor {
    pub(super) lidar: RearLidar,
    pub(super) model: Lidar,
    /// Scan pattern and range of the LiDAR.
    kind: &'static LidarKind,
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
    pub(super) faults: FaultList<LidarFault>,
    /// Whether scans are lost and late, drawn with each scan if the LiDAR has faults.
    fault_rng: Stream,
    pub(super) health: Health,
    /// What the monitors have noticed.
    pub(super) alarms: Alarms,
    /// The monitor of the scans that the tracker gets.
    pub(super) transport: TransportMonitor,
    road_watch: RoadWatch,
    rng: Stream,
    pub(super) pending: VecDeque<PendingScan>,
    /// Number of scans so far.
    pub(super) scans: u64,
    /// Memory of the scans that the tracker has processed. Later scans use it again.
    spare: Vec<Vec<Detection>>,
}

/// A scan before its boxes are classified.
pub(super) struct NewScan {
    pub(super) detections: Vec<Detection>,
    pub(super) fault: Option<LidarFault>,
    pub(super) late_steps: u64,
}

impl NewScan {
    /// Returns whether no scan has arrived.
    pub(super) fn is_missing(&self) -> bool {
        self.fault.is_some_and(|fault| fault.is_dead)
    }

    /// Returns the time by which the scan is dated too late.
    pub(super) fn clock_offset(&self) -> Time {
        self.fault.map_or(Time::ZERO, |fault| offset(fault.clock_offset_s))
    }
}

impl ChainSensor {
    /// Creates the sensor before its first step, with random streams keyed by `key` and `channel`.
    pub(super) fn new(lidar: Lidar, key: &NoiseKey, channel: [&str; 2]) -> Self {
        let noticed_s = f64::from(NOTICED_AFTER_SCANS) * CONTROL_STEP.s();
        Self {
            lidar: RearLidar::new(lidar),
            model: lidar,
            kind: lidar.kind,
            reach_m: lidar.reach_m(),
            clear_range_m: lidar.nominal_range_m * lidar.window_transmission,
            empty_scans: 0,
            frozen_scans: 0,
            noticed_after_scans: scans_in(noticed_s, lidar.kind.period_s()),
            faults: FaultList::default(),
            fault_rng: key.stream(channel[1]),
            health: Health::Ok,
            alarms: Alarms::NONE,
            transport: TransportMonitor::new(lidar.kind.period_s()),
            road_watch: RoadWatch::new(lidar.kind),
            rng: key.stream(channel[0]),
            pending: VecDeque::with_capacity(RESERVED_SCANS),
            scans: 0,
            spare: Vec::with_capacity(RESERVED_SCANS),
        }
    }

    /// Returns whether a scan ends at this time.
    pub(super) fn is_due(&self, time: Time) -> bool {
        self.kind.is_due(time)
    }

    /// Returns the fault of the LiDAR in this step, and the number of steps by which the scan is
    /// late. A lost scan counts as a scan of a dead sensor.
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

    /// Scans the scene, and detects boxes.
    ///
    /// # Errors
    /// [`SensorError`] if a model fails.
    pub(super) fn scan(&mut self, seen: &Seen<'_>) -> Result<NewScan, SensorError> {
        let mut new = self.scan_only(seen);
        let Seen { believed, others, altered, .. } = *seen;
        let has_true_clusters = altered.has_true_clusters;
        let measured = if has_true_clusters { self.lidar.detect_by_truth()? } else { self.lidar.detect()? };
        new.detections.extend_from_slice(measured);
        if has_true_clusters {
            give_true_boxes(&mut new.detections, others, believed);
        }
        Ok(new)
    }

    /// Scans the scene without detecting boxes.
    pub(super) fn scan_only(&mut self, seen: &Seen<'_>) -> NewScan {
        let Seen { scene, believed, altered, .. } = *seen;
        let (fault, late_steps) = self.fault_now(scene.time);
        let seen = match altered.has_true_points {
            true => &Scene { environment: &Environment::CLEAR_DAY, ..*scene },
            false => scene,
        };
        self.lidar.scan_with([seen, believed], &mut self.rng, fault.as_ref());
        let is_frozen = fault.is_some_and(|fault| fault.is_frozen && !fault.is_dead);
        // The noise of a working sensor never repeats, so that a monitor finds a frozen one by
        // comparing two scans.
        self.frozen_scans = if is_frozen { self.frozen_scans.saturating_add(1) } else { 0 };
        self.empty_scans = if self.lidar.is_dark() { self.empty_scans.saturating_add(1) } else { 0 };
        // A silent sensor shows the monitor nothing, and a frozen one nothing new.
        if fault.is_none_or(|fault| !fault.is_dead && !fault.is_frozen) {
            self.road_watch.look(&mut self.lidar, seen);
        }
        (self.alarms, self.health) = self.judge_health(scene, fault.as_ref());
        while let Some(scan) = self.pending.pop_front_if(|scan| scan.is_processed) {
            self.spare.push(scan.detections);
        }
        let mut detections = self.spare.pop().unwrap_or_else(|| Vec::with_capacity(RESERVED_CLUSTERS));
        detections.clear();
        NewScan { detections, fault, late_steps }
    }

    /// Detects boxes in a recorded scan, and appends it to the queue. The tracker may have it from
    /// `due_step` on.
    ///
    /// # Errors
    /// [`SensorError`] if a point is not finite.
    pub(super) fn push_recorded(
        &mut self,
        scan: &LidarScan,
        (road, ego): (&Road, VehicleState),
        due_step: u64,
    ) -> Result<(), SensorError> {
        while let Some(scan) = self.pending.pop_front_if(|scan| scan.is_processed) {
            self.spare.push(scan.detections);
        }
        let mut detections = self.spare.pop().unwrap_or_else(|| Vec::with_capacity(RESERVED_CLUSTERS));
        detections.clear();
        detections.extend_from_slice(self.lidar.detect_recorded(scan, &LaneGeometry::new(road, &ego))?);
        self.pending.push_back(PendingScan {
            number: self.scans,
            time: scan.end,
            road: road.clone(),
            ego,
            detections,
            due_step,
            is_processed: false,
            is_missing: false,
            lateness_s: 0.0,
        });
        self.scans += 1;
        Ok(())
    }

    /// Returns the latest scan as a program gets it.
    pub(super) fn outside_scan(&self) -> OutsideScan {
        OutsideScan {
            sensor: self.model.name(),
            has_mirror_sides: self.lidar.has_mirror_sides(),
            scan: self.lidar.complete_scan(),
        }
    }

    /// Keeps the memory of a scan that the tracker does not get.
    pub(super) fn recycle(&mut self, scan: NewScan) {
        let lateness_s = scan.late_steps as f64 * CONTROL_STEP.s() - scan.clock_offset().s();
        self.transport.observe(Arrival { is_lost: scan.is_missing(), lateness_s });
        self.spare.push(scan.detections);
    }

    /// Appends a scan to the queue. The tracker may have it from `step` on, if it is not late.
    pub(super) fn push(&mut self, new: NewScan, step: u64, Seen { scene, believed, .. }: &Seen<'_>) {
        // Scans arrive in their order.
        let due_step = (step + new.late_steps).max(self.pending.back().map_or(0, |scan| scan.due_step));
        let mut scan = PendingScan {
            number: self.scans,
            time: scene.time,
            road: believed.road.clone(),
            ego: believed.ego.state,
            is_missing: new.is_missing(),
            detections: new.detections,
            due_step,
            is_processed: false,
            lateness_s: due_step.saturating_sub(step) as f64 * CONTROL_STEP.s(),
        };
        if let Some(offset_s) = new.fault.map(|fault| fault.clock_offset_s).filter(|offset_s| *offset_s != 0.0) {
            scan.misdate(offset_s);
        }
        self.pending.push_back(scan);
        self.scans += 1;
    }

    /// Returns what the monitors have noticed, and the LiDAR's health: failed if no point has
    /// returned for a while, or if the same points return again and again; degraded if weather or
    /// dirt cost more than half of the range, or if another monitor has noticed something.
    fn judge_health(&self, scene: &Scene<'_>, fault: Option<&LidarFault>) -> (Alarms, Health) {
        let degraded_below_m = DEGRADED_SHARE * self.model.nominal_range_m;
        let clear_range_m = fault.map_or(self.clear_range_m, |fault| self.clear_range_m * fault.window_transmission);
        let is_short =
            clear_range_m < degraded_below_m || range_in_weather_m(clear_range_m, scene.environment) < degraded_below_m;
        let has_failed = self.empty_scans.max(self.frozen_scans) >= self.noticed_after_scans;
        let alarms = self
            .road_watch
            .alarms()
            .with_if(Alarm::NothingNew, has_failed)
            .with_if(Alarm::ShortRange, is_short)
            .with_if(Alarm::LostScans, self.transport.loses_scans())
            .with_if(Alarm::LateScans, self.transport.is_late());
        let health = match (has_failed, alarms.is_empty()) {
            (true, _) => Health::Failed,
            (false, false) => Health::Degraded,
            (false, true) => Health::Ok,
        };
        (alarms, health)
    }

    /// Returns the boxes of the latest scan.
    pub(super) fn detections(&self) -> &[Detection] {
        self.pending.back().map_or(&[], |scan| &scan.detections)
    }

    /// Returns the field of view.
    pub(super) fn field(&self) -> FieldOfView {
        FieldOfView {
            half_angle_tan: self.kind.half_field_tan,
            range_m: self.reach_m,
            inset_m: self.model.inset_m,
            left_m: self.model.left_m,
            azimuth_rad: self.model.azimuth_rad,
        }
    }

    /// Returns the field of view for the tracker, of a sensor whose ego has its rear end at
    /// `rear_x_m`.
    pub(super) fn view(&self, rear_x_m: f64) -> RearView {
        RearView {
            half_angle_tan: self.kind.half_field_tan,
            range_m: self.reach_m,
            sensor_x_m: rear_x_m + self.model.inset_m,
            sensor_y_m: self.model.left_m,
            axis_azimuth_rad: self.model.azimuth_rad,
        }
    }
}

/// Returns the number of scans in a time, one at least.
fn scans_in(time_s: f64, period_s: f64) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a second has 25 scans at most")]
    let scans = (time_s / period_s).round() as u32;
    scans.max(1)
}

/// Returns the offset of a clock as a time.
fn offset(offset_s: f64) -> Time {
    #[expect(clippy::cast_possible_truncation, reason = "some milliseconds")]
    let offset_ns = (offset_s * 1e9).round() as i64;
    Time::from_ns(offset_ns)
}

impl PendingScan {
    /// Returns what the ego sees of the transport of the scan.
    pub(super) fn arrival(&self) -> Arrival {
        Arrival { is_lost: self.is_missing, lateness_s: self.lateness_s }
    }

    /// Dates the scan `offset_s` later than it was measured: the ego then takes itself to have
    /// measured it from where it was at that time.
    fn misdate(&mut self, offset_s: f64) {
        let offset = offset(offset_s);
        self.time += offset;
        self.lateness_s -= offset_s;
        self.ego.s_m += self.ego.speed_mps * maths::cos(self.ego.heading_rad) * offset_s;
        self.ego.d_m += self.ego.speed_mps * maths::sin(self.ego.heading_rad) * offset_s;
        self.detections.iter_mut().for_each(|detection| detection.time += offset);
    }
}
