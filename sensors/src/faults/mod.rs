//! Faults of the sensors, each with a start and an end: a sensor breaks, becomes dirty, is late, or
//! is misaligned.
//!
//! ```text
//!  [[fault.rear-lidar]]  ─▶ FaultList ─▶ what holds at this instant ─▶ scan, frames, health (also [[fault.front-lidar]])
//!  [[fault.rear-camera]] ─▶     〃    ─▶            〃              ─▶ pixels of each crop, health
//!  [[fault.front-radar]] and the other object-level sensors         ─▶ measurements, tracks, health
//!  [[fault.rear-radar]]  ─▶     〃    ─▶            〃              ─▶ detections, health
//!  [fault.odometry]      ─▶ OdometryErrors ─▶ the scene and the map as the ego believes them to be
//! ```
//!
//! The ego does not know its faults. It notices only what a monitor of the sensor's output can
//! notice: a sensor that delivers nothing ([`Health::Failed`](crate::Health::Failed) after
//! [`NOTICED_AFTER_SCANS`] scans), or the same bits again and again. A sensor whose dirt leaves
//! less than half of its range reports [`Health::Degraded`](crate::Health::Degraded), as sensors
//! with a blockage monitor do. So does one whose scans are lost or late, and a LiDAR that does not
//! see the road as it should ([`monitors`](crate::monitors)). No function acts on that. Glare, dirt
//! on the camera, false points and ghosts, a wrong yaw, a wrong odometry or map, and most faults of
//! the measurements of object-level sensors remain unnoticed.
//!
//! The random numbers of faults come from streams of their own, and from the address of a beam in a
//! scan. A scenario without faults draws none of them.

mod config;
mod list;
mod object;
mod odometry;
mod of_all_sensors;
mod radar;
mod sector;
#[cfg(test)]
mod tests;
mod words;

pub use config::{CameraFaultConfig, FaultEntries, LidarFaultConfig};
pub(crate) use list::FaultList;
pub(crate) use odometry::Belief;
pub use odometry::{OdometryErrorConfig, OdometryErrors};
pub use of_all_sensors::Faults;
pub(crate) use words::ActingSensors;
pub use words::{SensorGroup, StatedFault};

pub(crate) use config::LidarFault;
pub(crate) use object::ObjectFault;
pub use object::ObjectFaultConfig;
pub(crate) use radar::RadarFault;
pub use radar::RadarFaultConfig;
pub(crate) use sector::Sectors;

/// Number of successive scans without output, or with the same output, after which the ego counts a
/// sensor as failed: 1 s.
///
/// An assumption: long enough for a restart of the connection, and short against the 4 s or more
/// from the detection of a rear vehicle to the critical distance.
pub const NOTICED_AFTER_SCANS: u32 = 25;
