//! Density-based clustering by DBSCAN in a stretched plane.
//!
//! Points of one vehicle lie millimetres apart at 3 m and metres apart at 100 m, where one layer on
//! the bumper and the next on the windscreen differ by 2 m in depth. No single radius suits both
//! distances. The points are therefore clustered in a plane that is stretched such that a radius of
//! 1 in it corresponds, in metres, to
//!
//! ```text
//!   along the road   e_x = 0.8 m + 0.015·r      0.8 m near, 2.3 m at 100 m: less than any gap between followers
//!   across the road  e_y = 0.5 m + 0.005·r      less than 1.6 m between vehicles side by side
//! ```
//!
//! with r the distance behind the sensor. The stretched coordinates of a point, whose lateral
//! offset from the ego's path is y, are X = ∫dr/e_x = ln(1 + b·r/a)/b for e_x = a + b·r, and Y =
//! y/e_y.
//!
//! The points are thinned first. If a small cell contains more points than a core point needs, the
//! clustering leaves out the surplus and gives it the label of the cell afterwards. All points of
//! such a cell are core points of the same cluster anyway. Thinning never joins clusters that
//! DBSCAN would keep apart. It may split a cluster that is connected only by gaps of more than 0.43
//! of the radius, which is the radius less two diagonals of a cell.
//!
//! DBSCAN comes from `linfa-clustering` with the search for neighbours in
//! [`neighbours`](super::neighbours), or from [`dbscan`](super::dbscan). Both give the same labels.
//! A point that lies exactly at the radius is a neighbour.

use std::ops::RangeInclusive;

use closecall_traffic::{Range, Time, maths};
use linfa::ParamGuard;
use linfa::traits::Transformer;
use linfa_clustering::Dbscan;
use linfa_nn::distance::L2Dist;
use ndarray::{Array1, ArrayView2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::candidate::Candidate;
use super::dbscan::Dbscan as GridDbscan;
use super::neighbours::GridSearch;
use crate::SensorError;

/// Radius along the road at the sensor (m).
const ALONG_M: f32 = 0.8;
/// Increase of that radius per metre of distance.
const ALONG_GAIN: f32 = 0.015;
/// Radius across the road at the sensor (m).
const ACROSS_M: f32 = 0.5;
/// Increase of that radius per metre of distance.
const ACROSS_GAIN: f32 = 0.005;
/// Number of points within the radius, the point itself included, that make a point a core point.
pub(crate) const CORE_POINTS: usize = 3;
/// Radius in the stretched plane.
const RADIUS: f64 = 1.0;
/// Number of thinning cells per radius. All points of a cell are within the radius of each other.
const CELLS_PER_RADIUS: f32 = CELLS_IN_RADIUS as f32;
const CELLS_IN_RADIUS: usize = 5;
/// Number of thinning cells along the road, which cover the region of interest.
const CELLS_ALONG: usize = 525;
/// Number of thinning cells across the road, which cover the region of interest.
const CELLS_ACROSS: usize = 200;

/// Number of cells with a side of one radius that cover the same region.
const GRID_CELLS: usize = (CELLS_ALONG / CELLS_IN_RADIUS + 1) * (CELLS_ACROSS / CELLS_IN_RADIUS + 1);

/// The implementation of DBSCAN that clusters the points of a LiDAR. All give the same clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ClusteringMethod {
    /// The one of `linfa-clustering`, with Closecall's grid as its index.
    #[default]
    Linfa,
    /// Closecall's own, over a grid: the faster one.
    Grid,
}

/// A second clustering of each scan by the other implementation, whose labels must be the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClusteringCheck {
    /// Number of core points of the second clustering, if a difference is planted.
    pub core_points: Option<usize>,
}

/// The parameters of DBSCAN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusteringModel {
    /// The implementation.
    pub(crate) method: ClusteringMethod,
    /// Radius in the stretched plane: a factor of the radii along and across the road.
    pub(crate) radius: f64,
    /// Number of points within the radius, the point itself included, that make a core point.
    pub(crate) core_points: usize,
}

