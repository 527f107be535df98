//! The chain behind the LiDARs that look in one direction: scans, boxes, queues, one tracker.
//!
//! ```text
//!   step k:   Scene ─▶ scan ─▶ boxes ─▶ (classes from the camera) ─▶ queue ─┐
//!                  └─▶ scan ─▶ boxes ─▶            〃             ─▶ queue ─┤ L steps later
//!              tracks of step k + L ◀─ prediction by L steps ◀─ tracker ◀───┘
//! ```
//!
//! The processing latency is L whole control steps. The tracks are predicted by the latency to the
//! present. A sensor that is slower than the control loop scans in some of the steps only;
//! in the other steps its tracks are predicted further.
//!
//! Several sensors share the tracker, not the clusters: each scan is clustered on its own, in the
//! ego's frame at its end, and the tracker is corrected with the boxes of all sensors in the order
//! of their times (Darms, Rybski, Baker and Urmson 2009, "Obstacle detection and tracking for the
//! Urban Challenge"). The parts that a box may have missed follow from the sensor that measured it
//! (spacing of its columns and layers, hidden edges, ends of its field of view). Merged points no
//! longer show the sensor. A sensor that is late, slow, dead or badly mounted disturbs no boxes of
//! other sensors. The alternative, one cloud of all points (the concatenation of Autoware), gives
//! denser clusters where fields of view overlap.

use crate::tracking::{BoxUse, RearView, TrackList, Tracker, TrackerModel, TrackerScan};
use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Road, Time, VehicleState};

use crate::external::{Outside, PerceptionAnswer};
use crate::faults::{FaultList, LidarFault, RadarFault};

use crate::detection_classifier::DetectionClassifier;
use crate::lidar::{Lidar, LidarScan, RESERVED_CLUSTERS};
use crate::monitors::Alarms;
use crate::object::NoiseKey;
use crate::perception::{FieldOfView, MountedLidar, UsedBox};
use crate::radar::{MountedRadars, RearRadars};
use crate::surroundings::OtherVehicle;
use crate::{Alterations, Detection, Health, Scene, SensorError, joint_health};

mod road_watch;
mod sensor;

use sensor::{ChainSensor, NewScan};

/// Number of LiDARs of a chain, at most.
const MAX_LIDARS: usize = 1 + MAX_ADDITIONAL_LIDARS;

/// The result of a chain in one step.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a> {
    /// The scene.
    pub(crate) scene: &'a Scene<'a>,
    /// The scene as the ego believes it to be.
    pub(crate) believed: &'a Scene<'a>,
    /// The other vehicles of the scene that the ego believes.
    pub(crate) others: &'a [OtherVehicle],
    /// The stages of the chain that the truth replaces.
    pub(crate) altered: &'a Alterations,
}

/// LiDARs with their processing, from the scene to the tracks.
pub(crate) struct LidarChain {
    /// One sensor at least.
    sensors: Vec<ChainSensor>,
    /// Number of the next step.
    step: u64,
    latency_steps: usize,
    tracker: Tracker,
    /// The radars that measure the speeds of the tracks, if there are any.
    radars: Option<RearRadars>,
    /// The scans of this step, with the indices of their sensors.
    scans: Vec<(usize, NewScan)>,
    /// The detections of several scans.
    all: Vec<Detection>,
    /// What the tracker has made of the boxes in this step, each with the number of its scan.
    uses: Vec<(u64, BoxUse)>,
}

