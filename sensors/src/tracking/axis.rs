//! A filter for one axis of the road: it estimates a vehicle's position and speed under one or
//! several modes of motion, with the sensor's slow error in the state.
//!
//! The state of each mode is `[p, v, a, β]`: position, speed, correlated acceleration, and the slow
//! part of the measurement error in units of its standard deviation σ_β. β is a Gauss–Markov
//! process. A measured position is
//!
//! ```text
//!   z = p + τ·v + σ_β·β + white noise          τ: time offset (s), such as the negative age of the measurement
//! ```
//!
//! With β in the state, the covariance stays consistent although the errors of successive scans are
//! correlated (Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and
//! Navigation*, 2001, section 8.2: state augmentation for autocorrelated noise). The modes are
//! mixed before each prediction, and their probabilities updated with each measurement (the same,
//! section 11.6.6: the interacting multiple model estimator). The reported estimate is the mean
//! over the modes, and its covariance includes the differences between them. The two axes of the
//! road are independent. In road coordinates, a vehicle that follows a bend at constant speed moves
//! uniformly, so a bend is not a manoeuvre.

use closecall_traffic::{CONTROL_STEP, maths};
use nalgebra::{Matrix4, Vector4};

use self::estimate::{ModeEstimate, mixture};
use super::box_use::Innovation;
use super::motion::{MODES, Mode, Situation};
use crate::tracking::gaussian::Gaussian;

mod estimate;

/// Standard deviation of a vehicle's deviation from the prediction when a manoeuvre has just begun
/// (m): 2.5 m/s² for 0.4 s.
///
/// Only the gate uses it. The gate is therefore at least 0.7 m wide, which is less than the
/// distance between two vehicles in any direction.
const MANOEUVRE_SD_M: f64 = 0.2;
/// Maximum step of a prediction over a horizon (s).
const MAX_STEP_S: f64 = CONTROL_STEP.s();
/// Rest of a horizon that is due to rounding (s).
const ROUNDING_S: f64 = 1e-9;

/// Shares of one mode that remain after a step.
#[derive(Clone, Copy, Debug, Default)]
struct Remaining {
    /// Of the correlated acceleration.
    persistence: f64,
    /// Of the speed.
    speed: f64,
    /// Probability that the mode goes on in a free situation.
    stays: f64,
}

impl Remaining {
    fn after(mode: &Mode, index: usize, step_s: f64) -> Self {
        Self {
            persistence: if mode.persistence_s > 0.0 { maths::exp(-step_s / mode.persistence_s) } else { 0.0 },
            speed: maths::exp(-step_s / mode.speed_decay_s),
            stays: staying_probability(&mode.rates_per_s(Situation::FREE), index, step_s),
        }
    }
}

/// The filter of one vehicle along one axis.
#[derive(Clone, Copy, Debug)]
pub struct AxisFilter {
    modes: &'static [Mode],
    estimates: [ModeEstimate; MODES],
    /// What remains after a control step, the usual step.
    usual: [Remaining; MODES],
    /// Situation of the latest prediction.
    situation: Situation,
}

/// How well a measurement fits the estimate along one axis.
#[derive(Clone, Copy, Debug)]
pub struct AxisFit {
    /// Squared innovation over its variance, which allows for a manoeuvre, under the mode in which
    /// this is least.
    pub squared_distance: f64,
    /// −2 · the logarithm of the likelihood over all modes, up to a constant.
    pub cost: f64,
    /// Logarithm of that variance's mean over all modes: the cost of a measurement without
    /// deviation.
    pub log_variance: f64,
}

/// A measured position along one axis.
#[derive(Clone, Copy, Debug)]
pub struct AxisMeasurement {
    /// Measured position (m).
    pub position_m: f64,
    /// Standard deviation of the white error (m).
    pub white_sd_m: f64,
    /// Standard deviation of the slow error (m).
    pub slow_sd_m: f64,
    /// Time after which the vehicle is at the measured position at its present speed (s); negative
    /// for an old measurement.
    pub time_offset_s: f64,
}