impl Default for ClusteringModel {
    fn default() -> Self {
        Self { method: ClusteringMethod::default(), radius: RADIUS, core_points: CORE_POINTS }
    }
}

impl ClusteringModel {
    /// Radii that the thinning allows: all points of a cell, whose diagonal is 0.28, are neighbours.
    pub(crate) const RADII: Range = Range::closed(0.4, 2.5);
    /// Numbers of core points that are allowed: `linfa-clustering` needs two.
    pub(crate) const CORE_POINTS: RangeInclusive<usize> = 2..=20;
}

/// Label of a point that belongs to no cluster.
pub(crate) const NOISE: u32 = u32::MAX;

/// The points of a scan as DBSCAN has clustered them, for a comparison with another DBSCAN.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusteredPoints {
    /// Coordinates in the plane of the clustering, whose unit is the radius.
    pub points: Vec<[f64; 2]>,
    /// Cluster of each point, `None` for noise.
    pub labels: Vec<Option<usize>>,
}

impl ClusteredPoints {
    /// Number of points within the radius, the point itself included, that make a point a core
    /// point.
    pub const CORE_POINTS: usize = CORE_POINTS;
    /// Radius within which points are neighbours.
    pub const RADIUS: f64 = RADIUS;

    /// Clusters points with one of the implementations.
    pub fn by(method: ClusteringMethod, points: Vec<[f64; 2]>) -> Self {
        let labels = match method {
            ClusteringMethod::Linfa => linfa_dbscan(&points, RADIUS, CORE_POINTS).to_vec(),
            ClusteringMethod::Grid => grid_dbscan(&points, RADIUS, CORE_POINTS),
        };
        Self { points, labels }
    }
}

/// The cluster labels of the candidates, and the working memory of the clustering.
#[derive(Clone, Debug)]
pub(crate) struct Clustering {
    /// Cluster of each candidate, or [`NOISE`].
    pub(crate) labels: Vec<u32>,
    /// Number of clusters.
    pub(crate) count: usize,
    /// For each cell, the number of candidates that were kept, at most as many as a core point needs,
    /// and the row of the latest.
    cells: Vec<(u8, u32)>,
    /// Cell of each candidate that was kept.
    kept_cells: Vec<u32>,
    /// Row of each candidate in `rows`. An omitted candidate has the row of another candidate in
    /// the same cell.
    row_of: Vec<u32>,
    /// Stretched coordinates of the candidates that were kept.
    rows: Vec<[f64; 2]>,
    /// The parameters of DBSCAN.
    pub(crate) model: ClusteringModel,
    grid: GridDbscan,
    /// New number of each cluster that is merged into no other cluster.
    renumbered: Vec<u32>,
    /// The vehicles of the clusters that the truth gives.
    vehicles: Vec<usize>,
}

impl Default for Clustering {
    fn default() -> Self {
        Self::with_capacity(0)
    }
}

impl Clustering {
    /// Creates a clustering with memory for so many candidates.
    pub(crate) fn with_capacity(candidates: usize) -> Self {
        Self {
            labels: Vec::with_capacity(candidates),
            count: 0,
            cells: vec![(0, 0); CELLS_ALONG * CELLS_ACROSS],
            kept_cells: Vec::with_capacity(candidates),
            row_of: Vec::with_capacity(candidates),
            rows: Vec::with_capacity(candidates),
            model: ClusteringModel::default(),
            grid: GridDbscan::with_capacity(candidates, GRID_CELLS),
            renumbered: Vec::with_capacity(super::RESERVED_CLUSTERS),
            vehicles: Vec::new(),
        }
    }

