//! The split of the pairs, and the calibrations.

use std::sync::atomic::{AtomicU64, Ordering};

use closecall_recorded::following::{FollowingData, FollowingPair};
use rayon::prelude::*;

use super::follower::{FollowingModel, simulate, squared_error};
use super::optimise::minimise;
use super::predictive::Predictive;

/// Number of held-out pairs of every ten.
const HELD_OUT_OF_TEN: u8 = 3;

/// Errors of the gap over some pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Number of pairs.
    pub pairs: usize,
    /// Root mean square error of the gap over all instants (m).
    pub rmse_m: f64,
    /// Relative error √(⟨Δs²/s⟩/⟨s⟩) (-): the mixed measure of Kesting and Treiber, *Calibrating
    /// Car-Following Models by Using Trajectory Data*, Transportation Research Record 2088 (2008),
    /// who report 11 to 29 % for several models.
    pub relative: f64,
}

/// The calibration of one pair.
#[derive(Clone, Debug, PartialEq)]
pub struct PairResult {
    /// Name of the pair.
    pub name: String,
    /// Values of the model's parameters, in the order of [`FollowingModel::parameters`].
    pub values: Vec<f64>,
    /// Root mean square error of the gap (m).
    pub rmse_m: f64,
}

/// The result of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The model.
    pub model: FollowingModel,
    /// The pairs of the calibration, each with its own parameters.
    pub pairs: Vec<PairResult>,
    /// Names of the held-out pairs.
    pub held_out: Vec<String>,
    /// One set of values for all pairs of the calibration together.
    pub pooled: Vec<f64>,
    /// Errors of the single sets on their own pairs.
    pub errors_of_single: Errors,
    /// Errors of the pooled set on the pairs of the calibration.
    pub errors_of_pooled: Errors,
    /// Errors of the pooled set on the held-out pairs; `None` if none is held out.
    pub errors_of_held_out: Option<Errors>,
    /// The predictions of the population of single sets for the held-out pairs.
    pub predictive: Option<Predictive>,
}

/// Returns true if a pair is held out. The hash of its name decides: a file always gives the same
/// split.
fn is_held_out(pair: &FollowingPair) -> bool {
    let hash = closecall_recorded::following::name_hash(&pair.name);
    hash % 10 < HELD_OUT_OF_TEN
}

/// Calibrates a model. Returns `None` if no pair is left for the calibration.
pub fn calibrate(model: FollowingModel, data: &FollowingData) -> Option<Calibration> {
    calibrate_watched(model, data, &|_| ())
}

/// Works like [`calibrate`]. `on_progress` receives the number of fits that are done, and of all:
/// one of each pair, and the pooled one, which counts as one of each pair.
pub fn calibrate_watched(
    model: FollowingModel,
    data: &FollowingData,
    on_progress: &(dyn Fn([u64; 2]) + Sync),
) -> Option<Calibration> {
    let (held_out, used): (Vec<&FollowingPair>, Vec<&FollowingPair>) =
        data.pairs.iter().partition(|pair| is_held_out(pair));
    if used.is_empty() {
        return None;
    }
    let dimensions = model.parameters().len();
    let (all, done) = (2 * used.len() as u64, AtomicU64::new(0));
    let pairs: Vec<PairResult> = used
        .par_iter()
        .map(|pair| {
            let (point, rmse_m) = minimise(dimensions, |point| rmse_m(model, &model.values(point), &[pair]));
            on_progress([done.fetch_add(1, Ordering::Relaxed) + 1, all]);
            PairResult { name: pair.name.clone(), values: model.values(&point), rmse_m }
        })
        .collect();
    let (point, _) = minimise(dimensions, |point| rmse_m(model, &model.values(point), &used));
    on_progress([all, all]);
    let pooled = model.values(&point);
    let single = |pair: &&FollowingPair| {
        let result = pairs.iter().find(|result| result.name == pair.name);
        result.map(|result| result.values.clone()).unwrap_or_default()
    };
    Some(Calibration {
        errors_of_single: errors(model, single, &used),
        errors_of_pooled: errors(model, |_| pooled.clone(), &used),
        errors_of_held_out: (!held_out.is_empty()).then(|| errors(model, |_| pooled.clone(), &held_out)),
        predictive: Predictive::of(model, &pairs, &held_out),
        model,
        held_out: held_out.iter().map(|pair| pair.name.clone()).collect(),
        pooled,
        pairs,
    })
}

/// Returns the root mean square error of the gap over all instants of the pairs (m).
fn rmse_m(model: FollowingModel, values: &[f64], pairs: &[&FollowingPair]) -> f64 {
    let sums = pairs.iter().map(|pair| squared_error(model, values, pair));
    let (sum, count) = sums.fold((0.0, 0), |all, pair| (all.0 + pair.0, all.1 + pair.1));
    (sum / count as f64).sqrt()
}

fn errors(model: FollowingModel, values: impl Fn(&&FollowingPair) -> Vec<f64>, pairs: &[&FollowingPair]) -> Errors {
    let (mut squares, mut weighted, mut gaps, mut count) = (0.0, 0.0, 0.0, 0.0);
    for pair in pairs {
        simulate(model, &values(pair), pair, |index, simulated| {
            let gap_m = pair.instants[index].gap_m();
            let square = (simulated.gap_m - gap_m).powi(2);
            squares += square;
            weighted += square / gap_m;
            gaps += gap_m;
            count += 1.0;
        });
    }
    Errors { pairs: pairs.len(), rmse_m: f64::sqrt(squares / count), relative: f64::sqrt(weighted / gaps) }
}

#[cfg(test)]
mod tests;
