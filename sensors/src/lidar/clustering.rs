//! Density clustering, by `linfa-clustering`'s DBSCAN on an exact grid index of our own.
//!
//! Points of one vehicle lie millimetres apart at 3 m and metres apart at 100 m, where a layer on the bumper and the
//! next on the windscreen differ by 2 m in depth. One radius cannot serve both. The points are therefore clustered in a
//! plane that is stretched so that the radius, 1 there, is in metres
//!
//! ```text
//!   along the road   e_x = 0.8 m + 0.015·r      (0.8 m near, 2.3 m at 100 m: less than any gap between vehicles that
//!   across the road  e_y = 0.5 m + 0.005·r       follow each other there, and between vehicles side by side: 1.6 m)
//! ```
//!
//! with r the distance behind the sensor: X = ∫dr/e_x = ln(1 + b·r/a)/b, and Y = y/e_y, y relative to E's path.
//!
//! Where more points than make a core point share a small cell, the surplus is left out, and gets the cell's label
//! afterwards: they are all core points of one cluster anyway. Thinning so never joins what DBSCAN would keep apart; it
//! may part what hangs together only by gaps of more than 0.43 of the radius (two diagonals of a cell less than it).

use linfa::Float;
use linfa::ParamGuard;
use linfa::traits::Transformer;
use linfa_clustering::Dbscan;
use linfa_nn::distance::{Distance, L2Dist};
use linfa_nn::{BuildError, NearestNeighbour, NearestNeighbourIndex, NnError};
use ndarray::{Array2, ArrayBase, ArrayView1, ArrayView2, Data, Ix2};

use super::ground::Candidate;
use crate::SensorError;

/// Radius along the road: at the sensor [m], and its gain with distance [1].
const ALONG_M: f32 = 0.8;
const ALONG_GAIN: f32 = 0.015;
/// Radius across the road: at the sensor [m], and its gain with distance [1].
const ACROSS_M: f32 = 0.5;
const ACROSS_GAIN: f32 = 0.005;
/// Points within the radius, itself among them, that make a point a core point.
pub(crate) const CORE_POINTS: usize = 3;
/// The radius in the stretched plane.
const RADIUS: f64 = 1.0;
/// Cells for thinning, per radius: all points of one cell are within the radius of each other.
const CELLS_PER_RADIUS: f32 = 5.0;
/// Extent of the grid of cells: covers the region of interest.
const CELLS_ALONG: usize = 525;
const CELLS_ACROSS: usize = 200;

/// Label of a point that belongs to no cluster.
pub(crate) const NOISE: u32 = u32::MAX;

/// Labels for points, with the memory that working them out takes.
#[derive(Clone, Debug)]
pub(crate) struct Clustering {
    /// For each candidate its cluster, or [`NOISE`].
    pub(crate) labels: Vec<u32>,
    /// Number of clusters.
    pub(crate) count: usize,
    /// Number of candidates in each cell, up to [`CORE_POINTS`], and the row of the latest.
    cells: Vec<(u8, u32)>,
    /// The cell of each candidate.
    cell_of: Vec<u32>,
    /// The row of each candidate in the matrix for linfa; that of another in the same cell where it was left out.
    row_of: Vec<u32>,
    rows: Vec<f64>,
}

impl Default for Clustering {
    fn default() -> Self {
        Self {
            labels: Vec::new(),
            count: 0,
            cells: vec![(0, 0); CELLS_ALONG * CELLS_ACROSS],
            cell_of: Vec::new(),
            row_of: Vec::new(),
            rows: Vec::new(),
        }
    }
}

impl Clustering {
    /// Labels the candidates.
    ///
    /// # Errors
    /// [`SensorError::Clustering`] where linfa refuses.
    pub(crate) fn run(&mut self, candidates: &[Candidate]) -> Result<(), SensorError> {
        self.thin(candidates);
        self.labels.clear();
        self.count = 0;
        if self.rows.is_empty() {
            self.labels.resize(candidates.len(), NOISE);
            return Ok(());
        }
        let refused = |reason: String| SensorError::Clustering { points: candidates.len(), reason };
        let shape = (self.rows.len() / 2, 2);
        let rows = Array2::from_shape_vec(shape, std::mem::take(&mut self.rows));
        let rows = rows.map_err(|error| refused(error.to_string()))?;
        let labels = dbscan(&rows, RADIUS, CORE_POINTS).map_err(refused)?;
        self.count = labels.iter().flatten().max().map_or(0, |most| most + 1);
        #[expect(clippy::cast_possible_truncation, reason = "fewer clusters than points")]
        let label = |row: &u32| labels[*row as usize].map_or(NOISE, |label| label as u32);
        self.labels.extend(self.row_of.iter().map(label));
        self.rows = rows.into_raw_vec_and_offset().0;
        Ok(())
    }

