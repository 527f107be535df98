//! DBSCAN (Ester et al. 1996) with an exact search for neighbours on a grid, in memory that is
//! reused from scan to scan.
//!
//! This implementation stays beside `linfa-clustering`, as a check of each other in the validity
//! checks, and for its speed: a point that has joined a cluster takes no part in later searches,
//! while `linfa-clustering` asks for all neighbours of each point, as a new list.
//! `docs/evidence/performance.md` has the figures. Both give the same labels with the same numbers,
//! and so does scikit-learn: a neighbour is at most the radius away.

use std::ops::RangeInclusive;

/// Maximum number of cells along each axis. Points that are spread wider get larger cells.
const MAX_CELLS: f64 = 256.0;

/// The clusters of a set of points in the plane.
#[derive(Clone, Debug, Default)]
pub(crate) struct Dbscan {
    /// Cluster of each point, or `None` for noise.
    pub(crate) labels: Vec<Option<u32>>,
    grid: Grid,
    /// Rows that the growing cluster has reached but not visited.
    reached: Vec<u32>,
}

impl Dbscan {
    /// Creates a clustering with memory for so many points in a grid of so many cells. More need
    /// more memory.
    pub(crate) fn with_capacity(points: usize, cells: usize) -> Self {
        let grid = Grid {
            starts: Vec::with_capacity(cells + 1),
            free_ends: Vec::with_capacity(cells + 1),
            sorted: Vec::with_capacity(points),
            ..Grid::default()
        };
        Self { labels: Vec::with_capacity(points), grid, reached: Vec::with_capacity(points) }
    }

    /// Assigns each point to a cluster. Returns the number of clusters.
    ///
    /// A neighbour is at most `radius` away. A core point has at least `core_points` neighbours,
    /// itself included. The order in which a cluster reaches its points does not change the labels.
    ///
    /// With `core_points` = 1, every finite point is a core point: there is no noise, and the
    /// clusters are the connected components of the points that are at most `radius` apart. 0
    /// counts as 1. A point that is not finite is noise.
    pub(crate) fn run(&mut self, points: &[[f64; 2]], radius: f64, core_points: usize) -> u32 {
        // Every point is its own neighbour, so that 0 would mean the same, but for points that are
        // not finite.
        let core_points = core_points.max(1);
        self.labels.clear();
        self.labels.resize(points.len(), None);
        self.grid.build(points, radius);
        let mut clusters = 0;
        for (row, &point) in points.iter().enumerate() {
            if self.labels[row].is_some() || !self.grid.take_if_core(point, radius, core_points, &mut self.reached) {
                continue;
            }
            while let Some(row) = self.reached.pop() {
                // A point within the radius of a core point belongs to the cluster even if it is no
                // core point.
                self.labels[row as usize] = Some(clusters);
                self.grid.take_if_core(points[row as usize], radius, core_points, &mut self.reached);
            }
            clusters += 1;
        }
        clusters
    }
}

/// Columns and rows of cells.
type Span = [RangeInclusive<usize>; 2];

/// A set of points, sorted into the square cells of a uniform grid.
///
/// The search is exact. It is fast if the search range is about the size of a cell.
#[derive(Clone, Debug, Default)]
struct Grid {
    low: [f64; 2],
    /// Number of cells per unit of length.
    per_unit: f64,
    size: [usize; 2],
    /// Index in `sorted` at which each cell begins, followed by the length of `sorted`.
    starts: Vec<u32>,
    /// Index in `sorted` at which the points of each cell end that have not been taken. While the
    /// grid is built, the index at which the next point of the cell goes.
    free_ends: Vec<u32>,
    /// Coordinates and row of each point, in order of the cells.
    sorted: Vec<([f64; 2], u32)>,
}

