//! DBSCAN of `linfa-clustering`, with an exact grid index as its neighbour search.
//!
//! linfa searches neighbours through an index that its caller supplies, but does not pass the radius to the index. The
//! index here receives the radius at its creation. The labels agree with those of scikit-learn
//! (`tests/golden/dbscan.py`), which uses the same convention: a neighbour is at most the radius away.

use linfa::Float;
use linfa::ParamGuard;
use linfa::traits::Transformer;
use linfa_clustering::Dbscan;
use linfa_nn::distance::{Distance, L2Dist};
use linfa_nn::{BuildError, NearestNeighbour, NearestNeighbourIndex, NnError};
use ndarray::{Array2, ArrayBase, ArrayView1, ArrayView2, Data, Ix2};

/// Returns the cluster of each row of a matrix with two columns, or `None` for noise.
///
/// A neighbour is at most `radius` away. A core point has at least `core_points` neighbours, itself included.
pub(super) fn dbscan(rows: &Array2<f64>, radius: f64, core_points: usize) -> Result<Vec<Option<usize>>, String> {
    let params = Dbscan::params_with(core_points, L2Dist, Grid { cell: radius }).tolerance(radius);
    let params = params.check().map_err(|error| error.to_string())?;
    Ok(params.transform(rows).to_vec())
}

/// A nearest-neighbour search for points in a plane, on a uniform grid of square cells.
///
/// The search is exact. It is fast if the search range is about the size of a cell. It always uses the Euclidean
/// distance and ignores the distance that linfa passes to it.
#[derive(Clone, Copy, Debug)]
struct Grid {
    cell: f64,
}

impl NearestNeighbour for Grid {
    /// Returns [`BuildError::ZeroDimension`] if the batch does not have two columns.
    fn from_batch_with_leaf_size<'a, F: Float, DT: Data<Elem = F>, D: 'a + Distance<F>>(
        &self,
        batch: &'a ArrayBase<DT, Ix2>,
        _: usize,
        _: D,
    ) -> Result<Box<dyn 'a + Send + Sync + NearestNeighbourIndex<F>>, BuildError> {
        match batch.ncols() {
            2 => Ok(Box::new(GridIndex::new(batch.view(), self.cell))),
            _ => Err(BuildError::ZeroDimension),
        }
    }
}

/// Number of neighbours for which memory is allocated in advance.
const NEIGHBOURS: usize = 128;
/// Maximum number of cells along each axis. Points that are spread wider get larger cells.
const MAX_CELLS: f64 = 256.0;

/// The index of a batch of points: the points, sorted by cell.
#[derive(Debug)]
struct GridIndex<'a, F: Float> {
    batch: ArrayView2<'a, F>,
    low: [f64; 2],
    cell: f64,
    size: [usize; 2],
    /// Index in `sorted` at which each cell begins, followed by the length of `sorted`.
    starts: Vec<u32>,
    /// Coordinates and row of each point, in order of the cells.
    sorted: Vec<([f64; 2], u32)>,
}

fn to_f64<F: Float>(value: F) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}

impl<'a, F: Float> GridIndex<'a, F> {
    fn new(batch: ArrayView2<'a, F>, cell: f64) -> Self {
        let points = || batch.rows().into_iter().map(|row| [to_f64(row[0]), to_f64(row[1])]);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points() {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(0.0);
        let cell = cell.max(extent / MAX_CELLS);
        let mut index = Self { batch, low, cell, size: [1; 2], starts: Vec::new(), sorted: Vec::new() };
        index.size = [0, 1].map(|axis| index.cell_along(high[axis], axis, usize::MAX) + 1);
        index.sort_into_cells(points);
        index
    }

    /// Sorts the points by cell, with a counting sort.
    #[expect(clippy::cast_possible_truncation, reason = "a scan has at most 20,000 points")]
    fn sort_into_cells<I: Iterator<Item = [f64; 2]>>(&mut self, points: impl Fn() -> I) {
        self.starts.resize(self.size[0] * self.size[1] + 1, 0);
        for point in points() {
            let cell = self.cell_of(point);
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut next = self.starts.clone();
        self.sorted.resize(self.batch.nrows(), ([0.0; 2], 0));
        for (row, point) in points().enumerate() {
            let cell = self.cell_of(point);
            self.sorted[next[cell] as usize] = (point, row as u32);
            next[cell] += 1;
        }
    }

    /// Returns the index of the cell along one axis, at most `max`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, NaN gives 0, then clamped")]
    fn cell_along(&self, value: f64, axis: usize, max: usize) -> usize {
        (((value - self.low[axis]) / self.cell) as usize).min(max)
    }

    /// Returns the index of the cell that contains a point.
    fn cell_of(&self, point: [f64; 2]) -> usize {
        let [column, row] = [0, 1].map(|axis| self.cell_along(point[axis], axis, self.size[axis] - 1));
        column * self.size[1] + row
    }

    /// Calls `each` with the squared distance and the row of each point within `range`.
    fn for_each_within(&self, point: [f64; 2], range: f64, mut each: impl FnMut(f64, usize)) {
        let square = range * range;
        let span = |axis: usize| {
            let max = self.size[axis] - 1;
            self.cell_along(point[axis] - range, axis, max)..=self.cell_along(point[axis] + range, axis, max)
        };
        for column in span(0) {
            let rows = span(1);
            let first = self.starts[column * self.size[1] + rows.start()] as usize;
            let end = self.starts[column * self.size[1] + rows.end() + 1] as usize;
            for &(other, row) in &self.sorted[first..end] {
                let (x, y) = (other[0] - point[0], other[1] - point[1]);
                let distance = x * x + y * y;
                if distance <= square {
                    each(distance, row as usize);
                }
            }
        }
    }
}

impl<F: Float> NearestNeighbourIndex<F> for GridIndex<'_, F> {
    fn k_nearest(&self, point: ArrayView1<'_, F>, k: usize) -> Result<Vec<(ArrayView1<'_, F>, usize)>, NnError> {
        let at = coordinates(point)?;
        let mut found = Vec::with_capacity(self.sorted.len());
        self.for_each_within(at, f64::INFINITY, |distance, row| found.push((distance, row)));
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(k);
        Ok(found.into_iter().map(|(_, row)| (self.batch.row(row).reborrow(), row)).collect())
    }

    fn within_range(&self, point: ArrayView1<'_, F>, range: F) -> Result<Vec<(ArrayView1<'_, F>, usize)>, NnError> {
        let mut found = Vec::with_capacity(NEIGHBOURS);
        self.for_each_within(coordinates(point)?, to_f64(range), |_, row| found.push((self.batch.row(row), row)));
        Ok(found)
    }
}

/// Returns the coordinates of a point, or [`NnError::WrongDimension`] if it does not have two.
fn coordinates<F: Float>(point: ArrayView1<'_, F>) -> Result<[f64; 2], NnError> {
    if point.len() == 2 { Ok([to_f64(point[0]), to_f64(point[1])]) } else { Err(NnError::WrongDimension) }
}

#[cfg(test)]
mod tests {
    use linfa_nn::LinearSearch;
    use ndarray::Array1;
    use proptest::prelude::*;