    /// Joins clusters: each to its host, which is another cluster or itself; hosts of hosts count.
    pub(crate) fn merge(&mut self, hosts: &[u32]) {
        let root = |label: u32| {
            let mut root = label;
            // A host is nearer than what it holds, so that the chain ends.
            while hosts[root as usize] != root {
                root = hosts[root as usize];
            }
            root
        };
        let mut next = 0;
        let mut renumbered = vec![NOISE; hosts.len()];
        for (label, &host) in (0..).zip(hosts) {
            if label == host {
                renumbered[label as usize] = next;
                next += 1;
            }
        }
        for label in self.labels.iter_mut().filter(|label| **label != NOISE) {
            *label = renumbered[root(*label) as usize];
        }
        self.count = next as usize;
    }

    /// Stretches the plane, and leaves out surplus points.
    fn thin(&mut self, candidates: &[Candidate]) {
        self.rows.clear();
        self.row_of.clear();
        self.cell_of.clear();
        for candidate in candidates {
            let [along, across] = stretched(candidate);
            let cell = cell(along, across);
            #[expect(clippy::cast_possible_truncation, reason = "a grid of 105,000 cells, a scan of 20,000 points")]
            self.cell_of.push(cell as u32);
            let (count, row) = &mut self.cells[cell];
            if usize::from(*count) < CORE_POINTS {
                *count += 1;
                #[expect(clippy::cast_possible_truncation, reason = "a scan has at most 20,000 points")]
                let next = (self.rows.len() / 2) as u32;
                *row = next;
                self.rows.extend([f64::from(along), f64::from(across)]);
            }
            self.row_of.push(*row);
        }
        for &cell in &self.cell_of {
            self.cells[cell as usize] = (0, 0);
        }
    }
}

