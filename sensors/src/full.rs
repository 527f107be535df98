//! Perception with the full rear chain (scan, boxes, classes, tracks), and object-level sensors
//! ahead and to the sides.
//!
//! The ego's own motion is known without error, unless the scenario gives it one
//! ([`crate::faults`]).

use crate::tracking::{TrackList, TrackerModel};
use closecall_traffic::{CONTROL_STEP, Time, Track};

use crate::detection_classifier::DetectionClassifier;
use crate::external::{Outside, OutsideCamera, PerceptionProgram};
use crate::faults::{Belief, Faults};
use crate::front_lidar::FrontLidar;
use crate::lidar::Lidar;
use crate::lidar_chain::MAX_ADDITIONAL_LIDARS;
use crate::lidar_chain::{LidarChain, Seen};
use crate::monitors::{Alarm, Alarms};
use crate::object::{NoiseKey, ObjectSensor, ObjectSensorModel, ScanInput};
use crate::perception::{FieldOfView, MountedLidar, UsedBox};
use crate::radar::{MountedRadars, RearRadar, RearRadars};
use crate::surroundings::{OtherVehicle, transform_scene};
use crate::{Alterations, Health, Perception, RearImage, Scene, SensorAlarms, SensorError, SensorHealth};

/// The sensor and tracker models of the full chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FullModel {
    /// The radar that looks ahead, unless a LiDAR does.
    pub front_radar: ObjectSensorModel,
    /// The LiDAR that looks ahead in place of the radar, if there is one.
    pub front_lidar: Option<Lidar>,
    /// The short-range sensors around the ego.
    pub surround: ObjectSensorModel,
    /// The rear LiDAR.
    pub rear_lidar: Lidar,
    /// The pair of rear corner radars, if there is one.
    pub rear_radar: Option<RearRadar>,
    /// Further rear LiDARs.
    pub additional_rear_lidars: [Option<Lidar>; MAX_ADDITIONAL_LIDARS],
    /// The tracker that processes the boxes of the rear LiDAR.
    pub tracker: TrackerModel,
}

impl FullModel {
    /// Returns all rear LiDARs.
    pub fn rear_lidars(&self) -> impl Iterator<Item = Lidar> + use<> {
        std::iter::once(self.rear_lidar).chain(self.additional_rear_lidars.into_iter().flatten())
    }
}

/// Number of tracks of all sensors together for which memory is reserved.
const RESERVED_TRACKS: usize = 64;

/// Perception by LiDAR point clouds behind the ego, and by object-level sensors in the other
/// directions.
pub struct FullPerception {
    front: ObjectSensor,
    front_lidar: Option<FrontLidar>,
    surround: ObjectSensor,
    /// The sensors that look back, if they are simulated.
    rear: Option<LidarChain>,
    belief: Belief,
    classifier: Option<Box<dyn DetectionClassifier>>,
    /// The program that perceives in place of the chain of the sensors that look back.
    outside: Option<Outside>,
    model: FullModel,
    altered: Alterations,
    others: Vec<OtherVehicle>,
    list: TrackList,
}

impl FullPerception {
    /// Creates the sensors before their first step, with random streams keyed by `key`.
    pub fn new(model: &FullModel, key: &NoiseKey) -> Self {
        Self::with_keys(model, [key; 2])
    }

    /// Creates the sensors before their first step. The first key is the key of the random streams
    /// of the sensors ahead and around, the second key of those behind.
    pub(crate) fn with_keys(model: &FullModel, [key, rear_key]: [&NoiseKey; 2]) -> Self {
        Self {
            front: ObjectSensor::front_radar(model.front_radar, key),
            front_lidar: model.front_lidar.map(|lidar| FrontLidar::new(lidar, model.tracker, key)),
            surround: ObjectSensor::surround(model.surround, key),
            rear: Some(
                LidarChain::new(model.rear_lidars(), model.tracker, rear_key, ["rear-lidar", "rear-lidar-fault"])
                    .with_radars(model.rear_radar.map(|radar| RearRadars::new(radar, rear_key))),
            ),
            belief: Belief::default(),
            classifier: None,
            outside: None,
            model: *model,
            altered: Alterations::default(),
            others: Vec::new(),
            list: TrackList::with_capacity(RESERVED_TRACKS),
        }
    }

    /// Returns the same sensors with `classifier` applied to the detections of each scan.
    #[must_use]
    pub fn with_classifier(self, classifier: Box<dyn DetectionClassifier>) -> Self {
        Self { classifier: Some(classifier), ..self }
    }

    /// Returns the same sensors, whose scans behind the program processes in place of the built-in
    /// chain.
    #[must_use]
    pub(crate) fn with_program(self, program: Option<Box<dyn PerceptionProgram>>, cameras: Vec<OutsideCamera>) -> Self {
        let latency_s = self.model.tracker.latency_steps() as f64 * CONTROL_STEP.s();
        let lidars = self.model.rear_lidars();
        let sensors = (lidars.collect(), self.model.rear_radar);
        let outside = program.map(|program| Outside::new(program, sensors, cameras, latency_s));
        let rear = if outside.is_some() { self.rear.map(LidarChain::with_program) } else { self.rear };
        Self { outside, rear, ..self }
    }

