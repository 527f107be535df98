//! The human drivers and the ego stack in the closed loop, with true tracks.
//!
//! * `golden`: the Wiedemann 99 driver beside the one of SUMO
//! * `following`: how a follower's reaction time shows from outside
//! * `overtaking`: an overtaker signals, gives up, and returns
//! * `paper_figure`: the reference point of the method
//! * `lead`: the ego never hits the lead vehicle first

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod drive;
mod following;
mod golden;
mod lead;
mod overtaking;
mod paper_figure;
