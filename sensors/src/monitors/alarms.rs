//! What the monitors of a sensor have noticed.

use std::fmt;

/// A finding of a monitor: the reason why a sensor is not healthy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Alarm {
    /// For a second the sensor has delivered nothing, or always the same.
    NothingNew,
    /// Less than half of the range is left.
    ShortRange,
    /// A fifth or more of the latest scans have not arrived.
    LostScans,
    /// The time stamps of a fifth or more of the latest scans do not fit their times of arrival.
    LateScans,
    /// A sector gives no return, not even from the road.
    BlockedSector,
    /// More returns of the road are missing than a faultless sensor loses.
    MissingReturns,
    /// Most returns of the road lie higher than the road, or lower.
    WrongHeight,
    /// The returns of the road scatter more than the returns of a faultless sensor.
    NoisyRanges,
}

impl Alarm {
    /// All alarms, the gravest first.
    pub const ALL: [Self; 8] = [
        Self::NothingNew,
        Self::ShortRange,
        Self::LostScans,
        Self::LateScans,
        Self::BlockedSector,
        Self::MissingReturns,
        Self::WrongHeight,
        Self::NoisyRanges,
    ];

    /// Returns the reason in words.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::NothingNew => "nothing new arrives",
            Self::ShortRange => "less than half of the range is left",
            Self::LostScans => "scans do not arrive",
            Self::LateScans => "time stamps do not fit the times of arrival",
            Self::BlockedSector => "a sector gives no returns",
            Self::MissingReturns => "returns of the road are missing",
            Self::WrongHeight => "the road appears too high or too low",
            Self::NoisyRanges => "the returns of the road scatter",
        }
    }
}

/// The alarms of a sensor or of a group of sensors. None by default.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct Alarms(u8);

impl Alarms {
    /// No alarm.
    pub const NONE: Self = Self(0);

    /// Returns these alarms and `alarm`, if it is raised.
    #[must_use]
    pub const fn with_if(self, alarm: Alarm, is_raised: bool) -> Self {
        if is_raised { Self(self.0 | 1 << alarm as u8) } else { self }
    }

    /// Returns the alarms that are in either.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns whether there is no alarm.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns whether this alarm is raised.
    pub const fn contains(self, alarm: Alarm) -> bool {
        self.0 >> alarm as u8 & 1 == 1
    }

    /// Returns the alarms, the gravest first.
    pub fn iter(self) -> impl Iterator<Item = Alarm> {
        Alarm::ALL.into_iter().filter(move |alarm| self.contains(*alarm))
    }
}

impl fmt::Debug for Alarms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

/// Writes the reasons, separated by commas.
impl fmt::Display for Alarms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, alarm) in self.iter().enumerate() {
            let separator = if index == 0 { "" } else { ", " };
            write!(f, "{separator}{}", alarm.reason())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_alarm_is_one_of_its_own_and_they_read_from_the_gravest_on() {
        for alarm in Alarm::ALL {
            let one = Alarms::NONE.with_if(alarm, true);
            assert_eq!(one.iter().collect::<Vec<_>>(), [alarm]);
            assert_eq!(Alarm::ALL.into_iter().filter(|other| one.contains(*other)).count(), 1);
            assert_eq!(one.to_string(), alarm.reason());
            assert!(Alarms::NONE.with_if(alarm, false).is_empty());
        }
        let both = Alarms::NONE.with_if(Alarm::NoisyRanges, true).and(Alarms::NONE.with_if(Alarm::LostScans, true));
        assert_eq!(both.to_string(), "scans do not arrive, the returns of the road scatter");
        assert_eq!(format!("{both:?}"), "{LostScans, NoisyRanges}");
        assert_eq!(Alarms::default(), Alarms::NONE);
    }
}
