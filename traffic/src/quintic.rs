//! Quintic polynomials: smooth transitions between two states.

/// Peak of the second derivative of the minimum-jerk path, 10/√3: on a lane change by `width`
/// within `duration`, the lateral acceleration peaks at 5.77·width/duration².
pub const MINIMUM_JERK_PEAK: f64 = 5.773_502_691_896_258;

/// Returns the share of a minimum-jerk path that is covered at the share `u` of its length: 10u³ −
/// 15u⁴ + 6u⁵.
///
/// Arguments below 0 count as 0, and arguments above 1 as 1. Source: Flash and Hogan, *Journal of
/// Neuroscience* 5 (1985) 1688–1703.
pub fn minimum_jerk(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// A quintic polynomial between two states, each with value, first and second derivative.
///
/// If all derivatives at both ends are 0, it is the minimum-jerk path, like [`minimum_jerk`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quintic {
    length: f64,
    /// Coefficients by powers of the share of the length.
    coefficients: [f64; 6],
}

impl Quintic {
    /// Creates the quintic that leads from the state `from` to the state `to` over `length` (above
    /// 0).
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

    /// Returns the value, the first and the second derivative at `x`, which lies between 0 and the
    /// length.
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
        for step in 0..=10 {
            let u = f64::from(step) / 10.0;
            assert!((path.at(150.0 * u)[0] - (-5.625 + 3.75 * minimum_jerk(u))).abs() < 1e-12);
        }
        let [middle, slope, bend] = path.at(75.0);
        assert!((middle + 3.75).abs() < 1e-12);
        // The slope in the middle is 15/8 of the mean slope.
        assert!((slope - 1.875 * 3.75 / 150.0).abs() < 1e-12);
        assert!(bend.abs() < 1e-12);
        // The second derivative peaks at u = (3 − √3)/6.
        let peak = path.at(150.0 * (3.0 - 3.0_f64.sqrt()) / 6.0)[2];
        assert!((peak - MINIMUM_JERK_PEAK * 3.75 / (150.0 * 150.0)).abs() < 1e-15);
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