    use super::*;

    /// A set of points of the golden file, with the labels of scikit-learn.
    struct GoldenSet<'a> {
        name: &'a str,
        radius: f64,
        core_points: usize,
        flat: Vec<f64>,
        expected: Vec<i64>,
    }

    #[test]
    fn clusters_match_scikit_learn_up_to_numbering() {
        let golden = include_str!("../../../tests/golden/dbscan.csv");
        let mut sets: Vec<GoldenSet<'_>> = Vec::new();
        for line in golden.lines().skip(1) {
            let fields: Vec<&str> = line.split(',').collect();
            if sets.last().is_none_or(|set| set.name != fields[0]) {
                let (radius, core_points) = (fields[1].parse().unwrap(), fields[2].parse().unwrap());
                sets.push(GoldenSet { name: fields[0], radius, core_points, flat: vec![], expected: vec![] });
            }
            let set = sets.last_mut().unwrap();
            set.flat.extend([fields[3].parse::<f64>().unwrap(), fields[4].parse().unwrap()]);
            set.expected.push(fields[5].parse().unwrap());
        }
        assert_eq!(sets.len(), 4);
        for GoldenSet { name, radius, core_points, flat, expected } in sets {
            let rows = Array2::from_shape_vec((expected.len(), 2), flat).unwrap();
            let found = dbscan(&rows, radius, core_points).unwrap();
            let mut pairs: Vec<(usize, i64)> = Vec::new();
            for (found, &expected) in found.iter().zip(&expected) {
                match found {
                    None => assert_eq!(expected, -1, "{name}"),
                    Some(label) => pairs.push((*label, expected)),
                }
            }
            pairs.sort_unstable();
            pairs.dedup();
            // The mapping is one to one: each label corresponds to one of scikit-learn's, and vice versa.
            let clusters = expected.iter().max().unwrap() + 1;
            assert!(clusters > 1, "{name}");
            assert_eq!(pairs.len(), usize::try_from(clusters).unwrap(), "{name}");
            for (index, pair) in pairs.iter().enumerate() {
                assert_eq!(pair.0, index, "{name}");
                assert!(pair.1 >= 0 && pairs.iter().filter(|other| other.1 == pair.1).count() == 1, "{name}");
            }
        }
    }

    fn plane() -> impl Strategy<Value = Vec<(f32, f32)>> {
        prop::collection::vec((0.5..150.0_f32, -9.0..9.0_f32), 0..120)
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_a_linear_search_finds(points in plane(), range in 0.1..5.0_f64, k in 1..10_usize) {
            let flat: Vec<f64> = points.iter().flat_map(|&(x, y)| [f64::from(x), f64::from(y)]).collect();
            let rows = Array2::from_shape_vec((points.len(), 2), flat).unwrap();
            let grid = Grid { cell: 1.0 }.from_batch(&rows, L2Dist).unwrap();
            let linear = LinearSearch.from_batch(&rows, L2Dist).unwrap();
            let at = Array1::from(vec![30.0, 1.0]);
            let sorted = |found: Vec<(ArrayView1<'_, f64>, usize)>| {
                let mut rows: Vec<usize> = found.into_iter().map(|(_, row)| row).collect();
                rows.sort_unstable();
                rows
            };
            prop_assert_eq!(
                sorted(grid.within_range(at.view(), range).unwrap()),
                sorted(linear.within_range(at.view(), range).unwrap())
            );
            prop_assert_eq!(
                sorted(grid.k_nearest(at.view(), k).unwrap()),
                sorted(linear.k_nearest(at.view(), k).unwrap())
            );
        }

    }
}
