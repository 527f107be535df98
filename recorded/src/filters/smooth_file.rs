//! Smooths the tracks of a file while it reads the file. Each recorded track is dropped as soon as
//! it is smoothed, so memory does not grow with the recorded rows.

use std::path::Path;

use closecall_traffic::Time;

use super::smooth::{SmoothedTrack, SmoothedTrajectoryData, smooth, smooth_track};
use crate::trajectory_data::{
    FlawCounts, Layout, MarkingObserver, QualityInspector, ReadOptions, Tracks, TrajectoryFileError, count_flaws,
    open_streaming, read_with,
};

/// Number of track points among which overlaps are searched: 25 MiB.
const STORED_POINTS: usize = 1 << 19;

/// The smoothed tracks of a file, and the reader's findings about the file.
#[derive(Clone, Debug)]
pub struct SmoothedFile {
    /// The smoothed tracks.
    pub data: SmoothedTrajectoryData,
    /// The flaws of the recorded tracks.
    pub flaws: FlawCounts,
    /// Time between two recorded frames.
    pub period: Time,
    /// Whether a warning says that lane changes may be missing, or that the recorded lane numbers
    /// do not name lanes.
    pub is_in_doubt: bool,
    /// Whether a warning says that the recorded lane numbers do not name lanes.
    pub doubts_lanes: bool,
    /// Whether a warning says that left and right may be exchanged.
    pub doubts_sides: bool,
    /// Messages about the file that belong beside every result of it.
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
    let recorded = read_with(path, options)?;
    Ok(SmoothedFile {
        data: smooth(&recorded),
        flaws: count_flaws(&recorded),
        period: recorded.period,
        is_in_doubt: recorded.is_in_doubt,
        doubts_lanes: recorded.doubts_lanes,
        doubts_sides: recorded.doubts_sides,
        warnings: recorded.warnings(),
        hash: recorded.hash,
    })
}

/// Smooths the tracks one by one. Returns `None` if the file has to be read as a whole.
fn smooth_stream(mut file: Tracks<'_>) -> Result<Option<SmoothedFile>, TrajectoryFileError> {
    // The export of NGSIM may hold several data sets, which only the last row tells apart.
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
    Ok(Some(SmoothedFile {
        data: SmoothedTrajectoryData::new(&file.name(), markings, file.lanes(), tracks),
        flaws: inspector.count_flaws(),
        period: file.period(),
        is_in_doubt: file.is_in_doubt(),
        doubts_lanes: file.doubts_lanes(),
        doubts_sides: file.doubts_sides(),
        warnings,
        hash: file.hash(),
    }))
}
