//! Fields to numbers, each with what is allowed.

use super::RecordingProblem;

/// A column that is wrong, and how.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) column: Option<&'static str>,
    pub(super) problem: RecordingProblem,
}

impl Fault {
    pub(super) fn at(column: &'static str, problem: RecordingProblem) -> Self {
        Self { column: Some(column), problem }
    }
}

impl From<RecordingProblem> for Fault {
    fn from(problem: RecordingProblem) -> Self {
        Self { column: None, problem }
    }
}

/// The numbers that a column allows. NaN is never allowed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: f64,
    pub(super) high: f64,
    /// False where `low` itself is not allowed.
    pub(super) low_is_allowed: bool,
}

impl Bounds {
    pub(super) const fn closed(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: true }
    }

    pub(super) const fn above(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: false }
    }

    pub(super) fn contains(self, value: f64) -> bool {
        (value > self.low || (self.low_is_allowed && value >= self.low)) && value <= self.high
    }

    fn describe(self, kind: &str) -> String {
        let Self { low, high, low_is_allowed } = self;
        if low_is_allowed {
            format!("{kind} from {low} to {high}")
        } else {
            format!("{kind} above {low} and up to {high}")
        }
    }
}

/// The longest part of a wrong field that an error repeats [characters].
const SHOWN: usize = 40;

pub(super) fn wrong_value(text: &str, allowed: String) -> RecordingProblem {
    RecordingProblem::Value { value: text.chars().take(SHOWN).collect(), allowed }
}

/// A finite number within `bounds`.
pub(super) fn number(text: &str, column: &'static str, bounds: Bounds) -> Result<f64, Fault> {
    let value = if text.contains(',') { without_separators(text).parse() } else { text.parse() };
    match value {
        Ok(value) if bounds.contains(value) => Ok(value),
        _ => Err(Fault::at(column, wrong_value(text, bounds.describe("a number")))),
    }
}

/// A whole number within `low..=high`.
pub(super) fn integer(text: &str, column: &'static str, (low, high): (i64, i64)) -> Result<i64, Fault> {
    let value = if text.contains(',') { without_separators(text).parse() } else { text.parse() };
    match value {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(Fault::at(column, wrong_value(text, format!("a whole number from {low} to {high}")))),
    }
}

/// `1,163,368` without its thousands separators; anything else that has commas stays, so that it is refused.
fn without_separators(text: &str) -> String {
    let whole = text.split_once('.').map_or(text, |(whole, _)| whole);
    let mut groups = whole.trim_start_matches('-').split(',');
    let first_is_short = groups.next().is_some_and(|group| (1..=3).contains(&group.len()));
    if first_is_short && groups.all(|group| group.len() == 3) { text.replace(',', "") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_separators_are_read_and_misplaced_ones_refused() {
        assert_eq!(integer("1,156", "Total_Frames", (0, 9_999)).unwrap(), 1156);
        assert_eq!(number("-1,000.5", "Local_X", Bounds::closed(-1e6, 1e6)).unwrap(), -1000.5);
        for wrong in ["1,15", "1156,000", ",156", "1,,156"] {
            assert!(integer(wrong, "Total_Frames", (0, 9_999_999)).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_not_a_number_in_bounds_is_refused_by_name() {
        for wrong in ["nan", "inf", "-inf", "", "abc", "0", "-1", "1e400", "0x10"] {
            let fault = number(wrong, "length_m", Bounds::above(0.0, 40.0)).unwrap_err();
            assert_eq!(fault.column, Some("length_m"));
            let needed = format!("is `{wrong}`, but a number above 0 and up to 40 is needed");
            assert_eq!(fault.problem.to_string(), needed);
        }
    }
}