    /// Assigns the candidates to clusters.
    pub(crate) fn run(&mut self, candidates: &[Candidate]) {
        self.thin(candidates);
        self.labels.clear();
        let ClusteringModel { method, radius, core_points } = self.model;
        match method {
            ClusteringMethod::Grid => {
                self.count = self.grid.run(&self.rows, radius, core_points) as usize;
                let of_rows = &self.grid.labels;
                self.labels.extend(self.row_of.iter().map(|&row| of_rows[row as usize].unwrap_or(NOISE)));
            }
            ClusteringMethod::Linfa => {
                let of_rows = linfa_dbscan(&self.rows, radius, core_points);
                self.count = of_rows.iter().flatten().max().map_or(0, |last| last + 1);
                let label = |row: u32| of_rows[row as usize].and_then(|label| u32::try_from(label).ok());
                self.labels.extend(self.row_of.iter().map(|&row| label(row).unwrap_or(NOISE)));
            }
        }
    }

    /// Clusters the points of the latest run once more, with the other implementation.
    ///
    /// # Errors
    /// [`SensorError::Clusterings`] if a label differs. The clusters of the latest run remain.
    pub(crate) fn compare(&self, check: ClusteringCheck, time: Time) -> Result<(), SensorError> {
        let (points, labels) = self.rows();
        let core_points = check.core_points.unwrap_or(self.model.core_points);
        let again = match self.model.method {
            ClusteringMethod::Linfa => grid_dbscan(points, self.model.radius, core_points),
            ClusteringMethod::Grid => linfa_dbscan(points, self.model.radius, core_points).to_vec(),
        };
        let different = labels.iter().zip(&again).filter(|(label, again)| label != again).count();
        if different > 0 {
            return Err(SensorError::Clusterings { different, points: points.len(), time });
        }
        Ok(())
    }

    /// Returns the points that the latest run has given to DBSCAN, in the stretched plane, with
    /// their labels.
    pub(crate) fn rows(&self) -> (&[[f64; 2]], Vec<Option<usize>>) {
        let mut labels = vec![None; self.rows.len()];
        for (&row, &label) in self.row_of.iter().zip(&self.labels) {
            labels[row as usize] = (label != NOISE).then_some(label as usize);
        }
        (&self.rows, labels)
    }

    /// Assigns the candidates to clusters by the vehicle that each belongs to, `None` for one that
    /// belongs to no vehicle.
    pub(crate) fn assign(&mut self, vehicles: impl Iterator<Item = Option<usize>>) {
        self.vehicles.clear();
        self.labels.clear();
        for vehicle in vehicles {
            let index = vehicle.map(|vehicle| {
                self.vehicles.iter().position(|listed| *listed == vehicle).unwrap_or_else(|| {
                    self.vehicles.push(vehicle);
                    self.vehicles.len() - 1
                })
            });
            self.labels.push(index.and_then(|index| u32::try_from(index).ok()).unwrap_or(NOISE));
        }
        self.count = self.vehicles.len();
    }

    /// Merges each cluster into its parent, which is another cluster or itself. Chains of parents
    /// are followed to their end.
    pub(crate) fn merge(&mut self, parents: &[u32]) {
        let root = |label: u32| {
            let mut root = label;
            // The chain ends, because a parent is nearer than its children.
            while parents[root as usize] != root {
                root = parents[root as usize];
            }
            root
        };
        let mut next = 0;
        self.renumbered.clear();
        self.renumbered.resize(parents.len(), NOISE);
        for (label, &parent) in (0..).zip(parents) {
            if label == parent {
                self.renumbered[label as usize] = next;
                next += 1;
            }
        }
        for label in self.labels.iter_mut().filter(|label| **label != NOISE) {
            *label = self.renumbered[root(*label) as usize];
        }
        self.count = next as usize;
    }

