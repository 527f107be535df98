//! Coloured noise with zero mean, as smooth as human steering and acceleration: white noise
//! filtered by three first-order lags.
//!
//! ```text
//!  white noise ─▶ 1/(1 + s·T₁) ─▶ 1/(1 + s·T₂) ─▶ 1/(1 + s·T₃) ─▶ value with two continuous derivatives
//! ```
//!
//! Value, first and second derivative together form a Markov process with the state matrix A. They
//! are sampled at knots a time h apart, with the exact transition Φ = exp(A·h) and covariance Q = P
//! − Φ·P·Φᵀ, where P is the stationary covariance (Maybeck, *Stochastic Models, Estimation, and
//! Control*, vol. 1, 1979, ch. 4). A quintic polynomial interpolates between two knots; it meets
//! value and derivatives at both.

use closecall_traffic::{Quintic, StandardNormal, Stream};
use nalgebra::{Matrix3, Vector3};
use rand::distr::Distribution;

/// Time between two knots (s), less than the shortest lag in use.
const KNOT_SPACING_S: f64 = 0.25;

/// Generates one realisation of the noise.
#[derive(Clone, Debug)]
pub(crate) struct SmoothNoise {
    /// Stationary standard deviation. The other members refer to noise of standard deviation 1.
    sd: f64,
    /// The transition Φ from one knot to the next.
    transition: Matrix3<f64>,
    /// The lower triangular L with L·Lᵀ = Q.
    noise: Matrix3<f64>,
    rng: Stream,
    /// Time of the last knot passed (s).
    knot_s: f64,
    /// Value, first and second derivative at the next knot.
    next: Vector3<f64>,
    /// Interpolates from the last knot to the next.
    segment: Quintic,
}

impl SmoothNoise {
    /// Creates noise with the lags `lags_s` (s), each above 0, that starts at zero with zero
    /// derivatives. Its standard deviation reaches `sd` after a few times the longest lag.
    pub(crate) fn from_rest(sd: f64, lags_s: [f64; 3], rng: Stream) -> Self {
        let covariance = stationary_covariance(lags_s);
        let transition = (dynamics(lags_s) * KNOT_SPACING_S).exp();
        let mut noise = Self {
            sd,
            noise: lower_triangle(&(covariance - transition * covariance * transition.transpose())),
            transition,
            rng,
            knot_s: 0.0,
            next: Vector3::zeros(),
            segment: Quintic::between([0.0; 3], [0.0; 3], KNOT_SPACING_S),
        };
        noise.draw_next();
        noise
    }

    /// Returns value, first and second derivative at `time_s`, which must not decrease from call to
    /// call.
    pub(crate) fn at(&mut self, time_s: f64) -> [f64; 3] {
        while time_s > self.knot_s + KNOT_SPACING_S {
            self.knot_s += KNOT_SPACING_S;
            self.draw_next();
        }
        self.segment.at(time_s - self.knot_s).map(|part| self.sd * part)
    }

    fn draw_next(&mut self) {
        let from = self.next;
        self.next = self.transition * from + self.noise * draw(&mut self.rng);
        self.segment = Quintic::between(from.into(), self.next.into(), KNOT_SPACING_S);
    }
}

/// Returns the standard deviations of the first (1/s) and second (1/s²) derivative of noise with
/// standard deviation 1.
pub(crate) fn derivative_sds(lags_s: [f64; 3]) -> [f64; 2] {
    let covariance = stationary_covariance(lags_s);
    [1, 2].map(|order| covariance[(order, order)].sqrt())
}

/// Draws three independent standard normal numbers.
fn draw(rng: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

/// Returns the state matrix A of the three lags, for the state (value, first derivative, second
/// derivative).
fn dynamics(lags_s: [f64; 3]) -> Matrix3<f64> {
    let [a0, a1, a2] = characteristic(lags_s);
    Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, -a0, -a1, -a2)
}

/// Returns the coefficients (a₀, a₁, a₂) of the characteristic polynomial s³ + a₂·s² + a₁·s + a₀,
/// whose roots are −1/T.
fn characteristic(lags_s: [f64; 3]) -> [f64; 3] {
    let [p, q, r] = lags_s.map(|lag_s| 1.0 / lag_s);
    [p * q * r, p * q + q * r + r * p, p + q + r]
}

