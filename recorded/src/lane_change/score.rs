//! Scores detected lane changes against a reference list.
//!
//! The list is a CSV file with the columns `recording_id, track_id, time_s, direction, clear`;
//! further columns are allowed. A detected lane change matches a listed lane change of the same
//! track and direction if their times differ by at most 0.5 s.
//!
//! - **Recall** refers to the listed lane changes that must be detected: the `clear` lane changes
//!   with at least 2 s of track on both sides.
//! - **Precision** refers to all listed lane changes, clear or not.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use closecall_traffic::input;
use closecall_traffic::statistics::interval::{COVERAGE, clopper_pearson};
use closecall_traffic::{Side, Time};
use serde::{Deserialize, Serialize};

use super::LaneChange;

/// Largest difference between the detected and the listed crossing time (s).
const AGREEMENT_S: f64 = 0.5;

/// Length of track on both sides from which on a listed lane change must be detected (s).
const ON_EACH_SIDE_S: f64 = 2.0;

/// Tolerance of time differences, because times in files are rounded (s).
const ROUNDING_S: f64 = 1e-6;

/// Largest size of a reference list (bytes): about a million lane changes.
const MAX_REFERENCE_BYTES: u64 = 64 << 20;

/// A lane change of the reference list.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct ReferenceChange {
    /// Name of the trajectory data set.
    pub recording_id: String,
    /// Track id in the trajectory data.
    pub track_id: u64,
    /// First instant in the new lane (s).
    pub time_s: f64,
    /// Direction: to the left or to the right.
    pub direction: Side,
    /// 1 if the vehicle clearly moved from one lane to another; 0 if it drove on the marking or its
    /// track was cut off.
    pub clear: u8,
}

/// The error for a reference list that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}; needed are the columns recording_id, track_id, time_s, direction (left or right), clear (0 or 1)", path.display())]
pub struct ReferenceError {
    /// The file.
    pub path: PathBuf,
    /// The cause, with its line.
    pub source: csv::Error,
}

impl ReferenceError {
    /// Returns true if the file cannot be read, as opposed to having wrong content.
    pub fn is_io(&self) -> bool {
        matches!(self.source.kind(), csv::ErrorKind::Io(error) if !input::is_of_content(error))
    }
}

/// Reads a reference list.
///
/// # Errors
/// Returns a [`ReferenceError`] with the file, the line and the required columns.
pub fn read_references(path: &Path) -> Result<Vec<ReferenceChange>, ReferenceError> {
    let fail = |source| ReferenceError { path: path.to_owned(), source };
    let file = input::open(path).map_err(|error| fail(error.into()))?;
    let wrong = |message: String| fail(io::Error::new(io::ErrorKind::InvalidData, message).into());
    let mut bytes = Vec::new();
    file.take(MAX_REFERENCE_BYTES + 1).read_to_end(&mut bytes).map_err(|error| fail(error.into()))?;
    if bytes.len() as u64 > MAX_REFERENCE_BYTES {
        return Err(wrong(format!("the file is larger than {} MiB", MAX_REFERENCE_BYTES >> 20)));
    }
    let text = input::with_line_feeds(&bytes);
    let mut reader = csv::Reader::from_reader(&text[..]);
    let changes: Vec<ReferenceChange> = reader.deserialize().collect::<Result<_, _>>().map_err(fail)?;
    if changes.is_empty() { Err(wrong("there are no rows".to_owned())) } else { Ok(changes) }
}

/// Returns the lane changes of the trajectory data `name`.
///
/// # Errors
/// If there are none: a score of nothing would look like a result.
pub fn listed_for(references: Vec<ReferenceChange>, name: &str) -> Result<Vec<ReferenceChange>, String> {
    let listed: Vec<_> = references.into_iter().filter(|listed| listed.recording_id == name).collect();
    match listed.is_empty() {
        true => Err(format!("the list of known lane changes has no row whose recording_id is `{name}`")),
        false => Ok(listed),
    }
}

/// A share, as a number of hits among trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct HitRate {
    /// Number of hits.
    pub hits: u64,
    /// Number of trials.
    pub of: u64,
}

impl fmt::Display for HitRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = clopper_pearson(self.hits, self.of, COVERAGE);
        let percent = 100.0 * self.hits as f64 / self.of as f64;
        write!(f, "{} of {}", self.hits, self.of)?;
        if self.of > 0 {
            write!(f, " = {percent:.1} % (95 %: {:.1} to {:.1} %)", 100.0 * low, 100.0 * high)?;
        }
        Ok(())
    }
}

