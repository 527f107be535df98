//! The optimiser: the method of Nelder and Mead (crate argmin) from several starts of a
//! low-discrepancy sequence.
//!
//! The method needs no derivative: Wiedemann 99 has none at the thresholds of its regimes. After it
//! has converged, it starts again with a new simplex around the best point, until that gains
//! nothing. Everything is deterministic.

use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::neldermead::NelderMead;
use closecall_scenarios::sampling::unit_point;
use rayon::prelude::*;

/// Number of points at which the cost is evaluated to find the starts, for each dimension.
const SCREENED_PER_DIMENSION: u32 = 100;
/// Number of starts.
const STARTS: usize = 12;
/// Size of a new simplex, as a share of the range of each parameter (-).
const SIMPLEX_SHARES: [f64; 3] = [0.15, 0.05, 0.02];
/// Largest number of iterations from one simplex, for each dimension.
const ITERATIONS_PER_DIMENSION: u64 = 100;
/// Spread of the costs in a simplex at which it has converged (m).
const TOLERANCE: f64 = 1e-6;
/// Cost added for each unit outside of the unit cube (m): far above any error.
const OUTSIDE_COST: f64 = 100.0;

/// A cost on the unit cube.
struct Problem<'a, F>(&'a F);

impl<F: Fn(&[f64]) -> f64> CostFunction for Problem<'_, F> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        let outside: f64 = point.iter().map(|u| (u - u.clamp(0.0, 1.0)).abs()).sum();
        Ok((self.0)(point) + OUTSIDE_COST * outside)
    }
}

/// Returns the point of the unit cube with the smallest cost that was found, and that cost.
pub(super) fn minimise(dimensions: usize, cost: impl Fn(&[f64]) -> f64 + Sync) -> (Vec<f64>, f64) {
    let screened = SCREENED_PER_DIMENSION * u32::try_from(dimensions).unwrap_or(u32::MAX / SCREENED_PER_DIMENSION);
    let mut points: Vec<(Vec<f64>, f64)> = (0..screened)
        .into_par_iter()
        .map(|index| {
            let point = unit_point(index, dimensions);
            let value = cost(&point);
            (point, value)
        })
        .collect();
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points.truncate(STARTS);
    let minima: Vec<(Vec<f64>, f64)> = points.into_par_iter().map(|start| descend(start, &cost)).collect();
    minima.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_else(|| (vec![0.5; dimensions], f64::INFINITY))
}

/// Descends from one start, with smaller and smaller simplices.
fn descend<F: Fn(&[f64]) -> f64>(start: (Vec<f64>, f64), cost: &F) -> (Vec<f64>, f64) {
    let mut best = start;
    for share in SIMPLEX_SHARES {
        let Some(next) = from_simplex(&best.0, share, cost) else { break };
        if next.1 < best.1 {
            best = next;
        }
    }
    best.0.iter_mut().for_each(|u| *u = u.clamp(0.0, 1.0));
    let value = cost(&best.0);
    (best.0, value)
}

/// Runs the method of Nelder and Mead from a simplex around `point`. Returns `None` if the
/// optimiser fails.
fn from_simplex<F: Fn(&[f64]) -> f64>(point: &[f64], share: f64, cost: &F) -> Option<(Vec<f64>, f64)> {
    let mut simplex = vec![point.to_vec()];
    for index in 0..point.len() {
        let mut corner = point.to_vec();
        // Towards the middle of the cube, so that the simplex does not begin outside of it.
        corner[index] += if corner[index] > 0.5 { -share } else { share };
        simplex.push(corner);
    }
    let solver = NelderMead::new(simplex).with_sd_tolerance(TOLERANCE).ok()?;
    let iterations = ITERATIONS_PER_DIMENSION * point.len() as u64;
    let result = Executor::new(Problem(cost), solver).configure(|state| state.max_iters(iterations)).run().ok()?;
    let state = result.state();
    Some((state.get_best_param()?.clone(), state.get_best_cost()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimum_of_a_curved_valley_is_found_and_found_again() {
        // Rosenbrock's function with its minimum at (0.7, 0.49).
        let cost = |p: &[f64]| 100.0 * (p[1] - p[0] * p[0]).powi(2) + (0.7 - p[0]).powi(2);
        let (point, value) = minimise(2, cost);
        // Along the valley the cost grows with the square of the distance.
        assert!(value < TOLERANCE && (point[0] - 0.7).abs() < TOLERANCE.sqrt(), "{point:?} {value}");
        assert_eq!(minimise(2, cost), (point, value));
    }

    #[test]
    fn a_minimum_outside_of_the_cube_ends_at_its_edge() {
        let (point, _) = minimise(3, |p: &[f64]| p.iter().map(|u| (u - 2.0).powi(2)).sum());
        assert!(point.iter().all(|u| *u > 0.99 && *u <= 1.0), "{point:?}");
    }
}
