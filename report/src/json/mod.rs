//! Results as JSON with stable keys, as the command line prints them.
//!
//! An absent value is `null`, and the key `…_absent` beside it states the reason. The units are
//! part of the keys.

mod anchor;
mod boundary;
mod campaign;
mod comparison;
mod frontier;
mod influence;
mod outcome;
mod sensitivity;
mod stamp;
mod trajectory_data;

pub use anchor::anchor;
pub use boundary::boundary;
pub use campaign::{campaign, campaign_report};
pub use comparison::comparison;
pub use frontier::frontier;
pub use outcome::{encounter_metrics, outcome};
pub use sensitivity::sensitivity;
pub use stamp::stamped;
pub use trajectory_data::{fitted, lane_changes, quality, robustness};