    /// Converts the candidates to the stretched plane, and leaves out the surplus points of each
    /// cell.
    fn thin(&mut self, candidates: &[Candidate]) {
        self.rows.clear();
        self.row_of.clear();
        self.kept_cells.clear();
        for candidate in candidates {
            let [along, across] = to_stretched_plane(candidate);
            let cell = cell(along, across);
            let (count, row) = &mut self.cells[cell];
            if usize::from(*count) < self.model.core_points {
                *count += 1;
                #[expect(clippy::cast_possible_truncation, reason = "a scan has at most 20,000 points")]
                let next = self.rows.len() as u32;
                *row = next;
                self.rows.push([f64::from(along), f64::from(across)]);
                #[expect(clippy::cast_possible_truncation, reason = "a grid of 105,000 cells")]
                self.kept_cells.push(cell as u32);
            }
            self.row_of.push(*row);
        }
        for &cell in &self.kept_cells {
            self.cells[cell as usize] = (0, 0);
        }
    }
}

/// Returns the cluster of each point by linfa's DBSCAN, `None` for noise. Needs two core points or
/// more, and a radius above 0.
#[expect(clippy::expect_used, reason = "the callers pass checked values")]
fn linfa_dbscan(points: &[[f64; 2]], radius: f64, core_points: usize) -> Array1<Option<usize>> {
    let params = Dbscan::params_with(core_points, L2Dist, GridSearch { cell: radius }).tolerance(radius);
    params.check().expect("two core points or more, a radius above 0").transform(&ArrayView2::from(points))
}

/// Returns the cluster of each point by Closecall's own DBSCAN, `None` for noise.
fn grid_dbscan(points: &[[f64; 2]], radius: f64, core_points: usize) -> Vec<Option<usize>> {
    let mut grid = GridDbscan::default();
    grid.run(points, radius, core_points);
    grid.labels.iter().map(|label| label.map(|label| label as usize)).collect()
}