impl LidarChain {
    /// Creates the chain of these sensors before its first step. `channel` has the names of the
    /// random streams of the first sensor, and of its faults.
    pub(crate) fn new(
        lidars: impl IntoIterator<Item = Lidar>,
        tracker: TrackerModel,
        key: &NoiseKey,
        channel: [&str; 2],
    ) -> Self {
        let sensor = |(index, lidar): (usize, Lidar)| match index {
            0 => ChainSensor::new(lidar, key, channel),
            _ => {
                let names = channel.map(|channel| format!("{channel}/{}", lidar.name()));
                ChainSensor::new(lidar, key, [&names[0], &names[1]])
            }
        };
        let sensors: Vec<ChainSensor> = lidars.into_iter().enumerate().map(sensor).collect();
        let period_s = sensors.iter().map(|sensor| sensor.model.kind.period_s()).fold(f64::INFINITY, f64::min);
        Self {
            sensors,
            step: 0,
            latency_steps: tracker.latency_steps(),
            tracker: Tracker::new(tracker.with_scan_period_s(period_s)),
            radars: None,
            scans: Vec::with_capacity(MAX_LIDARS),
            all: Vec::new(),
            uses: Vec::with_capacity(RESERVED_CLUSTERS),
        }
    }

    /// Returns the same chain, the speeds of whose tracks these radars measure, too.
    pub(crate) fn with_radars(self, radars: Option<RearRadars>) -> Self {
        Self { radars, ..self }
    }

    /// Returns the same chain, whose radars keep their scans for a program, too.
    pub(crate) fn with_program(self) -> Self {
        Self { radars: self.radars.map(RearRadars::with_program), ..self }
    }

    /// Returns the same chain with faults of its radars.
    pub(crate) fn with_radar_faults(self, faults: FaultList<RadarFault>) -> Self {
        Self { radars: self.radars.map(|radars| radars.with_faults(faults)), ..self }
    }

    /// Returns the same chain with faults of the sensors.
    pub(crate) fn with_faults(mut self, faults: FaultList<LidarFault>) -> Self {
        for sensor in &mut self.sensors {
            sensor.faults = faults.of_sensor(sensor.model.name());
        }
        self
    }

    /// Scans the scene with each sensor whose scan is due, and appends its detections to the queue
    /// of pending scans. The classifier sees the boxes of all these sensors at once.
    ///
    /// # Errors
    /// [`SensorError`] if a model fails.
    pub(crate) fn detect(
        &mut self,
        seen: Seen<'_>,
        classifier: Option<&mut Box<dyn DetectionClassifier>>,
    ) -> Result<(), SensorError> {
        self.sense(&seen)?;
        let mut scans = std::mem::take(&mut self.scans);
        for (index, sensor) in self.sensors.iter_mut().enumerate() {
            if sensor.is_due(seen.scene.time) {
                scans.push((index, sensor.scan(&seen)?));
            }
        }
        self.classify(&seen, classifier, &mut scans)?;
        self.push(&seen, scans);
        Ok(())
    }

    /// Scans the scene as [`Self::detect`] does, and lets a program process the scans. Its
    /// detections take the place of boxes; its tracks are kept until they are due.
    ///
    /// # Errors
    /// [`SensorError`] if a model or the program fails.
    pub(crate) fn ask(
        &mut self,
        seen: Seen<'_>,
        classifier: Option<&mut Box<dyn DetectionClassifier>>,
        outside: &mut Outside,
    ) -> Result<(), SensorError> {
        self.sense(&seen)?;
        let mut scans = std::mem::take(&mut self.scans);
        let mut arrived = Vec::with_capacity(self.sensors.len());
        for (index, sensor) in self.sensors.iter_mut().enumerate() {
            if sensor.is_due(seen.scene.time) {
                let new = sensor.scan_only(&seen);
                if !new.is_missing() {
                    arrived.push(sensor.outside_scan());
                }
                scans.push((index, new));
            }
        }
        if !scans.is_empty() {
            let due_step = self.step + self.latency_steps as u64;
            let radar_scans = self.radars.as_mut().map(|radars| radars.arrived(due_step)).unwrap_or_default();
            match outside.ask([seen.scene, seen.believed], (&arrived, &radar_scans))? {
                PerceptionAnswer::Detections(detections) => {
                    // The boxes belong to no LiDAR alone. They come with the first scan that has
                    // arrived.
                    let first = scans.iter().position(|(_, scan)| !scan.is_missing()).unwrap_or(0);
                    scans[first].1.detections.extend(detections);
                    self.classify(&seen, classifier, &mut scans)?;
                }
                PerceptionAnswer::Tracks(tracks) => {
                    let late_steps = scans.iter().map(|(_, scan)| scan.late_steps).max().unwrap_or(0);
                    let offset = scans.iter().find(|(_, scan)| !scan.is_missing()).map(|(_, scan)| scan.clock_offset());
                    let step = self.step + self.latency_steps as u64 + late_steps;
                    outside.keep(seen.believed, offset.unwrap_or(Time::ZERO), tracks, step);
                    for (index, scan) in scans.drain(..) {
                        self.sensors[index].recycle(scan);
                    }
                }
            }
        }
        self.push(&seen, scans);
        Ok(())
    }

