//! The world: vehicles that drive and collide on a road.
//!
//! ```text
//!  actions ─▶ plant of each vehicle ─▶ boxes before and after ─▶ swept test ─▶ contact ─▶ rapier2d: impact, sliding
//! ```
//!
//! All drivers read the state at t, then all vehicles are moved to t + dt. A vehicle that has touched another one is a
//! wreck from then on: its driver has lost control, and rapier's solver moves it. Only physical contact counts as a
//! collision. A swept test on oriented boxes in `f64` finds its time; rapier computes the response.

mod contact;
mod impact;
mod neighbours;
mod path;
mod plant;
mod search;
mod state;

pub(crate) use plant::lateral_grip_mps2;
pub(crate) use state::{Action, InitialVehicle, World};
