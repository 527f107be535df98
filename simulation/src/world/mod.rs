//! The world: vehicles that drive and collide on a road.
//!
//! ```text
//!  actions ─▶ plant of each vehicle ─▶ boxes before and after ─▶ parry: first contact ─▶ rapier: impact, sliding
//! ```
//!
//! All drivers read the state at t, then all vehicles are moved to t + dt. A vehicle that has
//! touched another one is a wreck from then on: its driver has lost control, and rapier's solver
//! moves it. Only physical contact counts as a collision. parry, the geometry library of the rapier
//! family, decides in `f64` whether, when and on which sides two vehicles touch; rapier computes
//! the response.

mod contact;
mod impact;
mod neighbours;
mod path;
mod plant;
mod search;
mod state;

pub use plant::Performance;
pub(crate) use state::{Action, InitialVehicle, World};
