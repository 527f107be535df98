//! A filter for one axis of the road: position and speed of a vehicle, under one or several modes of motion, with the
//! slow error of the sensor in the state.
//!
//! State of each mode [p, v, a, β]: position, speed, persistent acceleration, and the slow part of the measurement's
//! error in units of its standard deviation, a Gauss–Markov process. A measured position is
//!
//! ```text
//!   z = p + ℓ·v + σ_β·β + white noise          ℓ: lever [s], e.g. the age of the measurement
//! ```
//!
//! With β in the state the covariance stays honest although the errors of successive scans are alike (Bar-Shalom, Li,
//! Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001, section 8.2: state augmentation for
//! autocorrelated noise). The modes are mixed before, and weighed after each measurement (the same, section 11.6.6: the
//! interacting multiple model estimator); the estimate reported is the mean over the modes, and its covariance has the
//! spread between them. Both axes of the road are independent; in road coordinates a vehicle that follows a bend at
//! constant speed moves uniformly, so that the bend is no manoeuvre.

use nalgebra::{Matrix4, Vector4};

use super::motion::{MODES, Mode, Situation};

/// How far a manoeuvre that has just begun may carry a vehicle beside what the filter expects [m]: 2.5 m/s² for 0.4 s. Only
/// the gate knows of it, which is at least 0.7 m wide therefore: less than what is between two vehicles in any direction.
const MANOEUVRE_SD_M: f64 = 0.2;
/// Horizons are gone in steps no longer than this [s].
const LONGEST_STEP_S: f64 = 0.04;
/// What is left of a horizon by rounding [s].
const ROUNDING_S: f64 = 1e-9;

/// What is known under one mode.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    state: Vector4<f64>,
    covariance: Matrix4<f64>,
    /// Probability that the mode holds [1].
    probability: f64,
}

/// What is known of one vehicle along one axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AxisFilter {
    modes: &'static [Mode],
    estimates: [Estimate; MODES],
    /// That of the latest prediction.
    situation: Situation,
}

/// How well a measurement fits to what is known along one axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AxisFit {
    /// Squared deviation over its variance, that of a manoeuvre included, under the mode that expects it most [1].
    pub(crate) distance: f64,
    /// −2 · the logarithm of its likelihood over all modes, up to a constant.
    pub(crate) cost: f64,
    /// The logarithm of that variance, the mean over all modes: what a pair at the distance 0 would cost.
    pub(crate) log_variance: f64,
}

/// A measured position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AxisMeasurement {
    pub(crate) position_m: f64,
    /// Standard deviation of the error that is new in each scan [m].
    pub(crate) white_sd_m: f64,
    /// Standard deviation of the slow error [m].
    pub(crate) slow_sd_m: f64,
    /// Time by which the speed carries the position on to what was measured [s].
    pub(crate) lever_s: f64,
}

/// Position and speed along one axis, with their covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AxisEstimate {
    pub(crate) position_m: f64,
    pub(crate) speed_mps: f64,
    pub(crate) position_m2: f64,
    pub(crate) position_speed_m2ps: f64,
    pub(crate) speed_m2ps2: f64,
}

impl AxisFilter {
    /// A filter whose first measurement is still to come, at a place where it is near `position_m` ± `position_sd_m`,
    /// with a speed of `speed_mps` ± `speed_sd_mps`.
    pub(crate) fn prior(modes: &'static [Mode], position_m: [f64; 2], speed_mps: [f64; 2]) -> Self {
        let estimates = std::array::from_fn(|index| {
            let mode = modes.get(index);
            let acceleration_sd = mode.map_or(0.0, |mode| mode.acceleration_sd_mps2);
            let deviations = Vector4::new(position_m[1], speed_mps[1], acceleration_sd, 1.0);
            Estimate {
                state: Vector4::new(position_m[0], speed_mps[0], 0.0, 0.0),
                covariance: Matrix4::from_diagonal(&deviations.component_mul(&deviations)),
                probability: mode.map_or(0.0, |mode| mode.prior),
            }
        });
        Self { modes, estimates, situation: Situation::FREE }
    }

