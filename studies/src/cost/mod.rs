//! The cost of a system in uneventful samples: no vehicle collides, and the lead vehicle does not
//! brake, in any arm. Each scenario is measured separately.
//!
//! If the ego slows down, the margins behind it shrink, and it loses speed and time. The occupants
//! feel each engagement. The figures follow from the journal. The time lost needs runs of both
//! arms, which are made for some samples unless the rear sensors are simulated in full.

mod html;
mod measure;
mod text;
mod time_lost;

pub use html::section;
pub use measure::{ArmCost, Cost, ScenarioCost, TIMED_SAMPLES, cost};
pub use text::CostText;
