//! The rear LiDAR: a sensor model that turns a scene into points, and a processing chain that turns
//! points into boxes.
//!
//! ```text
//!  Scene ─▶ solids (shapes, roadside) ─▶ targets ─▶ cast ─▶ echoes ─▶ receiver ─▶ LidarScan      the sensor
//!                                         pattern ──┘    power, soft, noise          │
//!                                                                                    ▼
//!  Detections ◀─ classify ◀─ boxes ◀─ clustering (DBSCAN) ◀─ thinning ◀─ ground, region of interest   the processing
//! ```
//!
//! The two halves share only the [`LidarScan`]: the processing chain has no access to the scene.

mod across;
mod bare_road;
mod beam_table;
mod boxes;
mod candidate;
mod cast;
mod classify;
mod clustering;
mod config;
mod dbscan;
mod detector;
mod echo;
mod edges;
mod false_alarms;
mod ground;
mod kind;
mod material;
mod model;
mod neighbours;
mod noise;
mod parts;
mod pattern;
mod power;
mod pulse;
mod rail_returns;
mod rear;
mod receiver;
mod recorded;
mod roadside;
mod scan;
mod scanner;
#[cfg(test)]
mod segmentation;
mod shapes;
mod silhouette;
mod soft;
mod solid;
mod spoil;
mod targets;
#[cfg(test)]
mod tests;
mod viewpoint;
mod wheels;

/// Number of clusters in a scan for which memory is reserved. A scan with more clusters reserves
/// more.
pub(crate) const RESERVED_CLUSTERS: usize = 64;

pub use crate::tracking::LaneGeometry;
pub use beam_table::BeamFileError;
pub use clustering::{ClusteredPoints, ClusteringCheck, ClusteringMethod, ClusteringModel};
pub(crate) use config::{FRONT_NAME, REAR_NAME};
pub use config::{Lidar, LidarConfig};
pub use detector::Detector;
#[cfg(test)]
pub(crate) use detector::FACE_SD_M;
pub(crate) use kind::MAX_HALF_FIELD_DEG;
pub use kind::{LidarKind, LidarKindConfig};
pub use material::Material;
pub use model::LidarModel;
pub(crate) use pattern::HALF_FIELD_DEG;
pub use pattern::Pattern;
pub use power::MAX_INTENSITY;
pub(crate) use power::extinction_per_m;
pub use pulse::echo_pulse_width_ns;
pub use rear::RearLidar;
pub use recorded::{PointError, PointFrame, PointTimes, RecordedPoints, ScanMotion};
pub use scan::{LidarScan, MirrorSide, PointBeam, PointSource, PointTruth, ScanEchoes, ScanTruth};
pub use scanner::Scanner;
#[cfg(test)]
pub(crate) use segmentation::SegmentationReport;
#[cfg(test)]
pub(crate) use shapes::append_solids;