    /// Goes on by `step_s` in this situation, after which `slow_share` of the slow error is left.
    pub(crate) fn predict(&mut self, step_s: f64, slow_share: f64, situation: Situation) {
        self.situation = situation;
        if self.modes.len() > 1 {
            self.mix(step_s);
        }
        for (estimate, mode) in self.estimates.iter_mut().zip(self.modes) {
            estimate.predict(mode, step_s, slow_share);
        }
    }

    /// The estimate of each mode as that of what may have switched to it within the step.
    fn mix(&mut self, step_s: f64) {
        let before = self.estimates;
        let count = self.modes.len();
        for (to, mixed) in self.estimates.iter_mut().enumerate().take(count) {
            let weights: [f64; MODES] = std::array::from_fn(|from| {
                let Some(mode) = self.modes.get(from) else { return 0.0 };
                before[from].probability * switches(&mode.rates_per_s(self.situation), from, to, step_s)
            });
            *mixed = mean(&before[..count], &weights);
        }
    }

    /// How well a measurement fits. Where a vehicle has held its lane for long, that mode alone would not let it go, and
    /// from near by, where it is known to millimetres, not even all modes would when it swerves.
    pub(crate) fn fit(&self, measurement: &AxisMeasurement) -> AxisFit {
        let (mut distance, mut likelihood, mut variance) = (f64::INFINITY, 0.0, 0.0);
        for estimate in &self.estimates[..self.modes.len()] {
            let (innovation_m, _, known_m2) = estimate.innovation(measurement);
            let variance_m2 = known_m2 + MANOEUVRE_SD_M * MANOEUVRE_SD_M;
            let deviations = innovation_m * innovation_m / variance_m2;
            distance = distance.min(deviations);
            likelihood += estimate.probability * (-0.5 * deviations).exp() / variance_m2.sqrt();
            variance += estimate.probability * variance_m2;
        }
        AxisFit { distance, cost: -2.0 * likelihood.ln(), log_variance: variance.ln() }
    }

    /// Takes in a measured position.
    pub(crate) fn measure_position(&mut self, measurement: &AxisMeasurement) {
        let count = self.modes.len();
        let mut logs = [f64::NEG_INFINITY; MODES];
        for (estimate, log) in self.estimates.iter_mut().zip(&mut logs).take(count) {
            let (innovation_m, gain, variance_m2) = estimate.innovation(measurement);
            *log = -0.5 * (innovation_m * innovation_m / variance_m2 + variance_m2.ln());
            estimate.correct(innovation_m, &gain, variance_m2);
        }
        self.weigh(&logs);
    }

    /// Takes in a measured speed.
    pub(crate) fn measure_speed(&mut self, speed_mps: f64, sd_mps: f64) {
        let count = self.modes.len();
        let mut logs = [f64::NEG_INFINITY; MODES];
        for (estimate, log) in self.estimates.iter_mut().zip(&mut logs).take(count) {
            let gain = estimate.covariance.column(1).into_owned();
            let (innovation, variance) = (speed_mps - estimate.state[1], gain[1] + sd_mps * sd_mps);
            *log = -0.5 * (innovation * innovation / variance + variance.ln());
            estimate.correct(innovation, &gain, variance);
        }
        self.weigh(&logs);
    }

    /// Multiplies the probabilities of the modes by their likelihoods.
    fn weigh(&mut self, logs: &[f64; MODES]) {
        if self.modes.len() < 2 {
            return;
        }
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: [f64; MODES] =
            std::array::from_fn(|index| self.estimates[index].probability * (logs[index] - most).exp());
        let sum: f64 = weights.iter().sum();
        // No likelihood is a number where the measurement was none: then nothing is learned of the modes.
        if sum > 0.0 && sum.is_finite() {
            for (estimate, weight) in self.estimates.iter_mut().zip(weights) {
                estimate.probability = weight / sum;
            }
        }
    }

    fn combined(&self) -> Estimate {
        if let [only] = &self.estimates[..self.modes.len()] {
            return *only;
        }
        let weights = self.estimates.map(|estimate| estimate.probability);
        mean(&self.estimates[..self.modes.len()], &weights)
    }

