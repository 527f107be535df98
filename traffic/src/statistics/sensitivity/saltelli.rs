//! Sobol' indices: the shares of the output's variance that a factor, or a group of factors,
//! explains.
//!
//! ```text
//!   A, B     two independent points in each row
//!   AB_i     A with the factors of group i from B
//!
//!   first order  S_i  = V[E(y | x_i)] / V[y]          ≈ mean (f(B) − c) (f(AB_i) − f(A)) / V     (Saltelli 2010)
//!   total        ST_i = E[V(y | all but x_i)] / V[y]  ≈ ½ mean (f(A) − f(AB_i))² / V             (Jansen 1999)
//! ```
//!
//! The constant c, the mean of the outputs, changes no expectation and lowers the variance of the
//! first-order index (I. M. Sobol' and E. E. Myshetskaya, Monte Carlo Methods and Applications 13
//! (2007) 455–465): its standard error is about √(2 ST_i / n).
//!
//! A and B are the two halves of one scrambled Sobol' sequence (B. Burley, JCGT 9(4), 2020, crate
//! `sobol_burley`). There are [`REPLICATES`] independent scramblings, from which the intervals
//! follow: see [`super::jackknife`].

use rand::Rng;

use super::jackknife::{Estimate, REPLICATES, jackknife};
use crate::statistics::interval::{COVERAGE, clopper_pearson};

/// Half the spacing of the numbers in the sequence, which have 23 bits: it keeps each number above
/// 0 and below 1.
const HALF_CELL: f64 = 1.0 / (1_u32 << 24) as f64;
/// Largest number of factors: the sequence has two dimensions for each.
pub const MAX_FACTORS: usize = sobol_burley::NUM_DIMENSIONS as usize / 2;
/// Largest number of rows in a replicate: the length of the sequence.
const MAX_ROWS: usize = 1 << 16;
/// Number of rows that must inform an index for Student's interval. With fewer, the distribution of
/// the estimate is far from normal.
const MIN_CHANGES: u64 = 10;
/// The same for the first-order index of an event: of the rows with a change, as many must have the
/// event at B, and as many must not. The event of the tests needs about twenty, since the products
/// of two rare events are skewed.
const MIN_ON_EACH_SIDE: u64 = 20;
/// Number of parts of a factor's range for which the output's mean is estimated.
pub const QUARTERS: usize = 4;

/// The design: rows of two independent points, and of the mixed points of every group.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    factors: usize,
    groups: Vec<Vec<usize>>,
    /// Number of rows in each replicate.
    rows: usize,
    /// Seed of each scrambling.
    scrambles: Vec<u32>,
}

/// The indices of one group of factors.
#[derive(Clone, Debug, PartialEq)]
pub struct Indices {
    /// The first-order index; `None` if the output does not vary, or changes in too few rows to
    /// say.
    pub first: Option<Estimate>,
    /// The total index; `None` if the output does not vary, or changes in too few rows to say.
    pub total: Option<Estimate>,
    /// Number of rows in which the output of A and of the mixed point differ.
    pub changes: u64,
    /// Number of rows in which all outputs are known.
    pub rows: u64,
}

/// The effect of one factor on the mean of the output, whatever the values of the other factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MainEffect {
    /// Share of the output's variance between the quarters of the factor's distribution. It is a
    /// lower bound of the first-order index, and has a smaller error, since all points of the
    /// design count.
    pub index: Estimate,
    /// The mean of the output while the factor lies in the first, second, third and last quarter.
    pub means: [Estimate; QUARTERS],
}

impl MainEffect {
    /// Returns the smallest and the largest of the means.
    pub fn ends(&self) -> [Estimate; 2] {
        let by = |a: &&Estimate, b: &&Estimate| a.value.total_cmp(&b.value);
        let [first, ..] = self.means;
        let low = self.means.iter().min_by(by).copied().unwrap_or(first);
        [low, self.means.iter().max_by(by).copied().unwrap_or(first)]
    }
}

impl Design {
    /// Returns a design with about `rows` rows, for groups of the factors `0..factors`. The number
    /// of rows is raised to a multiple of [`REPLICATES`].
    ///
    /// # Panics
    /// Panics if there are more than [`MAX_FACTORS`] factors.
    pub fn new(factors: usize, groups: Vec<Vec<usize>>, rows: usize, rng: &mut impl Rng) -> Self {
        assert!(factors <= MAX_FACTORS, "{factors} factors are more than {MAX_FACTORS}");
        let rows = rows.div_ceil(REPLICATES).clamp(1, MAX_ROWS);
        Self { factors, groups, rows, scrambles: (0..REPLICATES).map(|_| rng.next_u32()).collect() }
    }