/// Returns the stationary covariance of value, first and second derivative for noise of variance 1.
/// It follows from the moments of the spectrum: the moments of orders 0, 2 and 4 are in the ratio
/// a₂/a₀ : 1 : a₁.
fn stationary_covariance(lags_s: [f64; 3]) -> Matrix3<f64> {
    let [a0, a1, a2] = characteristic(lags_s);
    let first = a0 / a2;
    let second = first * a1;
    Matrix3::new(1.0, 0.0, -first, 0.0, first, 0.0, -first, 0.0, second)
}

/// Returns the lower triangular L with L·Lᵀ = `covariance`. If the covariance is not positive
/// definite, L is NaN, which the check of the driver's input refuses.
fn lower_triangle(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    covariance.cholesky().map_or_else(|| Matrix3::repeat(f64::NAN), |cholesky| cholesky.l())
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, PHYSICS_STEP, stream};

    use super::*;

    const LAGS_S: [f64; 3] = [4.0, 0.5, 0.3];
    const STEP_S: f64 = PHYSICS_STEP.s();

    fn rng(seed: u64) -> Stream {
        stream(seed, 0, &ActorId::new("rear").unwrap(), "drift")
    }

    #[test]
    fn variances_of_value_and_derivatives_follow_from_the_spectrum() {
        let mut noise = SmoothNoise::from_rest(0.2, LAGS_S, rng(1));
        let steps = 4_000_000;
        let mut squares = [0.0; 3];
        for step in 0..steps {
            let now = noise.at(f64::from(step) * STEP_S);
            squares.iter_mut().zip(now).for_each(|(sum, value)| *sum += value * value / f64::from(steps));
        }
        let expected = 0.2 * 0.2 * stationary_covariance(LAGS_S).diagonal();
        // 40,000 s are some 10,000 times the longest lag: the sample variance is accurate to 3 %.
        // Between the knots, the second derivative of the quintic varies slightly less than the
        // second derivative of the noise.
        assert!((squares[0] / expected[0] - 1.0).abs() < 0.05, "{squares:?} {expected}");
        assert!((squares[1] / expected[1] - 1.0).abs() < 0.05, "{squares:?} {expected}");
        assert!((0.8..1.05).contains(&(squares[2] / expected[2])), "{squares:?} {expected}");
    }

    #[test]
    fn the_stationary_covariance_solves_the_lyapunov_equation() {
        let covariance = stationary_covariance(LAGS_S);
        let dynamics = dynamics(LAGS_S);
        let change = dynamics * covariance + covariance * dynamics.transpose();
        // Only the element of the second derivative remains: the white noise enters there.
        for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2)] {
            assert!(change[(row, column)].abs() < 1e-12, "{change}");
        }
        assert!(change[(2, 2)] < 0.0);
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let mut noise = SmoothNoise::from_rest(0.2, LAGS_S, rng(2));
        let step_s = 1e-4;
        let mut before = noise.at(0.0);
        for step in 1..60_000 {
            let now = noise.at(f64::from(step) * step_s);
            for order in 0..2 {
                let slope = (now[order] - before[order]) / step_s;
                let mean = 0.5 * (now[order + 1] + before[order + 1]);
                assert!((slope - mean).abs() < 2e-3, "order {order} at step {step}: {slope} {mean}");
            }
            before = now;
        }
    }

    #[test]
    fn noise_from_rest_reaches_its_stationary_standard_deviation() {
        let at_s = |time_s: f64| {
            let squares = (0..2_000).map(|seed| SmoothNoise::from_rest(0.5, LAGS_S, rng(seed)).at(time_s)[0].powi(2));
            (squares.sum::<f64>() / 2_000.0).sqrt()
        };
        assert_eq!(at_s(0.0), 0.0);
        assert!(at_s(1.0) < 0.25, "{}", at_s(1.0));
        assert!((at_s(20.0) - 0.5).abs() < 0.03, "{}", at_s(20.0));
    }
}
