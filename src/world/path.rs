//! The lateral path of a lane change: a quintic polynomial over the distance travelled.
//!
//! Written over distance and not over time, so that the path is one that can be steered at any speed: a driver who
//! brakes in the middle of a lane change stays on it and takes longer.
//!
//! The quintic joins any lateral state (offset, slope, curvature) to the centre of the target lane with slope and
//! curvature zero; between two centres it is the minimum-jerk path 10p³ − 15p⁴ + 6p⁵ (Flash and Hogan, 1985).

/// A lateral state along a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LateralState {
    /// Lateral position, positive to the left [m].
    pub(crate) d_m: f64,
    /// Its derivative by the distance travelled [1].
    pub(crate) slope: f64,
    /// Its second derivative [1/m].
    pub(crate) bend_per_m: f64,
}

/// A smooth path from one lateral state to the centre of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LanePath {
    length_m: f64,
    coefficients: [f64; 6],
}

impl LanePath {
    /// The path from `from` to the lateral position `to_m` over `length_m` (above 0) of travel.
    pub(crate) fn new(from: LateralState, to_m: f64, length_m: f64) -> Self {
        // In p = σ/L the end conditions d(1) = to, d'(1) = d''(1) = 0 leave three unknowns of the six.
        let (start, slope, bend) = (from.d_m, from.slope * length_m, from.bend_per_m * length_m * length_m);
        let rest = to_m - start - slope - 0.5 * bend;
        let rest_slope = -slope - bend;
        let rest_bend = -bend;
        Self {
            length_m,
            coefficients: [
                start,
                slope,
                0.5 * bend,
                10.0 * rest - 4.0 * rest_slope + 0.5 * rest_bend,
                -15.0 * rest + 7.0 * rest_slope - rest_bend,
                6.0 * rest - 3.0 * rest_slope + 0.5 * rest_bend,
            ],
        }
    }

    /// Length of the path along the road [m].
    pub(crate) fn length_m(&self) -> f64 {
        self.length_m
    }

    /// The lateral state after `travelled_m`; beyond the end, the state at the end.
    pub(crate) fn at(&self, travelled_m: f64) -> LateralState {
        let p = (travelled_m / self.length_m).clamp(0.0, 1.0);
        let [c0, c1, c2, c3, c4, c5] = self.coefficients;
        let d = c0 + p * (c1 + p * (c2 + p * (c3 + p * (c4 + p * c5))));
        let slope = c1 + p * (2.0 * c2 + p * (3.0 * c3 + p * (4.0 * c4 + p * 5.0 * c5)));
        let bend = 2.0 * c2 + p * (6.0 * c3 + p * (12.0 * c4 + p * 20.0 * c5));
        LateralState { d_m: d, slope: slope / self.length_m, bend_per_m: bend / (self.length_m * self.length_m) }
    }

    /// The largest curvature of the path [1/m], from samples at every 5 % of it.
    pub(crate) fn largest_bend_per_m(&self) -> f64 {
        (0..=20).map(|k| self.at(self.length_m * f64::from(k) / 20.0).bend_per_m.abs()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn between_two_centres_it_is_the_minimum_jerk_path() {
        let path = LanePath::new(LateralState { d_m: -5.625, ..LateralState::default() }, -1.875, 150.0);
        let middle = path.at(75.0);
        assert!((middle.d_m + 3.75).abs() < 1e-12);
        // The slope in the middle is 15/8 of the mean slope.
        assert!((middle.slope - 1.875 * 3.75 / 150.0).abs() < 1e-12);
        assert!(middle.bend_per_m.abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn both_ends_are_met(
            d in -12.0..0.0, slope in -0.1..0.1, bend in -0.01..0.01, to in -12.0..0.0, length in 20.0..300.0,
        ) {
            let from = LateralState { d_m: d, slope, bend_per_m: bend };
            let path = LanePath::new(from, to, length);
            let (start, end) = (path.at(0.0), path.at(length));
            prop_assert!((start.d_m - d).abs() < 1e-9 && (start.slope - slope).abs() < 1e-9);
            prop_assert!((start.bend_per_m - bend).abs() < 1e-9);
            prop_assert!((end.d_m - to).abs() < 1e-9 && end.slope.abs() < 1e-9 && end.bend_per_m.abs() < 1e-9);
        }
    }
}
