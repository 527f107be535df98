//! For how long a vehicle was recorded in which lane.

use closecall_traffic::{Lane, Time, Trajectory};

use super::PERIOD;

/// Frames in a row in one lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stay {
    /// The lane.
    pub lane: Lane,
    /// Its first frame.
    pub first: Time,
    /// For how long it is held: its frames times the time between two.
    pub held: Time,
}

/// The stays of a track, in the order of time.
pub fn stays_of(track: &Trajectory) -> Vec<Stay> {
    let period = period_of(track).unwrap_or(PERIOD);
    let mut found: Vec<Stay> = Vec::new();
    for point in &track.points {
        match found.last_mut() {
            Some(stay) if stay.lane == point.lane => stay.held += period,
            _ => found.push(Stay { lane: point.lane, first: point.time, held: period }),
        }
    }
    found
}

/// The time between two frames of a track that has at least two, at different times.
pub(super) fn period_of(track: &Trajectory) -> Option<Time> {
    let (first, last) = track.span()?;
    let steps = track.points.len() as i64 - 1;
    (steps > 0 && last > first).then(|| Time::from_ns((last - first).ns() / steps))
}
