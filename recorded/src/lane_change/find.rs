//! The lane changes of a whole trajectory file. Its tracks are read one by one.

use super::{Criterion, DetectionBasis, LaneChange, LaneChangeDetector, TrackSpans};
use crate::trajectory_data::{Tracks, TrajectoryFileError};

/// The lane changes of a trajectory file.
#[derive(Clone, Debug)]
pub struct FoundLaneChanges {
    /// The lane changes, in order of their tracks, then of their crossings.
    pub lane_changes: Vec<LaneChange>,
    /// First and last instant of each track.
    pub spans: TrackSpans,
    /// Number of tracks.
    pub tracks: u64,
    /// The basis of the detection.
    pub basis: DetectionBasis,
}

/// Detects the lane changes of a trajectory file. The memory does not grow with the file, apart
/// from some bytes for each track.
///
/// # Errors
/// [`TrajectoryFileError`] if the file cannot be read or used.
pub fn find(tracks: &mut Tracks<'_>, criterion: Criterion) -> Result<FoundLaneChanges, TrajectoryFileError> {
    let lanes = tracks.lanes();
    let detector = LaneChangeDetector::new(lanes, tracks.markings());
    let basis = DetectionBasis::new(criterion, lanes, tracks.markings());
    let mut result = FoundLaneChanges { lane_changes: Vec::new(), spans: TrackSpans::new(), tracks: 0, basis };
    while let Some(track) = tracks.next_track()? {
        result.tracks += 1;
        result.basis.push(&track.trajectory, &track.markings);
        result.lane_changes.extend(detector.detect(criterion, &track.trajectory, &track.markings));
        result.spans.extend(track.trajectory.span().map(|span| (track.trajectory.track_id, span)));
    }
    result.basis.set_hidden_crossings(tracks.continuity().hidden_crossings);
    result.lane_changes.sort_by(|a, b| a.track_id.cmp(&b.track_id).then(a.crossing_s.total_cmp(&b.crossing_s)));
    Ok(result)
}
