//! Labelling of a trajectory file: its tracks are read once more, and written with what was found.

use std::io;
use std::path::Path;

use super::sorted_points::{LabelledPoint, PointSorter};
use super::write::{Facts, Vehicle, write};
use crate::criticality::CriticalLaneChange;
use crate::lane_change::{LaneChange, LaneReliability};
use crate::trajectory_data::{
    LaneMarkings, Layout, ReadOptions, Tracks, TrajectoryFileError, WriteError, check_finite, open, open_whole,
};
use closecall_traffic::atomic::{parent_folder, write_atomically};

/// What was found in a trajectory file.
#[derive(Clone, Copy, Debug)]
pub enum Labels<'a> {
    /// Lane changes.
    LaneChanges(&'a [LaneChange]),
    /// Lane changes with their metrics, and the markings by which they were found.
    Criticality(&'a [CriticalLaneChange], &'a LaneMarkings),
}

/// A file that cannot be labelled. What was there before is untouched.
#[derive(Debug, thiserror::Error)]
pub enum LabelError {
    /// The trajectory file cannot be read.
    #[error(transparent)]
    Read(#[from] TrajectoryFileError),
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Why writing stopped, before the path of the output is attached.
#[derive(Debug)]
pub(super) enum Failure {
    Io(io::Error),
    Label(LabelError),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::Label(error.into())
    }
}

impl From<TrajectoryFileError> for Failure {
    fn from(error: TrajectoryFileError) -> Self {
        Self::Label(error.into())
    }
}

/// Writes the tracks of the file at `input`, which is read with `options`, and `labels` as
/// OpenLABEL 1.0.0 to `output`.
///
/// The file appears complete or not at all. A file of more than
/// [`WINDOW_ROWS`](crate::trajectory_data::WINDOW_ROWS) rows that is not sorted is held in memory.
///
/// # Errors
/// [`LabelError`] if `input` cannot be read, `output` cannot be written, a number is not finite, or
/// two points of a track are in one frame.
pub fn label_file(input: &Path, options: ReadOptions, labels: &Labels<'_>, output: &Path) -> Result<(), LabelError> {
    let in_folder = |error| WriteError::Io { path: output.to_owned(), source: error };
    let written = write_atomically(output, |file| {
        let gathered = match open(input, options).map_err(Failure::from).and_then(|tracks| gather(tracks, output)) {
            Err(Failure::Label(LabelError::Read(error))) if error.problem.needs_all_rows() => {
                gather(open_whole(input, options)?, output)?
            }
            gathered => gathered?,
        };
        let Gathered { sorter, vehicles, name, layout, period, markings, states_markings, is_simulated } = gathered;
        let markings = match labels {
            Labels::LaneChanges(_) => &markings,
            Labels::Criticality(_, markings) => *markings,
        };
        let facts = Facts {
            name: &name,
            tagged_file: &input.file_name().unwrap_or_default().to_string_lossy(),
            period,
            markings,
            is_simulated,
            states_markings,
            states_lanes: options.lanes == LaneReliability::Reliable && states_lanes(layout),
            is_motorway: is_motorway(layout, options.location),
        };
        write(file, &facts, &vehicles, labels, sorter.sorted()?)
    });
    written.map_err(|failure| match failure {
        Failure::Label(error) => error,
        Failure::Io(error) => in_folder(error).into(),
    })
}

/// Returns true if vehicles are in lanes that the files of this layout state.
fn states_lanes(layout: Layout) -> bool {
    match layout {
        Layout::Plain
        | Layout::Ngsim18
        | Layout::Ngsim25
        | Layout::Highd
        | Layout::Commonroad
        | Layout::Sumo
        | Layout::Vissim
        | Layout::OpenLabel
        | Layout::Osi => true,
        Layout::Exid | Layout::InCar | Layout::I24 => false,
    }
}

/// Returns true if a recording is certainly of a motorway.
fn is_motorway(layout: Layout, location: Option<&str>) -> bool {
    matches!(layout, Layout::Highd | Layout::I24) || matches!(location, Some("us-101" | "i-80"))
}

/// The points of a file, and what is needed before the first of them is written.
struct Gathered {
    sorter: PointSorter,
    vehicles: Vec<Vehicle>,
    name: String,
    layout: Layout,
    period: closecall_traffic::Time,
    markings: LaneMarkings,
    states_markings: bool,
    is_simulated: bool,
}

fn gather(mut tracks: Tracks<'_>, output: &Path) -> Result<Gathered, Failure> {
    let mut sorter = PointSorter::new(parent_folder(output));
    let mut vehicles = Vec::new();
    while let Some(track) = tracks.next_track()? {
        let track = track.trajectory;
        let Some((first, last)) = track.span() else { continue };
        let index = u32::try_from(vehicles.len()).unwrap_or(u32::MAX);
        for point in &track.points {
            check_finite(&track, point)?;
            sorter.push(LabelledPoint::new(index, point))?;
        }
        let mut lanes: Vec<u8> = track.points.iter().map(|point| point.lane.0).collect();
        lanes.dedup();
        let (track_id, vehicle_id) = (track.track_id, track.vehicle_id);
        let (class, dimensions) = (track.class, track.dimensions);
        vehicles.push(Vehicle { track_id, vehicle_id, class, dimensions, first, last, lanes });
    }
    Ok(Gathered {
        name: tracks.name(),
        layout: tracks.layout(),
        period: tracks.period(),
        markings: tracks.markings().clone(),
        states_markings: tracks.states_markings(),
        is_simulated: tracks.is_simulated(),
        sorter,
        vehicles,
    })
}