impl AxisMeasurement {
    /// Returns the measured position at the filter's time (m), for a vehicle of this speed, and its
    /// variance (m²).
    pub(crate) fn position_now(&self, speed_mps: f64) -> [f64; 2] {
        let variance_m2 = self.white_sd_m * self.white_sd_m + self.slow_sd_m * self.slow_sd_m;
        [self.position_m - self.time_offset_s * speed_mps, variance_m2]
    }
}

/// Position and speed along one axis, with their covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisEstimate {
    /// Position (m).
    pub position_m: f64,
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Variance of the position (m²).
    pub position_variance_m2: f64,
    /// Covariance of position and speed (m²/s).
    pub position_speed_covariance_m2ps: f64,
    /// Variance of the speed (m²/s²).
    pub speed_variance_m2ps2: f64,
}

impl AxisFilter {
    /// Creates a filter before its first measurement, with the prior distributions of position and
    /// speed.
    #[inline]
    pub fn prior(modes: &'static [Mode], position_m: Gaussian, speed_mps: Gaussian) -> Self {
        let estimates = std::array::from_fn(|index| {
            let mode = modes.get(index);
            let acceleration_sd = mode.map_or(0.0, |mode| mode.acceleration_sd_mps2);
            let deviations = Vector4::new(position_m.sd, speed_mps.sd, acceleration_sd, 1.0);
            ModeEstimate {
                state: Vector4::new(position_m.mean, speed_mps.mean, 0.0, 0.0),
                covariance: Matrix4::from_diagonal(&deviations.component_mul(&deviations)),
                probability: mode.map_or(0.0, |mode| mode.prior_probability),
            }
        });
        let usual = std::array::from_fn(|index| {
            modes.get(index).map_or_else(Remaining::default, |mode| Remaining::after(mode, index, CONTROL_STEP.s()))
        });
        Self { modes, estimates, usual, situation: Situation::FREE }
    }

    /// Predicts by `step_s` in this situation, after which the share `slow_share` of the slow error
    /// remains.
    #[inline]
    pub fn predict(&mut self, step_s: f64, slow_share: f64, situation: Situation) {
        self.situation = situation;
        let remaining = if step_s == CONTROL_STEP.s() {
            self.usual
        } else {
            std::array::from_fn(|index| match self.modes.get(index) {
                Some(mode) => Remaining::after(mode, index, step_s),
                None => Remaining::default(),
            })
        };
        if self.modes.len() > 1 {
            self.mix(step_s, &remaining);
        }
        for ((estimate, mode), remaining) in self.estimates.iter_mut().zip(self.modes).zip(&remaining) {
            estimate.predict(mode, step_s, remaining, slow_share);
        }
    }

    /// Replaces each mode's estimate by the mixture of the estimates that may switch to the mode
    /// within the step.
    fn mix(&mut self, step_s: f64, remaining: &[Remaining; MODES]) {
        let before = self.estimates;
        let count = self.modes.len();
        let mut weights = [[0.0; MODES]; MODES];
        for (from, mode) in self.modes.iter().enumerate() {
            let rates_per_s = mode.rates_per_s(self.situation);
            let is_free = self.situation == Situation::FREE;
            let stays = if is_free { remaining[from].stays } else { staying_probability(&rates_per_s, from, step_s) };
            for (weights, share) in weights.iter_mut().zip(transition_probabilities(&rates_per_s, from, stays)) {
                weights[from] = before[from].probability * share;
            }
        }
        for (mixed, weights) in self.estimates.iter_mut().zip(&weights).take(count) {
            *mixed = mixture(&before[..count], weights);
        }
    }

