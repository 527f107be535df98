//! Density clustering, by DBSCAN (`linfa-clustering`) in a stretched plane.
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

mod dbscan;

use dbscan::dbscan;
use ndarray::Array2;

use super::ground::Candidate;
use crate::SensorError;

/// Radius along the road: at the sensor (m), and its gain with distance (dimensionless).
const ALONG_M: f32 = 0.8;
const ALONG_GAIN: f32 = 0.015;
/// Radius across the road: at the sensor (m), and its gain with distance (dimensionless).
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
        self.count = labels.iter().flatten().max().map_or(0, |max| max + 1);
        #[expect(clippy::cast_possible_truncation, reason = "fewer clusters than points")]
        let label = |row: &u32| labels[*row as usize].map_or(NOISE, |label| label as u32);
        self.labels.extend(self.row_of.iter().map(label));
        self.rows = rows.into_raw_vec_and_offset().0;
        Ok(())
    }

    /// Joins clusters: each to its host, which is another cluster or itself; hosts of hosts count.
    pub(crate) fn merge(&mut self, parents: &[u32]) {
        let root = |label: u32| {
            let mut root = label;
            // A host is nearer than what it holds, so that the chain ends.
            while parents[root as usize] != root {
                root = parents[root as usize];
            }
            root
        };
        let mut next = 0;
        let mut renumbered = vec![NOISE; parents.len()];
        for (label, &parent) in (0..).zip(parents) {
            if label == parent {
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
            let [along, across] = to_stretched_plane(candidate);
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

fn to_stretched_plane(candidate: &Candidate) -> [f32; 2] {
    let along = (ALONG_GAIN / ALONG_M * candidate.back_m).ln_1p() / ALONG_GAIN;
    [along, candidate.left_m / (ACROSS_M + ACROSS_GAIN * candidate.back_m)]
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates, then clamped")]
fn cell(along: f32, across: f32) -> usize {
    let column = (along * CELLS_PER_RADIUS) as usize;
    let row = (across * CELLS_PER_RADIUS + 0.5 * CELLS_ACROSS as f32) as usize;
    column.min(CELLS_ALONG - 1) * CELLS_ACROSS + row.min(CELLS_ACROSS - 1)
}

#[cfg(test)]
mod tests {
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

    fn plane() -> impl Strategy<Value = Vec<(f32, f32)>> {
        prop::collection::vec((0.5..150.0_f32, -9.0..9.0_f32), 0..120)
    }

    proptest! {
        #[test]
        fn thinning_joins_nothing_and_parts_only_what_hangs_loosely_together(
            points in plane(),
            copies in 1..6_usize,
        ) {
            // Crowded cells: each point several times over.
            let points: Vec<_> = points.iter().flat_map(|&point| vec![point; copies]).collect();
            let rows: Vec<f64> = candidates(&points).iter().flat_map(|at| to_stretched_plane(at).map(f64::from)).collect();
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
