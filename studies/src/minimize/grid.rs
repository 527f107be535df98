//! Readable values of a parameter.

use closecall_traffic::maths;

/// Number of steps of the grid in the middle 95 % of a distribution, at least.
const STEPS: f64 = 100.0;

/// Returns the step of the grid: the largest of 1, 2 and 5 times a power of ten that divides `span`
/// into 100 steps or more.
pub(super) fn step(span: f64) -> f64 {
    let finest = span / STEPS;
    let power = maths::powf(10.0, maths::log10(finest).floor());
    [5.0, 2.0].into_iter().map(|factor| factor * power).find(|step| *step <= finest).unwrap_or(power)
}

/// Returns the multiple of `step` at `index`, with no more digits than it needs.
pub(super) fn at(index: i64, step: f64) -> f64 {
    // The quotient of two whole numbers has the shortest decimal form.
    let per_unit = (1.0 / step).round();
    if step < 1.0 { index as f64 / per_unit } else { index as f64 * step }
}

/// Returns the index of the grid value next to `value` on the side away from `nominal`.
pub(super) fn beyond(value: f64, nominal: f64, step: f64) -> i64 {
    let position = value / step;
    #[expect(clippy::cast_possible_truncation, reason = "parameters are below 1e12, steps above 1e-12")]
    let index = if value >= nominal { position.ceil() } else { position.floor() } as i64;
    index
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_readable_and_fine_enough() {
        assert_eq!((step(11.1), step(0.35), step(3.2), step(0.6)), (0.1, 0.002, 0.02, 0.005));
        assert_eq!((at(83, 0.1), at(7, 0.002), at(-3, 20.0)), (8.3, 0.014, -60.0));
        assert_eq!((beyond(8.31, 5.0, 0.1), beyond(8.31, 9.0, 0.1)), (84, 83));
    }
}
