//! Elementary effects: a screening of many factors with few runs.
//!
//! ```text
//!   trajectory:  x₀ ──▶ x₁ ──▶ x₂ ──▶ … ──▶ x_k     one factor moves at each step, by half of its range, up or down
//!   elementary effect of the factor that moves:  d = (y_high − y_low) / ½
//!   μ = mean of d     μ* = mean of |d|     σ = standard deviation of d (interactions, curvature)
//! ```
//!
//! Morris's grid has p levels for each factor and steps of p/(2(p − 1)), half of the levels. Here a
//! level is one of p equally probable parts of the factor, and each trajectory lies at a random
//! place within its parts. On Morris's own grid, a value that occurs only beyond the outermost
//! level would never be seen: for example a label with a probability of a tenth.

use rand::{Rng, RngExt};

use super::jackknife::{Estimate, magnitude};

/// Number of levels p of the grid, as in Morris's and Campolongo's examples: an even number.
const LEVELS: usize = 4;
/// Length of a step in the unit cube.
const STEP: f64 = 0.5;

/// The design: trajectories through the unit cube.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectories {
    factors: usize,
    trajectories: Vec<Trajectory>,
}

/// One trajectory: a start, and the order in which the factors move.
#[derive(Clone, Debug, PartialEq)]
struct Trajectory {
    /// The lower of the two values of each factor.
    low: Vec<f64>,
    /// Whether each factor starts at its higher value.
    starts_high: Vec<bool>,
    /// The factors, in the order in which they move.
    order: Vec<usize>,
}

/// The elementary effects of one factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Effects {
    /// μ: mean of the effects; `None` of no effects.
    pub mu: Option<f64>,
    /// μ*: mean of the magnitudes of the effects, with its interval; `None` of fewer than two
    /// effects.
    pub mu_star: Option<Estimate>,
    /// σ: standard deviation of the effects; `None` of fewer than two effects.
    pub sigma: Option<f64>,
    /// Number of effects.
    pub effects: usize,
    /// Number of effects that are missing, since a run at one of their ends has no output.
    pub missing: usize,
}

impl Trajectories {
    /// Draws `count` trajectories.
    pub fn new(factors: usize, count: usize, rng: &mut impl Rng) -> Self {
        let mut trajectory = || {
            let level = |rng: &mut _| RngExt::random_range(rng, 0..LEVELS / 2) as f64;
            let low = (0..factors).map(|_| (level(rng) + rng.random::<f64>()) / LEVELS as f64).collect();
            let starts_high = (0..factors).map(|_| rng.random()).collect();
            let mut order: Vec<usize> = (0..factors).collect();
            for last in (1..factors).rev() {
                order.swap(last, rng.random_range(0..=last));
            }
            Trajectory { low, starts_high, order }
        };
        Self { factors, trajectories: (0..count).map(|_| trajectory()).collect() }
    }

    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.trajectories.len() * (self.factors + 1)
    }

    /// Returns true if there is no point.
    pub fn is_empty(&self) -> bool {
        self.trajectories.is_empty()
    }

    /// Returns a point. The points of a trajectory follow each other.
    ///
    /// # Panics
    /// Panics if `index` is not below [`Self::len`].
    pub fn point(&self, index: usize) -> Vec<f64> {
        let (trajectory, step) = (&self.trajectories[index / (self.factors + 1)], index % (self.factors + 1));
        let mut is_high = trajectory.starts_high.clone();
        for &factor in &trajectory.order[..step] {
            is_high[factor] = !is_high[factor];
        }
        let value = |(low, is_high): (&f64, bool)| if is_high { low + STEP } else { *low };
        trajectory.low.iter().zip(is_high).map(value).collect()
    }

    /// Returns the effects of every factor. `outputs` are the outputs of the points, `None` where a
    /// run has no output.
    ///
    /// # Panics
    /// Panics if there are fewer outputs than points.
    pub fn effects(&self, outputs: &[Option<f64>]) -> Vec<Effects> {
        let mut by_factor: Vec<(Vec<f64>, usize)> = vec![(Vec::new(), 0); self.factors];
        for (number, trajectory) in self.trajectories.iter().enumerate() {
            let first = number * (self.factors + 1);
            for (step, &factor) in trajectory.order.iter().enumerate() {
                let (effects, missing) = &mut by_factor[factor];
                match (outputs[first + step], outputs[first + step + 1]) {
                    (Some(before), Some(after)) => {
                        let [low, high] =
                            if trajectory.starts_high[factor] { [after, before] } else { [before, after] };
                        effects.push((high - low) / STEP);
                    }
                    _ => *missing += 1,
                }
            }
        }
        by_factor.into_iter().map(|(effects, missing)| Effects::of(&effects, missing)).collect()
    }
}

impl Effects {
    fn of(effects: &[f64], missing: usize) -> Self {
        let count = effects.len() as f64;
        let mu = (!effects.is_empty()).then(|| effects.iter().sum::<f64>() / count);
        let magnitudes: Vec<f64> = effects.iter().map(|effect| effect.abs()).collect();
        let squares = |mu: f64| effects.iter().map(|effect| (effect - mu).powi(2)).sum::<f64>();
        let sigma = mu.filter(|_| effects.len() > 1).map(|mu| (squares(mu) / (count - 1.0)).sqrt());
        Self { mu, mu_star: magnitude(&magnitudes), sigma, effects: effects.len(), missing }
    }
}
