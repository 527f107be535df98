//! The shapes of vehicles: a few convex solids each, with the materials that matter for a LiDAR.
//!
//! ```text
//!            ____                      ┌──┐┌────────────────┐            o  helmet
//!      _____/    \____                 │▒▒││                │           /█\ torso
//!     |______________|  body, cabin    │__││________________│         ─<██>─ bars, fairing
//!       (o)      (o)    wheels           o      o o     ooo            O  O  wheels
//! ```
//!
//! The camera builds its bodies from the same [`Proportions`], so both sensors see the same
//! extents. All coordinates are in the vehicle's frame: x forward, z = 0 on the ground.

mod append;
mod car;
mod motorcycle;
mod truck;

use append::append_pair;
pub(crate) use append::{append_rear_plate, append_solids};
