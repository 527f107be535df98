//! The world: vehicles that drive, touch and collide on a road.
//!
//! ```text
//!  actions ─▶ plant of each vehicle ─▶ boxes before and after ─▶ swept test ─▶ touch ─▶ rapier2d: impact, sliding
//! ```
//!
//! Every vehicle reads the state at t, then all are moved to t + dt. Vehicles that have touched another are wrecks
//! from then on: their drivers have lost control, and rapier's solver moves them. Physical overlap alone is a
//! collision, and its moment is judged by a swept test on oriented boxes in `f64`; rapier gives the response.

mod contact;
mod impact;
mod neighbours;
mod path;
mod plant;
mod state;

pub(crate) use plant::lateral_grip_mps2;
pub(crate) use state::{Action, Placed, World};
