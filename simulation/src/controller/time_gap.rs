//! The time gap of a baseline controller.

use std::fmt;
use std::str::FromStr;

/// A time gap in steps of 0.1 s, from 0.8 to 2.5 s.
///
/// 0.8 s is the shortest time gap that ISO 15622 allows. About 2.5 s is the longest that the manual
/// of a production system offers (Volvo, five steps from about 1 to about 2.5 s).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TimeGap {
    tenths: u16,
}

/// Shortest time gap (0.1 s) (ISO 15622).
const SHORTEST: u16 = 8;
/// Longest time gap (0.1 s).
const LONGEST: u16 = 25;

impl TimeGap {
    /// The allowed time gaps, in words.
    pub const ALLOWED: &'static str = "0.8 to 2.5 s in steps of 0.1 s";

    /// Returns the time gap (s).
    pub fn s(self) -> f64 {
        f64::from(self.tenths) / 10.0
    }
}

impl fmt::Display for TimeGap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.tenths / 10, self.tenths % 10)
    }
}

impl FromStr for TimeGap {
    type Err = ();

    /// Reads a time gap as [`Display`](fmt::Display) writes it: one time gap has one name.
    fn from_str(text: &str) -> Result<Self, ()> {
        let all = (SHORTEST..=LONGEST).map(|tenths| Self { tenths });
        all.into_iter().find(|gap| gap.to_string() == text).ok_or(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_gap_has_one_spelling_within_the_range() {
        for (text, time_gap_s) in [("0.8", 0.8), ("1.6", 1.6), ("2.5", 2.5)] {
            let gap: TimeGap = text.parse().unwrap();
            assert_eq!((gap.s(), gap.to_string()), (time_gap_s, text.to_owned()));
        }
        for text in ["0.7", "2.6", "1.65", "1.60", "2", "-1.6", "1.6s", "nan", "inf", ""] {
            assert_eq!(text.parse::<TimeGap>(), Err(()), "{text}");
        }
    }
}
