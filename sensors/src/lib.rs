//! The perception of the ego vehicle: models of its rear LiDAR, rear camera and object-level
//! sensors, and the tracker behind the rear LiDAR.
//!
//! ```text
//!            ┌ lidar/   scan pattern ─▶ ray cast ─▶ power, noise ─▶ points ─▶ clusters ─▶ boxes ┐
//!  Scene ────┤ camera/  image crop at each cluster ─▶ classifier ─▶ class scores                ├─▶ tracking/ ─▶ tracks
//!            ├ radar/   range, angle, radial speed of each vehicle behind ─────────────────────────▶ speed of tracks
//!            └ object/  range, noise, latency, field of view (front radar, surround, rear sensor) ─▶ tracks
//!  monitors/   what a sensor delivers ─▶ alarms, health
//! ```

mod alterations;
mod audit;
pub mod camera;
mod config;
pub mod datasets;
mod detection_classifier;
mod error;
mod exposures;
pub mod external;
pub mod faults;
mod front_lidar;
mod full;
mod ground_truth;
mod half_turn;
mod image_detector;
mod image_evidence;
mod joint_health;
mod kept;
pub mod lidar;
mod lidar_chain;
pub mod monitors;
mod object;
mod perception;
mod radar;
mod recorded;
mod sensor_name;
mod several_cameras;
mod surroundings;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
pub mod tracking;
mod worker_classifier;

pub use crate::tracking::{
    BoxRole, BoxUse, Detection, Extent, Innovation, SeenBy, SeenPart, TrackerConfig, TrackerModel,
};
pub use alterations::Alterations;
pub use audit::{NEES_QUANTILE_95, TrackAudit, TrackMatch, TrackMatcher};
pub use closecall_traffic::{Scene, SceneVehicle};
pub use config::{SensorMode, Sensors, SensorsConfig};
pub use detection_classifier::DetectionClassifier;
pub use error::SensorError;
pub use exposures::rear_exposures;
pub use full::{FullModel, FullPerception};
pub use ground_truth::GroundTruth;
pub use lidar_chain::MAX_ADDITIONAL_LIDARS;
pub use object::{
    ByClass, Chain, ErrorGrid, ErrorGrids, FitError, FittedErrors, NamedGrid, NoiseKey, ObjectPerception,
    ObjectSensorConfig, ObjectSensorModel, Origin, PitchedShapes, RangeGrid, RearFit, ShapeRatios, Validation,
    ValidationFigures,
};
pub use perception::{FieldOfView, Health, MountedLidar, Perception, RearImage, SensorAlarms, SensorHealth, UsedBox};
pub use radar::{MountedRadars, RadarReturn, RadarSource, RearRadar, RearRadarConfig};
pub use recorded::{RecordedPerception, RecordedScanError};
pub use several_cameras::MAX_ADDITIONAL_CAMERAS;
pub use worker_classifier::{inference_backend, set_inference_backend};
