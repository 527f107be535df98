//! Functions of the unit cube with known indices.

use crate::maths;
use std::f64::consts::PI;

/// T. Ishigami and T. Homma, *An importance quantification technique in uncertainty analysis for
/// computer models*, ISUMA 1990, with a = 7 and b = 0.1.
pub(super) fn ishigami(u: &[f64]) -> f64 {
    let x: Vec<f64> = u.iter().map(|u| PI * (2.0 * u - 1.0)).collect();
    maths::sin(x[0]) + A * maths::sin(x[1]).powi(2) + B * x[2].powi(4) * maths::sin(x[0])
}

const A: f64 = 7.0;
const B: f64 = 0.1;

/// Returns the first-order and the total index of each factor of Ishigami's function.
pub(super) fn ishigami_indices() -> Vec<[f64; 2]> {
    let v1 = 0.5 * (1.0 + B * PI.powi(4) / 5.0).powi(2);
    let v2 = A * A / 8.0;
    let v13 = B * B * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
    let v = v1 + v2 + v13;
    vec![[v1 / v, (v1 + v13) / v], [v2 / v, v2 / v], [0.0, v13 / v]]
}

/// Coefficients of Sobol's g-function: the smaller, the more a factor matters.
const G: [f64; 5] = [0.0, 0.5, 3.0, 9.0, 99.0];

/// Sobol's g-function (A. Saltelli and I. M. Sobol', Reliability Engineering & System Safety 50
/// (1995) 225–239).
pub(super) fn g_function(u: &[f64]) -> f64 {
    u.iter().zip(G).map(|(u, a)| ((4.0 * u - 2.0).abs() + a) / (1.0 + a)).product()
}

/// Returns the first-order and the total index of each factor of the g-function.
pub(super) fn g_indices() -> Vec<[f64; 2]> {
    let parts = G.map(|a| 1.0 / (3.0 * (1.0 + a).powi(2)));
    let v: f64 = parts.iter().map(|part| 1.0 + part).product::<f64>() - 1.0;
    parts.iter().map(|part| [part / v, part * (v + 1.0) / (1.0 + part) / v]).collect()
}

/// Bounds below which each factor must lie for the event.
const EDGES: [f64; 3] = [0.3, 0.6, 0.9];

/// An event: 1 if every factor lies below its bound. A fourth factor has no influence.
pub(super) fn event(u: &[f64]) -> f64 {
    if u.iter().zip(EDGES).all(|(u, edge)| *u < edge) { 1.0 } else { 0.0 }
}

/// Returns the first-order and the total index of each factor of the event.
pub(super) fn event_indices() -> Vec<[f64; 2]> {
    let p: f64 = EDGES.iter().product();
    let v = p * (1.0 - p);
    let indices = |edge: &f64| [p * p * (1.0 / edge - 1.0) / v, p / edge * edge * (1.0 - edge) / v];
    EDGES.iter().map(indices).chain([[0.0, 0.0]]).collect()
}
