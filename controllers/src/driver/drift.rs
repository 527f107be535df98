//! A random quantity that drifts about zero as smoothly as a human steers and accelerates: white noise behind three
//! first-order lags.
//!
//! ```text
//!  white noise ─▶ 1/(1 + s·T₁) ─▶ 1/(1 + s·T₂) ─▶ 1/(1 + s·T₃) ─▶ value, with two continuous derivatives
//! ```
//!
//! Value and derivatives are Markov together: from knot to knot they are drawn with the exact transition Φ = exp(A·h) and
//! covariance Q = P − Φ·P·Φᵀ, where P is the stationary covariance (Maybeck, *Stochastic Models, Estimation, and Control*,
//! vol. 1, 1979, ch. 4). Between two knots lies the quintic that meets both.

use closecall_traffic::{Quintic, Stream};
use nalgebra::{Matrix3, Vector3};
use rand_distr::{Distribution, StandardNormal};

/// Distance of two knots [s], less than the shortest lag in use.
const KNOT_SPACING_S: f64 = 0.25;

/// A random quantity that drifts.
#[derive(Clone, Debug)]
pub(crate) struct Drift {
    /// Standard deviation in the long run; what follows is in units of it.
    sd: f64,
    transition: Matrix3<f64>,
    /// The lower triangle whose square is Q.
    noise: Matrix3<f64>,
    rng: Stream,
    /// The last knot passed [s], and value and derivatives at the next one.
    knot_s: f64,
    next: Vector3<f64>,
    /// From the last knot to the next.
    between: Quintic,
}

impl Drift {
    /// One that starts at zero and at rest, and comes to the standard deviation `sd` within a few of the longest of the
    /// lags `lags_s` (above 0) [s].
    pub(crate) fn from_rest(sd: f64, lags_s: [f64; 3], rng: Stream) -> Self {
        let covariance = stationary_covariance(lags_s);
        let transition = (dynamics(lags_s) * KNOT_SPACING_S).exp();
        let mut drift = Self {
            sd,
            noise: lower_triangle(&(covariance - transition * covariance * transition.transpose())),
            transition,
            rng,
            knot_s: 0.0,
            next: Vector3::zeros(),
            between: Quintic::between([0.0; 3], [0.0; 3], KNOT_SPACING_S),
        };
        drift.draw_next();
        drift
    }

    /// Value, first and second derivative at `at_s`, which never falls from call to call.
    pub(crate) fn at(&mut self, at_s: f64) -> [f64; 3] {
        while at_s > self.knot_s + KNOT_SPACING_S {
            self.knot_s += KNOT_SPACING_S;
            self.draw_next();
        }
        self.between.at(at_s - self.knot_s).map(|part| self.sd * part)
    }

    fn draw_next(&mut self) {
        let from = self.next;
        self.next = self.transition * from + self.noise * draw(&mut self.rng);
        self.between = Quintic::between(from.into(), self.next.into(), KNOT_SPACING_S);
    }
}

/// Standard deviations of the first and of the second derivative, for a value of standard deviation 1 [1/s, 1/s²].
pub(crate) fn derivative_sds(lags_s: [f64; 3]) -> [f64; 2] {
    let covariance = stationary_covariance(lags_s);
    [1, 2].map(|order| covariance[(order, order)].sqrt())
}

/// Three independent standard normal numbers.
fn draw(rng: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

/// The lags as one differential equation of third order, for (value, derivative, second derivative).
fn dynamics(lags_s: [f64; 3]) -> Matrix3<f64> {
    let [a0, a1, a2] = characteristic(lags_s);
    Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, -a0, -a1, -a2)
}

/// Coefficients of s³ + a₂·s² + a₁·s + a₀, whose roots are the −1/T.
fn characteristic(lags_s: [f64; 3]) -> [f64; 3] {
    let [p, q, r] = lags_s.map(|lag_s| 1.0 / lag_s);
    [p * q * r, p * q + q * r + r * p, p + q + r]
}

