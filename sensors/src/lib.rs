//! What the ego vehicle perceives: models of its rear LiDAR, rear camera and object-level sensors, and the tracker
//! behind the rear LiDAR.
//!
//! ```text
//!            ┌ lidar/   scan pattern ─▶ ray cast ─▶ power, noise ─▶ points ─▶ clusters ─▶ boxes ┐
//!  Scene ────┤ camera/  image crop at each cluster ─▶ classifier ─▶ class scores                ├─▶ tracking/ ─▶ tracks
//!            └ object/  range, noise, latency, field of view (front radar, surround, rear sensor) ─▶ tracks
//! ```

mod alterations;
mod bodies;
pub mod camera;
mod config;
mod detection;
mod full;
mod gaussian;
mod ground_truth;
mod guard_rail;
pub mod lidar;
mod object;
mod perception;
mod scene;
mod surroundings;
#[cfg(test)]
mod testing;
pub mod tracking;
mod worker_classifier;

pub use alterations::Alterations;
pub use config::{SensorMode, Sensors, SensorsConfig};
pub use detection::{Detection, Extent};
pub use full::{DetectionClassifier, FullModel, FullPerception};
pub use ground_truth::GroundTruth;
pub use object::{NoiseKey, ObjectPerception, ObjectSensorConfig, ObjectSensorModel};
pub use perception::{FieldOfView, Health, Perception, SensorError, SensorHealth};
pub use scene::{Scene, SceneVehicle};
pub use tracking::{NEES_QUANTILE_95, TrackAudit, TrackerConfig, TrackerModel};
pub use worker_classifier::{inference_backend, rear_exposures, set_inference_backend};
