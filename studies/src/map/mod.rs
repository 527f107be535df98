//! The map: the margin that the system reaches, over approach speed, detection distance and front
//! time headway.
//!
//! ```text
//!  grid point ─┬▶ solver of the braking plan, with the build-up of the braking ─▶ margin in theory
//!              └▶ run of the loop with true tracks, rear vehicle at a constant speed ─▶ margin in the loop
//! ```
//!
//! The margin is the gain of the front time headway from the engagement until the rear vehicle is
//! at the critical gap. Theory and loop make the same assumptions, so a difference of more than 0.2
//! s has a reason. The map states it, as it follows from the run. The region "in time" of the paper
//! is beside it: always below a speed difference of 20 km/h, in 59 % of the cases up to 25 km/h,
//! and never above 30 km/h.

mod point;
mod run;
mod svg;
mod table;

pub use point::MapPoint;
pub use run::{Map, MapError, MapGrid, map};
pub use svg::panel;
pub use table::{MapText, csv};
