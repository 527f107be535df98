//! Recorded traffic: trajectory data, lane changes, criticality, fitted distributions, and
//! encounters to re-enact.

pub mod aerial;
pub mod criticality;
pub mod encounter;
pub mod filters;
pub mod fit;
pub mod following;
pub mod lane_change;
mod mcap_records;
pub mod openlabel;
pub mod osi;
pub mod robustness;
pub mod scans;
pub mod trajectory_data;
