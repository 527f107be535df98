//! Results from trajectory data: texts and charts.

pub mod drift;
pub mod fit;
pub mod lane_changes;
pub mod paper;
pub mod paper_charts;
pub mod quality;
pub mod reenactment;
pub mod reproduction;
pub mod robustness;
pub mod sampling;
pub mod statistics;
pub mod trajectory_charts;
