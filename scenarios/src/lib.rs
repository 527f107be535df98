//! What Closecall tests: trajectory data, lane changes, parameter distributions, sampling designs and the scenario
//! library.

pub mod atomic;
pub mod criticality;
pub mod encounter;
pub mod filters;
pub mod fit;
pub mod following;
pub mod lane_change;
pub mod parameters;
pub mod robustness;
pub mod same_file;
pub mod sampling;
pub mod trajectory_data;
