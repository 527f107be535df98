//! Parsing of fields into numbers, each with its allowed range.

use super::error::TrajectoryFileProblem;

/// A problem with a field, with the name of its column.
#[derive(Debug)]
pub(super) struct FieldError {
    pub(super) column: Option<&'static str>,
    pub(super) problem: TrajectoryFileProblem,
}

impl FieldError {
    pub(super) fn at(column: &'static str, problem: TrajectoryFileProblem) -> Self {
        Self { column: Some(column), problem }
    }
}

impl From<TrajectoryFileProblem> for FieldError {
    fn from(problem: TrajectoryFileProblem) -> Self {
        Self { column: None, problem }
    }
}

/// The range of numbers that a column allows. NaN is never allowed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: f64,
    pub(super) high: f64,
    /// `false` if the value must be greater than `low`.
    pub(super) low_is_allowed: bool,
}

impl Bounds {
    /// Creates the range `low..=high`.
    pub(super) const fn closed(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: true }
    }

    /// Creates the range of numbers above `low`, up to and including `high`.
    pub(super) const fn above(low: f64, high: f64) -> Self {
        Self { low, high, low_is_allowed: false }
    }

    pub(super) fn contains(self, value: f64) -> bool {
        (value > self.low || (self.low_is_allowed && value >= self.low)) && value <= self.high
    }

    /// Describes the range for an error message; `kind` is "a number", for example.
    pub(super) fn describe(self, kind: &str) -> String {
        let Self { low, high, low_is_allowed } = self;
        if low_is_allowed {
            format!("{kind} from {low} to {high}")
        } else {
            format!("{kind} above {low} and up to {high}")
        }
    }
}

/// Returns a number as an error message shows it: with an exponent if it has many digits.
pub(super) fn shown(value: f64) -> String {
    /// The largest number that is written with all of its digits.
    const LONGEST: f64 = 1e15;
    if value.abs() > LONGEST { format!("{value:e}") } else { value.to_string() }
}

/// Maximum length of a wrong field's text that an error message repeats (characters).
const MAX_SHOWN_CHARS: usize = 40;

/// Creates the problem of a field that does not hold an allowed value.
pub(super) fn wrong_value(text: &str, allowed: String) -> TrajectoryFileProblem {
    TrajectoryFileProblem::Value { value: text.chars().take(MAX_SHOWN_CHARS).collect(), allowed }
}

/// Parses a finite number within `bounds`.
pub(super) fn number(text: &str, column: &'static str, bounds: Bounds) -> Result<f64, FieldError> {
    let value = if text.contains(',') { without_separators(text).parse() } else { text.parse() };
    match value {
        Ok(value) if bounds.contains(value) => Ok(value),
        _ => Err(FieldError::at(column, wrong_number(text, bounds.describe("a number")))),
    }
}

/// Parses a finite number within `bounds`. Returns `None` if the field is empty.
pub(super) fn optional_number(text: &str, column: &'static str, bounds: Bounds) -> Result<Option<f64>, FieldError> {
    if text.is_empty() { Ok(None) } else { number(text, column, bounds).map(Some) }
}

/// Parses a whole number within `low..=high`.
pub(super) fn integer(text: &str, column: &'static str, (low, high): (i64, i64)) -> Result<i64, FieldError> {
    let text_of_number = if text.contains(',') { without_separators(text) } else { text.to_owned() };
    // A spreadsheet or pandas writes whole numbers as 1.0.
    let whole = text_of_number.split_once('.').filter(|(_, digits)| digits.bytes().all(|digit| digit == b'0'));
    match whole.map_or(&text_of_number[..], |(whole, _)| whole).parse() {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(FieldError::at(column, wrong_number(text, format!("a whole number from {low} to {high}")))),
    }
}

/// Creates the problem of a field that does not hold an allowed number.
fn wrong_number(text: &str, allowed: String) -> TrajectoryFileProblem {
    let is_number = |text: &str| text.parse::<f64>().is_ok_and(f64::is_finite);
    match text.split_once(',') {
        Some((whole, decimals)) if is_number(&format!("{whole}.{decimals}")) => {
            TrajectoryFileProblem::DecimalComma { value: text.chars().take(MAX_SHOWN_CHARS).collect() }
        }
        _ => wrong_value(text, allowed),
    }
}

/// Removes the thousands separators from a number such as `1,163,368`. Leaves misplaced commas in
/// the text, so that parsing fails, and so do decimal commas such as in `0,125`.
fn without_separators(text: &str) -> String {
    let whole = text.split_once('.').map_or(text, |(whole, _)| whole);
    let mut groups = whole.trim_start_matches('-').split(',');
    let first_fits = groups.next().is_some_and(|group| (1..=3).contains(&group.len()) && !group.starts_with('0'));
    if first_fits && groups.all(|group| group.len() == 3) { text.replace(',', "") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_separators_are_accepted_and_misplaced_ones_rejected() {
        assert_eq!(integer("1,156", "Total_Frames", (0, 9_999)).unwrap(), 1156);
        assert_eq!(number("-1,000.5", "Local_X", Bounds::closed(-1e6, 1e6)).unwrap(), -1000.5);
        for wrong in ["1,15", "1156,000", ",156", "1,,156"] {
            assert!(integer(wrong, "Total_Frames", (0, 9_999_999)).is_err(), "{wrong}");
        }
    }

    #[test]
    fn decimal_commas_are_named() {
        for text in ["0,1", "-1,25", "0,125", "16,4", "1156,000"] {
            let problem = number(text, "d_m", Bounds::closed(-1e3, 1e3)).unwrap_err().problem;
            assert!(matches!(problem, TrajectoryFileProblem::DecimalComma { .. }), "{text}: {problem}");
        }
        let problem = integer("1,0", "frame", (0, 9)).unwrap_err().problem;
        assert!(matches!(problem, TrajectoryFileProblem::DecimalComma { .. }), "{problem}");
        for text in ["1,,2", "a,b", "1,2,3"] {
            let problem = number(text, "d_m", Bounds::closed(-1e3, 1e3)).unwrap_err().problem;
            assert!(matches!(problem, TrajectoryFileProblem::Value { .. }), "{text}: {problem}");
        }
    }

    #[test]
    fn a_field_that_is_no_number_in_bounds_is_rejected_with_its_column() {
        for wrong in ["nan", "inf", "-inf", "", "abc", "0", "-1", "1e400", "0x10"] {
            let error = number(wrong, "length_m", Bounds::above(0.0, 40.0)).unwrap_err();
            assert_eq!(error.column, Some("length_m"));
            let needed = format!("is `{wrong}`, but a number above 0 and up to 40 is needed");
            assert_eq!(error.problem.to_string(), needed);
        }
    }
}
