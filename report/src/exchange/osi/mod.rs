//! A run as ASAM Open Simulation Interface (OSI) 3.8: `GroundTruth` and `SensorData` of each
//! control step.
//!
//! ```text
//!  run ─▶ OsiRecorder ─▶ FILE.mcap   ground_truth, sensor_data, and ground_truth_map with the OpenDRIVE road
//!                     └▶ FILE.osi    a trace of each message type, with the name that the standard asks for
//! ```
//!
//! Positions are the centres of the boxes, as OSI asks for; `bbcenter_to_rear` leads to the middle
//! of the rear axle. A track has the accuracy of each value (`base_rmse`): OSI cannot say how the
//! errors of two values depend on each other.

mod ground_truth;
mod recorder;
mod sensor_data;
mod write;

pub use recorder::OsiRecorder;
