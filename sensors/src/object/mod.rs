//! Object-level sensors: models of the tracks that a radar, or a LiDAR with its own tracking,
//! delivers.
//!
//! They leave out the physics of the measurement. One sensor looks ahead, one around the ego, and
//! one behind. Each has a field of view, a range, errors (white and slowly varying), a latency,
//! lost measurements, and a filter whose covariance follows from the errors. The rear sensor
//! replaces LiDAR and camera in fast campaigns. Its ranges and errors are fitted to the ranges and
//! errors of these two ([`RearFit`]): dark paint, fog and rain shorten its range and enlarge its
//! errors, too. In fog, the LiDAR sees the plate or the lamps of a vehicle that the camera does not
//! recognise yet: its track is confirmed, and classified as background until the vehicle has come
//! within the distance at which the full chain classifies it as a vehicle. The other two sensors
//! are part of the full chain.
//!
//! The models deviate from real sensors on purpose:
//!
//! - The model knows which vehicle a measurement belongs to.
//! - Lengths and widths are true.
//! - There are no ghost objects, unless the scenario injects one.
//! - The radar's angle error does not grow with range.
//! - The ego's own motion and its position in the lane are known exactly (odometry and map), unless
//!   the scenario gives them errors.

mod arrivals;
mod config;
mod errors;
mod faulty;
mod fit;
mod noise;
mod perception;
mod ranges;
mod sector;
mod sensor;
mod target;
#[cfg(test)]
mod tests;
mod validated;
mod visibility;
mod weather;

pub use config::{ObjectSensorConfig, ObjectSensorModel};
pub use errors::{ErrorGrid, ErrorGrids, FittedErrors, NamedGrid};
pub use fit::{ByClass, FitError, Origin, PitchedShapes, RangeGrid, RearFit, ShapeRatios};
pub use noise::NoiseKey;
pub use perception::ObjectPerception;
pub(crate) use sensor::{DEGRADED_SHARE, ObjectSensor, ScanInput};
pub use validated::{Chain, Validation, ValidationFigures};
pub(crate) use weather::range_in_weather_m;