    /// Returns the number of rows of all replicates.
    pub fn rows(&self) -> usize {
        self.rows * REPLICATES
    }

    /// Returns the number of points: for each row two, and one for each group.
    pub fn len(&self) -> usize {
        self.rows() * self.width()
    }

    /// Returns true if there is no point: never.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of points in a row.
    fn width(&self) -> usize {
        self.groups.len() + 2
    }

    /// Returns a point. The points of a row follow each other.
    ///
    /// # Panics
    /// Panics if `index` is not below [`Self::len`].
    pub fn point(&self, index: usize) -> Vec<f64> {
        (0..self.factors).map(|factor| self.coordinate(index, factor)).collect()
    }

    /// Returns one coordinate of a point.
    fn coordinate(&self, index: usize, factor: usize) -> f64 {
        let (row, column) = (index / self.width(), index % self.width());
        let (scramble, number) = (self.scrambles[row / self.rows], (row % self.rows) as u32);
        let is_from_b = match column {
            0 => false,
            1 => true,
            mixed => self.groups[mixed - 2].contains(&factor),
        };
        let dimension = if is_from_b { self.factors + factor } else { factor };
        f64::from(sobol_burley::sample(number, dimension as u32, scramble)) + HALF_CELL
    }

    /// Returns the indices of every group. `outputs` are the outputs of the points, `None` if a run
    /// has no output: its row is then left out for the groups that need it.
    ///
    /// # Panics
    /// Panics if there are fewer outputs than points.
    pub fn indices(&self, outputs: &[Option<f64>]) -> Vec<Indices> {
        let complete: Vec<f64> = outputs.iter().flatten().copied().collect();
        let mean = complete.iter().sum::<f64>() / complete.len().max(1) as f64;
        let is_event = complete.iter().all(|output| *output == 0.0 || (output - 1.0).abs() <= f64::EPSILON);
        (0..self.groups.len()).map(|group| self.of_group(group, outputs, mean, is_event)).collect()
    }

    fn of_group(&self, group: usize, outputs: &[Option<f64>], mean: f64, is_event: bool) -> Indices {
        let mut sums = GroupSums::default();
        for row in 0..self.rows() {
            let of_row = &outputs[row * self.width()..(row + 1) * self.width()];
            if let (Some(a), Some(b), Some(mixed)) = (of_row[0], of_row[1], of_row[2 + group]) {
                sums.push(row / self.rows, [a, b, mixed].map(|output| output - mean));
            }
        }
        sums.indices(is_event)
    }

    /// Returns how a factor moves the mean of the output; `None` if a quarter of its distribution
    /// has no outputs, or they do not vary. All points count: each coordinate is uniformly
    /// distributed in each of them.
    ///
    /// # Panics
    /// Panics if there are fewer outputs than points.
    pub fn main_effect(&self, factor: usize, outputs: &[Option<f64>]) -> Option<MainEffect> {
        // For each replicate and quarter: the number of outputs, their sum, and the sum of their
        // squares.
        let mut replicates = [[0.0; 3 * QUARTERS]; REPLICATES];
        for (index, output) in outputs.iter().enumerate() {
            let Some(output) = output else { continue };
            let share = self.coordinate(index, factor);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in [0, 1)")]
            let quarter = ((share * QUARTERS as f64) as usize).min(QUARTERS - 1);
            let sums = &mut replicates[index / self.width() / self.rows];
            for (sum, term) in sums[3 * quarter..].iter_mut().zip([1.0, *output, output * output]) {
                *sum += term;
            }
        }
        let mean = |quarter: usize| {
            jackknife(&replicates, |sums| {
                let count = sums[3 * quarter];
                (count > 0.0).then(|| sums[3 * quarter + 1] / count)
            })
        };
        let is_event = outputs.iter().flatten().all(|output| *output == 0.0 || (output - 1.0).abs() <= f64::EPSILON);
        // A mean lies where the outputs can lie: the mean of harm is not negative, the mean of an
        // event at most 1.
        let is_positive = outputs.iter().flatten().all(|output| *output >= 0.0);
        let range = [if is_positive { 0.0 } else { f64::NEG_INFINITY }, if is_event { 1.0 } else { f64::INFINITY }];
        let bounded = |quarter: usize| mean(quarter).map(|mean| mean.within(range));
        let means = [bounded(0)?, bounded(1)?, bounded(2)?, bounded(3)?];
        let squares: f64 = replicates.iter().flat_map(|sums| sums.chunks_exact(3)).map(|quarter| quarter[2]).sum();
        let index = jackknife(&replicates, |sums| share_between(sums, rounding_error(squares)))?;
        Some(MainEffect { index, means })
    }
}

