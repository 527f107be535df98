//! Simulated traffic written as trajectory data, and charts of trajectory data.

pub mod in_car;
pub mod recorder;
pub mod trajectory_charts;
