//! What every reader gives: rows in SI units, in the order of the file.
//!
//! ```text
//!   NGSIM, highD, exiD, plain, in-car (text, by lines) ─┐
//!                                                        ├─▶ RowSource ─▶ rows ─▶ Tracks (the only way out)
//!   CommonRoad (XML, by events)                        ─┘
//! ```
//!
//! A reader holds one line or one XML element at a time; what it needs to know beforehand (the other files of a highD
//! recording, the lanelets of a CommonRoad scenario) it reads when it is opened.

use closecall_traffic::{Time, VehicleClass};

use super::fields::Fault;
use super::{LaneMarkings, Layout, MarkingDistances, RecordingProblem};

/// Whether frame numbers may start again within one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clock {
    /// One count of frames for the whole file.
    Continuous,
    /// Original NGSIM files put one behind the other: vehicle and frame numbers recur at later times.
    MayRestart,
}

/// One vehicle at one frame, in SI units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Rows of the same number and origin belong to one track, before it is split at gaps.
    pub(super) number: u64,
    /// Time of frame 0, where it tells apart several recordings in one file; zero where it does not.
    pub(super) origin: Time,
    pub(super) vehicle_id: u64,
    pub(super) frame: i64,
    pub(super) time: Time,
    pub(super) clock: Clock,
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) lane: u8,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: Option<f64>,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) class: VehicleClass,
    /// In-car logs only.
    pub(super) marking_distances: MarkingDistances,
    pub(super) line: u64,
}

/// What a reader knows about its recording before the last row.
#[derive(Clone, Debug)]
pub(super) struct About {
    pub(super) layout: Layout,
    /// The name that the file states, known after the first row at the latest.
    pub(super) name: Option<String>,
    /// Time between two frames, where the layout states it.
    pub(super) period: Option<Time>,
    /// The lane markings, where the layout states them.
    pub(super) markings: Option<LaneMarkings>,
}

/// A reader of one layout.
pub(super) trait RowSource {
    /// What is known so far.
    fn about(&self) -> About;

    /// The next row in the order of the file; nothing at its end.
    ///
    /// # Errors
    /// The line and what is wrong. After one that [`Refusal::is_of_row`], the next row can be asked for.
    fn next_row(&mut self) -> Result<Option<Row>, Refusal>;
}

/// An error before it knows its file.
#[derive(Debug)]
pub(super) struct Refusal {
    pub(super) line: Option<u64>,
    pub(super) column: Option<&'static str>,
    pub(super) problem: RecordingProblem,
}

impl Refusal {
    pub(super) fn of_file(problem: RecordingProblem) -> Self {
        Self { line: None, column: None, problem }
    }

    pub(super) fn new(line: u64, fault: impl Into<Fault>) -> Self {
        let Fault { column, problem } = fault.into();
        Self { line: Some(line), column, problem }
    }

    pub(super) fn of_fault(fault: Fault) -> Self {
        Self { line: None, column: fault.column, problem: fault.problem }
    }

    /// True where only this row is unusable, and reading can go on behind it.
    pub(super) fn is_of_row(&self) -> bool {
        self.problem.is_of_row()
    }
}
