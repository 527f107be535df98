//! The lateral path of a lane change: a quintic polynomial over the distance travelled.
//!
//! The path is a function of distance, not of time. A vehicle can follow it at any speed: a driver
//! that brakes in the middle of a lane change stays on the path and takes longer.
//!
//! The quintic connects any lateral state (position, slope, second derivative) to the centre of the
//! target lane, where slope and second derivative are zero. Between two lane centres it is the
//! minimum-jerk path.

use closecall_traffic::Quintic;

/// A lateral state along a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LateralState {
    /// Lateral position, positive to the left (m).
    pub(crate) d_m: f64,
    /// First derivative of `d_m` by the distance travelled (dimensionless).
    pub(crate) slope: f64,
    /// Second derivative of `d_m` by the distance travelled (1/m).
    pub(crate) second_derivative_per_m: f64,
}

impl LateralState {
    /// Returns this state relative to a line that has the state `line`, on the road.
    pub(crate) fn plus(&self, line: &Self) -> Self {
        Self {
            d_m: self.d_m + line.d_m,
            slope: self.slope + line.slope,
            second_derivative_per_m: self.second_derivative_per_m + line.second_derivative_per_m,
        }
    }

    /// Returns this state on the road, relative to a line that has the state `line`.
    pub(crate) fn minus(&self, line: &Self) -> Self {
        Self {
            d_m: self.d_m - line.d_m,
            slope: self.slope - line.slope,
            second_derivative_per_m: self.second_derivative_per_m - line.second_derivative_per_m,
        }
    }
}

/// A smooth path from one lateral state to the centre of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LanePath(Quintic);

impl LanePath {
    /// Returns the path from the state `from` to the lateral position `to_m` over a distance of
    /// `length_m`, which must be positive.
    pub(crate) fn new(from: LateralState, to_m: f64, length_m: f64) -> Self {
        Self(Quintic::between([from.d_m, from.slope, from.second_derivative_per_m], [to_m, 0.0, 0.0], length_m))
    }

    /// Returns the length of the path along the road (m).
    pub(crate) fn length_m(&self) -> f64 {
        self.0.length()
    }

    /// Returns the lateral state after a distance of `travelled_m`. Beyond the end, it is the state
    /// at the end.
    pub(crate) fn at(&self, travelled_m: f64) -> LateralState {
        let [d_m, slope, second_derivative_per_m] = self.0.at(travelled_m.clamp(0.0, self.length_m()));
        LateralState { d_m, slope, second_derivative_per_m }
    }

    /// Returns the largest magnitude of the second derivative (1/m), from samples at every 5 % of
    /// the path.
    pub(crate) fn max_second_derivative_per_m(&self) -> f64 {
        (0..=20)
            .map(|k| self.at(self.length_m() * f64::from(k) / 20.0).second_derivative_per_m.abs())
            .fold(0.0, f64::max)
    }
}