/// The covariance of value, derivative and second derivative in the long run, for a value of variance 1, by the moments of
/// the spectrum: those of orders 0, 2 and 4 are as a₂/a₀ to 1 to a₁.
fn stationary_covariance(lags_s: [f64; 3]) -> Matrix3<f64> {
    let [a0, a1, a2] = characteristic(lags_s);
    let first = a0 / a2;
    let second = first * a1;
    Matrix3::new(1.0, 0.0, -first, 0.0, first, 0.0, -first, 0.0, second)
}

/// The lower triangle L with L·Lᵀ = `covariance`. Where that is not positive definite there is none, and no number drives
/// anybody.
fn lower_triangle(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    covariance.cholesky().map_or_else(|| Matrix3::repeat(f64::NAN), |cholesky| cholesky.l())
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};

    use super::*;

    const LAGS_S: [f64; 3] = [4.0, 0.5, 0.3];
    const STEP_S: f64 = 0.01;

    fn rng(seed: u64) -> Stream {
        stream(seed, 0, &ActorId::new("rear").unwrap(), "drift")
    }

    #[test]
    fn values_and_derivatives_scatter_as_the_spectrum_says() {
        let mut drift = Drift::from_rest(0.2, LAGS_S, rng(1));
        let steps = 4_000_000;
        let mut squares = [0.0; 3];
        for step in 0..steps {
            let now = drift.at(f64::from(step) * STEP_S);
            squares.iter_mut().zip(now).for_each(|(sum, value)| *sum += value * value / f64::from(steps));
        }
        let expected = 0.2 * 0.2 * stationary_covariance(LAGS_S).diagonal();
        // 40,000 s are some 10,000 times the longest lag: the variance is met within 3 %. Between the knots the quintic is a
        // little calmer than the drift in its second derivative.
        assert!((squares[0] / expected[0] - 1.0).abs() < 0.05, "{squares:?} {expected}");
        assert!((squares[1] / expected[1] - 1.0).abs() < 0.05, "{squares:?} {expected}");
        assert!((0.8..1.05).contains(&(squares[2] / expected[2])), "{squares:?} {expected}");
    }

    #[test]
    fn the_moments_of_the_spectrum_solve_the_lyapunov_equation() {
        let covariance = stationary_covariance(LAGS_S);
        let dynamics = dynamics(LAGS_S);
        let change = dynamics * covariance + covariance * dynamics.transpose();
        // Only the noise on the last derivative is left.
        for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2)] {
            assert!(change[(row, column)].abs() < 1e-12, "{change}");
        }
        assert!(change[(2, 2)] < 0.0);
    }

    #[test]
    fn the_derivatives_are_those_of_the_value() {
        let mut drift = Drift::from_rest(0.2, LAGS_S, rng(2));
        let step_s = 1e-4;
        let mut before = drift.at(0.0);
        for step in 1..60_000 {
            let now = drift.at(f64::from(step) * step_s);
            for order in 0..2 {
                let slope = (now[order] - before[order]) / step_s;
                let mean = 0.5 * (now[order + 1] + before[order + 1]);
                assert!((slope - mean).abs() < 2e-3, "order {order} at step {step}: {slope} {mean}");
            }
            before = now;
        }
    }

    #[test]
    fn one_that_starts_at_rest_grows_to_the_same_width() {
        let at_s = |time_s: f64| {
            let squares = (0..2_000).map(|seed| Drift::from_rest(0.5, LAGS_S, rng(seed)).at(time_s)[0].powi(2));
            (squares.sum::<f64>() / 2_000.0).sqrt()
        };
        assert_eq!(at_s(0.0), 0.0);
        assert!(at_s(1.0) < 0.25, "{}", at_s(1.0));
        assert!((at_s(20.0) - 0.5).abs() < 0.03, "{}", at_s(20.0));
    }
}
