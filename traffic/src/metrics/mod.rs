//! Criticality metrics in continuous time.
//!
//! Pure functions of one moment: positions, sizes and velocities in, one value out, or the reason why there is none
//! ([`Absent`](crate::Absent)). Nothing is rounded, stored, or searched for by stepping through time.
//!
//! - [`time_headway_s`], [`time_to_collision_s`], [`required_deceleration_mps2`]: one vehicle behind another.
//! - [`arrival_time_s`]: when a faster follower arrives while the own vehicle brakes.
//! - [`time_to_touch_s`], [`closest_encounter`]: two oriented boxes in the plane.
//!
//! # What is not finite
//!
//! All arguments must be finite, which debug builds assert. Should NaN get in nevertheless, the result is the most
//! critical one, 0 s or 0 m (or an infinite deceleration), so that a failed computation can never look safe.

mod following;
mod plane;

#[cfg(test)]
mod tests;

pub use following::{arrival_time_s, required_deceleration_mps2, time_headway_s, time_to_collision_s};
pub use plane::{Encounter, Moving, closest_encounter, time_to_touch_s};
