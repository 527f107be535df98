//! Object-level sensors: what a radar, or a LiDAR with its own tracking, delivers, without the physics in between.
//!
//! Three of them look ahead, all round, and behind. Each has a field of view, a range, errors (white and slowly
//! varying), a latency, losses, and a filter whose covariance is what the errors make it. The rear one stands in for
//! LiDAR and camera where a campaign is to run fast, and like them it sees less far in fog and rain; the other two serve
//! the full chain as well.
//!
//! Deviations from real sensors, on purpose: which measurement belongs to which vehicle is known; extents are the true
//! ones; there are no ghost objects; the radar's angle error does not grow with range; and E's own motion and its place
//! in the lane are known exactly (odometry and map).

mod config;
mod noise;
mod sensor;
mod visibility;
mod weather;

pub use config::{ObjectSensorConfig, ObjectSensorModel};
pub use noise::NoiseKey;

use closecall_traffic::Track;

use crate::perception::FieldOfView;
use crate::surroundings::{OtherVehicle, transform_scene};
use crate::tracking::TrackList;
use crate::{Perception, Scene, SensorError, SensorHealth};
pub(crate) use sensor::{DEGRADED_SHARE, ObjectSensor, ScanView};
pub(crate) use weather::range_in_weather_m;

/// Perception by object-level sensors alone.
#[derive(Clone, Debug)]
pub struct ObjectPerception {
    sensors: [ObjectSensor; 3],
    others: Vec<OtherVehicle>,
    list: TrackList,
}

impl ObjectPerception {
    /// Front radar, surround and rear sensor, with streams of their own under `key`.
    pub fn new(models: [ObjectSensorModel; 3], key: &NoiseKey) -> Self {
        let [front, surround, rear] = models;
        Self {
            sensors: [
                ObjectSensor::front_radar(front, key),
                ObjectSensor::surround(surround, key),
                ObjectSensor::rear_object(rear, key),
            ],
            others: Vec::new(),
            list: TrackList::default(),
        }
    }
}

impl Perception for ObjectPerception {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let frame = transform_scene(scene, &mut self.others)?;
        self.list.tracks.clear();
        let view = ScanView { scene, frame: &frame, others: &self.others };
        for sensor in &mut self.sensors {
            sensor.scan(&view, &mut self.list);
        }
        Ok(&self.list.tracks)
    }

    fn health(&self) -> SensorHealth {
        let [front, surround, rear] = &self.sensors;
        SensorHealth { front: front.health(), surround: surround.health(), rear: rear.health() }
    }

    fn rear_field(&self) -> Option<FieldOfView> {
        let [_, _, rear] = &self.sensors;
        Some(rear.field_of_view())
    }
}

#[cfg(test)]
mod tests;