    /// Returns the same sensors without the sensors that look back.
    #[must_use]
    pub(crate) fn without_rear(self) -> Self {
        Self { rear: None, classifier: None, ..self }
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
            front_lidar: self.front_lidar.map(|lidar| lidar.with_faults(faults.front_lidar)),
            surround: self.surround.with_faults(faults.surround),
            rear: self.rear.map(|rear| rear.with_faults(faults.rear_lidar).with_radar_faults(faults.rear_radar)),
            belief: Belief::new(faults.odometry),
            ..self
        }
    }

    /// Measures `scene`, which the ego believes to be `believed`, and lists the tracks.
    fn perceive(&mut self, scene: &Scene<'_>, believed: &Scene<'_>) -> Result<(), SensorError> {
        let frame = transform_scene(believed, &mut self.others)?;
        self.list.tracks.clear();
        let input = ScanInput { scene: believed, frame: &frame, others: &self.others };
        match &mut self.front_lidar {
            Some(lidar) => lidar.step([scene, believed], &mut self.list)?,
            None => self.front.scan(&input, &mut self.list),
        }
        self.surround.scan(&input, &mut self.list);
        if let Some(rear) = &mut self.rear {
            let seen = Seen { scene, believed, others: &self.others, altered: &self.altered };
            match &mut self.outside {
                None => rear.detect(seen, self.classifier.as_mut())?,
                Some(outside) => {
                    rear.ask(seen, self.classifier.as_mut(), outside)?;
                    outside.report(rear.step(), believed, &frame, &mut self.list);
                }
            }
            rear.update_tracker(-0.5 * scene.ego.vehicle.dimensions.length_m, &mut self.list);
            rear.report(scene.time, &frame, &mut self.list);
        }
        Ok(())
    }

    /// Returns the worse of the health of the LiDARs and of the cameras.
    fn rear_health(&self) -> Health {
        let lidars = self.rear.as_ref().map_or(Health::Ok, LidarChain::health);
        match self.classifier.as_ref().map_or(Health::Ok, |classifier| classifier.health()) {
            Health::Ok => lidars,
            Health::Failed => Health::Failed,
            Health::Degraded if lidars == Health::Failed => Health::Failed,
            Health::Degraded => Health::Degraded,
        }
    }
}

impl Perception for FullPerception {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let mut belief = std::mem::take(&mut self.belief);
        let result = self.perceive(scene, &belief.of(scene));
        self.belief = belief;
        result.map(|()| &*self.list.tracks)
    }

    fn finish(&mut self, time: Time) -> Result<(), SensorError> {
        self.outside.as_mut().map_or(Ok(()), |outside| outside.finish(time))
    }

    fn health(&self) -> SensorHealth {
        let front = self.front_lidar.as_ref().map_or_else(|| self.front.health(), FrontLidar::health);
        SensorHealth { front, surround: self.surround.health(), rear: self.rear_health() }
    }

    fn alarms(&self) -> SensorAlarms {
        let front = self.front_lidar.as_ref().map_or_else(|| self.front.alarms(), FrontLidar::alarms);
        let lidars = self.rear.as_ref().map_or(Alarms::NONE, LidarChain::alarms);
        // The monitor of a camera notices only that nothing new arrives.
        let cameras = self.classifier.as_ref().map_or(Health::Ok, |classifier| classifier.health());
        let rear = lidars.with_if(Alarm::NothingNew, cameras != Health::Ok);
        SensorAlarms { front, surround: self.surround.alarms(), rear }
    }

    fn lidars(&self) -> Vec<MountedLidar<'_>> {
        self.front_lidar
            .iter()
            .flat_map(FrontLidar::lidar)
            .chain(self.rear.iter().flat_map(LidarChain::lidars))
            .collect()
    }

    fn used_boxes(&self) -> Vec<UsedBox> {
        let front = self.front_lidar.iter().flat_map(FrontLidar::used_boxes);
        front.chain(self.rear.iter().flat_map(LidarChain::used_boxes)).collect()
    }

    fn rear_radars(&self) -> Option<MountedRadars<'_>> {
        self.rear.as_ref().and_then(LidarChain::rear_radars)
    }

    fn rear_images(&self) -> Vec<&RearImage> {
        self.classifier.as_ref().map_or(Vec::new(), |classifier| classifier.rear_images())
    }

    fn failed_cameras(&self) -> &[&'static str] {
        self.classifier.as_ref().map_or(&[], |classifier| classifier.failed_cameras())
    }

    fn rear_fields(&self) -> Vec<FieldOfView> {
        self.rear.iter().flat_map(LidarChain::fields).collect()
    }
}
