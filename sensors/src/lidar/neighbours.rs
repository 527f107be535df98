//! An exact search for neighbours on a grid, as an index of `linfa-nn`.
//!
//! ```text
//!   ┌───┬───┬───┬───┐
//!   │   │▒▒▒│▒▒▒│▒▒▒│    The neighbours of a point lie in at most nine cells (▒),
//!   ├───┼───┼───┼───┤    whose sides are as long as the radius.
//!   │   │▒▒▒│▒•▒│▒▒▒│    The points are sorted by cell, column by column,
//!   ├───┼───┼───┼───┤    so that each column is one run of points.
//!   │   │▒▒▒│▒▒▒│▒▒▒│
//!   └───┴───┴───┴───┘
//! ```
//!
//! The searches of `linfa-nn` differ at the edge of the radius. A k-d tree returns the points that
//! lie exactly at the radius, while the linear search and the ball tree leave them out (version
//! 0.8.1). This index returns them: the definition of DBSCAN does (Ester et al. 1996), and so does
//! scikit-learn. `linfa-clustering` counts all points that the index returns.
//!
//! The index keeps the coordinates beside the views that `linfa-nn` requires. Distances between
//! views would make the clustering slower by two fifths.

use std::ops::Range;

use linfa::Float;
use linfa_nn::distance::Distance;
use linfa_nn::{BuildError, NearestNeighbour, NearestNeighbourIndex, NnError};
use ndarray::{ArrayBase, ArrayView1, ArrayView2, Axis, Data, Ix2, aview1};

/// Maximum number of cells along each axis. Points that are spread wider get larger cells.
const MAX_CELLS: f64 = 256.0;
/// Number of points that a query tests together.
const BLOCK: usize = 32;
/// Share by which the cells of a query reach beyond its radius, so that rounding hides no point.
const ROUNDING: f64 = 1e-5;

/// The search on a grid, for points in the plane and `L2Dist`. It is fast if the radius of a query
/// is about the side of a cell.
#[derive(Clone, Debug)]
pub(crate) struct GridSearch {
    /// Side of a cell, in the unit of the points.
    pub(crate) cell: f64,
}

impl NearestNeighbour for GridSearch {
    /// Sorts the points into the cells. Panics if a point does not have two coordinates.
    fn from_batch_with_leaf_size<'a, F: Float, DT: Data<Elem = F>, D: 'a + Distance<F>>(
        &self,
        batch: &'a ArrayBase<DT, Ix2>,
        leaf_size: usize,
        dist_fn: D,
    ) -> Result<Box<dyn 'a + Send + Sync + NearestNeighbourIndex<F>>, BuildError> {
        if batch.ncols() == 0 {
            return Err(BuildError::ZeroDimension);
        }
        if leaf_size == 0 {
            return Err(BuildError::EmptyLeaf);
        }
        assert_eq!(batch.ncols(), 2, "the points lie in a plane");
        let at = |x: f64, y: f64| [F::cast(x), F::cast(y)];
        debug_assert_eq!(dist_fn.distance(aview1(&at(0.0, 0.0)), aview1(&at(3.0, 4.0))), F::cast(5.0), "not L2Dist");
        Ok(Box::new(Grid::new(batch.view(), self.cell)))
    }
}

/// A set of points, sorted into the square cells of a uniform grid.
struct Grid<'a, F: Float> {
    low: [f64; 2],
    /// Number of cells per unit of length.
    per_unit: f64,
    size: [usize; 2],
    /// Index in `sorted` at which each cell begins, followed by the number of points.
    starts: Vec<u32>,
    /// The points and their rows, in order of the cells.
    sorted: Vec<(ArrayView1<'a, F>, usize)>,
    /// Coordinates of the points, in the same order.
    places: Vec<[f64; 2]>,
}

impl<'a, F: Float> Grid<'a, F> {
    /// Sorts the points into cells with a counting sort.
    fn new(points: ArrayView2<'a, F>, cell: f64) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points.rows() {
            let at = place(point);
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(0.0);
        let per_unit = 1.0 / cell.max(extent / MAX_CELLS);
        let mut grid = Self { low, per_unit, size: [1; 2], starts: Vec::new(), sorted: Vec::new(), places: Vec::new() };
        grid.size = [0, 1].map(|axis| grid.cell_along(high[axis], axis, usize::MAX) + 1);
        grid.sort(points);
        grid
    }

