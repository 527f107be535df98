//! Sensors that classify the detections of other sensors.

use crate::{Detection, Health, RearImage, Scene, SensorError};

/// A classifier that assigns class scores to detections from the measurements of another sensor.
pub trait DetectionClassifier: Send {
    /// Replaces the class scores of each detection of the scan that ended at the scene's time.
    ///
    /// # Errors
    /// Returns [`SensorError::Classifier`] if the classifier cannot be run.
    fn classify(&mut self, scene: &Scene<'_>, detections: &mut [Detection]) -> Result<(), SensorError>;

    /// Returns what that sensor alone has seen, as of the latest scan. Usually nothing.
    fn seen_alone(&self) -> &[Detection] {
        &[]
    }

    /// Returns the latest image of each camera that a network has evaluated as a whole. Usually none.
    fn rear_images(&self) -> Vec<&RearImage> {
        Vec::new()
    }

    /// Returns the names of the cameras that delivered no image for the latest scan, or were known
    /// to have failed. Usually none.
    fn failed_cameras(&self) -> &[&'static str] {
        &[]
    }

    /// Returns the health of that sensor.
    fn health(&self) -> Health {
        Health::Ok
    }
}