    /// Detects boxes in a recorded scan of the sensor with this number, and appends it to the queue
    /// of pending scans, as [`Self::detect`] does with a simulated one.
    ///
    /// # Errors
    /// [`SensorError`] if a point is not finite.
    pub(crate) fn take_recorded(
        &mut self,
        sensor: usize,
        scan: &LidarScan,
        place: (&Road, VehicleState),
    ) -> Result<(), SensorError> {
        self.sensors[sensor].push_recorded(scan, place, self.step + self.latency_steps as u64)
    }

    /// Returns the number of the next step.
    pub(crate) fn step(&self) -> u64 {
        self.step
    }

    /// Lets the classifier see the boxes of all scans at once.
    fn classify(
        &mut self,
        seen: &Seen<'_>,
        classifier: Option<&mut Box<dyn DetectionClassifier>>,
        scans: &mut [(usize, NewScan)],
    ) -> Result<(), SensorError> {
        match (classifier, scans) {
            (None, _) | (_, []) => {}
            (Some(classifier), [(_, scan)]) => {
                classifier.classify(seen.scene, &mut scan.detections)?;
                scan.detections.extend_from_slice(classifier.seen_alone());
            }
            (Some(classifier), several) => {
                self.all.clear();
                several.iter().for_each(|(_, scan)| self.all.extend_from_slice(&scan.detections));
                classifier.classify(seen.scene, &mut self.all)?;
                let mut classified = self.all.drain(..);
                for (_, scan) in several.iter_mut() {
                    scan.detections.iter_mut().zip(&mut classified).for_each(|(slot, detection)| *slot = detection);
                }
                // Camera-only detections belong to no LiDAR. They come with the first LiDAR.
                if let [(_, scan), ..] = several {
                    scan.detections.extend_from_slice(classifier.seen_alone());
                }
            }
        }
        Ok(())
    }

    /// Lets the radars measure the scene.
    fn sense(&mut self, seen: &Seen<'_>) -> Result<(), SensorError> {
        let due_step = self.step + self.latency_steps as u64;
        match &mut self.radars {
            Some(radars) => radars.sense([seen.scene, seen.believed], due_step),
            None => Ok(()),
        }
    }

    /// Corrects the speeds of the tracks with the radar scans that are due, up to the time
    /// `before`, which is excluded.
    fn correct_speeds(&mut self, before: Option<Time>, rear_x_m: f64) {
        if let Some(radars) = &mut self.radars {
            radars.pass_due(self.step, before, |scan| self.tracker.correct_speeds(scan, rear_x_m));
        }
    }

    /// Appends scans to the queues of their sensors, and keeps the memory of the list.
    fn push(&mut self, seen: &Seen<'_>, mut scans: Vec<(usize, NewScan)>) {
        for (index, scan) in scans.drain(..) {
            self.sensors[index].push(scan, self.step + self.latency_steps as u64, seen);
        }
        self.scans = scans;
    }

