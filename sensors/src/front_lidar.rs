//! The LiDAR that looks ahead: the chain of the rear LiDAR on a scene turned by half a turn.
//!
//! It measures the rears of the vehicles ahead, with their plates. The boxes are classified by
//! their shape alone: no camera looks ahead. Three things differ from a chain made for this
//! direction. While a vehicle ahead changes lanes, its lateral position is the middle of its rear,
//! which lies up to half a length times the sine of the heading from its centre. The processing
//! allows for hidden parts of a vehicle's *front*. The tracker assumes that a vehicle that the ego
//! closes on has to react. It expects a change of motion sooner than the driver of a vehicle ahead
//! makes one.

use crate::tracking::{TrackList, TrackerModel};
use closecall_traffic::Source;
use closecall_traffic::ego_frame::EgoFrame;

use crate::faults::{FaultList, LidarFault};
use crate::half_turn::{HalfTurn, turn_back};
use crate::lidar::Lidar;
use crate::lidar_chain::{LidarChain, Seen};
use crate::monitors::Alarms;
use crate::object::NoiseKey;
use crate::perception::{MountedLidar, UsedBox};
use crate::{Alterations, Health, Scene, SceneVehicle, SensorError};

/// The front LiDAR with its processing.
pub(crate) struct FrontLidar {
    chain: LidarChain,
    /// Memory of the vehicles of the scene, and of the vehicles of the scene that the ego believes.
    memory: [Vec<SceneVehicle>; 2],
}

impl FrontLidar {
    /// Creates the chain before its first step, with random streams keyed by `key`.
    pub(crate) fn new(lidar: Lidar, tracker: TrackerModel, key: &NoiseKey) -> Self {
        let chain = LidarChain::new([lidar.half_turned()], tracker, key, ["front-lidar", "front-lidar-fault"]);
        Self { chain, memory: Default::default() }
    }

    /// Returns the same sensor with faults.
    pub(crate) fn with_faults(self, faults: FaultList<LidarFault>) -> Self {
        Self { chain: self.chain.with_faults(faults.map(LidarFault::turned)), ..self }
    }

    /// Measures `scene`, which the ego believes to be `believed`, and appends the tracks to `list`.
    ///
    /// # Errors
    /// [`SensorError`] if a model fails.
    pub(crate) fn step(&mut self, [scene, believed]: [&Scene<'_>; 2], list: &mut TrackList) -> Result<(), SensorError> {
        let [scene_memory, believed_memory] = std::mem::take(&mut self.memory);
        let turned = [HalfTurn::of(scene, scene_memory), HalfTurn::of(believed, believed_memory)];
        let [scene, believed] = [&turned[0], &turned[1]].map(HalfTurn::scene);
        let altered = &Alterations::default();
        self.chain.detect(Seen { scene: &scene, believed: &believed, others: &[], altered }, None)?;
        self.chain.update_tracker(-0.5 * scene.ego.vehicle.dimensions.length_m, list);
        let first = list.tracks.len();
        self.chain.report(scene.time, &EgoFrame::new(believed.road, &believed.ego.state), list);
        for track in &mut list.tracks[first..] {
            turn_back(track);
            track.source = Source::Front;
        }
        self.memory = turned.map(HalfTurn::into_memory);
        Ok(())
    }

    /// Returns the sensor with its latest scan, in the turned frame.
    pub(crate) fn lidar(&self) -> impl Iterator<Item = MountedLidar<'_>> {
        self.chain.lidars().map(|lidar| MountedLidar { looks_ahead: true, ..lidar })
    }

    /// Returns what the tracker has made of boxes in the latest step.
    pub(crate) fn used_boxes(&self) -> impl Iterator<Item = UsedBox> {
        self.chain.used_boxes()
    }

    /// Returns what the monitors of the sensor have noticed.
    pub(crate) fn alarms(&self) -> Alarms {
        self.chain.alarms()
    }

    /// Returns the health of the sensor.
    pub(crate) fn health(&self) -> Health {
        self.chain.health()
    }
}
