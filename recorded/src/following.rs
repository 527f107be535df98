//! Recorded car-following: a vehicle and the vehicle ahead of it in the same lane, for the
//! calibration of driver models.
//!
//! ```text
//!   follower                leader
//!   ┌──────┐      gap      ┌──────┐
//!   └──────┘◀─────────────▶└──────┘
//!        follower_front_m   leader_rear_m
//! ```
//!
//! Two layouts are read, plain or compressed with gzip, and recognised by their first line: a table
//! of pairs as published for NGSIM I-80 (one row for each pair and instant), and a platoon of the
//! OpenACC database (one row for each instant, with the bumper-to-bumper spacing between
//! neighbours).

mod pair;
mod pair_table;
mod platoon;
mod read;

pub use pair::{FollowingInstant, FollowingPair, LeftOut, name_hash};
pub use read::{FollowingData, FollowingError, FollowingFile, read};
