//! A Kalman filter along one axis with position, speed and acceleration, and its smoother.
//!
//! The acceleration is a random walk: its derivative, the jerk, is white noise. After the last
//! measurement, the smoother of Rauch, Tung and Striebel (1965) goes back through time, as the
//! acquisition of highD does (R. Krajewski et al., ITSC 2018).

use nalgebra::{Matrix3, Vector3};

/// Variance of the speed of a vehicle that is seen for the first time (m²/s²).
const FIRST_SPEED_VARIANCE: f64 = 40.0 * 40.0;
/// Variance of its acceleration (m²/s⁴).
const FIRST_ACCELERATION_VARIANCE: f64 = 2.0 * 2.0;

/// The estimate of position (m), speed (m/s) and acceleration (m/s²), with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) mean: Vector3<f64>,
    pub(crate) covariance: Matrix3<f64>,
}

/// The constants of a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisModel {
    /// Density of the jerk (m²/s⁵).
    pub(crate) jerk_density: f64,
    /// Standard deviation of a measured position (m).
    pub(crate) sigma_m: f64,
}

impl AxisModel {
    /// Returns the first estimate from a measured position, with the expected speed.
    pub(crate) fn first(&self, position_m: f64, speed_mps: f64) -> Estimate {
        let variances = Vector3::new(self.sigma_m * self.sigma_m, FIRST_SPEED_VARIANCE, FIRST_ACCELERATION_VARIANCE);
        Estimate { mean: Vector3::new(position_m, speed_mps, 0.0), covariance: Matrix3::from_diagonal(&variances) }
    }

    fn transition(dt_s: f64) -> Matrix3<f64> {
        Matrix3::new(1.0, dt_s, 0.5 * dt_s * dt_s, 0.0, 1.0, dt_s, 0.0, 0.0, 1.0)
    }

    /// Predicts an estimate by `dt_s`.
    pub(crate) fn predicted(&self, estimate: &Estimate, dt_s: f64) -> Estimate {
        let transition = Self::transition(dt_s);
        let t = dt_s;
        let noise = Matrix3::new(
            t.powi(5) / 20.0,
            t.powi(4) / 8.0,
            t.powi(3) / 6.0,
            t.powi(4) / 8.0,
            t.powi(3) / 3.0,
            t * t / 2.0,
            t.powi(3) / 6.0,
            t * t / 2.0,
            t,
        );
        Estimate {
            mean: transition * estimate.mean,
            covariance: transition * estimate.covariance * transition.transpose() + self.jerk_density * noise,
        }
    }

    /// Updates a predicted estimate by a measured position.
    pub(crate) fn updated(&self, predicted: &Estimate, position_m: f64) -> Estimate {
        let variance = predicted.covariance[(0, 0)] + self.sigma_m * self.sigma_m;
        let gain = predicted.covariance.column(0) / variance;
        let mean = predicted.mean + gain * (position_m - predicted.mean.x);
        let covariance = predicted.covariance - gain * predicted.covariance.row(0);
        Estimate { mean, covariance: 0.5 * (covariance + covariance.transpose()) }
    }

    /// Smooths filtered estimates that are `dt_s` apart.
    pub(crate) fn smoothed(&self, filtered: &[Estimate], dt_s: f64) -> Vec<Estimate> {
        let mut smoothed = filtered.to_vec();
        let transition = Self::transition(dt_s);
        for index in (0..filtered.len().saturating_sub(1)).rev() {
            let predicted = self.predicted(&filtered[index], dt_s);
            let Some(inverse) = predicted.covariance.try_inverse() else { continue };
            let gain = filtered[index].covariance * transition.transpose() * inverse;
            let next = smoothed[index + 1];
            smoothed[index].mean = filtered[index].mean + gain * (next.mean - predicted.mean);
            smoothed[index].covariance =
                filtered[index].covariance + gain * (next.covariance - predicted.covariance) * gain.transpose();
        }
        smoothed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use closecall_traffic::maths;

    #[test]
    fn a_constant_acceleration_is_recovered_and_the_smoother_is_not_worse() {
        let (model, dt_s) = (AxisModel { jerk_density: 0.1, sigma_m: 0.2 }, 0.08);
        let truth = |k: usize| 25.0 * k as f64 * dt_s + 0.5 * (k as f64 * dt_s).powi(2);
        // A fixed disturbance with a mean of 0.
        let measured = |k: usize| truth(k) + 0.2 * maths::sin(k as f64 * 2.4);
        let mut filtered = vec![model.first(measured(0), 0.0)];
        for k in 1..100 {
            let predicted = model.predicted(&filtered[k - 1], dt_s);
            filtered.push(model.updated(&predicted, measured(k)));
        }
        let smoothed = model.smoothed(&filtered, dt_s);
        let error = |all: &[Estimate]| (0..100).map(|k| (all[k].mean.x - truth(k)).powi(2)).sum::<f64>();
        assert!(error(&smoothed) <= error(&filtered), "{} {}", error(&smoothed), error(&filtered));
        assert!((smoothed[50].mean.y - 25.0 - 50.0 * dt_s).abs() < 0.15, "{:?}", smoothed[50].mean);
        assert!((smoothed[50].mean.z - 1.0).abs() < 0.3);
    }
}
