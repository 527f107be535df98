//! Lane stays: the intervals in which a vehicle was recorded in one lane.

use closecall_traffic::{Lane, Time, Trajectory};

use super::PERIOD;

/// A lane stay: consecutive recorded frames of a vehicle in one lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stay {
    /// The lane.
    pub lane: Lane,
    /// Time of the first frame.
    pub first: Time,
    /// Duration of the stay: the number of its frames times the frame period.
    pub duration: Time,
}

/// Returns the lane stays of a track in order of time.
pub fn stays_of(track: &Trajectory) -> Vec<Stay> {
    let period = period_of(track).unwrap_or(PERIOD);
    let mut stays: Vec<Stay> = Vec::new();
    for point in &track.points {
        match stays.last_mut() {
            Some(stay) if stay.lane == point.lane => stay.duration += period,
            _ => stays.push(Stay { lane: point.lane, first: point.time, duration: period }),
        }
    }
    stays
}

/// Returns the mean time between two frames of a track, or `None` if the track does not have two at
/// different times.
pub(super) fn period_of(track: &Trajectory) -> Option<Time> {
    let (first, last) = track.span()?;
    let steps = track.points.len() as i64 - 1;
    (steps > 0 && last > first).then(|| Time::from_ns((last - first).ns() / steps))
}