fn stretched(candidate: &Candidate) -> [f32; 2] {
    let along = (ALONG_GAIN / ALONG_M * candidate.back_m).ln_1p() / ALONG_GAIN;
    [along, candidate.left_m / (ACROSS_M + ACROSS_GAIN * candidate.back_m)]
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates, then clamped")]
fn cell(along: f32, across: f32) -> usize {
    let column = (along * CELLS_PER_RADIUS) as usize;
    let row = (across * CELLS_PER_RADIUS + 0.5 * CELLS_ACROSS as f32) as usize;
    column.min(CELLS_ALONG - 1) * CELLS_ACROSS + row.min(CELLS_ACROSS - 1)
}

/// DBSCAN on the rows of a matrix of two columns. A neighbour is at `radius` or nearer; a core point has `core_points`
/// neighbours, itself among them.
pub(crate) fn dbscan(rows: &Array2<f64>, radius: f64, core_points: usize) -> Result<Vec<Option<usize>>, String> {
    let params = Dbscan::params_with(core_points, L2Dist, Grid { cell: radius }).tolerance(radius);
    let params = params.check().map_err(|error| error.to_string())?;
    Ok(params.transform(rows).to_vec())
}

/// A nearest-neighbour search on a uniform grid of square cells, for points in a plane: exact, and quick where the
/// range searched is about the cell's size. It measures Euclidean distances, whatever distance it is given.
#[derive(Clone, Copy, Debug)]
struct Grid {
    cell: f64,
}

impl NearestNeighbour for Grid {
    /// Any other number of columns than two is refused as a wrong dimension.
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

/// Neighbours for which memory is taken beforehand.
const NEIGHBOURS: usize = 128;
/// The most cells along each axis; points spread wider get larger cells.
const MOST_CELLS: f64 = 256.0;

/// Points sorted by the cell that they lie in.
#[derive(Debug)]
struct GridIndex<'a, F: Float> {
    batch: ArrayView2<'a, F>,
    low: [f64; 2],
    cell: f64,
    size: [usize; 2],
    /// Where each cell begins in `sorted`; one more at the end.
    starts: Vec<u32>,
    /// Coordinates and row.
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
        let cell = cell.max(extent / MOST_CELLS);
        let mut index = Self { batch, low, cell, size: [1; 2], starts: Vec::new(), sorted: Vec::new() };
        index.size = [0, 1].map(|axis| index.place(high[axis], axis, usize::MAX) + 1);
        index.sort(points);
        index
    }

    /// Sorts by counting.
    #[expect(clippy::cast_possible_truncation, reason = "a scan has at most 20,000 points")]
    fn sort<I: Iterator<Item = [f64; 2]>>(&mut self, points: impl Fn() -> I) {
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

    /// The cell along one axis, at most `most`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, NaN gives 0, then clamped")]
    fn place(&self, value: f64, axis: usize, most: usize) -> usize {
        (((value - self.low[axis]) / self.cell) as usize).min(most)
    }

    fn cell_of(&self, point: [f64; 2]) -> usize {
        let [column, row] = [0, 1].map(|axis| self.place(point[axis], axis, self.size[axis] - 1));
        column * self.size[1] + row
    }

    /// Calls `each` with the squared distance and the row of each point within `range`.
    fn visit(&self, point: [f64; 2], range: f64, mut each: impl FnMut(f64, usize)) {
        let square = range * range;
        let span = |axis: usize| {
            let most = self.size[axis] - 1;
            self.place(point[axis] - range, axis, most)..=self.place(point[axis] + range, axis, most)
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
        self.visit(at, f64::INFINITY, |distance, row| found.push((distance, row)));
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(k);
        Ok(found.into_iter().map(|(_, row)| (self.batch.row(row).reborrow(), row)).collect())
    }

    fn within_range(&self, point: ArrayView1<'_, F>, range: F) -> Result<Vec<(ArrayView1<'_, F>, usize)>, NnError> {
        let mut found = Vec::with_capacity(NEIGHBOURS);
        self.visit(coordinates(point)?, to_f64(range), |_, row| found.push((self.batch.row(row), row)));
        Ok(found)
    }
}

fn coordinates<F: Float>(point: ArrayView1<'_, F>) -> Result<[f64; 2], NnError> {
    if point.len() == 2 { Ok([to_f64(point[0]), to_f64(point[1])]) } else { Err(NnError::WrongDimension) }
}

#[cfg(test)]
mod tests {
    use linfa_nn::LinearSearch;
    use ndarray::Array1;
    use proptest::prelude::*;

    use super::*;

    fn candidates(points: &[(f32, f32)]) -> Vec<Candidate> {
        points.iter().zip(0..).map(|(&(back_m, left_m), index)| Candidate { index, back_m, left_m }).collect()
    }

    fn labels(points: &[(f32, f32)]) -> Vec<u32> {
        let mut clustering = Clustering::default();
        clustering.run(&candidates(points)).unwrap();
        clustering.labels
    }

    #[test]
    fn vehicles_side_by_side_and_behind_each_other_stay_apart_at_any_range() {
        for back in [2.0, 10.0, 30.0, 60.0, 100.0, 145.0_f32] {
            let column_m = (back * 0.002_2).max(0.05);
            let mut points = Vec::new();
            // Own lane, left lane (1.9 m between the sides), and a follower one radius and a half behind the first.
            for (at, left) in [(back, 0.0), (back, 3.75), (back + 1.5 * (ALONG_M + ALONG_GAIN * back) + 0.5, 0.0)] {
                let mut across = -0.92;
                while across < 0.92 {
                    points.push((at, left + across));
                    across += column_m;
                }
            }
            let mut clustering = Clustering::default();
            clustering.run(&candidates(&points)).unwrap();
            assert_eq!(clustering.count, 3, "at {back} m");
            assert!(!clustering.labels.contains(&NOISE));
        }
    }

    #[test]
    fn three_columns_of_a_motorcycle_are_a_cluster_and_two_are_not() {
        assert_eq!(labels(&[(100.0, 0.0), (100.0, 0.22), (100.0, 0.44)]), [0, 0, 0]);
        assert_eq!(labels(&[(100.0, 0.0), (100.0, 0.22)]), [NOISE, NOISE]);
        assert_eq!(labels(&[]), [] as [u32; 0]);
    }

    /// One set of points of the golden file with the labels of scikit-learn.
    struct GoldenSet<'a> {
        name: &'a str,
        radius: f64,
        core_points: usize,
        flat: Vec<f64>,
        expected: Vec<i64>,
    }

    #[test]
    fn labels_are_those_of_scikit_learn_up_to_their_numbers() {
        let golden = include_str!("../../tests/golden/dbscan.csv");
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
            // One to one: each of our labels meets one of theirs, and the other way round.
            let clusters = expected.iter().max().unwrap() + 1;
            assert!(clusters > 1, "{name}");
            assert_eq!(pairs.len(), usize::try_from(clusters).unwrap(), "{name}");
            for (place, pair) in pairs.iter().enumerate() {
                assert_eq!(pair.0, place, "{name}");
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

        #[test]
        fn thinning_joins_nothing_and_parts_only_what_hangs_loosely_together(
            points in plane(),
            copies in 1..6_usize,
        ) {
            // Crowded cells: each point several times over.
            let points: Vec<_> = points.iter().flat_map(|&point| vec![point; copies]).collect();
            let rows: Vec<f64> = candidates(&points).iter().flat_map(|at| stretched(at).map(f64::from)).collect();
            let rows = Array2::from_shape_vec((points.len(), 2), rows).unwrap();
            let thinned = labels(&points);
            let whole = dbscan(&rows, RADIUS, CORE_POINTS).unwrap();
            let tight = dbscan(&rows, 0.43, CORE_POINTS).unwrap();
            // A point on the border of two clusters may go to either: only core points are compared.
            let neighbours = |at: usize, radius: f64| {
                let distance = |to: usize| (rows[[at, 0]] - rows[[to, 0]]).hypot(rows[[at, 1]] - rows[[to, 1]]);
                (0..points.len()).filter(|&to| distance(to) <= radius).count()
            };
            let core: Vec<bool> = (0..points.len()).map(|at| neighbours(at, 0.43) >= CORE_POINTS).collect();
            for i in 0..points.len() {
                prop_assert!(whole[i].is_some() || thinned[i] == NOISE);
                for j in (0..i).filter(|&j| core[i] && core[j]) {
                    prop_assert!(thinned[i] != thinned[j] || whole[i] == whole[j]);
                    prop_assert!(tight[i] != tight[j] || thinned[i] == thinned[j]);
                }
            }
        }
    }
}
