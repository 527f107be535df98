//! Recorded traffic: reading it, knowing how good it is, and writing it.
//!
//! ```text
//!   file (plain or gzip) ─▶ reader of its layout ─▶ rows in SI units ─▶ tracks without gaps, one by one ─▶ Recording
//!                            (one line or element at a time)            (memory: the open ones)         (all of them)
//! ```
//!
//! The layout is told by what the file holds, not by its name; `docs/trajectory-data.md` describes all of them for users:
//!
//! | layout | what | module |
//! |---|---|---|
//! | plain | CSV with a header, metres, one row for each (track, frame); what [`write_recording`] writes | `plain` |
//! | NGSIM | 18 columns in feet, with or without a header; 25 columns of the catalogue's export (DOI 10.21949/1504477) | `ngsim` |
//! | highD, exiD | three files for each recording | `highd`, `exid`, `file_set` |
//! | CommonRoad | XML with lanelets and dynamic obstacles | `commonroad`, `lanelets` |
//! | in-car | log of one vehicle that sees the lane markings; what [`write_in_car`] writes | `in_car` |
//!
//! # What the readers do
//!
//! - Units become SI. `d` becomes positive to the left, 0 at the left edge of the leftmost lane. NGSIM's `Local_Y` is the
//!   middle of the front bumper: half a length is taken off to get the box's centre. `Local_X` is kept: across a lane
//!   change at 0.05 rad the front is 0.1 m beside the centre, which is below NGSIM's own accuracy.
//! - A vehicle's rows are split wherever a frame is missing, as NGSIM numbers recur after gaps. The first piece keeps the
//!   number; the later ones add multiples of [`PIECE_STRIDE`] to it.
//! - The catalogue's export joins several recordings of one place, in which numbers recur. They are told apart by the
//!   time of frame 0, and laid one behind the other where their clocks overlap, so that their vehicles never meet. (Not in
//!   files longer than [`WINDOW_ROWS`] rows: their spans are not known before the end.)
//! - NGSIM times are milliseconds; where they count from 1970 they are counted from the first instant instead.
//! - What a layout does not carry is derived by differences between neighbouring frames: the acceleration where its
//!   field is empty, lateral speed and lateral acceleration.
//! - Anything else is refused, with line, column and what is allowed, also units and columns that are mixed up
//!   (`plausible`). Nothing is guessed or repaired. Rows that cannot be used are left out only where that is asked for
//!   ([`BadRows::Drop`]), and counted.
//!
//! # Memory
//!
//! [`open`] gives complete tracks one by one and keeps the rows of the tracks that are not complete, and some dozen bytes for
//! each vehicle. For that, files longer than [`WINDOW_ROWS`] rows have to be sorted by vehicle or by time; `order` says more.
//! [`read`] keeps the whole recording, in any order: criticality needs it, because every vehicle may be an opponent.

mod assemble;
mod builder;
mod commonroad;
mod dropped;
mod error;
mod exid;
mod fields;
mod file_set;
mod highd;
mod in_car;
mod lanelets;
mod layout;
mod markings;
mod ngsim;
mod open;
mod order;
mod plain;
mod plausible;
mod quality;
mod reference_line;
mod rows;
mod source;
#[cfg(test)]
pub(crate) mod test_support;
mod text;
mod tracks;
mod write;
mod write_in_car;
mod xml;

use closecall_traffic::{Time, Trajectory};
use serde::Serialize;

pub use builder::PIECE_STRIDE;
pub use dropped::{Dropped, DroppedRows};
pub use error::{RecordingError, RecordingProblem, WriteError};
pub use markings::{DEFAULT_LANE_WIDTH_M, LaneMarkings};
pub use open::{open, open_from, read, read_from, read_with};
pub use order::WINDOW_ROWS;
pub use quality::{Flaw, FlawPlace, Flaws, Inspector, Quality, quality};
pub use tracks::{BadRows, LayoutChoice, ReadOptions, Tracks};
pub use write::write_recording;
pub use write_in_car::{BusFrame, InCarFrame, InCarLog, TrueLaneChange, truth_path, write_in_car, write_truth};

/// The layout of a recording's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// CSV in metres.
    Plain,
    /// NGSIM's 18 columns in feet.
    Ngsim18,
    /// The 25 columns of NGSIM's catalogue export.
    Ngsim25,
    /// highD's three files.
    Highd,
    /// exiD's three files.
    Exid,
    /// CommonRoad XML.
    Commonroad,
    /// A log of one vehicle that sees the lane markings.
    InCar,
}

impl Layout {
    /// Its name, as in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Ngsim18 => "ngsim18",
            Self::Ngsim25 => "ngsim25",
            Self::Highd => "highd",
            Self::Exid => "exid",
            Self::Commonroad => "commonroad",
            Self::InCar => "in-car",
        }
    }
}

/// How far away the markings of the own lane are, as a vehicle's camera sees them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MarkingDistances {
    /// Distance of the left marking from the vehicle's centre line, above 0 while it is on the left [m].
    pub left_m: Option<f64>,
    /// Distance of the right marking from the vehicle's centre line, above 0 while it is on the right [m].
    pub right_m: Option<f64>,
}

impl MarkingDistances {
    /// True where at least one marking is seen.
    pub fn is_seen(&self) -> bool {
        self.left_m.is_some() || self.right_m.is_some()
    }
}

/// A track as a reader gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedTrack {
    /// The movement.
    pub trajectory: Trajectory,
    /// The line of the file for each of its points, counted from 1.
    pub lines: Vec<u64>,
    /// Distances to the markings for each of its points, in in-car logs; empty in other recordings.
    pub markings: Vec<MarkingDistances>,
}

/// Recorded traffic on one road.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Its name: as the file states it, or else the file's name without its extension.
    pub name: String,
    /// The layout it was read from, or is to be written in.
    pub layout: Layout,
    /// Time between two frames.
    pub period: Time,
    /// Where the lane markings are, as far as the recorded lanes tell.
    pub markings: LaneMarkings,
    /// The tracks in the order of their numbers.
    pub trajectories: Vec<Trajectory>,
    /// BLAKE3 hash of the file, in hexadecimal digits; empty where there is no file.
    pub hash: String,
}

impl Recording {
    /// A recording made of `trajectories`, which are put in the order of their numbers.
    pub fn new(name: &str, period: Time, mut trajectories: Vec<Trajectory>) -> Self {
        trajectories.sort_by_key(|track| track.track_id);
        let markings = LaneMarkings::of(&trajectories);
        Self { name: name.to_owned(), layout: Layout::Plain, period, markings, trajectories, hash: String::new() }
    }
}
