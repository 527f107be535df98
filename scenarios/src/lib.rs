//! What is tested: recordings, lane changes, parameter distributions, sampling designs and the scenario library.

mod atomic;
pub mod filters;
pub mod lane_change;
pub mod parameters;
pub mod recordings;
pub mod sampling;
