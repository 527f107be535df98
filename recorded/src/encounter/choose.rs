//! The choice of an encounter among the lane changes of trajectory data.

use closecall_traffic::Time;

use super::{NoEncounter, RecordedEncounter, encounter};
use crate::criticality::{Judgement, by_severity, criticality};
use crate::filters::SmoothedTrajectoryData;
use crate::lane_change::LaneChange;

/// The reason why no encounter was chosen.
#[derive(Clone, Debug, PartialEq)]
pub enum ChoiceError {
    /// There is no lane change, or none of the track.
    NoLaneChange {
        /// Whether the file has a track at all that was asked for.
        is_recorded: bool,
        /// The tracks that change lanes, if a track was asked for.
        others: Vec<u64>,
    },
    /// None of the lane changes is an encounter.
    NoEncounter {
        /// The condition that the most critical lane change does not meet.
        source: NoEncounter,
        /// The tracks of the other lane changes that are encounters, if a track was asked for.
        possible: Vec<u64>,
    },
}

/// Returns the most critical lane change of `data`, or of its track `track`, that is an encounter,
/// with a trajectory point at every `period`.
///
/// # Errors
/// [`ChoiceError`] if there is none.
pub fn choose(
    data: &SmoothedTrajectoryData,
    track: Option<u64>,
    period: Time,
) -> Result<RecordedEncounter, ChoiceError> {
    let changes = criticality(data, &Judgement::default());
    let all: Vec<LaneChange> = changes.iter().map(|change| change.lane_change.clone()).collect();
    let encounter_of = |change: &LaneChange| encounter(data, change, &all, period);
    let mut refused = None;
    for change in by_severity(&changes, track) {
        match encounter_of(&change.lane_change) {
            Ok(encounter) => return Ok(encounter),
            Err(source) => refused = refused.or(Some(source)),
        }
    }
    let source = refused.ok_or_else(|| {
        let mut others: Vec<u64> = track.map_or(Vec::new(), |_| all.iter().map(|change| change.track_id).collect());
        others.dedup();
        ChoiceError::NoLaneChange { is_recorded: track.is_none_or(|track| data.track_index(track).is_some()), others }
    })?;
    let possible = track.map_or(Vec::new(), |_| {
        all.iter().filter(|change| encounter_of(change).is_ok()).map(|change| change.track_id).collect()
    });
    Err(ChoiceError::NoEncounter { source, possible })
}
