//! Object-level sensors: models of the tracks that a radar, or a LiDAR with its own tracking, delivers.
//!
//! They leave out the physics of the measurement. One sensor looks ahead, one around the ego, and one behind. Each has
//! a field of view, a range, errors (white and slowly varying), a latency, lost measurements, and a filter whose
//! covariance follows from the errors. The rear sensor replaces LiDAR and camera in fast campaigns. Like them, it has a
//! shorter range in fog and rain. The other two sensors are part of the full chain, too.
//!
//! The models deviate from real sensors on purpose:
//!
//! - The vehicle that a measurement belongs to is known.
//! - Lengths and widths are the true ones.
//! - There are no ghost objects.
//! - The radar's angle error does not grow with range.
//! - The ego's own motion and its position in the lane are known exactly (odometry and map).

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
pub(crate) use sensor::{DEGRADED_SHARE, ObjectSensor, ScanInput};
pub(crate) use weather::range_in_weather_m;

/// Perception by object-level sensors only.
#[derive(Clone, Debug)]
pub struct ObjectPerception {
    sensors: [ObjectSensor; 3],
    others: Vec<OtherVehicle>,
    list: TrackList,
}

impl ObjectPerception {
    /// Creates the front radar, the surround sensors and the rear sensor (`models` in this order), with random streams
    /// keyed by `key`.
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
        let input = ScanInput { scene, frame: &frame, others: &self.others };
        for sensor in &mut self.sensors {
            sensor.scan(&input, &mut self.list);
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
