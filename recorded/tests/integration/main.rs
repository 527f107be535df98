//! Tests of the chain from trajectory files to parameter distributions, through the crate's public
//! interface.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod derived_roads;
mod estimated_lanes;
mod fitted;
mod golden;
mod in_car;
mod layouts;
mod malformed;
mod malformed_layouts;
mod malformed_rows;
mod ngsim_us101;
mod osi;
mod other_programs;
mod own_trajectory_files;
mod repeated_rows;
mod robustness;
mod smooth_file;
mod support;
