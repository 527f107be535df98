//! Perception by object-level sensors only.

use super::sensor::{ObjectSensor, ScanInput};
use super::{NoiseKey, ObjectSensorModel};
use crate::faults::{Belief, Faults};
use crate::perception::FieldOfView;
use crate::surroundings::{OtherVehicle, transform_scene};
use crate::tracking::TrackList;
use crate::{Perception, Scene, SensorAlarms, SensorError, SensorHealth};
use closecall_traffic::Track;

/// Perception by object-level sensors only.
#[derive(Clone, Debug)]
pub struct ObjectPerception {
    sensors: [ObjectSensor; 3],
    others: Vec<OtherVehicle>,
    list: TrackList,
    belief: Belief,
}

impl ObjectPerception {
    /// Creates the front radar, the surround sensors and the rear sensor (`models` in this order),
    /// with random streams keyed by `key`.
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
            belief: Belief::default(),
        }
    }

    /// Returns the same sensors with faults.
    #[must_use]
    pub(crate) fn with_faults(self, faults: &Faults) -> Self {
        let [front, surround, rear] = self.sensors;
        let sensors = [
            front.with_faults(faults.front_radar),
            surround.with_faults(faults.surround),
            rear.with_faults(faults.rear_object),
        ];
        Self { sensors, belief: Belief::new(faults.odometry), ..self }
    }
}

impl Perception for ObjectPerception {
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError> {
        let scene = self.belief.of(scene);
        let frame = transform_scene(&scene, &mut self.others)?;
        self.list.tracks.clear();
        self.list.tracks.reserve(self.sensors.len() * scene.others.len());
        let input = ScanInput { scene: &scene, frame: &frame, others: &self.others };
        for sensor in &mut self.sensors {
            sensor.scan(&input, &mut self.list);
        }
        Ok(&self.list.tracks)
    }

    fn health(&self) -> SensorHealth {
        let [front, surround, rear] = &self.sensors;
        SensorHealth { front: front.health(), surround: surround.health(), rear: rear.health() }
    }

    fn alarms(&self) -> SensorAlarms {
        let [front, surround, rear] = &self.sensors;
        SensorAlarms { front: front.alarms(), surround: surround.alarms(), rear: rear.alarms() }
    }

    fn rear_fields(&self) -> Vec<FieldOfView> {
        let [_, _, rear] = &self.sensors;
        vec![rear.field_of_view()]
    }
}
