//! The Kalman filter of one track: constant velocity in two dimensions with white acceleration.
//!
//! State [x, y, vx, vy] in ground axes. The acceleration is stronger along the direction of travel than across it, so
//! its spectral density is a matrix turned with the heading (continuous white noise acceleration model: Bar-Shalom, Li,
//! Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001, section 6.2.2).

use nalgebra::{Matrix2, Matrix4, Matrix4x2, Vector2, Vector4};

use super::{ACROSS_MANOEUVRE_M2PS3, ALONG_MANOEUVRE_M2PS3};

/// What is known of one point of a vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct GroundFilter {
    pub(super) state: Vector4<f64>,
    pub(super) covariance: Matrix4<f64>,
}

/// How a measurement deviates from what was expected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Innovation {
    pub(super) deviation_m: Vector2<f64>,
    pub(super) covariance_m2: Matrix2<f64>,
    inverse: Matrix2<f64>,
}

/// The covariance with standard deviations `along` and `across` the direction `yaw_rad`.
pub(super) fn turned(along_sd: f64, across_sd: f64, yaw_rad: f64) -> Matrix2<f64> {
    let (sin, cos) = yaw_rad.sin_cos();
    let (a, b) = (along_sd * along_sd, across_sd * across_sd);
    let off = (a - b) * sin * cos;
    Matrix2::new(a * cos * cos + b * sin * sin, off, off, a * sin * sin + b * cos * cos)
}

impl GroundFilter {
    /// A filter at its first measurement, with the velocity known only as `velocity_mps` with `velocity_m2ps2`.
    pub(super) fn first(
        position_m: Vector2<f64>,
        position_m2: Matrix2<f64>,
        velocity_mps: Vector2<f64>,
        velocity_m2ps2: Matrix2<f64>,
    ) -> Self {
        let mut covariance = Matrix4::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&position_m2);
        covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(&velocity_m2ps2);
        Self { state: Vector4::new(position_m.x, position_m.y, velocity_mps.x, velocity_mps.y), covariance }
    }

    /// Goes on by `t` seconds; `yaw_rad` is the direction of travel.
    pub(super) fn predict(&mut self, t: f64, yaw_rad: f64) {
        let velocity = self.velocity_mps();
        self.state[0] += t * velocity.x;
        self.state[1] += t * velocity.y;
        let density = turned(ALONG_MANOEUVRE_M2PS3.sqrt(), ACROSS_MANOEUVRE_M2PS3.sqrt(), yaw_rad);
        let pp = self.block(0, 0);
        let pv = self.block(0, 2);
        let vv = self.block(2, 2);
        let next_pv = pv + vv * t + density * (0.5 * t * t);
        let next_pp = pp + (pv + pv.transpose()) * t + vv * (t * t) + density * (t * t * t / 3.0);
        self.set(0, 0, &next_pp);
        self.set(0, 2, &next_pv);
        self.set(2, 0, &next_pv.transpose());
        self.set(2, 2, &(vv + density * t));
    }

    /// How a measured position of covariance `noise_m2` deviates; nothing where the noise is not a covariance.
    pub(super) fn innovation(&self, position_m: Vector2<f64>, noise_m2: &Matrix2<f64>) -> Option<Innovation> {
        let covariance_m2 = self.block(0, 0) + noise_m2;
        let inverse = covariance_m2.try_inverse()?;
        Some(Innovation { deviation_m: position_m - self.position_m(), covariance_m2, inverse })
    }

    /// Takes in the measurement that `innovation` stems from.
    pub(super) fn correct(&mut self, innovation: &Innovation) {
        let cross: Matrix4x2<f64> = self.covariance.fixed_view::<4, 2>(0, 0).into_owned();
        let gain = cross * innovation.inverse;
        self.state += gain * innovation.deviation_m;
        let reduced = self.covariance - gain * cross.transpose();
        // The two halves differ by rounding only; over thousands of scans that would add up.
        self.covariance = (reduced + reduced.transpose()) * 0.5;
    }

    pub(super) fn position_m(&self) -> Vector2<f64> {
        Vector2::new(self.state[0], self.state[1])
    }

    pub(super) fn velocity_mps(&self) -> Vector2<f64> {
        Vector2::new(self.state[2], self.state[3])
    }

    /// Standard deviation of the velocity along `direction`, a unit vector [m/s].
    pub(super) fn velocity_sd_mps(&self, direction: Vector2<f64>) -> f64 {
        (direction.transpose() * self.block(2, 2) * direction)[0].sqrt()
    }

    fn block(&self, row: usize, column: usize) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(row, column).into_owned()
    }

    fn set(&mut self, row: usize, column: usize, block: &Matrix2<f64>) {
        self.covariance.fixed_view_mut::<2, 2>(row, column).copy_from(block);
    }
}

impl Innovation {
    /// Squared Mahalanobis distance [1].
    pub(super) fn distance(&self) -> f64 {
        (self.deviation_m.transpose() * self.inverse * self.deviation_m)[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_covariance_keeps_its_axes() {
        let covariance = turned(2.0, 0.5, 0.7);
        let along = Vector2::new(0.7_f64.cos(), 0.7_f64.sin());
        let across = Vector2::new(-along.y, along.x);
        assert!(((along.transpose() * covariance * along)[0] - 4.0).abs() < 1e-12);
        assert!(((across.transpose() * covariance * across)[0] - 0.25).abs() < 1e-12);
    }

    #[test]
    fn two_steps_predict_like_one() {
        let velocity = Vector2::new(30.0, 1.0);
        let first = GroundFilter::first(Vector2::zeros(), turned(0.1, 0.2, 0.1), velocity, turned(3.0, 1.0, 0.1));
        let (mut once, mut twice) = (first, first);
        once.predict(0.1, 0.03);
        twice.predict(0.04, 0.03);
        twice.predict(0.06, 0.03);
        assert!((once.state - twice.state).norm() < 1e-12);
        assert!((once.covariance - twice.covariance).norm() < 1e-12);
    }

    #[test]
    fn an_exact_measurement_is_believed() {
        let unit = Matrix2::identity();
        let mut filter = GroundFilter::first(Vector2::zeros(), unit, Vector2::zeros(), unit);
        let innovation = filter.innovation(Vector2::new(1.0, 2.0), &(unit * 1e-9)).unwrap();
        assert!((innovation.distance() - 5.0).abs() < 1e-6);
        filter.correct(&innovation);
        assert!((filter.position_m() - Vector2::new(1.0, 2.0)).norm() < 1e-6);
        assert!(filter.covariance[(0, 0)] < 1e-8 && filter.covariance[(2, 2)] > 0.9);
    }
}
