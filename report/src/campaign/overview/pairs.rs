//! The pair of parameters that the outcome depends on most.

use closecall_traffic::{Parameters, maths};

use super::Axis;

/// Number of cells along each axis.
pub const CELLS: usize = 8;

/// The numbers of samples, and of samples with a collision, in each cell of the plane of two
/// parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct PairBins {
    /// The indices of both parameters among the axes.
    pub axes: [usize; 2],
    /// The number of samples, of samples with a collision in any arm, and of samples with one in
    /// the arm under test, by the cell of the first and of the second parameter.
    pub cells: [[[u64; 3]; CELLS]; CELLS],
}

impl PairBins {
    pub(super) const fn new(axes: [usize; 2]) -> Self {
        Self { axes, cells: [[[0; 3]; CELLS]; CELLS] }
    }

    pub(super) fn push(&mut self, axes: &[Axis], parameters: &[Option<usize>], [any, tested]: [bool; 2]) {
        let [first, second] = self.axes;
        if let (Some(x), Some(y)) = (parameters[first], parameters[second]) {
            debug_assert!(axes.len() == parameters.len());
            let [samples, in_any, in_tested] = &mut self.cells[x][y];
            *samples += 1;
            *in_any += u64::from(any);
            *in_tested += u64::from(tested);
        }
    }

    /// Returns how much the two parameters tell about the outcome (nat). This is the mutual
    /// information between the cell and the event of a collision, less the amount that chance alone
    /// is expected to show (G. A. Miller, *Note on the bias of information estimates*, 1955).
    pub fn information_nat(&self) -> f64 {
        let cells = || self.cells.iter().flatten().filter(|[samples, ..]| *samples > 0);
        let samples: u64 = cells().map(|[samples, ..]| samples).sum();
        let collisions: u64 = cells().map(|[_, collisions, _]| collisions).sum();
        if samples == 0 {
            return 0.0;
        }
        let total = samples as f64;
        let within: f64 = cells().map(|[n, k, _]| *n as f64 / total * entropy_nat(*k as f64 / *n as f64)).sum();
        let by_chance = (cells().count() as f64 - 1.0) / (2.0 * total);
        entropy_nat(collisions as f64 / total) - within - by_chance
    }

    /// Returns the number of cells with a sample, and the number of all cells.
    pub fn coverage(&self, axes: &[Axis]) -> [usize; 2] {
        let [first, second] = self.axes;
        let hit = self.cells.iter().flatten().filter(|[samples, ..]| *samples > 0).count();
        [hit, axes[first].cells(CELLS) * axes[second].cells(CELLS)]
    }
}

/// Returns the entropy of an event that has this probability (nat).
fn entropy_nat(probability: f64) -> f64 {
    let term = |p: f64| if p > 0.0 { -p * maths::ln(p) } else { 0.0 };
    term(probability) + term(1.0 - probability)
}

/// Returns the cell of each parameter, `None` for a parameter that the sample lacks.
pub(super) fn cells_of(axes: &[Axis], parameters: &Parameters) -> Vec<Option<usize>> {
    let cell = |axis: &Axis| {
        let value = parameters.iter().find(|(name, _)| name.as_str() == axis.name())?.1;
        axis.cell(value, CELLS)
    };
    axes.iter().map(cell).collect()
}
