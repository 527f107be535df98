//! Posterior predictive checks: the predictions of a population of calibrated drivers for held-out
//! recordings.

use closecall_recorded::following::FollowingPair;
use closecall_traffic::statistics::quantiles::quantile;
use rayon::prelude::*;

use super::calibrate::PairResult;
use super::follower::{FollowingModel, simulate};

/// Probabilities of the compared quantiles (-).
pub(super) const PROBABILITIES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];
/// Probability of the predictive band (-).
const BAND: f64 = 0.9;
/// Speed below which a time headway says nothing (m/s).
const MIN_SPEED_MPS: f64 = 2.0;
/// Largest number of drivers of the population.
const MAX_DRIVERS: usize = 100;

/// The predictions of the population, beside the recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Predictive {
    /// Number of drivers in the population.
    pub drivers: usize,
    /// Probabilities of the quantiles (-).
    pub probabilities: [f64; 5],
    /// Quantiles of the recorded time headways, gap over speed, above 2 m/s (s).
    pub recorded_s: [f64; 5],
    /// Quantiles of the simulated ones (s).
    pub simulated_s: [f64; 5],
    /// Share of the instants whose recorded gap lies between the 5th and the 95th percentile of the
    /// simulated gaps (-). If the population describes the recordings, it is about 0.9.
    pub coverage: f64,
}

impl Predictive {
    /// Simulates each pair with the parameters of every calibrated driver. Returns `None` without
    /// pairs or drivers.
    pub(super) fn of(model: FollowingModel, drivers: &[PairResult], pairs: &[&FollowingPair]) -> Option<Self> {
        let drivers = &drivers[..drivers.len().min(MAX_DRIVERS)];
        if drivers.is_empty() || pairs.is_empty() {
            return None;
        }
        let of_pair: Vec<PairPrediction> = pairs.par_iter().map(|pair| predict(model, drivers, pair)).collect();
        let (mut recorded, mut simulated, mut covered, mut instants) = (Vec::new(), Vec::new(), 0, 0);
        for pair in of_pair {
            recorded.extend(pair.recorded_s);
            simulated.extend(pair.simulated_s);
            covered += pair.covered;
            instants += pair.instants;
        }
        if recorded.is_empty() || simulated.is_empty() {
            return None;
        }
        Some(Self {
            drivers: drivers.len(),
            probabilities: PROBABILITIES,
            recorded_s: quantiles_of(recorded),
            simulated_s: quantiles_of(simulated),
            coverage: f64::from(covered) / f64::from(instants),
        })
    }
}

struct PairPrediction {
    recorded_s: Vec<f64>,
    simulated_s: Vec<f64>,
    covered: u32,
    instants: u32,
}

fn predict(model: FollowingModel, drivers: &[PairResult], pair: &FollowingPair) -> PairPrediction {
    let mut gaps_m: Vec<Vec<f64>> = vec![Vec::with_capacity(drivers.len()); pair.instants.len()];
    let mut simulated_s = Vec::new();
    for driver in drivers {
        simulate(model, &driver.values, pair, |index, simulated| {
            gaps_m[index].push(simulated.gap_m);
            if simulated.speed_mps > MIN_SPEED_MPS {
                simulated_s.push(simulated.gap_m / simulated.speed_mps);
            }
        });
    }
    let moving = pair.instants.iter().filter(|instant| instant.follower_mps > MIN_SPEED_MPS);
    let recorded_s = moving.map(|instant| instant.gap_m() / instant.follower_mps).collect();
    let (mut covered, mut instants) = (0, 0);
    // All simulations begin at the recorded gap, and the first instant says nothing.
    for (mut gaps_m, instant) in gaps_m.into_iter().zip(&pair.instants).skip(1) {
        gaps_m.sort_by(f64::total_cmp);
        let [low_m, high_m] = [0.5 - 0.5 * BAND, 0.5 + 0.5 * BAND].map(|u| quantile(&gaps_m, u));
        covered += u32::from((low_m..=high_m).contains(&instant.gap_m()));
        instants += 1;
    }
    PairPrediction { recorded_s, simulated_s, covered, instants }
}

fn quantiles_of(mut values: Vec<f64>) -> [f64; 5] {
    values.sort_by(f64::total_cmp);
    PROBABILITIES.map(|u| quantile(&values, u))
}
