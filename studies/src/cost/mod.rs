//! What a system costs where nothing happens: in the samples in which no vehicle collides, and the lead vehicle does
//! not brake, in any arm. Each scenario is measured for itself.
//!
//! Margins behind the ego shrink if the ego slows down, speed and time are lost, and each engagement is felt by the occupants.
//! The figures follow from the journal; the time lost needs runs of both arms, which are made for some samples unless the rear
//! sensors are simulated in full.

mod html;
mod measure;
mod text;
mod time_lost;

pub use html::section;
pub use measure::{ArmCost, Cost, ScenarioCost, TIMED_SAMPLES, cost};
pub use text::CostText;
