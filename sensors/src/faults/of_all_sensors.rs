//! The checked faults of all sensors.

use closecall_traffic::Side;

use super::list::{Combine, FaultList};
use super::{LidarFault, ObjectFault, OdometryErrors, RadarFault};
use crate::camera::CameraFault;

/// The checked faults of all sensors. None by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    pub(crate) rear_lidar: FaultList<LidarFault>,
    pub(crate) front_lidar: FaultList<LidarFault>,
    pub(crate) rear_camera: FaultList<CameraFault>,
    pub(crate) front_radar: FaultList<ObjectFault>,
    pub(crate) surround: FaultList<ObjectFault>,
    pub(crate) rear_object: FaultList<ObjectFault>,
    pub(crate) rear_radar: FaultList<RadarFault>,
    /// The errors of the ego's odometry and map.
    pub odometry: OdometryErrors,
}

impl Faults {
    /// Returns whether a fault concerns the sensors that look back, or the odometry and the map
    /// that all sensors depend on.
    pub fn concern_rear(&self) -> bool {
        let has_sensor = !(self.rear_lidar.is_empty() && self.rear_camera.is_empty() && self.rear_object.is_empty());
        has_sensor || !self.rear_radar.is_empty() || !self.odometry.is_none()
    }

    /// Returns whether odometry and map are all that is wrong: such faults act in each mode of the
    /// sensors.
    pub fn concern_odometry_only(&self) -> bool {
        !self.odometry.is_none() && *self == Self { odometry: self.odometry, ..Self::default() }
    }

    /// Returns the same faults, each from before the start of the run to its end.
    #[must_use]
    pub fn throughout(self) -> Self {
        Self {
            rear_lidar: self.rear_lidar.throughout(),
            front_lidar: self.front_lidar.throughout(),
            rear_camera: self.rear_camera.throughout(),
            front_radar: self.front_radar.throughout(),
            surround: self.surround.throughout(),
            rear_object: self.rear_object.throughout(),
            rear_radar: self.rear_radar.throughout(),
            odometry: self.odometry.throughout(),
        }
    }
}

/// The effects of faults of one of several sensors.
pub(crate) trait OfSensor {
    /// Returns the name of the sensor; `None` if each sensor has the fault.
    fn sensor(&self) -> Option<&'static str>;
}

impl OfSensor for LidarFault {
    fn sensor(&self) -> Option<&'static str> {
        self.sensor
    }
}

impl OfSensor for CameraFault {
    fn sensor(&self) -> Option<&'static str> {
        self.sensor
    }
}

impl<T: Combine + OfSensor> FaultList<T> {
    /// Returns the entries of the sensor with this name: the entries that name it, and the entries
    /// that name no sensor.
    pub(crate) fn of_sensor(self, name: &str) -> Self {
        self.only(|fault| fault.sensor().is_none_or(|sensor| sensor == name))
    }
}

impl FaultList<LidarFault> {
    /// Returns the names of sensors that the entries have.
    pub(crate) fn sensors(&self) -> impl Iterator<Item = &'static str> + use<> {
        let names: Vec<&'static str> = self.spans().filter_map(|(fault, _)| fault.sensor).collect();
        names.into_iter()
    }
}

impl FaultList<RadarFault> {
    /// Returns the entries of the radar on this side: the entries that name it, and the entries
    /// that name no side.
    pub(crate) fn of_side(self, side: Side) -> Self {
        self.only(|fault| fault.side.is_none_or(|of| of == side))
    }
}
