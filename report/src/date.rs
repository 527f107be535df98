//! The date of today, for the headers of files of other tools' standards.

use std::time::SystemTime;

const SECONDS_PER_DAY: u64 = 86_400;

/// Returns the date (UTC) as `2026-01-31`, or the first day of 1970 if the clock is before it.
pub(crate) fn today() -> String {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let [year, month, day] = date_of(since.as_secs() / SECONDS_PER_DAY);
    format!("{year}-{month:02}-{day:02}")
}

/// Returns year, month and day of the Gregorian calendar, this many days after 1970-01-01.
fn date_of(days: u64) -> [u64; 3] {
    let is_leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let (mut year, mut left) = (1970, days);
    while left >= 365 + u64::from(is_leap(year)) {
        left -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(is_leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 1;
    for length in lengths {
        if left < length {
            break;
        }
        left -= length;
        month += 1;
    }
    [year, month, left + 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_dates_of_the_gregorian_calendar() {
        assert_eq!(date_of(0), [1970, 1, 1]);
        assert_eq!(date_of(59), [1970, 3, 1]);
        assert_eq!(date_of(11_016), [2000, 2, 29]);
        assert_eq!(date_of(20_780), [2026, 11, 23]);
    }
}