impl Grid {
    /// Replaces the points, and sorts them into cells with a counting sort.
    fn build(&mut self, points: &[[f64; 2]], cell: f64) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(0.0);
        (self.low, self.per_unit, self.size) = (low, 1.0 / cell.max(extent / MAX_CELLS), [1; 2]);
        self.size = [0, 1].map(|axis| self.cell_along(high[axis], axis, usize::MAX) + 1);
        self.starts.clear();
        self.starts.resize(self.size[0] * self.size[1] + 1, 0);
        for &point in points {
            let cell = self.cell_of(point);
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        self.free_ends.clone_from(&self.starts);
        self.sorted.resize(points.len(), ([0.0; 2], 0));
        for (row, &point) in (0..).zip(points) {
            let cell = self.cell_of(point);
            self.sorted[self.free_ends[cell] as usize] = (point, row);
            self.free_ends[cell] += 1;
        }
    }

    /// Returns the index of the cell along one axis, at most `max`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, NaN gives 0, then clamped")]
    fn cell_along(&self, value: f64, axis: usize, max: usize) -> usize {
        (((value - self.low[axis]) * self.per_unit) as usize).min(max)
    }

    /// Returns the index of the cell that contains a point.
    fn cell_of(&self, point: [f64; 2]) -> usize {
        let [column, row] = [0, 1].map(|axis| self.cell_along(point[axis], axis, self.size[axis] - 1));
        column * self.size[1] + row
    }

    /// Returns the columns and rows of the cells that may contain points within `range`.
    fn span(&self, point: [f64; 2], range: f64) -> Span {
        [0, 1].map(|axis| {
            let max = self.size[axis] - 1;
            self.cell_along(point[axis] - range, axis, max)..=self.cell_along(point[axis] + range, axis, max)
        })
    }

    /// Appends to `taken` the rows of the points within `range` that no earlier call has taken, if
    /// there are at least `count` within
    /// `range`. Returns whether there are.
    fn take_if_core(&mut self, point: [f64; 2], range: f64, count: usize, taken: &mut Vec<u32>) -> bool {
        let span = self.span(point, range);
        let is_core = self.has_within(&span, point, range, count);
        if is_core {
            self.take_within(span, point, range, taken);
        }
        is_core
    }

    /// Returns true if there are at least `count` points within `range`.
    fn has_within(&self, [columns, rows]: &Span, point: [f64; 2], range: f64, count: usize) -> bool {
        // The own column first: it has most neighbours.
        let centre_column = self.cell_along(point[0], 0, self.size[0] - 1);
        let mut neighbours = 0;
        for column in std::iter::once(centre_column).chain(columns.clone().filter(|&column| column != centre_column)) {
            let first = self.starts[column * self.size[1] + rows.start()] as usize;
            let end = self.starts[column * self.size[1] + rows.end() + 1] as usize;
            for (other, _) in &self.sorted[first..end] {
                neighbours += usize::from(is_within(*other, point, range));
                if neighbours >= count {
                    return true;
                }
            }
        }
        false
    }

    /// Appends to `taken` the rows of the points within `range` that no earlier call has taken.
    fn take_within(&mut self, [columns, rows]: Span, point: [f64; 2], range: f64, taken: &mut Vec<u32>) {
        for column in columns {
            for cell in column * self.size[1] + rows.start()..=column * self.size[1] + rows.end() {
                let (mut next, mut end) = (self.starts[cell] as usize, self.free_ends[cell]);
                while next < end as usize {
                    let (other, row) = self.sorted[next];
                    if is_within(other, point, range) {
                        taken.push(row);
                        end -= 1;
                        self.sorted.swap(next, end as usize);
                    } else {
                        next += 1;
                    }
                }
                self.free_ends[cell] = end;
            }
        }
    }
}

/// Returns true if two points are at most `range` apart.
fn is_within(a: [f64; 2], b: [f64; 2], range: f64) -> bool {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x * x + y * y <= range * range
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_that_is_not_finite_is_noise_for_every_number_of_core_points() {
        let points = [[0.0, 0.0], [f64::NAN, 0.0], [0.5, 0.0], [9.0, f64::NAN]];
        let mut dbscan = Dbscan::default();
        for core_points in [0, 1, 2] {
            assert_eq!(dbscan.run(&points, 1.0, core_points), 1, "{core_points}");
            assert_eq!(dbscan.labels, [Some(0), None, Some(0), None], "{core_points}");
        }
    }
}
