//! The estimate of position, speed, acceleration and slow error under one mode of motion.

use nalgebra::{Matrix4, Vector4};

use super::{AxisMeasurement, Remaining};
use crate::tracking::motion::{MODES, Mode};

/// The estimate under one mode.
#[derive(Clone, Copy, Debug)]
pub(super) struct ModeEstimate {
    pub(super) state: Vector4<f64>,
    pub(super) covariance: Matrix4<f64>,
    /// Probability of the mode.
    pub(super) probability: f64,
}

/// Returns the mean and covariance of a mixture; its probability is the sum of the weights.
pub(super) fn mixture(estimates: &[ModeEstimate], weights: &[f64; MODES]) -> ModeEstimate {
    let sum: f64 = weights.iter().sum();
    let shares = weights.map(|weight| weight / sum);
    let mut state = Vector4::zeros();
    for (estimate, share) in estimates.iter().zip(shares) {
        state += estimate.state * share;
    }
    let mut covariance = Matrix4::zeros();
    for (estimate, share) in estimates.iter().zip(shares) {
        let deviation = estimate.state - state;
        covariance += (estimate.covariance + deviation * deviation.transpose()) * share;
    }
    ModeEstimate { state, covariance, probability: sum }
}

impl ModeEstimate {
    /// Predicts by `t` seconds under one mode.
    ///
    /// ```text
    ///       1  t  t²/2  0        r: share of the speed that remains, q: of the acceleration, s: of the slow error
    ///   F = 0  r  t     0
    ///       0  0  q     0        The state x becomes F·x, and its covariance P becomes F·P·Fᵀ. The zeros are left out;
    ///       0  0  0     s        the sums keep the order of the full products.
    /// ```
    pub(super) fn predict(&mut self, mode: &Mode, t: f64, remaining: &Remaining, slow_share: f64) {
        let Remaining { persistence, speed, .. } = *remaining;
        let half = 0.5 * t * t;
        let propagated = |x: [f64; 4]| {
            [x[0] + t * x[1] + half * x[2], speed * x[1] + t * x[2], persistence * x[2], slow_share * x[3]]
        };
        self.state = propagated(self.state.into()).into();
        // On a local array, which the compiler keeps in registers.
        let mut columns = self.covariance.data.0;
        columns = columns.map(propagated);
        for row in 0..4 {
            let to = propagated(columns.map(|column| column[row]));
            for (column, value) in columns.iter_mut().zip(to) {
                column[row] = value;
            }
        }
        self.covariance.data.0 = columns;
        let q = mode.white_density_m2ps3;
        let new_share = 1.0 - persistence * persistence;
        self.covariance[(0, 0)] += q * t * t * t / 3.0;
        self.covariance[(0, 1)] += q * half;
        self.covariance[(1, 0)] += q * half;
        self.covariance[(1, 1)] += q * t;
        self.covariance[(2, 2)] += new_share * mode.acceleration_sd_mps2 * mode.acceleration_sd_mps2;
        self.covariance[(3, 3)] += 1.0 - slow_share * slow_share;
    }

    /// Returns the innovation of a measurement, P·Hᵀ, and the variance of the innovation.
    ///
    /// P is the covariance of the state, and H the row of the measurement equation.
    pub(super) fn innovation(&self, measurement: &AxisMeasurement) -> (f64, Vector4<f64>, f64) {
        let row = Vector4::new(1.0, measurement.time_offset_s, 0.0, measurement.slow_sd_m);
        let gain = self.covariance * row;
        let variance_m2 = row.dot(&gain) + measurement.white_sd_m * measurement.white_sd_m;
        (measurement.position_m - row.dot(&self.state), gain, variance_m2)
    }

    /// Corrects the estimate with an innovation of this variance; `gain` is P·Hᵀ.
    pub(super) fn correct(&mut self, innovation: f64, gain: &Vector4<f64>, variance: f64) {
        self.state += gain * (innovation / variance);
        self.covariance -= gain * gain.transpose() / variance;
    }
}
