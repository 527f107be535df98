//! Trajectory data: written by the simulator, or shown as charts.

pub mod in_car;
pub mod recorder;
pub mod recording_charts;