    /// Returns how well a measurement fits.
    ///
    /// The least distance over all modes counts: after a vehicle has kept its lane for long, the
    /// lane-keeping mode alone would reject the start of a lane change. The allowance for a
    /// manoeuvre is needed in addition at short range, where the position is known to millimetres
    /// and all modes would reject the measurements of a swerving vehicle.
    #[inline]
    pub fn fit(&self, measurement: &AxisMeasurement) -> AxisFit {
        let (mut squared_distance, mut likelihood, mut variance) = (f64::INFINITY, 0.0, 0.0);
        for estimate in &self.estimates[..self.modes.len()] {
            let (innovation_m, _, predicted_variance_m2) = estimate.innovation(measurement);
            let variance_m2 = predicted_variance_m2 + MANOEUVRE_SD_M * MANOEUVRE_SD_M;
            let deviations = innovation_m * innovation_m / variance_m2;
            squared_distance = squared_distance.min(deviations);
            likelihood += estimate.probability * maths::exp(-0.5 * deviations) / variance_m2.sqrt();
            variance += estimate.probability * variance_m2;
        }
        AxisFit { squared_distance, cost: -2.0 * maths::ln(likelihood), log_variance: maths::ln(variance) }
    }

    /// Returns the innovation of a measurement, over all modes.
    pub(crate) fn innovation(&self, measurement: &AxisMeasurement) -> Innovation {
        let modes = || {
            let estimates = self.estimates[..self.modes.len()].iter();
            estimates.map(|estimate| (estimate.probability, estimate.innovation(measurement)))
        };
        let innovation_m = modes().map(|(probability, (innovation_m, _, _))| probability * innovation_m).sum();
        let spread_m2 = |mode_m: f64| (mode_m - innovation_m) * (mode_m - innovation_m);
        let variance_m2 =
            modes().map(|(probability, (mode_m, _, mode_m2))| probability * (mode_m2 + spread_m2(mode_m))).sum();
        Innovation { innovation_m, variance_m2 }
    }

    /// Forgets the slow error: the next measurement has another slow error.
    pub(crate) fn renew_slow_error(&mut self) {
        for estimate in &mut self.estimates[..self.modes.len()] {
            estimate.state[3] = 0.0;
            estimate.covariance.row_mut(3).fill(0.0);
            estimate.covariance.column_mut(3).fill(0.0);
            estimate.covariance[(3, 3)] = 1.0;
        }
    }

    /// Moves the point that the filter follows by `offset_m`, which is known with the variance
    /// `variance_m2`.
    pub(crate) fn shift(&mut self, offset_m: f64, variance_m2: f64) {
        for estimate in &mut self.estimates[..self.modes.len()] {
            estimate.state[0] += offset_m;
            estimate.covariance[(0, 0)] += variance_m2;
        }
    }

    /// Corrects the filter with a measured position.
    #[inline]
    pub fn measure_position(&mut self, measurement: &AxisMeasurement) {
        let count = self.modes.len();
        let mut logs = [f64::NEG_INFINITY; MODES];
        for (estimate, log) in self.estimates.iter_mut().zip(&mut logs).take(count) {
            let (innovation_m, gain, variance_m2) = estimate.innovation(measurement);
            *log = -0.5 * (innovation_m * innovation_m / variance_m2 + maths::ln(variance_m2));
            estimate.correct(innovation_m, &gain, variance_m2);
        }
        self.update_probabilities(&logs);
    }

    /// Corrects the filter with a measured speed.
    #[inline]
    pub fn measure_speed(&mut self, speed_mps: f64, sd_mps: f64) {
        let count = self.modes.len();
        let mut logs = [f64::NEG_INFINITY; MODES];
        for (estimate, log) in self.estimates.iter_mut().zip(&mut logs).take(count) {
            let gain = estimate.covariance.column(1).into_owned();
            let (innovation, variance) = (speed_mps - estimate.state[1], gain[1] + sd_mps * sd_mps);
            *log = -0.5 * (innovation * innovation / variance + maths::ln(variance));
            estimate.correct(innovation, &gain, variance);
        }
        self.update_probabilities(&logs);
    }

    /// Updates the probabilities of the modes with their log-likelihoods `logs`.
    fn update_probabilities(&mut self, logs: &[f64; MODES]) {
        if self.modes.len() < 2 {
            return;
        }
        let max_log = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: [f64; MODES] =
            std::array::from_fn(|index| self.estimates[index].probability * maths::exp(logs[index] - max_log));
        let sum: f64 = weights.iter().sum();
        // If the measurement is not a number, neither is any likelihood. The probabilities then
        // stay unchanged.
        if sum > 0.0 && sum.is_finite() {
            for (estimate, weight) in self.estimates.iter_mut().zip(weights) {
                estimate.probability = weight / sum;
            }
        }
    }

