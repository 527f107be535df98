//! Results as JSON with stable keys, as the command line prints them.
//!
//! An absent value is `null`, and the key `…_absent` beside it states the reason. The units are part of the keys.

mod campaign;
mod comparison;
mod outcome;
mod stamp;
mod trajectory_data;

pub use campaign::campaign;
pub use comparison::comparison;
pub use outcome::{encounter_metrics, outcome};
pub use stamp::stamped;
pub use trajectory_data::{fitted, quality, robustness};
