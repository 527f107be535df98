//! Quintic polynomials: smooth transitions between two states.

/// A quintic polynomial between two states, each with value, first and second derivative.
///
/// If all derivatives at both ends are 0, it is the minimum-jerk path 10p³ − 15p⁴ + 6p⁵ (Flash and Hogan, *Journal of
/// Neuroscience* 5 (1985) 1688–1703).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quintic {
    length: f64,
    /// Coefficients by powers of the share of the length.
    coefficients: [f64; 6],
}

impl Quintic {
    /// Creates the quintic that leads from the state `from` to the state `to` over `length` (above 0).
    pub fn between(from: [f64; 3], to: [f64; 3], length: f64) -> Self {
        let [start, start_first, start_second] = [from[0], from[1] * length, from[2] * length * length];
        let [end, end_first, end_second] = [to[0], to[1] * length, to[2] * length * length];
        // The part of the change that remains after the first three terms.
        let rest = end - start - start_first - 0.5 * start_second;
        let rest_first = end_first - start_first - start_second;
        let rest_second = end_second - start_second;
        Self {
            length,
            coefficients: [
                start,
                start_first,
                0.5 * start_second,
                10.0 * rest - 4.0 * rest_first + 0.5 * rest_second,
                -15.0 * rest + 7.0 * rest_first - rest_second,
                6.0 * rest - 3.0 * rest_first + 0.5 * rest_second,
            ],
        }
    }

    /// Returns the length of the interval, in the unit of the argument.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Returns the value, the first and the second derivative at `x`, which lies between 0 and the length.
    pub fn at(&self, x: f64) -> [f64; 3] {
        let p = x / self.length;
        let [c0, c1, c2, c3, c4, c5] = self.coefficients;
        let value = c0 + p * (c1 + p * (c2 + p * (c3 + p * (c4 + p * c5))));
        let first = c1 + p * (2.0 * c2 + p * (3.0 * c3 + p * (4.0 * c4 + p * 5.0 * c5)));
        let second = 2.0 * c2 + p * (6.0 * c3 + p * (12.0 * c4 + p * 20.0 * c5));
        [value, first / self.length, second / (self.length * self.length)]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn with_zero_derivatives_it_is_the_minimum_jerk_path() {
        let path = Quintic::between([-5.625, 0.0, 0.0], [-1.875, 0.0, 0.0], 150.0);
        let [middle, slope, bend] = path.at(75.0);
        assert!((middle + 3.75).abs() < 1e-12);
        // The slope in the middle is 15/8 of the mean slope.
        assert!((slope - 1.875 * 3.75 / 150.0).abs() < 1e-12);
        assert!(bend.abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn both_end_states_are_reached(
            from in (-12.0..0.0, -0.1..0.1, -0.01..0.01), to in (-12.0..0.0, -0.1..0.1, -0.01..0.01), length in 0.25..300.0,
        ) {
            let (from, to): ([f64; 3], [f64; 3]) = (from.into(), to.into());
            let path = Quintic::between(from, to, length);
            for (wanted, at) in [(from, path.at(0.0)), (to, path.at(length))] {
                for order in 0..3 {
                    // The derivatives are divided by the length, and so are their rounding errors.
                    let tolerance = 1e-11 * (1.0 + length.powi(-2));
                    prop_assert!((wanted[order] - at[order]).abs() < tolerance, "{wanted:?} {at:?}");
                }
            }
        }
    }
}
