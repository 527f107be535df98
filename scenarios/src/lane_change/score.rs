//! Lane changes that were found, held against a list of those that happened.
//!
//! The list is CSV with the columns `recording_id, track_id, time_s, direction, clear`; others may stand beside them. A
//! found lane change agrees with a listed one of the same track and direction whose time it meets within 0.5 s.
//!
//! - **recall** is over the listed ones that have to be found: `clear` ones, with at least 2 s of track on both sides;
//! - **precision** is against all listed ones, whether clear or not.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use closecall_traffic::{Side, Time};
use serde::{Deserialize, Serialize};

use super::LaneChange;
use crate::interval::clopper_pearson;

/// Largest difference between the crossing found and the listed one [s].
const AGREEMENT_S: f64 = 0.5;

/// A listed lane change has to be found where its track goes on for this long on both sides [s].
const ON_EACH_SIDE_S: f64 = 2.0;

/// Times in files are rounded; a difference may exceed its limit by this [s].
const ROUNDING_S: f64 = 1e-6;

/// A lane change that happened.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct ReferenceChange {
    /// The recording's name.
    pub recording_id: String,
    /// The recording's number of the track.
    pub track_id: u64,
    /// First instant in the other lane [s].
    pub time_s: f64,
    /// To the left or to the right.
    pub direction: Side,
    /// 1 where the vehicle clearly moved from one lane to another, 0 where it rode on the marking or its track was cut.
    pub clear: u8,
}

/// A list that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}; needed are the columns recording_id, track_id, time_s, direction (left or right), clear (0 or 1)", path.display())]
pub struct ReferenceError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong, with its line.
    pub source: csv::Error,
}

impl ReferenceError {
    /// True where the file could not be read at all.
    pub fn is_io(&self) -> bool {
        self.source.is_io_error()
    }
}

/// Reads a list of lane changes that happened.
///
/// # Errors
/// [`ReferenceError`] with the file, the line and what is needed.
pub fn read_references(path: &Path) -> Result<Vec<ReferenceChange>, ReferenceError> {
    let fail = |source| ReferenceError { path: path.to_owned(), source };
    let mut reader = csv::Reader::from_path(path).map_err(fail)?;
    reader.deserialize().collect::<Result<_, _>>().map_err(fail)
}

/// Hits among trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Share {
    /// How many were hit.
    pub hits: u64,
    /// Of how many.
    pub of: u64,
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = clopper_pearson(self.hits, self.of);
        let percent = 100.0 * self.hits as f64 / self.of as f64;
        write!(f, "{} of {}", self.hits, self.of)?;
        if self.of > 0 {
            write!(f, " = {percent:.1} % (95 %: {:.1} to {:.1} %)", 100.0 * low, 100.0 * high)?;
        }
        Ok(())
    }
}

/// How well a detector did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Score {
    /// Of the listed ones that have to be found, those that were.
    pub recall: Share,
    /// Of those found, the listed ones.
    pub precision: Share,
    /// Largest difference of a crossing time among those that agree [s].
    pub max_time_error_s: f64,
}

impl Score {
    /// Adds what another recording gave.
    pub fn add(&mut self, other: &Self) {
        for (own, other) in [(&mut self.recall, other.recall), (&mut self.precision, other.precision)] {
            own.hits += other.hits;
            own.of += other.of;
        }
        self.max_time_error_s = self.max_time_error_s.max(other.max_time_error_s);
    }
}

/// First and last instant of the tracks of a recording, by their numbers.
pub type Spans = BTreeMap<u64, (Time, Time)>;

/// Scores `found` against the `listed` ones of the same recording, whose tracks last as `spans` says.
pub fn score(found: &[LaneChange], listed: &[&ReferenceChange], spans: &Spans) -> Score {
    let needed: Vec<_> = listed.iter().filter(|listed| has_to_be_found(listed, spans)).collect();
    let recalled = needed.iter().filter(|listed| found.iter().any(|change| error_s(change, listed).is_some()));
    let errors = found
        .iter()
        .filter_map(|change| listed.iter().filter_map(|listed| error_s(change, listed)).min_by(f64::total_cmp));
    let errors: Vec<f64> = errors.collect();
    Score {
        recall: Share { hits: recalled.count() as u64, of: needed.len() as u64 },
        precision: Share { hits: errors.len() as u64, of: found.len() as u64 },
        max_time_error_s: errors.into_iter().fold(0.0, f64::max),
    }
}

/// The difference of the crossing times [s], where the two agree.
fn error_s(found: &LaneChange, listed: &ReferenceChange) -> Option<f64> {
    let error_s = (found.crossing_s - listed.time_s).abs();
    let same = found.track_id == listed.track_id && found.direction == listed.direction;
    (same && error_s <= AGREEMENT_S + ROUNDING_S).then_some(error_s)
}

fn has_to_be_found(listed: &ReferenceChange, spans: &Spans) -> bool {
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
    use crate::recordings::test_support::{changing_track, recording_of};

    fn listed(track_id: u64, time_s: f64, direction: Side) -> ReferenceChange {
        ReferenceChange { recording_id: "made-up".to_owned(), track_id, time_s, direction, clear: 1 }
    }

    #[test]
    fn what_agrees_counts_and_what_does_not_counts_against_both() {
        let track = |id| changing_track(id, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        let recording = recording_of(vec![track(1), track(2), track(3)]);
        let found = detect(&smooth(&recording));
        let list = [
            listed(1, 7.4, Side::Left),
            listed(2, 7.0, Side::Right),
            listed(3, 7.8, Side::Left),
            listed(3, 1.0, Side::Left),
        ];
        let spans = recording.trajectories.iter().filter_map(|track| Some((track.track_id, track.span()?))).collect();
        let scored = score(&found, &list.iter().collect::<Vec<_>>(), &spans);
        assert_eq!((scored.recall, scored.precision), (Share { hits: 1, of: 3 }, Share { hits: 1, of: 3 }));
        assert!((scored.max_time_error_s - 0.3).abs() <= 0.21, "{}", scored.max_time_error_s);
    }

    #[test]
    fn a_list_that_cannot_be_used_names_its_line() {
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
