//! The choice of an encounter among the lane changes of trajectory data.

use closecall_traffic::Time;

use super::{Lead, NoEncounter, RecordedEncounter, encounter};
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
    /// The track has fewer lane changes.
    NoSuchNumber {
        /// Number of its lane changes.
        count: usize,
    },
    /// None of the lane changes is an encounter.
    NoEncounter {
        /// The condition that the most critical lane change does not meet.
        source: NoEncounter,
        /// The tracks of the other lane changes that are encounters, if a track was asked for.
        possible: Vec<u64>,
    },
}

/// Which lane change is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Track that changes lanes; `None` for the most critical lane change.
    pub track: Option<u64>,
    /// Number of the lane change among the track's lane changes, in order of time, from 1 on;
    /// `None` for the most critical one.
    pub number: Option<usize>,
    /// Whether a lead vehicle is required.
    pub lead: Lead,
}

/// Returns the most critical lane change of `data` that is wanted and is an encounter, with a
/// trajectory point at every `period`.
///
/// # Errors
/// [`ChoiceError`] if there is none.
pub fn choose(data: &SmoothedTrajectoryData, wanted: Wanted, period: Time) -> Result<RecordedEncounter, ChoiceError> {
    let Ok(chosen) = choose_first(data, wanted, period, Ok::<_, std::convert::Infallible>)?;
    Ok(chosen)
}

/// Returns what `accept` makes of the most critical lane change of `data` that is wanted, is an
/// encounter and is accepted, with a trajectory point at every `period`. If none is accepted,
/// returns the first reason of `accept`.
///
/// # Errors
/// [`ChoiceError`] if there is no encounter.
pub fn choose_first<T, E>(
    data: &SmoothedTrajectoryData,
    Wanted { track, number, lead }: Wanted,
    period: Time,
    accept: impl Fn(RecordedEncounter) -> Result<T, E>,
) -> Result<Result<T, E>, ChoiceError> {
    let changes = criticality(data, &Judgement::default());
    let all: Vec<LaneChange> = changes.iter().map(|change| change.lane_change.clone()).collect();
    let encounter_of = |change: &LaneChange| encounter(data, change, &all, period, lead);
    let mut candidates = by_severity(&changes, track);
    if let Some(number) = number {
        candidates.sort_by(|a, b| a.lane_change.crossing_s.total_cmp(&b.lane_change.crossing_s));
        let count = candidates.len();
        let chosen = number.checked_sub(1).filter(|index| *index < count);
        candidates = chosen.map(|index| candidates[index]).into_iter().collect();
        if candidates.is_empty() && count > 0 {
            return Err(ChoiceError::NoSuchNumber { count });
        }
    }
    let (mut refused, mut not_accepted) = (None, None);
    for change in candidates {
        match encounter_of(&change.lane_change).map(&accept) {
            Ok(Ok(accepted)) => return Ok(Ok(accepted)),
            Ok(Err(reason)) => not_accepted = not_accepted.or(Some(reason)),
            Err(source) => refused = refused.or(Some(source)),
        }
    }
    if let Some(reason) = not_accepted {
        return Ok(Err(reason));
    }
    let source = refused.ok_or_else(|| {
        let mut others: Vec<u64> = track.map_or(Vec::new(), |_| all.iter().map(|change| change.track_id).collect());
        others.dedup();
        ChoiceError::NoLaneChange { is_recorded: track.is_none_or(|track| data.track_index(track).is_some()), others }
    })?;
    let possible = track.map_or(Vec::new(), |_| {
        let mut tracks: Vec<u64> =
            all.iter().filter(|change| encounter_of(change).is_ok()).map(|change| change.track_id).collect();
        tracks.dedup();
        tracks
    });
    Err(ChoiceError::NoEncounter { source, possible })
}