/// Returns the coordinates (X, Y) of a candidate in the stretched plane.
fn to_stretched_plane(candidate: &Candidate) -> [f32; 2] {
    let along = maths::ln_1p(ALONG_GAIN / ALONG_M * candidate.back_m) / ALONG_GAIN;
    [along, candidate.left_m / (ACROSS_M + ACROSS_GAIN * candidate.back_m)]
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates, then clamped")]
/// Returns the index of the thinning cell at a point of the stretched plane.
fn cell(along: f32, across: f32) -> usize {
    let column = (along * CELLS_PER_RADIUS) as usize;
    let row = (across * CELLS_PER_RADIUS + 0.5 * CELLS_ACROSS as f32) as usize;
    column.min(CELLS_ALONG - 1) * CELLS_ACROSS + row.min(CELLS_ACROSS - 1)
}

#[cfg(test)]
mod tests {
    use closecall_testing::dbscan_by_definition;
    use proptest::prelude::*;

    use super::*;

    /// A set of points of the golden file, with the labels of scikit-learn.
    struct GoldenSet<'a> {
        name: &'a str,
        radius: f64,
        core_points: usize,
        points: Vec<[f64; 2]>,
        expected: Vec<i64>,
    }

    #[test]
    fn a_planted_difference_between_the_clusterings_is_an_error() {
        for method in [ClusteringMethod::Linfa, ClusteringMethod::Grid] {
            let model = ClusteringModel { method, ..ClusteringModel::default() };
            let mut clustering = Clustering { model, ..Clustering::default() };
            // Three points that four core points make noise.
            clustering.run(&candidates(&[(100.0, 0.0), (100.0, 0.22), (100.0, 0.44)]));
            let compared = |core_points| clustering.compare(ClusteringCheck { core_points }, Time::ZERO);
            assert_eq!(compared(None), Ok(()));
            assert_eq!(compared(Some(4)), Err(SensorError::Clusterings { different: 3, points: 3, time: Time::ZERO }));
        }
    }

    #[test]
    fn clusters_match_scikit_learn_up_to_numbering() {
        let golden = include_str!("../../tests/golden/dbscan.csv");
        let mut sets: Vec<GoldenSet<'_>> = Vec::new();
        for line in golden.lines().skip(1) {
            let fields: Vec<&str> = line.split(',').collect();
            if sets.last().is_none_or(|set| set.name != fields[0]) {
                let (radius, core_points) = (fields[1].parse().unwrap(), fields[2].parse().unwrap());
                sets.push(GoldenSet { name: fields[0], radius, core_points, points: vec![], expected: vec![] });
            }
            let set = sets.last_mut().unwrap();
            set.points.push([fields[3].parse().unwrap(), fields[4].parse().unwrap()]);
            set.expected.push(fields[5].parse().unwrap());
        }
        assert_eq!(sets.len(), 4);
        for GoldenSet { name, radius, core_points, points, expected } in sets {
            let mut pairs: Vec<(usize, i64)> = Vec::new();
            let labels = linfa_dbscan(&points, radius, core_points).to_vec();
            assert_eq!(grid_dbscan(&points, radius, core_points), labels, "{name}");
            for (label, &expected) in labels.iter().zip(&expected) {
                match label {
                    None => assert_eq!(expected, -1, "{name}"),
                    Some(label) => pairs.push((*label, expected)),
                }
            }
            pairs.sort_unstable();
            pairs.dedup();
            // The mapping is one to one: each label corresponds to one of scikit-learn's, and vice
            // versa.
            let clusters = expected.iter().max().unwrap() + 1;
            assert!(clusters > 1, "{name}");
            assert_eq!(pairs.len(), usize::try_from(clusters).unwrap(), "{name}");
            for (index, pair) in pairs.iter().enumerate() {
                assert_eq!(pair.0, index, "{name}");
                assert!(pair.1 >= 0 && pairs.iter().filter(|other| other.1 == pair.1).count() == 1, "{name}");
            }
        }
    }

    #[test]
    fn points_exactly_at_the_radius_are_neighbours() {
        // With only the nearer points as neighbours, the first three were no core points, and all
        // were noise.
        let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.5, 0.0]];
        assert_eq!(linfa_dbscan(&points, 1.0, 3).to_vec(), [Some(0), Some(0), Some(0), None]);
        assert_eq!(grid_dbscan(&points, 1.0, 3), [Some(0), Some(0), Some(0), None]);
    }

    /// Points in clumps: clusters, their borders and noise all occur. Coordinates are whole
    /// quarters in half of the cases, and some points then lie exactly at the radius.
    fn clumps() -> impl Strategy<Value = Vec<[f64; 2]>> {
        let clump = ((0.0..30.0_f64, -9.0..9.0_f64), prop::collection::vec((-1.5..1.5_f64, -1.5..1.5_f64), 1..20));
        let clumps = prop::collection::vec(clump, 0..8);
        (clumps, any::<bool>()).prop_map(|(clumps, in_quarters)| {
            let place = |value: f64| if in_quarters { (4.0 * value).round() / 4.0 } else { value };
            let mut points = Vec::new();
            for ((x, y), around) in clumps {
                points.extend(around.into_iter().map(|(dx, dy)| [place(x + dx), place(y + dy)]));
            }
            points
        })
    }

    proptest! {
        #[test]
        fn the_labels_follow_the_definition(
            points in clumps(),
            earlier in clumps(),
            radius in prop::sample::select(vec![0.25, 0.7, 1.0, 1.25, 1.9]),
            core_points in 2..6_usize,
        ) {
            let expected = dbscan_by_definition(&points, radius, core_points);
            prop_assert_eq!(&linfa_dbscan(&points, radius, core_points).to_vec(), &expected);
            // The memory of an earlier scan leaves no trace.
            let mut grid = GridDbscan::default();
            grid.run(&earlier, radius, core_points);
            let count = grid.run(&points, radius, core_points);
            let labels: Vec<_> = grid.labels.iter().map(|label| label.map(|label| label as usize)).collect();
            prop_assert_eq!(&labels, &expected);
            prop_assert_eq!(count as usize, expected.iter().flatten().max().map_or(0, |last| last + 1));
        }
    }

    fn candidates(points: &[(f32, f32)]) -> Vec<Candidate> {
        points.iter().zip(0..).map(|(&(back_m, left_m), index)| Candidate { index, back_m, left_m }).collect()
    }

    fn labels(points: &[(f32, f32)]) -> Vec<u32> {
        let mut clustering = Clustering::default();
        clustering.run(&candidates(points));
        clustering.labels
    }

    #[test]
    fn neighbouring_vehicles_form_separate_clusters_at_any_range() {
        for back in [2.0, 10.0, 30.0, 60.0, 100.0, 145.0_f32] {
            let column_m = (back * 0.002_2).max(0.05);
            let mut points = Vec::new();
            // One vehicle in the ego's lane, one in the left lane with 1.9 m between their sides,
            // and one behind the first at a distance of 1.5 radii and 0.5 m.
            for (at, left) in [(back, 0.0), (back, 3.75), (back + 1.5 * (ALONG_M + ALONG_GAIN * back) + 0.5, 0.0)] {
                let mut across = -0.92;
                while across < 0.92 {
                    points.push((at, left + across));
                    across += column_m;
                }
            }
            let mut clustering = Clustering::default();
            clustering.run(&candidates(&points));
            assert_eq!(clustering.count, 3, "at {back} m");
            assert!(!clustering.labels.contains(&NOISE));
        }
    }

    #[test]
    fn radius_and_core_points_are_those_of_the_model() {
        let points = candidates(&[(100.0, 0.0), (100.0, 0.22), (100.0, 2.0)]);
        let of = |radius, core_points| {
            let model = ClusteringModel { radius, core_points, ..ClusteringModel::default() };
            let mut clustering = Clustering { model, ..Clustering::default() };
            clustering.run(&points);
            assert_eq!(clustering.compare(ClusteringCheck::default(), Time::ZERO), Ok(()));
            clustering.labels
        };
        assert_eq!(of(1.0, 3), [NOISE; 3]);
        assert_eq!(of(1.0, 2), [0, 0, NOISE]);
        // Across the road the radius is 1 m there: 1.78 m are within 1.8 radii.
        assert_eq!(of(1.85, 2), [0, 0, 0]);
        assert_eq!(of(1.7, 2), [0, 0, NOISE]);
    }

    #[test]
    fn three_columns_of_a_motorcycle_form_a_cluster_and_two_do_not() {
        assert_eq!(labels(&[(100.0, 0.0), (100.0, 0.22), (100.0, 0.44)]), [0, 0, 0]);
        assert_eq!(labels(&[(100.0, 0.0), (100.0, 0.22)]), [NOISE, NOISE]);
        assert_eq!(labels(&[]), [] as [u32; 0]);
    }

    fn plane() -> impl Strategy<Value = Vec<(f32, f32)>> {
        prop::collection::vec((0.5..150.0_f32, -9.0..9.0_f32), 0..120)
    }

    proptest! {
        #[test]
        fn thinning_joins_no_clusters_and_splits_only_loosely_connected_clusters(
            points in plane(),
            copies in 1..6_usize,
        ) {
            // Several copies of each point make the cells crowded.
            let points: Vec<_> = points.iter().flat_map(|&point| vec![point; copies]).collect();
            let stretched = |at: &Candidate| to_stretched_plane(at).map(f64::from);
            let rows: Vec<[f64; 2]> = candidates(&points).iter().map(stretched).collect();
            let thinned = labels(&points);
            let unthinned = |radius: f64| dbscan_by_definition(&rows, radius, CORE_POINTS);
            let (whole, tight) = (unthinned(RADIUS), unthinned(0.43));
            // A point on the border of two clusters may belong to either, so only core points are
            // compared.
            let neighbours = |at: usize, radius: f64| {
                let distance = |to: usize| maths::hypot(rows[at][0] - rows[to][0], rows[at][1] - rows[to][1]);
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
