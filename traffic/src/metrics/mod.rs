//! Criticality metrics in continuous time.
//!
//! Each metric is a pure function of one moment: it takes positions, sizes and velocities, and
//! returns one value or the reason for its absence ([`Absent`](crate::Absent)). No metric rounds,
//! stores, or searches by stepping through time.
//!
//! - [`bumper_gap_m`], [`time_headway_s`], [`time_to_collision_s`], [`required_deceleration_mps2`]:
//!   a vehicle that follows another.
//! - [`arrival_time_s`]: time until a faster follower arrives while the own vehicle brakes.
//! - [`time_to_touch_s`], [`closest_encounter`]: two oriented boxes in the plane.
//! - [`curvilinear_encounter`]: two oriented boxes that stay on a road with lanes.
//!
//! # Values that are not finite
//!
//! All arguments must be finite, which debug builds assert. If NaN gets in nevertheless, the result
//! is the most critical one, 0 s or 0 m (or an infinite deceleration), so a failed computation
//! never looks safe.

mod curvilinear;
mod following;
mod plane;

#[cfg(test)]
mod tests;

pub use curvilinear::{Settling, curvilinear_encounter};
pub use following::{
    CRITICAL_THW_S, arrival_time_s, bumper_gap_m, required_deceleration_mps2, time_headway_s, time_to_collision_s,
    touching_distance_m,
};
pub use plane::{Encounter, Moving, closest_encounter, time_to_touch_s};