/// The sums of one group.
#[derive(Clone, Debug, Default)]
struct GroupSums {
    /// For each replicate: the number of rows; the sums of the outputs of A and B, and of their
    /// squares; the sums of the terms of both indices.
    replicates: [[f64; 5]; REPLICATES],
    /// Number of rows.
    rows: u64,
    /// Number of rows with a change, in which the output of B lies below the mean, and above it.
    changes: [u64; 2],
}

impl GroupSums {
    /// Adds a row: the outputs of A, B and the mixed point, less the mean of all outputs.
    fn push(&mut self, replicate: usize, [a, b, mixed]: [f64; 3]) {
        let terms = [1.0, a + b, a * a + b * b, b * (mixed - a), 0.5 * (a - mixed).powi(2)];
        for (sum, term) in self.replicates[replicate].iter_mut().zip(terms) {
            *sum += term;
        }
        self.rows += 1;
        self.changes[usize::from(b > 0.0)] += u64::from((a - mixed).abs() > 0.0);
    }

    fn indices(&self, is_event: bool) -> Indices {
        let error = rounding_error(self.all()[2]);
        let share_of =
            |part: usize| jackknife(&self.replicates, |sums| Some(sums[part] / sums[0] / variance(sums, error)?));
        let (first, total) = (share_of(3), share_of(4));
        let changes = self.changes.iter().sum();
        let (first, total) = match self.bounds(is_event) {
            _ if !is_event && changes < MIN_CHANGES => (None, None),
            Some(bounds) if changes < MIN_CHANGES => (with(first, [0.0, bounds[1]]), with(total, bounds)),
            // The first-order index is no larger than the total index.
            _ if is_event && self.changes.iter().any(|side| *side < MIN_ON_EACH_SIDE) => {
                (first.zip(total).map(|(first, total)| first.with_interval([0.0, total.interval_95[1]])), total)
            }
            _ => (first, total),
        };
        Indices { first, total, changes, rows: self.rows }
    }

    /// Returns the bounds of the total index of an event. Jansen's index is then the probability of
    /// a change over twice the variance. For other outputs, nothing is known about the size of
    /// changes that were not seen.
    fn bounds(&self, is_event: bool) -> Option<[f64; 2]> {
        let all = self.all();
        let variance = variance(&all, rounding_error(all[2])).filter(|_| is_event)?;
        let changes = self.changes.iter().sum();
        Some(clopper_pearson(changes, self.rows, COVERAGE).map(|probability| 0.5 * probability / variance))
    }

    /// Returns the sums over all replicates.
    fn all(&self) -> [f64; 5] {
        let mut all = [0.0; 5];
        for replicate in &self.replicates {
            all.iter_mut().zip(replicate).for_each(|(sum, term)| *sum += term);
        }
        all
    }
}

fn with(estimate: Option<Estimate>, interval_95: [f64; 2]) -> Option<Estimate> {
    estimate.map(|estimate| estimate.with_interval(interval_95))
}

/// Returns the largest variance that rounding alone can give outputs without variance.
/// `sum_of_squares` is the sum over all replicates. The sum of n squares is wrong by at most n ε /
/// 2 of itself, and the mean square therefore by ε / 2 of the sum. The squared mean is wrong by
/// twice as much (N. J. Higham, *Accuracy and Stability of Numerical Algorithms*, SIAM 2002,
/// section 4.2). The factor leaves room for the sums that the jackknife subtracts.
fn rounding_error(sum_of_squares: f64) -> f64 {
    4.0 * f64::EPSILON * sum_of_squares
}

/// Returns the variance of the outputs of A and B; `None` if they do not vary by more than the
/// error of rounding.
fn variance([count, sum, squares, ..]: &[f64; 5], error: f64) -> Option<f64> {
    let variance = squares / (2.0 * count) - (sum / (2.0 * count)).powi(2);
    (variance > error).then_some(variance)
}

/// Returns the share of the variance between the quarters; `None` if the outputs do not vary by
/// more than the error of rounding. The sums are the count, the sum and the sum of the squares of
/// each quarter.
fn share_between(sums: &[f64; 3 * QUARTERS], error: f64) -> Option<f64> {
    let quarters = || sums.chunks_exact(3).filter(|quarter| quarter[0] > 0.0);
    let total = |part: usize| quarters().map(|quarter| quarter[part]).sum::<f64>();
    let (count, mean) = (total(0), total(1) / total(0));
    let variance = total(2) / count - mean * mean;
    let between: f64 = quarters().map(|quarter| quarter[0] * (quarter[1] / quarter[0] - mean).powi(2)).sum();
    (variance > error).then(|| between / count / variance)
}
