//! Simulated time as an integer number of nanoseconds.
//!
//! Sums of integer steps are exact: a run of 6,000 steps of 10 ms ends at exactly 60 s.

use std::fmt;
use std::ops::{Add, AddAssign, Mul, Rem, Sub};

use serde::{Deserialize, Serialize};

const NS_PER_S: f64 = 1e9;

/// A point in simulated time since the start of the run, or a duration, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Time(i64);

impl Time {
    /// The start of every run.
    pub const ZERO: Self = Self(0);
    /// The latest time that the type can represent: about 292 years.
    pub const MAX: Self = Self(i64::MAX);

    /// Creates a time from whole nanoseconds.
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// Creates a time from whole milliseconds.
    pub const fn from_ms(ms: i64) -> Self {
        Self(ms * 1_000_000)
    }

    /// Creates the time nearest to `seconds` (s). Saturates at the limits of the type; NaN gives
    /// zero.
    pub fn from_s(seconds: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, which is what is documented")]
        Self((seconds * NS_PER_S).round() as i64)
    }

    /// Returns the time in whole nanoseconds.
    pub const fn ns(self) -> i64 {
        self.0
    }

    /// Returns the time in seconds, for formulas and output.
    pub const fn s(self) -> f64 {
        self.0 as f64 / NS_PER_S
    }

    /// Returns true if this time is a whole multiple of `period`.
    pub fn is_multiple_of(self, period: Self) -> bool {
        self.0 % period.0 == 0
    }
}

impl Add for Time {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl AddAssign for Time {
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl Sub for Time {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Mul<i64> for Time {
    type Output = Self;
    fn mul(self, factor: i64) -> Self {
        Self(self.0 * factor)
    }
}

impl Rem for Time {
    type Output = Self;
    fn rem(self, period: Self) -> Self {
        Self(self.0 % period.0)
    }
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} s", self.s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_add_up_exactly() {
        let mut time = Time::ZERO;
        for _ in 0..6_000 {
            time += Time::from_ms(10);
        }
        assert_eq!(time, Time::from_s(60.0));
        assert!(time.is_multiple_of(Time::from_ms(40)));
    }

    #[test]
    fn seconds_round_to_the_nearest_nanosecond() {
        assert_eq!(Time::from_s(0.1), Time::from_ms(100));
        assert_eq!(Time::from_s(f64::NAN), Time::ZERO);
        assert_eq!(Time::from_s(f64::INFINITY), Time::MAX);
    }
}
