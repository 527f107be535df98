//! The lateral path of a lane change: a quintic polynomial over the distance travelled.
//!
//! Written over distance and not over time, so that the path is one that can be steered at any speed: a driver who
//! brakes in the middle of a lane change stays on it and takes longer.
//!
//! The quintic joins any lateral state (offset, slope, curvature) to the centre of the target lane with slope and
//! curvature zero; between two centres it is the minimum-jerk path.

use closecall_traffic::Quintic;

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
pub(crate) struct LanePath(Quintic);

impl LanePath {
    /// The path from `from` to the lateral position `to_m` over `length_m` (above 0) of travel.
    pub(crate) fn new(from: LateralState, to_m: f64, length_m: f64) -> Self {
        Self(Quintic::between([from.d_m, from.slope, from.bend_per_m], [to_m, 0.0, 0.0], length_m))
    }

    /// Length of the path along the road [m].
    pub(crate) fn length_m(&self) -> f64 {
        self.0.length()
    }

    /// The lateral state after `travelled_m`; beyond the end, the state at the end.
    pub(crate) fn at(&self, travelled_m: f64) -> LateralState {
        let [d_m, slope, bend_per_m] = self.0.at(travelled_m.clamp(0.0, self.length_m()));
        LateralState { d_m, slope, bend_per_m }
    }

    /// The largest curvature of the path [1/m], from samples at every 5 % of it.
    pub(crate) fn largest_bend_per_m(&self) -> f64 {
        (0..=20).map(|k| self.at(self.length_m() * f64::from(k) / 20.0).bend_per_m.abs()).fold(0.0, f64::max)
    }
}
