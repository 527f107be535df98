//! The trajectory data of one road: its tracks, its layout and its lane markings.

use std::path::PathBuf;

use closecall_traffic::{Time, Trajectory};

use super::class_names::UnknownClass;
use super::continuity::Continuity;
use super::file_layout::Layout;
use super::markings::LaneMarkings;
use crate::lane_change::LaneReliability;

/// Distances to the markings of the vehicle's own lane, as its camera measures them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MarkingDistances {
    /// Distance from the vehicle's centre line to the left marking (m). It is positive while the
    /// marking is on the left.
    pub left_m: Option<f64>,
    /// Distance from the vehicle's centre line to the right marking (m). It is positive while the
    /// marking is on the right.
    pub right_m: Option<f64>,
}

impl MarkingDistances {
    /// Returns `true` if the camera sees at least one marking.
    pub fn is_seen(&self) -> bool {
        self.left_m.is_some() || self.right_m.is_some()
    }
}

/// A gapless track, as a reader yields it.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedTrack {
    /// The movement of the vehicle.
    pub trajectory: Trajectory,
    /// Line number in the file for each point of the trajectory, counted from 1.
    pub lines: Vec<u64>,
    /// Distances to the markings for each point of the trajectory, from in-car logs. Empty for
    /// other layouts.
    pub markings: Vec<MarkingDistances>,
}

/// The trajectory data of one road.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryData {
    /// Name that the file states, or else the file name without its extension.
    pub name: String,
    /// Layout from which the data was read or in which it is to be written.
    pub layout: Layout,
    /// Time between two frames.
    pub period: Time,
    /// Known positions of the lane markings.
    pub markings: LaneMarkings,
    /// Whether lane changes are found by the recorded lanes.
    pub lanes: LaneReliability,
    /// The tracks, sorted by track number.
    pub trajectories: Vec<Trajectory>,
    /// BLAKE3 hash of the file content in hexadecimal digits. Empty if the data does not come from
    /// a file.
    pub hash: String,
    /// Whether a warning says that lane changes may be wrong or missing, or that the recorded lanes
    /// are none.
    pub is_in_doubt: bool,
    /// Whether a warning says that the recorded lane numbers do not name lanes.
    pub doubts_lanes: bool,
    /// Whether a warning says that left and right may be exchanged.
    pub doubts_sides: bool,
    /// Unknown names of vehicle classes in the file.
    pub unknown_classes: Vec<UnknownClass>,
    /// What the reader of the file notes on its content.
    pub notes: Vec<String>,
    /// How the rows of the file became tracks; zeros if the data does not come from a file.
    pub continuity: Continuity,
}

/// Checks that no two of the files at `paths`, which hold `data_sets`, have the same content: their
/// lane changes would count twice, and every interval would be too narrow.
///
/// # Errors
/// The names of the first two such files.
pub fn refuse_duplicates(paths: &[PathBuf], data_sets: &[TrajectoryData]) -> Result<(), String> {
    for (later, data) in data_sets.iter().enumerate() {
        if let Some(earlier) = data_sets[..later].iter().position(|earlier| earlier.hash == data.hash) {
            let (first, second) = (paths[earlier].display(), paths[later].display());
            return Err(format!("{first} and {second} have the same content"));
        }
    }
    Ok(())
}

impl TrajectoryData {
    /// Creates trajectory data from `trajectories`, sorts them by track number and derives the lane
    /// markings from them.
    pub fn new(name: &str, period: Time, mut trajectories: Vec<Trajectory>) -> Self {
        trajectories.sort_by_key(|track| track.track_id);
        let markings = LaneMarkings::from_trajectories(&trajectories);
        Self {
            name: name.to_owned(),
            layout: Layout::Plain,
            period,
            markings,
            lanes: LaneReliability::default(),
            trajectories,
            hash: String::new(),
            is_in_doubt: false,
            doubts_lanes: false,
            doubts_sides: false,
            unknown_classes: Vec::new(),
            notes: Vec::new(),
            continuity: Continuity::default(),
        }
    }

    /// Returns the notes for a reader of results from this data: markings that are not used, and
    /// unknown vehicle classes.
    pub fn warnings(&self) -> Vec<String> {
        let ignored = self.markings.ignored().iter().map(ToString::to_string);
        let unknown = self.unknown_classes.iter().map(ToString::to_string);
        let notes = self.notes.iter().cloned();
        notes.chain(self.continuity.warnings()).chain(ignored).chain(unknown).collect()
    }
}
