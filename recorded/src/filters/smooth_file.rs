//! Smoothing of a file while it is read: recorded tracks are dropped as soon as they are smoothed.

use std::path::Path;

use closecall_traffic::Time;

use super::smooth::{SmoothedTrack, SmoothedTrajectoryData, smooth, smooth_track};
use crate::trajectory_data::{
    FlawCounts, Layout, MarkingObserver, QualityInspector, ReadOptions, Tracks, TrajectoryFileError, count_flaws,
    open_streaming, read_with,
};

/// Number of track points among which overlaps are searched: 25 MiB.
const STORED_POINTS: usize = 1 << 19;

/// The smoothed tracks of a file, and what its reader has found besides.
#[derive(Clone, Debug)]
pub struct SmoothedFile {
    /// The smoothed tracks.
    pub data: SmoothedTrajectoryData,
    /// The flaws of the recorded tracks.
    pub flaws: FlawCounts,
    /// Time between two recorded frames.
    pub period: Time,
    /// Whether a warning says that lane changes may be missing, or that the recorded lanes are
    /// none.
    pub is_in_doubt: bool,
    /// Whether a warning says that the recorded lanes are none.
    pub doubts_lanes: bool,
    /// Whether a warning says that left and right may be exchanged.
    pub doubts_sides: bool,
    /// What a reader of results has to know of the file.
    pub warnings: Vec<String>,
    /// BLAKE3 hash of the file content in hexadecimal digits.
    pub hash: String,
}

/// Smooths the tracks of the file at `path`, and holds no more of its rows than needed.
///
/// A file of more than [`STREAM_ROWS`](crate::trajectory_data::STREAM_ROWS) rows is held as a whole
/// only if it is not sorted, or if it may hold several data sets whose clocks overlap.
///
/// # Errors
/// [`TrajectoryFileError`] with file, line, column and allowed values.
pub fn smooth_file(path: &Path, options: ReadOptions) -> Result<SmoothedFile, TrajectoryFileError> {
    match open_streaming(path, options).and_then(smooth_stream) {
        Ok(Some(file)) => return Ok(file),
        Err(error) if !error.problem.needs_all_rows() => return Err(error),
        Ok(None) | Err(_) => {}
    }
    let data = read_with(path, options)?;
    let (flaws, warnings) = (count_flaws(&data), data.warnings());
    let (is_in_doubt, doubts_lanes, doubts_sides) = (data.is_in_doubt, data.doubts_lanes, data.doubts_sides);
    let (period, hash) = (data.period, data.hash.clone());
    Ok(SmoothedFile { data: smooth(&data), flaws, period, is_in_doubt, doubts_lanes, doubts_sides, warnings, hash })
}

/// Smooths the tracks one by one. Returns `None` if the file has to be read as a whole.
fn smooth_stream(mut file: Tracks<'_>) -> Result<Option<SmoothedFile>, TrajectoryFileError> {
    // The export may hold several data sets, which are told apart after the last row.
    if file.layout() == Layout::Ngsim25 {
        return Ok(None);
    }
    let mut markings = MarkingObserver::default();
    let mut inspector = QualityInspector::storing(STORED_POINTS);
    let mut tracks: Vec<SmoothedTrack> = Vec::new();
    while let Some(track) = file.next_track()? {
        markings.add(&track.trajectory);
        inspector.add(&track);
        tracks.extend(smooth_track(&track.trajectory).map(|mut smoothed| {
            smoothed.trajectory.points.shrink_to_fit();
            smoothed
        }));
    }
    tracks.sort_by_key(|track| track.trajectory.track_id);
    let markings = if file.states_markings() { file.markings().clone() } else { markings.finish() };
    let warnings = file.warnings().into_iter().chain(markings.ignored().iter().map(ToString::to_string)).collect();
    let data = SmoothedTrajectoryData::new(&file.name(), markings, file.lanes(), tracks);
    let (flaws, period, is_in_doubt) = (inspector.count_flaws(), file.period(), file.is_in_doubt());
    let (doubts_lanes, doubts_sides, hash) = (file.doubts_lanes(), file.doubts_sides(), file.hash());
    Ok(Some(SmoothedFile { data, flaws, period, is_in_doubt, doubts_lanes, doubts_sides, warnings, hash }))
}