    fn sort(&mut self, points: ArrayView2<'a, F>) {
        let count = points.nrows();
        if count == 0 {
            return;
        }
        let point = |row: usize| points.index_axis_move(Axis(0), row);
        // The start of each cell is one place late, until the points that are sorted into the cell
        // before have moved it.
        self.starts.resize(self.size[0] * self.size[1] + 2, 0);
        for row in 0..count {
            let cell = self.cell(place(point(row)));
            self.starts[cell + 2] += 1;
        }
        for cell in 2..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        self.sorted.resize(count, (point(0), 0));
        self.places.resize(count, [0.0; 2]);
        for row in 0..count {
            let at = place(point(row));
            let next = self.cell(at) + 1;
            let index = self.starts[next] as usize;
            self.sorted[index] = (point(row), row);
            self.places[index] = at;
            self.starts[next] += 1;
        }
    }

    /// Returns the index of the cell along one axis, at most `max`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, NaN gives 0, then clamped")]
    fn cell_along(&self, value: f64, axis: usize, max: usize) -> usize {
        (((value - self.low[axis]) * self.per_unit) as usize).min(max)
    }

    /// Returns the index of the cell that contains a place.
    fn cell(&self, at: [f64; 2]) -> usize {
        let [column, row] = [0, 1].map(|axis| self.cell_along(at[axis], axis, self.size[axis] - 1));
        column * self.size[1] + row
    }

    /// Returns the indices in `sorted` of the points that may lie within `range` of a place: one
    /// run for each column of cells.
    fn runs(&self, at: [f64; 2], range: f64) -> impl Iterator<Item = Range<usize>> + Clone {
        let reach = range * (1.0 + ROUNDING);
        let [columns, rows] = [0, 1].map(|axis| {
            let max = self.size[axis] - 1;
            self.cell_along(at[axis] - reach, axis, max)..=self.cell_along(at[axis] + reach, axis, max)
        });
        columns.map(move |column| {
            let first = self.starts[column * self.size[1] + rows.start()] as usize;
            first..self.starts[column * self.size[1] + rows.end() + 1] as usize
        })
    }
}

/// Returns the coordinates of a point; a missing one is 0.
fn place<F: Float>(point: ArrayView1<'_, F>) -> [f64; 2] {
    [0, 1].map(|axis| point.get(axis).and_then(F::to_f64).unwrap_or(0.0))
}

/// Returns the place of a query, or an error if it does not lie in the plane.
fn query<F: Float>(point: ArrayView1<'_, F>) -> Result<[f64; 2], NnError> {
    if point.len() == 2 { Ok(place(point)) } else { Err(NnError::WrongDimension) }
}

/// Returns the square of the distance of two places.
fn square(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x * x + y * y
}

impl<F: Float> NearestNeighbourIndex<F> for Grid<'_, F> {
    /// Looks at every point: DBSCAN does not ask for the nearest neighbours.
    fn k_nearest(&self, point: ArrayView1<'_, F>, k: usize) -> Result<Vec<(ArrayView1<'_, F>, usize)>, NnError> {
        let at = query(point)?;
        let mut nearest: Vec<_> = self.sorted.iter().map(|&(other, row)| (other.reborrow(), row)).collect();
        nearest.sort_by(|(a, _), (b, _)| square(at, place(*a)).total_cmp(&square(at, place(*b))));
        nearest.truncate(k);
        Ok(nearest)
    }

    fn within_range(&self, point: ArrayView1<'_, F>, range: F) -> Result<Vec<(ArrayView1<'_, F>, usize)>, NnError> {
        let at = query(point)?;
        if self.sorted.is_empty() {
            return Ok(Vec::new());
        }
        let range = range.to_f64().unwrap_or(f64::NAN);
        let limit = range * range;
        let runs = self.runs(at, range);
        let mut within = Vec::with_capacity(runs.clone().map(|run| run.len()).sum());
        for run in runs {
            for (places, points) in self.places[run.clone()].chunks(BLOCK).zip(self.sorted[run].chunks(BLOCK)) {
                // A third of the points are within the range: a branch would be taken at random.
                let (mut near, mut count) = ([0_usize; BLOCK], 0);
                for (index, &other) in places.iter().enumerate() {
                    near[count % BLOCK] = index;
                    count += usize::from(square(at, other) <= limit);
                }
                within.extend(near[..count].iter().map(|&index| (points[index].0.reborrow(), points[index].1)));
            }
        }
        Ok(within)
    }
}