/// The score of a detector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Score {
    /// Share of the listed lane changes that must be detected and are.
    pub recall: HitRate,
    /// Share of the detected lane changes that are listed.
    pub precision: HitRate,
    /// Largest difference of the crossing times of a match (s).
    pub max_time_error_s: f64,
}

impl Score {
    /// Adds the score of another trajectory data set.
    pub fn add(&mut self, other: &Self) {
        for (rate, other) in [(&mut self.recall, other.recall), (&mut self.precision, other.precision)] {
            rate.hits += other.hits;
            rate.of += other.of;
        }
        self.max_time_error_s = self.max_time_error_s.max(other.max_time_error_s);
    }
}

/// First and last instant of each track, by track id.
pub type TrackSpans = BTreeMap<u64, (Time, Time)>;

/// Scores the `detected` lane changes against the lane changes `listed` for the same trajectory
/// data. Its tracks cover `spans`.
pub fn score(detected: &[LaneChange], listed: &[&ReferenceChange], spans: &TrackSpans) -> Score {
    let required: Vec<_> = listed.iter().filter(|listed| must_be_detected(listed, spans)).collect();
    let recalled = required.iter().filter(|listed| detected.iter().any(|change| error_s(change, listed).is_some()));
    let errors = detected
        .iter()
        .filter_map(|change| listed.iter().filter_map(|listed| error_s(change, listed)).min_by(f64::total_cmp));
    let errors: Vec<f64> = errors.collect();
    Score {
        recall: HitRate { hits: recalled.count() as u64, of: required.len() as u64 },
        precision: HitRate { hits: errors.len() as u64, of: detected.len() as u64 },
        max_time_error_s: errors.into_iter().fold(0.0, f64::max),
    }
}

/// Returns the difference of the crossing times (s), or `None` if the two do not match.
fn error_s(detected: &LaneChange, listed: &ReferenceChange) -> Option<f64> {
    let error_s = (detected.crossing_s - listed.time_s).abs();
    let same = detected.track_id == listed.track_id && detected.direction == listed.direction;
    (same && error_s <= AGREEMENT_S + ROUNDING_S).then_some(error_s)
}

/// Returns true if a listed lane change counts for recall.
fn must_be_detected(listed: &ReferenceChange, spans: &TrackSpans) -> bool {
    let Some((first, last)) = spans.get(&listed.track_id) else { return false };
    listed.clear == 1
        && listed.time_s - first.s() >= ON_EACH_SIDE_S - ROUNDING_S
        && last.s() - listed.time_s >= ON_EACH_SIDE_S - ROUNDING_S
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filters::smooth;
    use crate::lane_change::detect;
    use crate::trajectory_data::test_support::{changing_track, trajectory_data_of};

    fn listed(track_id: u64, time_s: f64, direction: Side) -> ReferenceChange {
        ReferenceChange { recording_id: "made-up".to_owned(), track_id, time_s, direction, clear: 1 }
    }

    #[test]
    fn a_mismatch_lowers_both_recall_and_precision() {
        let track = |id| changing_track(id, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        let data = trajectory_data_of(vec![track(1), track(2), track(3)]);
        let detected = detect(&smooth(&data));
        let list = [
            listed(1, 7.4, Side::Left),
            listed(2, 7.0, Side::Right),
            listed(3, 7.8, Side::Left),
            listed(3, 1.0, Side::Left),
        ];
        let spans = data.trajectories.iter().filter_map(|track| Some((track.track_id, track.span()?))).collect();
        let scored = score(&detected, &list.iter().collect::<Vec<_>>(), &spans);
        assert_eq!((scored.recall, scored.precision), (HitRate { hits: 1, of: 3 }, HitRate { hits: 1, of: 3 }));
        assert!((scored.max_time_error_s - 0.3).abs() <= 0.21, "{}", scored.max_time_error_s);
    }

    #[test]
    fn a_malformed_list_is_refused_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("list.csv");
        std::fs::write(&path, "recording_id,track_id,time_s,direction,clear\na,1,2.0,left,1\na,1,2.0,up,1\n").unwrap();
        let message = read_references(&path).unwrap_err().to_string();
        assert!(
            message.contains("list.csv") && message.contains("line: 3") && message.contains("direction"),
            "{message}"
        );
    }
}
