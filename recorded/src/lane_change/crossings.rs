//! Lane crossings: changes of the recorded lane.

use closecall_traffic::{Lane, Side, Time};

use crate::filters::Stay;

/// Shortest time in a lane before and after a crossing.
pub(crate) const MIN_DWELL: Time = Time::from_ms(500);

/// Tolerance of the dwell time, because recorded times are rounded.
const ROUNDING: Time = Time::from_ms(5);

/// Returns true if a vehicle is long enough in a lane to stay there.
pub(crate) fn is_stay(duration: Time) -> bool {
    duration + ROUNDING >= MIN_DWELL
}

/// A change of the recorded lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// Time of the first frame in the new lane.
    pub(super) time: Time,
    /// Old lane.
    pub(super) from: Lane,
    /// New lane.
    pub(super) to: Lane,
}

impl Crossing {
    pub(super) fn direction(&self) -> Side {
        if self.to < self.from { Side::Left } else { Side::Right }
    }
}

/// Returns the changes between two lanes if the vehicle stays in each for at least [`MIN_DWELL`].
/// Shorter stays are ignored.
pub(super) fn crossings(stays: &[Stay]) -> Vec<Crossing> {
    let mut crossings = Vec::new();
    let mut current: Option<Lane> = None;
    for stay in stays.iter().filter(|stay| is_stay(stay.duration)) {
        if let Some(from) = current.filter(|from| *from != stay.lane) {
            crossings.push(Crossing { time: stay.first, from, to: stay.lane });
        }
        current = Some(stay.lane);
    }
    crossings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stay(lane: u8, first_ms: i64, duration_ms: i64) -> Stay {
        Stay { lane: Lane(lane), first: Time::from_ms(first_ms), duration: Time::from_ms(duration_ms) }
    }

    #[test]
    fn short_stays_are_ignored() {
        let accepted = crossings(&[stay(2, 0, 3_000), stay(1, 3_000, 200), stay(2, 3_200, 300), stay(1, 3_500, 900)]);
        assert_eq!(accepted, [Crossing { time: Time::from_ms(3_500), from: Lane(2), to: Lane(1) }]);
        assert_eq!(accepted[0].direction(), Side::Left);
    }

    #[test]
    fn half_a_second_in_each_lane_is_enough_and_less_is_not() {
        assert_eq!(crossings(&[stay(1, 0, 500), stay(2, 500, 500)]).len(), 1);
        assert!(crossings(&[stay(1, 0, 500), stay(2, 500, 400)]).is_empty());
        assert!(crossings(&[stay(1, 0, 400), stay(2, 400, 900)]).is_empty());
    }
}
