//! What is tested: recordings, lane changes, parameter distributions, sampling designs and the scenario library.

pub mod parameters;
pub mod sampling;
