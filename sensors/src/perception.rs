//! The boundary between the sensors and the loop.

use closecall_traffic::{Time, Track};

use crate::lidar::RearLidar;
use crate::{Detection, Scene};

/// Time from one control step, and one scan, to the next: 25 Hz.
pub const SCAN_PERIOD: Time = Time::from_ms(40);

/// Whether a group of sensors works.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Health {
    /// It works.
    #[default]
    Ok,
    /// It works with reduced range or certainty.
    Degraded,
    /// It delivers nothing that could be used.
    Failed,
}

/// The health of each group of E's sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorHealth {
    /// The radar that looks ahead.
    pub front: Health,
    /// The short-range sensors to both sides.
    pub surround: Health,
    /// LiDAR and camera that look back.
    pub rear: Health,
}

/// The wedge in which a sensor sees, from its place at the bumper on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    /// Tangent of half of its angle [1].
    pub half_angle_tan: f64,
    /// How far it reaches, in the present weather where the model says so [m].
    pub range_m: f64,
}

/// All of E's sensors with their processing: from the scene to tracks.
///
/// Called once for each control step (25 Hz), in order of time.
pub trait Perception: Send {
    /// Measures the scene and returns every track, front, surround and rear.
    ///
    /// # Errors
    /// [`SensorError`] where a model failed; the run then ends as an error, never as a result.
    fn step(&mut self, scene: &Scene<'_>) -> Result<&[Track], SensorError>;

    /// The health of the sensors after the latest step.
    fn health(&self) -> SensorHealth;

    /// The rear LiDAR with its latest points and boxes, for those who show them; none where it is not simulated.
    fn rear_lidar(&self) -> Option<&RearLidar> {
        None
    }

    /// The boxes found in the latest scan of the rear LiDAR, with the classes that the camera gave them; none where it is
    /// not simulated.
    fn rear_detections(&self) -> &[Detection] {
        &[]
    }

    /// Where the rear sensor looks from the rear bumper; none where its limits are not simulated.
    fn rear_field(&self) -> Option<FieldOfView> {
        None
    }
}

/// A sensor model that could not go on. The state of the sensors after it is undefined; the run ends.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SensorError {
    /// A number that has to be finite was not.
    #[error("failed to measure: {what} is not finite at {time}")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// When.
        time: Time,
    },
    /// The density clustering refused its input.
    #[error("failed to cluster {points} points: {reason}")]
    Clustering {
        /// Number of points.
        points: usize,
        /// The library's reason.
        reason: String,
    },
    /// The classifier could not be run.
    #[error("failed to classify: {reason}")]
    Classifier {
        /// The library's reason.
        reason: String,
    },
}
