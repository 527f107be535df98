//! The interface between the sensors and the simulation loop.

use closecall_traffic::{Time, Track};

use crate::lidar::RearLidar;
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

/// The horizontal field of view of a sensor: a wedge whose apex is the sensor's position at the bumper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    /// Tangent of half of the opening angle.
    pub half_angle_tan: f64,
    /// Range (m); it is the range in the current weather if the sensor's model derives one.
    pub range_m: f64,
}

/// All of the ego's sensors with their processing, from the scene to the tracks.
///
/// The loop calls [`Perception::step`] once in each control step, in order of time.
pub trait Perception: Send {
    /// Measures the scene and returns the tracks of all sensors: front, surround and rear.
    ///
    /// # Errors
    /// Returns [`SensorError`] if a model fails. The run then ends with an error, never with a result.
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError>;

    /// Returns the health of the sensors after the latest step.
    fn health(&self) -> SensorHealth;

    /// Returns the rear LiDAR with its latest points and boxes, for display. Returns `None` if it is not simulated.
    fn rear_lidar(&self) -> Option<&RearLidar> {
        None
    }

    /// Returns the LiDAR that looks ahead with its latest points and boxes, for display. They are in the frame of an ego that is
    /// turned by half a turn: x and y have the opposite sign. Returns `None` if no such LiDAR is simulated.
    fn front_lidar(&self) -> Option<&RearLidar> {
        None
    }

    /// Returns the boxes found in the latest scan of the LiDAR that looks ahead, in its frame. Returns an empty slice if no such
    /// LiDAR is simulated.
    fn front_detections(&self) -> &[Detection] {
        &[]
    }

    /// Returns the boxes found in the latest scan of the rear LiDAR, with the camera's class scores if the camera is
    /// simulated. Returns an empty slice if the LiDAR is not simulated.
    fn rear_detections(&self) -> &[Detection] {
        &[]
    }

    /// Returns the field of view of the rear sensor from the rear bumper. Returns `None` if its limits are not
    /// simulated.
    fn rear_field(&self) -> Option<FieldOfView> {
        None
    }
}

/// The failure of a sensor model. It leaves the sensors in an undefined state and ends the run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SensorError {
    /// A quantity that must be finite is not.
    #[error("failed to measure: {what} is not finite at {time}")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// The scene's time.
        time: Time,
    },
    /// The classifier could not be loaded or run.
    #[error("failed to classify: {reason}")]
    Classifier {
        /// The classifier's message.
        reason: String,
    },
}