#[cfg(test)]
mod tests {
    use linfa_nn::CommonNearestNeighbour::{self, BallTree, KdTree, LinearSearch};
    use linfa_nn::distance::L2Dist;
    use ndarray::Array2;
    use proptest::prelude::*;

    use super::*;

    /// Returns the rows of the points within `range` of `at`, in order.
    fn within(search: &impl NearestNeighbour, points: &[[f64; 2]], at: [f64; 2], range: f64) -> Vec<usize> {
        let points = ArrayView2::from(points);
        let index = search.from_batch(&points, L2Dist).unwrap();
        let mut rows: Vec<usize> =
            index.within_range(aview1(&at), range).unwrap().into_iter().map(|(_, row)| row).collect();
        rows.sort_unstable();
        rows
    }

    const GRID: GridSearch = GridSearch { cell: 1.0 };

    #[test]
    fn the_searches_differ_at_the_radius() {
        let points = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [0.0, -1.0], [1.5, 0.0]];
        let at_radius = |search: CommonNearestNeighbour| within(&search, &points, [0.0, 0.0], 1.0);
        assert_eq!(within(&GRID, &points, [0.0, 0.0], 1.0), [0, 1, 2, 3]);
        assert_eq!(at_radius(KdTree), [0, 1, 2, 3]);
        assert_eq!(at_radius(LinearSearch), [0, 1]);
        assert_eq!(at_radius(BallTree), [0, 1]);
    }

    #[test]
    fn a_point_that_is_not_finite_is_no_neighbour() {
        let points = [[0.0, 0.0], [f64::NAN, 0.0], [0.5, 0.0], [9.0, f64::NAN]];
        assert_eq!(within(&GRID, &points, [0.0, 0.0], 1.0), [0, 2]);
        assert_eq!(within(&GRID, &points, points[1], 1.0), [0; 0]);
    }

    #[test]
    fn points_without_coordinates_and_queries_with_others_are_refused() {
        assert!(matches!(GRID.from_batch(&Array2::<f64>::zeros((3, 0)), L2Dist), Err(BuildError::ZeroDimension)));
        let points = Array2::<f64>::zeros((3, 2));
        assert!(matches!(GRID.from_batch_with_leaf_size(&points, 0, L2Dist), Err(BuildError::EmptyLeaf)));
        let index = GRID.from_batch(&points, L2Dist).unwrap();
        assert!(matches!(index.within_range(aview1(&[0.0]), 1.0), Err(NnError::WrongDimension)));
        assert!(matches!(index.k_nearest(aview1(&[0.0, 0.0, 0.0]), 1), Err(NnError::WrongDimension)));
    }

    /// Points in whole quarters in half of the cases, so that some lie exactly at a radius of whole
    /// quarters.
    fn points() -> impl Strategy<Value = Vec<[f64; 2]>> {
        let points = prop::collection::vec((-6.0..6.0_f64, -3.0..300.0_f64), 0..200);
        (points, any::<bool>(), prop::sample::select(vec![0.01, 1.0])).prop_map(|(points, in_quarters, stretch)| {
            let place = |value: f64| if in_quarters { (4.0 * value).round() / 4.0 } else { value };
            points.into_iter().map(|(x, y)| [place(x), place(y * stretch)]).collect()
        })
    }

    proptest! {
        #[test]
        fn the_neighbours_equal_the_k_d_tree(
            points in points(),
            at in (-8.0..8.0_f64, -4.0..4.0_f64),
            quarters in 0..12_u8,
            cell in 0.2..3.0_f64,
        ) {
            let (range, grid) = (f64::from(quarters) / 4.0, GridSearch { cell });
            for at in points.iter().copied().chain([[at.0, at.1]]) {
                prop_assert_eq!(within(&grid, &points, at, range), within(&KdTree, &points, at, range));
            }
        }

        #[test]
        fn the_nearest_are_as_far_as_in_the_linear_search(points in points(), k in 0..30_usize) {
            let points = ArrayView2::from(&points[..]);
            let (grid, linear) = (GRID.from_batch(&points, L2Dist).unwrap(), LinearSearch.from_batch(&points, L2Dist).unwrap());
            for at in points.rows() {
                let far = |index: &dyn NearestNeighbourIndex<f64>| -> Vec<f64> {
                    index.k_nearest(at, k).unwrap().into_iter().map(|(other, _)| L2Dist.distance(at, other)).collect()
                };
                prop_assert_eq!(far(&*grid), far(&*linear));
            }
        }
    }
}
