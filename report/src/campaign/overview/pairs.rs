//! Which two parameters the outcome depends on most.

use closecall_traffic::Parameters;

use super::Axis;

/// Parts of each axis.
pub const CELLS: usize = 8;

/// How many samples lie in each cell of two parameters' plane, and in how many of them anybody's E collided.
#[derive(Clone, Debug, PartialEq)]
pub struct PairBins {
    /// Places of the two among the axes.
    pub axes: [usize; 2],
    /// Samples, and those with a collision in some arm, by the cell of the first and of the second parameter.
    pub cells: [[[u64; 2]; CELLS]; CELLS],
}

impl PairBins {
    pub(super) const fn new(axes: [usize; 2]) -> Self {
        Self { axes, cells: [[[0; 2]; CELLS]; CELLS] }
    }

    pub(super) fn take(&mut self, axes: &[Axis], parameters: &[Option<usize>], collided: bool) {
        let [one, other] = self.axes;
        if let (Some(x), Some(y)) = (parameters[one], parameters[other]) {
            debug_assert!(axes.len() == parameters.len());
            let [samples, collisions] = &mut self.cells[x][y];
            *samples += 1;
            *collisions += u64::from(collided);
        }
    }

    /// How much the two parameters tell of the outcome [nat]: the mutual information between the cell and whether there
    /// was a collision, less the amount that chance alone is expected to show (G. A. Miller, *Note on the bias of
    /// information estimates*, 1955).
    pub fn information(&self) -> f64 {
        let cells = || self.cells.iter().flatten().filter(|[samples, _]| *samples > 0);
        let samples: u64 = cells().map(|[samples, _]| samples).sum();
        let collisions: u64 = cells().map(|[_, collisions]| collisions).sum();
        if samples == 0 {
            return 0.0;
        }
        let total = samples as f64;
        let within: f64 = cells().map(|[n, k]| *n as f64 / total * entropy(*k as f64 / *n as f64)).sum();
        let by_chance = (cells().count() as f64 - 1.0) / (2.0 * total);
        entropy(collisions as f64 / total) - within - by_chance
    }

    /// Cells that have a sample, and cells that there are.
    pub fn coverage(&self, axes: &[Axis]) -> [usize; 2] {
        let [one, other] = self.axes;
        let hit = self.cells.iter().flatten().filter(|[samples, _]| *samples > 0).count();
        [hit, axes[one].cells(CELLS) * axes[other].cells(CELLS)]
    }
}

/// Entropy of a yes that has this probability [nat].
fn entropy(probability: f64) -> f64 {
    let term = |p: f64| if p > 0.0 { -p * p.ln() } else { 0.0 };
    term(probability) + term(1.0 - probability)
}

/// The cell of each parameter.
pub(super) fn cells_of(axes: &[Axis], parameters: &Parameters) -> Vec<Option<usize>> {
    let cell = |axis: &Axis| {
        let value = parameters.iter().find(|(name, _)| name.as_str() == axis.name())?.1;
        axis.cell(value, CELLS)
    };
    axes.iter().map(cell).collect()
}