    /// Returns the present estimate of position and speed: the mean over the modes.
    #[inline]
    pub fn estimate(&self) -> AxisEstimate {
        let estimates = &self.estimates[..self.modes.len()];
        let (state, covariance) = match estimates {
            [only] => ([only.state[0], only.state[1]], COVARIANCES.map(|at| only.covariance[at])),
            _ => self.mean(estimates),
        };
        AxisEstimate {
            position_m: state[0],
            speed_mps: state[1],
            position_variance_m2: covariance[0],
            position_speed_covariance_m2ps: covariance[1],
            speed_variance_m2ps2: covariance[2],
        }
    }

    /// Returns position and speed of the mixture of all modes, and their [`COVARIANCES`]: the same
    /// as [`mixture`].
    fn mean(&self, estimates: &[ModeEstimate]) -> ([f64; 2], [f64; 3]) {
        let sum: f64 = self.estimates.iter().map(|estimate| estimate.probability).sum();
        let mut state = [0.0; 2];
        for estimate in estimates {
            let share = estimate.probability / sum;
            for (index, value) in state.iter_mut().enumerate() {
                *value += estimate.state[index] * share;
            }
        }
        let mut covariance = [0.0; 3];
        for estimate in estimates {
            let share = estimate.probability / sum;
            for (value, (row, column)) in covariance.iter_mut().zip(COVARIANCES) {
                let (row_error, column_error) =
                    (estimate.state[row] - state[row], estimate.state[column] - state[column]);
                *value += (estimate.covariance[(row, column)] + row_error * column_error) * share;
            }
        }
        (state, covariance)
    }

    /// Returns the estimate predicted by `horizon_s`, in the situation of the latest prediction.
    ///
    /// A negative horizon, as a clock that runs ahead causes it, moves the position back at
    /// constant speed. The covariance stays.
    #[inline]
    pub fn predicted(&self, horizon_s: f64) -> AxisEstimate {
        if horizon_s < -ROUNDING_S {
            let latest = self.estimate();
            return AxisEstimate { position_m: latest.position_m + latest.speed_mps * horizon_s, ..latest };
        }
        let mut predicted = *self;
        let mut remaining_s = horizon_s;
        while remaining_s > ROUNDING_S {
            let step_s = remaining_s.min(MAX_STEP_S);
            predicted.predict(step_s, 1.0, self.situation);
            remaining_s -= step_s;
        }
        predicted.estimate()
    }
}

/// Indices of the variance of the position, its covariance with the speed, and the variance of the
/// speed.
const COVARIANCES: [(usize, usize); 3] = [(0, 0), (0, 1), (1, 1)];

/// Returns the rate of leaving the mode with the index `from` (1/s), whose rates of switching are
/// `rates_per_s`.
fn leaving_per_s(rates_per_s: &[f64; MODES], from: usize) -> f64 {
    (0..MODES).filter(|other| *other != from).map(|other| rates_per_s[other]).sum()
}

/// Returns the probability that the mode with the index `from` goes on for a step of `step_s`.
fn staying_probability(rates_per_s: &[f64; MODES], from: usize, step_s: f64) -> f64 {
    maths::exp(-leaving_per_s(rates_per_s, from) * step_s)
}

/// Returns the probabilities that the mode changes from the index `from` to each mode in a step, in
/// which it goes on with the probability `stays`. At most one switch per step is considered.
fn transition_probabilities(rates_per_s: &[f64; MODES], from: usize, stays: f64) -> [f64; MODES] {
    let leaving_per_s = leaving_per_s(rates_per_s, from);
    std::array::from_fn(|to| {
        if from == to {
            stays
        } else if leaving_per_s > 0.0 {
            (1.0 - stays) * rates_per_s[to] / leaving_per_s
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests;
