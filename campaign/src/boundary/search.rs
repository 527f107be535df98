//! The points that are run: first points that fill the unit square, then points whose sign is most
//! uncertain.
//!
//! The search knows margins only. Its next points depend on the seed and on the margins so far.

use super::surface::{Surface, Z_95};

/// Number of first runs, which fill the rectangle: ten for each parameter (Loeppky, Sacks and Welch
/// 2009).
pub const START_RUNS: usize = 20;
/// Smallest number of runs: an assumption; ten runs beside the first ones follow a simple boundary.
pub const SMALLEST_BUDGET: u64 = 30;
/// Largest number of runs: the cost of a fit grows with the cube of the number.
pub const LARGEST_BUDGET: u64 = 200;

/// Number of times that the surface is fitted before the last runs.
const ROUNDS: usize = 10;
/// Number of candidates along each parameter.
pub(super) const SIDE: usize = 41;
/// Half the spacing of the numbers of the Sobol sequence, which have 23 bits.
const HALF_CELL: f64 = 1.0 / (1_u32 << 24) as f64;
/// Distance of coordinates below which a candidate is a run.
const SAME: f64 = 1e-9;

/// The margins of points; `None` for a run without one.
pub(super) type Margins = Vec<Option<f64>>;

/// Points of the unit square, and their margins.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Searched {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) margins: Margins,
}

impl Searched {
    /// Returns the surface of the runs that have a margin, and their numbers; `None` if there is no
    /// surface.
    pub(super) fn surface(&self) -> Option<(Surface, Vec<usize>)> {
        let with_margin = self.margins.iter().enumerate().filter_map(|(index, margin)| Some((index, (*margin)?)));
        let (indices, margins): (Vec<usize>, Vec<f64>) = with_margin.unzip();
        let points: Vec<[f64; 2]> = indices.iter().map(|index| self.points[*index]).collect();
        Some((Surface::fit(&points, &margins)?, indices))
    }
}

/// Returns point `index` of a Sobol sequence that is scrambled with this number.
fn sobol(index: usize, scramble: u32) -> [f64; 2] {
    #[expect(clippy::cast_possible_truncation, reason = "at most 200 points")]
    let at = |dimension| f64::from(sobol_burley::sample(index as u32, dimension, scramble)) + HALF_CELL;
    [at(0), at(1)]
}

/// Returns the coordinates of a grid along one parameter, both ends included.
pub(super) fn coordinates(count: usize) -> impl Iterator<Item = f64> + Clone {
    (0..count).map(move |index| index as f64 / (count - 1) as f64)
}

/// Returns the candidates: a grid of the unit square, the second coordinate changing fastest.
pub(super) fn grid() -> Vec<[f64; 2]> {
    coordinates(SIDE).flat_map(|x| coordinates(SIDE).map(move |y| [x, y])).collect()
}

/// Runs up to `budget` points of the unit square. `evaluate` returns the margins of points, or
/// `None` to end the search without a result.
///
/// # Errors
/// The error of `evaluate`.
pub(super) fn search<E>(
    budget: usize,
    scramble: u32,
    mut evaluate: impl FnMut(&[[f64; 2]]) -> Result<Option<Margins>, E>,
) -> Result<Option<Searched>, E> {
    let mut searched = Searched::default();
    let mut next: Vec<[f64; 2]> = (0..START_RUNS.min(budget)).map(|index| sobol(index, scramble)).collect();
    let each_round = budget.saturating_sub(START_RUNS).div_ceil(ROUNDS);
    while !next.is_empty() {
        let Some(margins) = evaluate(&next)? else { return Ok(None) };
        searched.points.append(&mut next);
        searched.margins.extend(margins);
        let (done, count) = (searched.points.len(), each_round.min(budget.saturating_sub(searched.points.len())));
        if count > 0 {
            next = match searched.surface() {
                Some((surface, _)) => straddling(surface, &searched.points, count),
                // Without a surface no sign is more uncertain than another one.
                None => (done..done + count).map(|index| sobol(index, scramble)).collect(),
            };
        }
    }
    Ok(Some(searched))
}