    /// Passes the scans whose latency has elapsed to the tracker: one of each sensor in each step,
    /// if no fault delays them. `rear_x_m` is the position of the ego's rear end (m).
    pub(crate) fn update_tracker(&mut self, rear_x_m: f64, list: &mut TrackList) {
        self.uses.clear();
        while let Some(time) = self.earliest_due() {
            self.correct_speeds(Some(time), rear_x_m);
            let mut idle: [Option<RearView>; MAX_LIDARS] = [None; MAX_LIDARS];
            let mut due: [Option<TrackerScan<'_>>; MAX_LIDARS] = [None; MAX_LIDARS];
            let mut numbers = [0; MAX_LIDARS];
            for (number, ((sensor, due), idle)) in self.sensors.iter_mut().zip(&mut due).zip(&mut idle).enumerate() {
                let view = sensor.view(rear_x_m);
                let next = sensor.pending.iter_mut().find(|scan| !scan.is_processed && scan.due_step <= self.step);
                match next.filter(|scan| scan.time == time) {
                    Some(scan) => {
                        scan.is_processed = true;
                        sensor.transport.observe(scan.arrival());
                        numbers[number] = scan.number;
                        let range_m = if scan.is_missing { 0.0 } else { view.range_m };
                        *due = Some(TrackerScan {
                            sensor: number,
                            time: scan.time,
                            road: &scan.road,
                            ego: scan.ego,
                            view: RearView { range_m, ..view },
                            rear_x_m,
                            detections: &scan.detections,
                        });
                    }
                    None => *idle = Some(view),
                }
            }
            self.tracker.update_together(due.into_iter().flatten(), idle.into_iter().flatten(), list);
            self.uses.extend(self.tracker.uses().iter().map(|used| (numbers[used.sensor], *used)));
        }
        self.correct_speeds(None, rear_x_m);
        self.step += 1;
    }

    /// Returns the earliest time of the scans that are next in their queues, and due.
    fn earliest_due(&self) -> Option<Time> {
        let next = |sensor: &ChainSensor| {
            let scan = sensor.pending.iter().find(|scan| !scan.is_processed && scan.due_step <= self.step);
            scan.map(|scan| scan.time)
        };
        self.sensors.iter().filter_map(next).min()
    }

    /// Appends the tracks at `time`, in the ego's frame, to `list`.
    pub(crate) fn report(&self, time: Time, frame: &EgoFrame<'_>, list: &mut TrackList) {
        self.tracker.report(time, frame, list);
    }

    /// Returns the sensors with their latest scans.
    pub(crate) fn lidars(&self) -> impl Iterator<Item = MountedLidar<'_>> {
        self.sensors.iter().map(|sensor| MountedLidar {
            name: sensor.model.name(),
            looks_ahead: false,
            scan: sensor.scans.saturating_sub(1),
            lidar: &sensor.lidar,
            detections: sensor.detections(),
        })
    }

    /// Returns what the tracker has made of the boxes in this step.
    pub(crate) fn used_boxes(&self) -> impl Iterator<Item = UsedBox> {
        let of_sensor = |used: &BoxUse| self.sensors.get(used.sensor).map(|sensor| sensor.model.name());
        self.uses
            .iter()
            .filter_map(move |(scan, used)| Some(UsedBox { sensor: of_sensor(used)?, scan: *scan, used: *used }))
    }

    /// Returns the fields of view.
    pub(crate) fn fields(&self) -> impl Iterator<Item = FieldOfView> + '_ {
        self.sensors.iter().map(ChainSensor::field)
    }

    /// Returns the radars with their latest scan, if there are any.
    pub(crate) fn rear_radars(&self) -> Option<MountedRadars<'_>> {
        self.radars.as_ref().map(RearRadars::mounted)
    }

    /// Returns what the monitors of all sensors have noticed.
    pub(crate) fn alarms(&self) -> Alarms {
        let radars = self.radars.as_ref().map_or(Alarms::NONE, RearRadars::alarms);
        self.sensors.iter().fold(radars, |all, sensor| all.and(sensor.alarms))
    }

    /// Returns the health of the sensors together. Without a radar the chain works, less well.
    pub(crate) fn health(&self) -> Health {
        let radars = self.radars.as_ref().map_or(Health::Ok, RearRadars::health);
        match joint_health::combined(&self.sensors, |sensor| sensor.health, |sensor| sensor.view(0.0)) {
            Health::Ok if radars != Health::Ok => Health::Degraded,
            health => health,
        }
    }
}

/// Maximum number of rear LiDARs besides the first.
pub const MAX_ADDITIONAL_LIDARS: usize = 3;
