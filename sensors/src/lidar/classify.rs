//! The classification of a box by its shape alone.
//!
//! Bayes' rule combines independent normal likelihoods of width, height and length. The likelihoods
//! allow for what a scan can show at the distance of the box: far away, a footprint is as high as a
//! car, and the outermost columns may be lost. The background class covers objects that are beside
//! the carriageway, return too little light, or are too low or too thin.

use closecall_traffic::{ClassScores, VehicleClass, maths};

use super::LaneGeometry;
use super::boxes::BoxFit;
use super::parts::ends_at_plate;
use crate::tracking::Gaussian;

/// The prior and the size distribution of a class.
struct ClassModel {
    /// Prior probability.
    prior: f64,
    /// Width (m).
    width_m: Gaussian,
    /// Height (m).
    height_m: Gaussian,
    /// Length (m).
    length_m: Gaussian,
}

/// Car, truck, motorcycle and background. The sizes are typical of European roads, the priors are
/// shares in motorway traffic (assumptions).
const CLASS_MODELS: [ClassModel; 4] = [
    ClassModel {
        prior: 0.60,
        width_m: Gaussian::new(1.83, 0.12),
        height_m: Gaussian::new(1.55, 0.25),
        length_m: Gaussian::new(4.5, 0.5),
    },
    ClassModel {
        prior: 0.20,
        width_m: Gaussian::new(2.50, 0.12),
        height_m: Gaussian::new(3.60, 0.50),
        length_m: Gaussian::new(13.0, 4.0),
    },
    ClassModel {
        prior: 0.10,
        width_m: Gaussian::new(0.70, 0.20),
        height_m: Gaussian::new(1.50, 0.20),
        length_m: Gaussian::new(2.2, 0.2),
    },
    ClassModel {
        prior: 0.10,
        width_m: Gaussian::new(1.00, 1.50),
        height_m: Gaussian::new(0.70, 0.60),
        length_m: Gaussian::new(6.0, 10.0),
    },
];
/// Distance from which the upper part of a vehicle may be missed entirely (m).
const LOST_TOP_M: f64 = 100.0;
/// Distance beyond the road's edge from which only background is expected (m).
const VERGE_M: f64 = 0.3;
/// Width of the transition to that region (m).
const VERGE_SOFTNESS_M: f64 = 0.2;
/// Factor on the odds of background well beside the carriageway.
const VERGE_ODDS: f64 = 1e4;
/// Mean intensity below which a cluster is probably spray.
const FAINT_INTENSITY: f64 = 0.03;
/// Distance up to which clusters are checked for spray (m).
const FAINT_REACH_M: f64 = 20.0;
/// Factor on the odds of background for a cluster of such low intensity.
const FAINT_ODDS: f64 = 30.0;
/// Factor on the odds of a motorcycle for a cluster with a plate (assumption): in front,
/// motorcycles have none in most states of Europe (the United Kingdom forbids it since 2001).
const MOTORCYCLE_PLATE_ODDS: f64 = 0.02;
/// Minimum score of each class, because shape alone cannot rule out a class.
const MIN_SCORE: f64 = 0.005;

/// Returns the typical length and width of a vehicle class (m), which replace the extents that are
/// not seen.
pub(crate) fn typical_size_m(class: usize) -> [f64; 2] {
    [CLASS_MODELS[class].length_m.mean, CLASS_MODELS[class].width_m.mean]
}

/// Returns the class scores of a fitted box. `width_seen` is true if both lateral edges were in
/// view.
pub(crate) fn class_scores(fit: &BoxFit, width_seen: bool, lane: &LaneGeometry) -> ClassScores {
    let mut logs = [0.0; 4];
    for (log, model) in logs.iter_mut().zip(&CLASS_MODELS) {
        *log = maths::ln(model.prior)
            + width_log(fit, model, width_seen && !ends_at_plate(fit))
            + height_log(fit, model)
            + length_log(fit, model);
    }
    logs[ClassScores::BACKGROUND] += background_log(fit, lane);
    if fit.plate_m.is_some() {
        logs[VehicleClass::Motorcycle as usize] += maths::ln(MOTORCYCLE_PLATE_ODDS);
    }
    let max = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut scores = logs.map(|log| maths::exp(log - max));
    let sum: f64 = scores.iter().sum();
    for score in &mut scores {
        *score = MIN_SCORE + (1.0 - 4.0 * MIN_SCORE) * *score / sum;
    }
    ClassScores(scores)
}

/// Returns the logarithm of a normal density, up to a constant.
fn normal_log(deviation: f64, sd: f64) -> f64 {
    -0.5 * (deviation / sd).powi(2) - maths::ln(sd)
}

/// Returns the log likelihood of the visible width.
fn width_log(fit: &BoxFit, model: &ClassModel, seen: bool) -> f64 {
    let Gaussian { mean: width, sd } = model.width_m;
    let seen_m = fit.width_m() + 0.5 * fit.spacing_m;
    let sd = maths::hypot(sd, 0.7 * fit.spacing_m);
    // A hidden edge, or one lost to weak returns, only makes a vehicle look narrower.
    let lost = if seen { fit.spacing_m } else { width };
    if seen_m < width { normal_log(width - seen_m, maths::hypot(sd, lost)) } else { normal_log(seen_m - width, sd) }
}

/// Returns the log likelihood of the visible height.
fn height_log(fit: &BoxFit, model: &ClassModel) -> f64 {
    let Gaussian { mean: height, sd } = model.height_m;
    let half_layer = 0.5 * fit.layer_m();
    let expected = height.min(fit.in_view_m - half_layer);
    let sd = maths::hypot(maths::hypot(sd, half_layer), 0.1);
    // From afar a single layer may hit the vehicle, and the upper part of a car is glass, which
    // returns little light.
    let lost = height * (fit.range_m / LOST_TOP_M).min(1.0);
    let deviation = fit.top_m - expected;
    // Neither branch is normalised: a class is not penalised because its top can be lost more
    // easily.
    if deviation < 0.0 { -0.5 * (deviation / maths::hypot(sd, lost)).powi(2) } else { -0.5 * (deviation / sd).powi(2) }
}

/// Returns the log likelihood of the visible length. Only a length in excess of the class's counts,
/// since a box is at least as long as its visible part.
fn length_log(fit: &BoxFit, model: &ClassModel) -> f64 {
    let Gaussian { mean: length, sd } = model.length_m;
    let excess = (fit.length_m() - length).max(0.0);
    -0.5 * (excess / maths::hypot(sd, 0.3)).powi(2)
}

/// Returns the additional log odds of background, from the lateral position and the intensity.
fn background_log(fit: &BoxFit, lane: &LaneGeometry) -> f64 {
    let (sin, cos) = maths::sin_cos(fit.heading_rad);
    let mean_v = 0.5 * (fit.across_m[0] + fit.across_m[1]);
    let (x, y) = (fit.front_u_m * cos - mean_v * sin, fit.front_u_m * sin + mean_v * cos);
    let left = y - lane.path_y_m(x);
    let beyond = (left - lane.edges_m[0]).max(lane.edges_m[1] - left) - VERGE_M;
    let beside = maths::ln(VERGE_ODDS) / (1.0 + maths::exp(-beyond / VERGE_SOFTNESS_M));
    let faint = fit.range_m < FAINT_REACH_M && fit.intensity < FAINT_INTENSITY;
    beside + if faint { maths::ln(FAINT_ODDS) } else { 0.0 }
}
