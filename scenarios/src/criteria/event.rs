//! Events that may happen in one sample, in the words of gates.
//!
//! ```text
//!  expression = event [ " - " event ]
//!  event      = flag | quantity ( "<" | "<=" | ">" | ">=" ) number | "collision"
//! ```
//!
//! `min_ttc_rear_s < 0.3` happens in a sample whose smallest time to collision is below 0.3 s.
//! `prevented - induced` asks for the difference of two probabilities. `collision` is short for
//! `ego_collided`.

use std::fmt;
use std::str::FromStr;

use super::expression::{Quantity, parse_quantity};
use super::measure::{EGO_COLLIDED, MEASURES, Measure, MeasureKind};

/// Another name of the collision of the ego.
const COLLISION: &str = "collision";

/// On which side of a bound a value lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    Below,
    AtMost,
    Above,
    AtLeast,
}

impl Comparison {
    /// All comparisons, in the order in which a text is searched for them: `<=` comes before `<`,
    /// which it contains.
    const ALL: [(&str, Self); 4] =
        [("<=", Self::AtMost), (">=", Self::AtLeast), ("<", Self::Below), (">", Self::Above)];

    fn text(self) -> &'static str {
        Self::ALL.iter().find(|(_, comparison)| *comparison == self).map_or("", |(text, _)| text)
    }

    const fn is_upper_bound(self) -> bool {
        matches!(self, Self::Below | Self::AtMost)
    }
}

/// An event that may happen in one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// The flag, or the number that is compared.
    pub quantity: Quantity,
    bound: Option<(Comparison, f64)>,
}

impl Event {
    /// Returns true if the event happens in a sample with this value of the quantity. A value that
    /// is not a number is no event.
    pub fn happens(&self, value: f64) -> bool {
        match self.bound {
            None => value == 1.0,
            Some((Comparison::Below, bound)) => value < bound,
            Some((Comparison::AtMost, bound)) => value <= bound,
            Some((Comparison::Above, bound)) => value > bound,
            Some((Comparison::AtLeast, bound)) => value >= bound,
        }
    }

    /// Returns a message if the event happens in every sample, or in none: all values that the
    /// number can have lie on one side of the bound. Returns `None` for other events.
    fn certainty(&self) -> Option<String> {
        let (comparison, bound) = self.bound?;
        let (measure, _) = self.quantity.measure()?;
        let (low, high) = (measure.range.low(), measure.range.high());
        let (always, never) = match comparison {
            Comparison::Below => (bound > high, bound <= low),
            Comparison::AtMost => (bound >= high, bound < low),
            Comparison::Above => (bound < low, bound >= high),
            Comparison::AtLeast => (bound <= low, bound > high),
        };
        let when = if always { "every sample" } else { "no sample" };
        (always || never).then(|| format!("it happens in {when}: `{}` is {}", measure.name, measure.range))
    }

    /// Returns how far a value is beyond the bound, negative if the event does not happen; `None`
    /// for a flag.
    pub fn excess(&self, value: f64) -> Option<f64> {
        let (comparison, bound) = self.bound?;
        Some(if comparison.is_upper_bound() { bound - value } else { value - bound })
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bound {
            None => write!(f, "{}", self.quantity),
            Some((comparison, bound)) => write!(f, "{} {} {bound}", self.quantity, comparison.text()),
        }
    }
}

/// One event, or the difference of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventExpression {
    /// The event.
    pub first: Event,
    /// The event whose probability is subtracted.
    pub second: Option<Event>,
}

impl EventExpression {
    /// Returns true if the events exist only in a paired campaign.
    pub fn needs_pairs(&self) -> bool {
        self.events().any(|event| event.quantity.needs_pairs())
    }

    /// Returns the events.
    pub fn events(&self) -> impl Iterator<Item = Event> {
        std::iter::once(self.first).chain(self.second)
    }
}

impl fmt::Display for EventExpression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.second {
            None => write!(f, "{}", self.first),
            Some(second) => write!(f, "{} - {second}", self.first),
        }
    }
}

/// Text that is not an event.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not an event: {problem}")]
pub struct EventError {
    /// The text.
    pub text: String,
    /// What is wrong, and what is allowed.
    pub problem: String,
}

impl FromStr for EventExpression {
    type Err = EventError;

    fn from_str(text: &str) -> Result<Self, EventError> {
        let fail = |problem| EventError { text: text.to_owned(), problem };
        let (first, second) = match text.split_once(" - ") {
            Some((first, second)) => (first, Some(parse_event(second).map_err(fail)?)),
            None => (text, None),
        };
        let first = parse_event(first).map_err(fail)?;
        if second == Some(first) {
            return Err(fail("the difference of an event and itself is 0".to_owned()));
        }
        Ok(Self { first, second })
    }
}