    /// Position and speed now.
    pub(crate) fn now(&self) -> AxisEstimate {
        let Estimate { state, covariance, .. } = self.combined();
        AxisEstimate {
            position_m: state[0],
            speed_mps: state[1],
            position_m2: covariance[(0, 0)],
            position_speed_m2ps: covariance[(0, 1)],
            speed_m2ps2: covariance[(1, 1)],
        }
    }

    /// Position and speed after `horizon_s` without another measurement, in the situation of the latest prediction.
    pub(crate) fn ahead(&self, horizon_s: f64) -> AxisEstimate {
        let mut ahead = *self;
        let mut left_s = horizon_s;
        while left_s > ROUNDING_S {
            let step_s = left_s.min(LONGEST_STEP_S);
            ahead.predict(step_s, 1.0, self.situation);
            left_s -= step_s;
        }
        ahead.now()
    }
}

/// Probability of being in the mode number `to` a step of `step_s` after that of the number `from`, which is left at these
/// rates [1/s] once at most.
fn switches(rates_per_s: &[f64; MODES], from: usize, to: usize, step_s: f64) -> f64 {
    let leaving_per_s: f64 = (0..MODES).filter(|other| *other != from).map(|other| rates_per_s[other]).sum();
    let stays = (-leaving_per_s * step_s).exp();
    if from == to {
        stays
    } else if leaving_per_s > 0.0 {
        (1.0 - stays) * rates_per_s[to] / leaving_per_s
    } else {
        0.0
    }
}

/// Mean and covariance of a mixture; its probability is the sum of the weights.
fn mean(estimates: &[Estimate], weights: &[f64; MODES]) -> Estimate {
    let sum: f64 = weights.iter().sum();
    let mut state = Vector4::zeros();
    for (estimate, weight) in estimates.iter().zip(weights) {
        state += estimate.state * (weight / sum);
    }
    let mut covariance = Matrix4::zeros();
    for (estimate, weight) in estimates.iter().zip(weights) {
        let apart = estimate.state - state;
        covariance += (estimate.covariance + apart * apart.transpose()) * (weight / sum);
    }
    Estimate { state, covariance, probability: sum }
}

impl Estimate {
    fn predict(&mut self, mode: &Mode, t: f64, slow_share: f64) {
        let persists = if mode.persistence_s > 0.0 { (-t / mode.persistence_s).exp() } else { 0.0 };
        let lasts = (-t / mode.calming_s).exp();
        let half = 0.5 * t * t;
        #[rustfmt::skip]
        let step = Matrix4::new(
            1.0, t, half, 0.0,
            0.0, lasts, t, 0.0,
            0.0, 0.0, persists, 0.0,
            0.0, 0.0, 0.0, slow_share,
        );
        self.state = step * self.state;
        self.covariance = step * self.covariance * step.transpose();
        let q = mode.white_m2ps3;
        let new_share = 1.0 - persists * persists;
        self.covariance[(0, 0)] += q * t * t * t / 3.0;
        self.covariance[(0, 1)] += q * half;
        self.covariance[(1, 0)] += q * half;
        self.covariance[(1, 1)] += q * t;
        self.covariance[(2, 2)] += new_share * mode.acceleration_sd_mps2 * mode.acceleration_sd_mps2;
        self.covariance[(3, 3)] += 1.0 - slow_share * slow_share;
    }

    /// How a measurement deviates from what was expected, P·Hᵀ, and the variance of the deviation.
    fn innovation(&self, measurement: &AxisMeasurement) -> (f64, Vector4<f64>, f64) {
        let row = Vector4::new(1.0, measurement.lever_s, 0.0, measurement.slow_sd_m);
        let gain = self.covariance * row;
        let variance_m2 = row.dot(&gain) + measurement.white_sd_m * measurement.white_sd_m;
        (measurement.position_m - row.dot(&self.state), gain, variance_m2)
    }

    fn correct(&mut self, innovation: f64, gain: &Vector4<f64>, variance: f64) {
        self.state += gain * (innovation / variance);
        self.covariance -= gain * gain.transpose() / variance;
    }
}

#[cfg(test)]
mod tests;
