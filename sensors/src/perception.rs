//! The interface between the sensors and the simulation loop.

use crate::camera::Instance;
use crate::tracking::{BoxUse, RearView};
use closecall_traffic::{Time, Track};

use crate::error::SensorError;
use crate::lidar::RearLidar;
use crate::monitors::Alarms;
use crate::radar::MountedRadars;
use crate::{Detection, Scene};

/// Operating state of a group of sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Health {
    /// The sensors work.
    #[default]
    Ok,
    /// The sensors work with reduced range or certainty.
    Degraded,
    /// The sensors deliver nothing usable.
    Failed,
}

/// The health of each group of the ego's sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorHealth {
    /// The radar that looks ahead.
    pub front: Health,
    /// The short-range sensors to both sides.
    pub surround: Health,
    /// The sensors that look back: LiDAR and camera, or the object-level sensor in their place.
    pub rear: Health,
}

/// What the monitors of each group of the ego's sensors have noticed: the reasons of their health.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorAlarms {
    /// The radar or the LiDAR that looks ahead.
    pub front: Alarms,
    /// The short-range sensors to both sides.
    pub surround: Alarms,
    /// The sensors that look back.
    pub rear: Alarms,
}

/// The horizontal field of view of a rear sensor: a wedge whose apex is the sensor's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    /// Tangent of half of the opening angle.
    pub half_angle_tan: f64,
    /// Range (m); it is the range in the current weather if the sensor's model derives one.
    pub range_m: f64,
    /// Distance of the sensor from the bumper towards the ego's middle (m).
    pub inset_m: f64,
    /// Position of the sensor to the left of the ego's centre line (m).
    pub left_m: f64,
    /// Azimuth of the sensor's axis (rad): 0 is straight behind, positive to the ego's left.
    pub azimuth_rad: f64,
}

impl FieldOfView {
    /// Returns the field of a sensor in the middle of the rear bumper that looks straight back.
    pub fn straight_back(half_angle_tan: f64, range_m: f64) -> Self {
        Self { half_angle_tan, range_m, inset_m: 0.0, left_m: 0.0, azimuth_rad: 0.0 }
    }

    /// Returns whether a point is in view that lies behind the bumper and to the left of the ego's
    /// centre line by these distances (m).
    pub fn contains(&self, back_m: f64, left_m: f64) -> bool {
        let view = RearView {
            half_angle_tan: self.half_angle_tan,
            range_m: self.range_m,
            sensor_x_m: self.inset_m,
            sensor_y_m: self.left_m,
            axis_azimuth_rad: self.azimuth_rad,
        };
        view.contains(-back_m, left_m)
    }
}

/// A LiDAR with its latest scan, for display and for tables.
#[derive(Clone, Copy, Debug)]
pub struct MountedLidar<'a> {
    /// Name of the sensor.
    pub name: &'static str,
    /// Whether it looks ahead. Its points and boxes are then in the frame of an ego that is turned
    /// by half a turn: x and y have the opposite sign.
    pub looks_ahead: bool,
    /// Number of its latest scan.
    pub scan: u64,
    /// The sensor with its latest points and boxes.
    pub lidar: &'a RearLidar,
    /// The boxes of the latest scan, with the camera's class scores if a camera has classified
    /// them.
    pub detections: &'a [Detection],
}

/// What the tracker has made of one box, which may be a box of an earlier scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsedBox {
    /// Name of the sensor.
    pub sensor: &'static str,
    /// Number of its scan, as [`MountedLidar::scan`] counts them.
    pub scan: u64,
    /// What has become of the box.
    pub used: BoxUse,
}

/// The latest image that a network has evaluated as a whole, for display.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RearImage {
    /// Name of the camera.
    pub camera: &'static str,
    /// Time of the exposure.
    pub time: Time,
    /// Time of the scene that the image shows: the time of the exposure, unless the camera is
    /// frozen.
    pub shown_time: Time,
    /// The instances of the network, in its order.
    pub instances: Vec<Instance>,
}

/// All of the ego's sensors with their processing, from the scene to the tracks.
///
/// The loop calls [`Perception::step`] once in each control step, in order of time.
pub trait Perception: Send {
    /// Measures the scene and returns the tracks of all sensors: front, surround and rear.
    ///
    /// # Errors
    /// Returns [`SensorError`] if a model fails. The run then ends with an error, never with a
    /// result.
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError>;

    /// Ends the sensors after the last step of a run.
    ///
    /// # Errors
    /// Returns [`SensorError::Program`] if a perception program has written more than its answers.
    fn finish(&mut self, _time: Time) -> Result<(), SensorError> {
        Ok(())
    }

    /// Returns the health of the sensors after the latest step.
    fn health(&self) -> SensorHealth;

    /// Returns what the monitors of the sensors have noticed by the latest step. A group without an
    /// alarm is healthy.
    fn alarms(&self) -> SensorAlarms {
        SensorAlarms::default()
    }

    /// Returns the LiDARs with their latest points and boxes: the LiDAR that looks ahead, then the
    /// LiDARs that look back in the order of the scenario. Returns none if none are simulated.
    fn lidars(&self) -> Vec<MountedLidar<'_>> {
        Vec::new()
    }

    /// Returns what the trackers have made of boxes in the latest step. Returns nothing if no boxes
    /// are tracked.
    fn used_boxes(&self) -> Vec<UsedBox> {
        Vec::new()
    }

    /// Returns the first of the rear LiDARs. Returns `None` if none is simulated.
    fn rear_lidar(&self) -> Option<MountedLidar<'_>> {
        self.lidars().into_iter().find(|lidar| !lidar.looks_ahead)
    }

    /// Returns the pair of rear radars with its latest scan. Returns `None` if none is simulated.
    fn rear_radars(&self) -> Option<MountedRadars<'_>> {
        None
    }

    /// Returns the latest image of each rear camera that a network has evaluated as a whole. Returns
    /// none if no network does.
    fn rear_images(&self) -> Vec<&RearImage> {
        Vec::new()
    }

    /// Returns the names of the rear cameras that delivered no image for the latest scan, or were
    /// known to have failed, if there are several. The other cameras classified what they see.
    fn failed_cameras(&self) -> &[&'static str] {
        &[]
    }

    /// Returns the fields of view of the rear sensors. Returns none if their limits are not
    /// simulated.
    fn rear_fields(&self) -> Vec<FieldOfView> {
        Vec::new()
    }
}