fn parse_event(text: &str) -> Result<Event, String> {
    let compared =
        Comparison::ALL.into_iter().find_map(|(sign, comparison)| Some((text.split_once(sign)?, comparison)));
    let Some(((name, bound), comparison)) = compared else {
        let name = text.trim();
        let quantity = parse_quantity(if name == COLLISION { EGO_COLLIDED } else { name })?;
        return match quantity.is_flag() {
            true => Ok(Event { quantity, bound: None }),
            false => Err(format!("`{quantity}` is a number, which has a bound, such as `{quantity} < 0.3`")),
        };
    };
    let quantity = parse_quantity(name.trim())?;
    if quantity.is_flag() {
        return Err(format!("`{quantity}` is a flag, which has no bound: write `{quantity}`"));
    }
    let event = match bound.trim().parse::<f64>() {
        Ok(bound_value) if bound_value.is_finite() => Event { quantity, bound: Some((comparison, bound_value)) },
        _ => return Err(format!("the bound `{}` is not a finite number", bound.trim())),
    };
    event.certainty().map_or(Ok(event), Err)
}

/// A measure that guides a search towards an event. If the measure is a minimum (`min_…`), a
/// smaller value is nearer to the event, otherwise a larger value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guide(pub &'static Measure);

impl Guide {
    /// Returns how near a value of the measure is to the event. The larger the result, the nearer.
    pub fn nearness(self, value: f64) -> f64 {
        if self.0.name.starts_with("min_") { -value } else { value }
    }
}

/// A word that is not the name of a number.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` is not a number of a sample; there are {}", number_names())]
pub struct GuideError {
    word: String,
}

impl FromStr for Guide {
    type Err = GuideError;

    fn from_str(word: &str) -> Result<Self, GuideError> {
        let named = Measure::named(word).filter(|measure| measure.kind == MeasureKind::Number);
        named.map(Self).ok_or_else(|| GuideError { word: word.to_owned() })
    }
}

fn number_names() -> String {
    let numbers = MEASURES.iter().filter(|measure| measure.kind == MeasureKind::Number);
    numbers.map(|measure| measure.name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_reads_back_as_it_is_written() {
        for text in [
            "ego_collided",
            "induced",
            "prevented - induced",
            "min_ttc_rear_s < 0.3",
            "min_ttc_rear_s <= 0.001",
            "max_jerk_mps3 > 20",
            "baseline.min_gap_rear_m >= 1",
            "harm > 0",
            "impact_speed_mps <= 0",
            "baseline.ego_collided - ego_collided",
        ] {
            let event: EventExpression = text.parse().unwrap();
            assert_eq!(event.to_string(), text);
        }
        assert_eq!("collision".parse::<EventExpression>().unwrap().to_string(), "ego_collided");
        assert_eq!(" min_ttc_rear_s<3e-1 ".parse::<EventExpression>().unwrap().to_string(), "min_ttc_rear_s < 0.3");
    }

    #[test]
    fn what_is_not_an_event_is_refused_with_what_is_allowed() {
        for (text, part) in [
            ("", "not a measure"),
            ("crash", "not a measure; there are ego_collided"),
            ("min_ttc_rear_s", "is a number, which has a bound"),
            ("ego_collided < 1", "is a flag, which has no bound"),
            ("min_ttc_rear_s < nan", "not a finite number"),
            ("min_ttc_rear_s < inf", "not a finite number"),
            ("min_ttc_rear_s < ", "not a finite number"),
            ("min_ttc_rear_s < -5", "it happens in no sample: `min_ttc_rear_s` is a number from 0 to 1000000"),
            ("min_ttc_rear_s < 0", "in no sample"),
            ("min_gap_front_m > -1", "in every sample"),
            ("max_jerk_mps3 < 1e9", "in every sample"),
            ("max_deceleration_mps2 >= 12", "in no sample: `max_deceleration_mps2` is a number from 0 to 11.772"),
            ("harm < 0", "in no sample"),
            ("harm >= 0", "in every sample"),
            ("baseline.delta_v_mps > -1", "in every sample"),
            ("duration_s <= -0.1", "in no sample"),
            ("induced - induced", "itself is 0"),
            ("count(induced) <= 0", "not a measure"),
        ] {
            let error = text.parse::<EventExpression>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!("ego_collided".parse::<Guide>().unwrap_err().to_string().contains("there are min_thw_front_s"));
    }

    #[test]
    fn a_bound_decides_on_which_side_it_happens() {
        let event = |text: &str| text.parse::<EventExpression>().unwrap().first;
        let [below, at_most] = ["min_ttc_rear_s < 0.3", "min_ttc_rear_s <= 0.3"].map(event);
        assert!(!below.happens(0.3) && at_most.happens(0.3) && below.happens(0.29));
        assert!(!below.happens(f64::NAN) && !at_most.happens(f64::NAN));
        assert_eq!(below.excess(0.5), Some(-0.2));
        assert_eq!(event("max_jerk_mps3 > 20").excess(15.0), Some(-5.0));
        assert_eq!(event("induced").excess(1.0), None);
        let guide = |word: &str| word.parse::<Guide>().unwrap();
        assert!(guide("min_gap_rear_m").nearness(1.0) > guide("min_gap_rear_m").nearness(2.0));
        assert!(guide("max_jerk_mps3").nearness(1.0) < guide("max_jerk_mps3").nearness(2.0));
    }
}
