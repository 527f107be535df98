//! What a run and a campaign leave behind: files to look at, to keep, and to gate on.

mod charts;
pub mod figure;
pub mod film;
pub mod findings;
pub mod html;
pub mod in_car;
pub mod junit;
pub mod markdown;
pub mod outcomes;
pub mod overview;
pub mod recording_charts;
pub mod recordings_index;
pub mod requirements;
pub mod rerun;
pub mod timings;
pub mod trace;
pub mod traffic;
mod units;
mod write;

pub use write::{WriteError, write_atomically};
