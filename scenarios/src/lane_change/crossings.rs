//! Changes of the recorded lane.

use closecall_traffic::{Lane, Side, Time};

use crate::filters::Stay;

/// A lane must be held for this long before and after a crossing.
pub(super) const MIN_DWELL: Time = Time::from_ms(500);

/// Recorded times are rounded; a dwell may be short by this.
const ROUNDING: Time = Time::from_ms(5);

/// A change from one lane to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// First frame in the other lane.
    pub(super) time: Time,
    pub(super) from: Lane,
    pub(super) to: Lane,
}

impl Crossing {
    pub(super) fn direction(&self) -> Side {
        if self.to < self.from { Side::Left } else { Side::Right }
    }
}

/// Changes between lanes that are each held for the least dwell; shorter stays are passed over.
pub(super) fn crossings(stays: &[Stay]) -> Vec<Crossing> {
    let mut crossings = Vec::new();
    let mut kept: Option<Lane> = None;
    for stay in stays.iter().filter(|stay| stay.held + ROUNDING >= MIN_DWELL) {
        if let Some(from) = kept.filter(|from| *from != stay.lane) {
            crossings.push(Crossing { time: stay.first, from, to: stay.lane });
        }
        kept = Some(stay.lane);
    }
    crossings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stay(lane: u8, first_ms: i64, held_ms: i64) -> Stay {
        Stay { lane: Lane(lane), first: Time::from_ms(first_ms), held: Time::from_ms(held_ms) }
    }

    #[test]
    fn flicker_is_passed_over() {
        let found = crossings(&[stay(2, 0, 3_000), stay(1, 3_000, 200), stay(2, 3_200, 300), stay(1, 3_500, 900)]);
        assert_eq!(found, [Crossing { time: Time::from_ms(3_500), from: Lane(2), to: Lane(1) }]);
        assert_eq!(found[0].direction(), Side::Left);
    }

    #[test]
    fn half_a_second_is_enough_and_less_is_not() {
        assert_eq!(crossings(&[stay(1, 0, 500), stay(2, 500, 500)]).len(), 1);
        assert!(crossings(&[stay(1, 0, 500), stay(2, 500, 400)]).is_empty());
        assert!(crossings(&[stay(1, 0, 400), stay(2, 400, 900)]).is_empty());
    }
}
