//! How near a sample came to an event: the score that guides a search.
//!
//! A score decides how many runs a search needs, and nothing else: no estimate and no interval
//! depends on it. A bound of a number is its own guide. A collision of the ego is guided by its
//! smallest gap, and `induced` and `prevented` by the smallest gap in the arm that is to collide,
//! plus the change of velocity of a collision in the arm that is not to. A search for the first
//! case is also led by what sets the arms apart ([`Nearness::with_contrast`]).

use closecall_scenarios::criteria::{EGO_COLLIDED, Event, EventExpression, Guide, Measure, PairFlag, Quantity};
use closecall_scenarios::outcome::Outcome;

use super::problem::Response;
use crate::gate::value;
use crate::record::Record;

/// The events of a campaign, with the number that leads to each of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearness {
    expression: EventExpression,
    guide: Option<Guide>,
    /// Whether the difference of two arms leads to an event of both, too.
    contrasts: bool,
}

/// An event to which nothing leads.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("nothing tells how near a sample comes to `{event}`: name a number of the sample that leads to it")]
pub struct NoGuide {
    /// The event.
    pub event: Event,
}

impl Nearness {
    /// Returns the events with what leads to them: `guide`, if one is named.
    ///
    /// # Errors
    /// [`NoGuide`] if none is named, and an event has none of its own.
    pub fn new(expression: EventExpression, guide: Option<Guide>) -> Result<Self, NoGuide> {
        let has_guide = |event: &Event| match event.quantity {
            _ if guide.is_some() || event.excess(0.0).is_some() => true,
            Quantity::Tested(measure) | Quantity::Baseline(measure) => measure.name == EGO_COLLIDED,
            Quantity::Pair(_) => true,
            Quantity::Compared(_) | Quantity::Covered(_) => false,
        };
        match expression.events().find(|event| !has_guide(event)) {
            Some(event) => Err(NoGuide { event }),
            None => Ok(Self { expression, guide, contrasts: false }),
        }
    }

    /// Returns the same events, to which the difference of the two arms leads as well: a sample in
    /// which one arm keeps its distance and the other does not is nearer than a sample in which
    /// both come equally close.
    #[must_use]
    pub const fn with_contrast(self) -> Self {
        Self { contrasts: true, ..self }
    }

    /// Returns the events.
    pub const fn expression(&self) -> EventExpression {
        self.expression
    }

    /// Returns which of [`Response::values`] is estimated: the event, or the difference of two.
    pub const fn value(&self) -> usize {
        if self.expression.second.is_some() { 2 } else { 0 }
    }

    /// Returns the number that leads to the events, if one is named.
    pub const fn guide(&self) -> Option<Guide> {
        self.guide
    }

    /// Returns how near a sample came to the events. A sample without an outcome has no event, and
    /// is farthest from all of them.
    pub fn response(&self, record: &Record) -> Response {
        let EventExpression { first, second } = self.expression;
        let happened = |event: Event| value(event.quantity, record).is_some_and(|value| event.happens(value));
        let events = [happened(first), second.is_some_and(happened)];
        if record.arms.iter().any(|arm| arm.result.is_err()) {
            return Response { score: f64::NEG_INFINITY, events: [false; 2] };
        }
        let scores = self.expression.events().filter_map(|event| self.score(event, record));
        Response { score: scores.fold(f64::NEG_INFINITY, f64::max), events }
    }

    fn score(&self, event: Event, record: &Record) -> Option<f64> {
        let tested = record.arms.len().checked_sub(1)?;
        let outcome = |index: usize| record.arms.get(index)?.result.as_ref().ok();
        let (own, other) = match event.quantity {
            Quantity::Covered(_) => return None,
            Quantity::Tested(_) => (tested, None),
            Quantity::Baseline(_) => (0, None),
            Quantity::Compared(comparison) => (if comparison.in_baseline { 0 } else { tested }, None),
            Quantity::Pair(PairFlag::Induced) => (tested, Some(0)),
            Quantity::Pair(PairFlag::Prevented) => (0, Some(tested)),
        };
        if let Some(guide) = self.guide {
            return guide.0.of(outcome(own)?).map(|value| guide.nearness(value));
        }
        if let Some(excess) = value(event.quantity, record).and_then(|value| event.excess(value)) {
            return Some(excess);
        }
        if event.excess(0.0).is_some() {
            // The sample does not have the number.
            return None;
        }
        let other = other.and_then(outcome);
        let struck = other.and_then(Outcome::ego_delta_v_mps).unwrap_or(0.0);
        let gap_m = smallest_gap_m(outcome(own)?);
        let lead_m =
            other.filter(|_| self.contrasts).map_or(0.0, |other| smallest_gap_m(other).min(SAFE_GAP_M) - gap_m);
        Some(lead_m - gap_m - struck)
    }
}

/// Gap of a sample in which no vehicle is near the ego in its lane (m): beyond the range of the
/// sensors.
const NO_GAP_M: f64 = 200.0;

/// Gap from which on it does not matter how much larger it is (m): an assumption; 5 to 30 are
/// plausible. It decides what a search tries next, and no result.
const SAFE_GAP_M: f64 = 10.0;

/// Returns the smallest gap of the ego to the vehicle ahead or behind.
fn smallest_gap_m(outcome: &Outcome) -> f64 {
    let gap_m = |name: &str| Measure::named(name).and_then(|measure| measure.of(outcome)).unwrap_or(NO_GAP_M);
    gap_m("min_gap_front_m").min(gap_m("min_gap_rear_m"))
}
