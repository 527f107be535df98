//! A recorded lane change as an encounter: who is R, E and F, from when to when, on a road and a clock of its own.
//!
//! ```text
//!   target ─────────────────────────────────────╭──────▶
//!                                        ╭──────╯
//!   home   ── R ─────────────────────────╯──▶  E ──▶  F ──▶
//!             │                          │
//!             start (time 0)             crossing
//! ```
//!
//! R is the vehicle that changes lanes; E the one that it is behind as it begins to, in the lane that it leaves; F the one
//! that E then follows. The encounter starts as early as the three are recorded in this order, at most [`LEAD_IN`] before
//! R begins to change lanes, and ends [`LEAD_OUT`] after the lane change, or with E's track.
//!
//! **Its own frame.** Time is 0 at the start, s is 0 where E then is. Recordings may hold several carriageways, laid side
//! by side with lanes counted on: the road is the lanes around R's that are counted without a break, the first of them
//! lane 1. They get the recording's typical width, placed so that the marking which R crosses is where it was recorded.

mod find;
mod frame;

use closecall_traffic::{Lane, Measured, Time, Trajectory};

pub use find::encounter;

use crate::lane_change::LaneChange;

/// Longest time before the lane change that belongs to an encounter.
pub const LEAD_IN: Time = Time::from_ms(20_000);
/// Time after the lane change that belongs to an encounter.
pub const LEAD_OUT: Time = Time::from_ms(6_000);
/// An encounter that begins later than this before the crossing shows nothing.
pub const SHORTEST_APPROACH: Time = Time::from_ms(2_000);
/// Vehicles that never come nearer to E than this along the road do not belong to it [m].
pub const REACH_M: f64 = 150.0;
/// R is not taken to be behind E for E's sake at a longer headway than this at the crossing [s].
pub const LONGEST_THW_S: f64 = 5.0;

/// The place of E among an encounter's vehicles.
pub const EGO: usize = 0;
/// The place of F.
pub const FRONT: usize = 1;
/// The place of R.
pub const REAR: usize = 2;

/// One vehicle of an encounter.
#[derive(Clone, Debug)]
pub struct Participant {
    /// How it moved, in the encounter's frame.
    pub trajectory: Trajectory,
    /// Its lane changes, in the recording's time and lanes.
    pub changes: Vec<LaneChange>,
}

/// A recorded encounter.
#[derive(Clone, Debug)]
pub struct RecordedEncounter {
    /// The recording's name.
    pub recording: String,
    /// R's lane change, in the recording's time and lanes.
    pub change: LaneChange,
    /// The recording's time at the encounter's time 0.
    pub start: Time,
    /// When R crosses the marking.
    pub crossing: Time,
    /// When it ends.
    pub end: Time,
    /// R's time headway to E at the crossing [s].
    pub crossing_thw_s: f64,
    /// Number of lanes of the road.
    pub lanes: u8,
    /// Their width [m].
    pub lane_width_m: f64,
    /// The lane that R leaves.
    pub home: Lane,
    /// The lane that R changes to.
    pub target: Lane,
    /// E, F, R, then everyone else who comes near E, in the order of the track numbers.
    pub vehicles: Vec<Participant>,
}

impl RecordedEncounter {
    /// E, F and R.
    pub fn protagonists(&self) -> [&Trajectory; 3] {
        [EGO, FRONT, REAR].map(|place| &self.vehicles[place].trajectory)
    }

    /// A time of the recording on the encounter's clock.
    pub fn time_of(&self, recorded_s: f64) -> Time {
        Time::from_s(recorded_s) - self.start
    }
}

/// Why a lane change is no encounter. Tracks are numbered as in the recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoEncounter {
    /// The recording does not have the track.
    #[error("the recording has no track {track_id}")]
    NoTrack {
        /// R.
        track_id: u64,
    },
    /// There is no E.
    #[error("nobody is ahead of track {track_id} in lane {lane} as it begins to change lanes: there is no E")]
    NobodyAhead {
        /// R.
        track_id: u64,
        /// The lane that it leaves.
        lane: u8,
    },
    /// There is no F.
    #[error(
        "track {ego_id}, which track {track_id} is behind, follows nobody: without F ahead E has no margin to increase"
    )]
    NobodyAheadOfEgo {
        /// R.
        track_id: u64,
        /// E.
        ego_id: u64,
    },
    /// The three are not recorded for long enough.
    #[error(
        "track {track_id} behind track {ego_id} behind track {front_id} is recorded for {recorded_s:.1} s before it \
         crosses the marking; {needed_s:.1} s are needed"
    )]
    TooShort {
        /// R.
        track_id: u64,
        /// E.
        ego_id: u64,
        /// F.
        front_id: u64,
        /// What is recorded [s].
        recorded_s: f64,
        /// What is needed [s].
        needed_s: f64,
    },
    /// R does not cross the marking close behind E.
    #[error(
        "as track {track_id} crosses the marking, its headway to track {ego_id} is {}: it has to be above 0 and at most \
         {longest_s:.0} s",
        match thw_s { Ok(thw_s) => format!("{thw_s:.2} s"), Err(absent) => format!("none ({absent})") }
    )]
    NotBehind {
        /// R.
        track_id: u64,
        /// E.
        ego_id: u64,
        /// R's time headway then [s].
        thw_s: Measured,
        /// The longest [s].
        longest_s: f64,
    },
    /// One of the three is recorded beside the road, too.
    #[error("track {track_id}, or one of the two ahead of it, leaves the road on which it changes lanes")]
    LeavesTheRoad {
        /// R.
        track_id: u64,
    },
    /// The road has more lanes than a road may have.
    #[error("the road of track {track_id} has {lanes} lanes; at most {most} are possible")]
    TooManyLanes {
        /// R.
        track_id: u64,
        /// How many.
        lanes: u8,
        /// The most.
        most: u8,
    },
}

#[cfg(test)]
mod tests;