/// Returns the points whose sign is most uncertain: 1.96 standard deviations less the distance of
/// the mean from 0 are largest (Bryan et al. 2005). Each point is believed to have the predicted
/// margin before the next one is chosen (Ginsbourger, Le Riche and Carraro 2010).
fn straddling(mut surface: Surface, points: &[[f64; 2]], count: usize) -> Vec<[f64; 2]> {
    let is_run = |candidate: &[f64; 2]| {
        points.iter().any(|point| (0..2).all(|axis| (point[axis] - candidate[axis]).abs() < SAME))
    };
    let mut candidates: Vec<[f64; 2]> = grid().into_iter().filter(|candidate| !is_run(candidate)).collect();
    let mut chosen = Vec::new();
    for _ in 0..count.min(candidates.len()) {
        let straddle = surface.predict(&candidates).into_iter().map(|at| Z_95 * at.sd - at.mean.abs());
        let largest = straddle.enumerate().reduce(|best, next| if next.1 > best.1 { next } else { best });
        let Some((index, _)) = largest else { break };
        let point = candidates.remove(index);
        surface = surface.believing(point);
        chosen.push(point);
    }
    chosen
}

#[cfg(test)]
pub(super) mod tests {
    use closecall_traffic::maths;

    use super::*;

    /// A margin over the unit square.
    pub(in crate::boundary) type Margin = fn(f64, f64) -> f64;

    /// Runs the points of a margin that is known.
    pub(in crate::boundary) fn searched(margin: Margin, budget: usize, scramble: u32) -> Searched {
        let evaluate = |points: &[[f64; 2]]| {
            Ok::<_, std::convert::Infallible>(Some(points.iter().map(|[x, y]| Some(margin(*x, *y))).collect()))
        };
        search(budget, scramble, evaluate).unwrap().unwrap()
    }

    #[test]
    fn later_points_lie_near_the_boundary_and_no_point_is_run_twice() {
        let distance: Margin = |x, y| maths::hypot(x - 0.5, y - 0.5) - 0.3;
        let searched = searched(distance, 60, 7);
        assert_eq!(searched.points.len(), 60);
        let near = |points: &[[f64; 2]]| points.iter().filter(|[x, y]| distance(*x, *y).abs() < 0.1).count();
        let (first, later) = (near(&searched.points[..START_RUNS]), near(&searched.points[START_RUNS..]));
        assert!(later > 20 && later as f64 / 40.0 > 1.5 * first as f64 / 20.0, "{first} of 20, {later} of 40");
        for (index, point) in searched.points.iter().enumerate() {
            assert!(!searched.points[..index].contains(point), "{point:?}");
        }
    }

    #[test]
    fn the_seed_determines_the_points() {
        let margin: Margin = |x, y| x - y;
        assert_eq!(searched(margin, 30, 3), searched(margin, 30, 3));
        assert_ne!(searched(margin, 30, 3).points, searched(margin, 30, 4).points);
    }

    #[test]
    fn runs_without_a_margin_are_no_part_of_the_surface_and_are_not_repeated() {
        let evaluate = |points: &[[f64; 2]]| {
            let margin = |[x, y]: &[f64; 2]| (*x < 0.5).then_some(y - 0.5);
            Ok::<_, std::convert::Infallible>(Some(points.iter().map(margin).collect()))
        };
        let searched = search(40, 1, evaluate).unwrap().unwrap();
        let (_, indices) = searched.surface().unwrap();
        assert!(indices.iter().all(|index| searched.points[*index][0] < 0.5));
        assert!(indices.len() < 40);
        let none = |points: &[[f64; 2]]| Ok::<_, std::convert::Infallible>(Some(vec![None; points.len()]));
        let searched = search(40, 1, none).unwrap().unwrap();
        assert!(searched.points.len() == 40 && searched.surface().is_none());
        let ended = search(40, 1, |_: &[[f64; 2]]| Ok::<_, std::convert::Infallible>(None)).unwrap();
        assert!(ended.is_none());
    }
}
