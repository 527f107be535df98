//! A rate as it is given on a command line.

use std::str::FromStr;

use super::Observed;

/// Events that were counted elsewhere: `EVENTS/KM`, such as `20/5000`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted {
    events: u64,
    distance_km: f64,
}

impl Counted {
    /// Returns the events and the distance as an observation.
    pub fn observed(self) -> Observed {
        let sources = vec!["counted elsewhere".to_owned()];
        Observed { sources, events: self.events, distance_km: self.distance_km, ..Observed::default() }
    }
}

/// Largest number of encounters per km that is believed: a lead vehicle that brakes without an end
/// every 100 m. An assumption.
const MOST_PER_KM: f64 = 10.0;

impl FromStr for Counted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not EVENTS/KM, such as 20/5000: a whole number, and a distance above 0");
        let (events, distance) = text.split_once('/').ok_or_else(wrong)?;
        let (events, distance_km) =
            (events.trim().parse().map_err(|_| wrong())?, distance.trim().parse().map_err(|_| wrong())?);
        if !(distance_km > 0.0 && f64::is_finite(distance_km)) {
            return Err(wrong());
        }
        let counted = Self { events, distance_km };
        if events as f64 > MOST_PER_KM * distance_km {
            return Err(format!(
                "`{text}` means {} encounters in {distance_km} km, more than {MOST_PER_KM} per km: expected EVENTS/KM, such as 20/5000",
                events
            ));
        }
        Ok(counted)
    }
}

/// A stated range of the rate: `LOW..HIGH`, in events per 10⁶ km.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatedRange(pub [f64; 2]);

impl FromStr for StatedRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not LOW..HIGH, such as 100..10000: two numbers above 0, in rising order");
        let (low, high) = text.split_once("..").ok_or_else(wrong)?;
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
        match (number(low), number(high)) {
            (Some(low), Some(high)) if low <= high => Ok(Self([low, high])),
            _ => Err(wrong()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_and_a_range_are_read_or_refused() {
        assert_eq!("20/5000".parse(), Ok(Counted { events: 20, distance_km: 5_000.0 }));
        assert_eq!("100..1e4".parse(), Ok(StatedRange([100.0, 10_000.0])));
        assert!("5000/20".parse::<Counted>().unwrap_err().contains("more than 10 per km"));
        for text in ["20", "-1/5", "2/0", "2/nan", "x/3"] {
            assert!(text.parse::<Counted>().unwrap_err().contains("EVENTS/KM"), "{text}");
        }
        for text in ["1", "3..2", "0..2", "a..b"] {
            assert!(text.parse::<StatedRange>().unwrap_err().contains("LOW..HIGH"), "{text}");
        }
    }
}
