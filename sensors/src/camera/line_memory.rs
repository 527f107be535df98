//! Memory of a row of pixels.

use super::body::MOMENTS;
use super::effects::Effects;

/// Memory of a row, which the next rendering can reuse.
#[derive(Default)]
pub(super) struct LineMemory {
    pub(super) effects: Effects,
    /// Memory for the x of the rays through each column.
    pub(super) x: Vec<[f32; MOMENTS + 1]>,
}
