//! A result of an instance detector in an image: a box, a class, a score and a mask.

use closecall_traffic::VehicleClass;

use super::picture::{HEIGHT_PX, WIDTH_PX};

/// Probability from which a pixel counts as a part of an instance, as in torchvision and in the
/// paper of Mask R-CNN (K. He et al., 2017).
pub const MASK_THRESHOLD: f32 = 0.5;

/// A vehicle that a detector has found in the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Box in the image: left, top, right, bottom (px). The first pixel reaches from 0 to 1.
    pub box_px: [f64; 4],
    /// The class.
    pub class: VehicleClass,
    /// Score of the class (0 to 1).
    pub score: f64,
    /// The mask.
    pub mask: Mask,
}

/// The probabilities that parts of the image belong to an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// Area of the image that the cells divide evenly: left, top, right, bottom (px).
    pub(super) area_px: [f64; 4],
    /// Number of columns and of rows of cells.
    pub(super) cells: [usize; 2],
    /// Probability of each cell, row by row from the top.
    pub(super) values: Vec<f32>,
}

impl Mask {
    /// Creates a mask from the probabilities of cells that divide `area_px` (left, top, right,
    /// bottom) evenly, row by row. Returns `None` unless there are `columns` · `rows` of them, and
    /// 1 at least.
    pub fn new(area_px: [f64; 4], [columns, rows]: [usize; 2], values: Vec<f32>) -> Option<Self> {
        let is_whole = columns * rows == values.len() && !values.is_empty();
        is_whole.then_some(Self { area_px, cells: [columns, rows], values })
    }

    /// Returns the probability at a position in the image (px): linear between the centres of the
    /// cells, and 0 outside of the area.
    pub fn at(&self, [u, v]: [f64; 2]) -> f32 {
        let [left, top, right, bottom] = self.area_px;
        if !((left..right).contains(&u) && (top..bottom).contains(&v)) {
            return 0.0;
        }
        let place = |at: f64, low: f64, high: f64, cells: usize| {
            let last = cells as f64 - 1.0;
            let position = ((at - low) / (high - low) * cells as f64 - 0.5).clamp(0.0, last);
            let lower = position.floor();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the cells")]
            let index = lower as usize;
            (index, (index + 1).min(cells - 1), (position - lower) as f32)
        };
        let (i, next_i, part_u) = place(u, left, right, self.cells[0]);
        let (j, next_j, part_v) = place(v, top, bottom, self.cells[1]);
        let value = |column: usize, row: usize| self.values[row * self.cells[0] + column];
        let across = |row: usize| value(i, row) + part_u * (value(next_i, row) - value(i, row));
        across(j) + part_v * (across(next_j) - across(j))
    }

    /// Returns the smallest box around the cells of the instance: left, top, right, bottom (px).
    /// Returns `None` if there is none.
    pub fn extent_px(&self) -> Option<[f64; 4]> {
        let [columns, _] = self.cells;
        let inside = self.values.iter().enumerate().filter(|(_, value)| **value >= MASK_THRESHOLD);
        let mut cells: Option<[usize; 4]> = None;
        for (index, _) in inside {
            let (column, row) = (index % columns, index / columns);
            let [left, top, right, bottom] = cells.unwrap_or([column, row, column, row]);
            cells = Some([left.min(column), top.min(row), right.max(column), bottom.max(row)]);
        }
        let [left, top, right, bottom] = self.area_px;
        let [width, height] = [(right - left) / self.cells[0] as f64, (bottom - top) / self.cells[1] as f64];
        cells.map(|[first, upper, last, lower]| {
            [
                left + first as f64 * width,
                top + upper as f64 * height,
                left + (last + 1) as f64 * width,
                top + (lower + 1) as f64 * height,
            ]
        })
    }

    /// Returns for each pixel of the image whether it belongs to the instance, row by row from the
    /// top.
    pub fn pixels(&self) -> Vec<bool> {
        let rows = (0..HEIGHT_PX).map(|row| f64::from(row) + 0.5);
        rows.flat_map(|v| (0..WIDTH_PX).map(move |column| [f64::from(column) + 0.5, v]))
            .map(|at| self.at(at) >= MASK_THRESHOLD)
            .collect()
    }
}

/// Returns the area that two boxes have in common, as a share of the smaller box (0 to 1).
pub fn overlap(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let area = |[left, top, right, bottom]: &[f64; 4]| (right - left).max(0.0) * (bottom - top).max(0.0);
    let common = area(&[a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]);
    common / area(a).min(area(b)).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_is_linear_between_the_centres_of_its_cells_and_zero_outside() {
        let mask = Mask::new([10.0, 20.0, 30.0, 40.0], [2, 2], vec![0.0, 1.0, 0.0, 1.0]).unwrap();
        for (u, value) in [(15.0, 0.0), (20.0, 0.5), (25.0, 1.0), (29.9, 1.0), (11.0, 0.0), (9.9, 0.0), (30.0, 0.0)] {
            assert!((mask.at([u, 30.0]) - value).abs() < 1e-6, "{u}");
        }
        assert_eq!(mask.at([25.0, 41.0]), 0.0);
        assert_eq!(mask.extent_px(), Some([20.0, 20.0, 30.0, 40.0]));
        assert_eq!(mask.pixels().iter().filter(|inside| **inside).count(), 10 * 20);
        assert_eq!(Mask::new([0.0; 4], [2, 2], vec![1.0; 3]), None);
        assert_eq!(Mask::new([0.0, 0.0, 1.0, 1.0], [1, 1], vec![0.2]).unwrap().extent_px(), None);
    }

    #[test]
    fn the_overlap_is_a_share_of_the_smaller_box() {
        let large = [0.0, 0.0, 100.0, 100.0];
        assert!((overlap(&large, &[90.0, 0.0, 110.0, 10.0]) - 0.5).abs() < 1e-12);
        assert!((overlap(&large, &[10.0, 10.0, 20.0, 20.0]) - 1.0).abs() < 1e-12);
        assert_eq!(overlap(&large, &[100.0, 0.0, 110.0, 10.0]), 0.0);
    }
}
