//! The detector of vehicles in aerial pictures: a trained network without anchors.
//!
//! `xtask/training/aerial_train.py` trains and exports it, and `models/MODEL_CARD.md` states how
//! well it finds cars and trucks. The network returns eight numbers for each cell of 8 px: the
//! logits that a car or a truck has its centre there, the offset of the centre, the logarithms of
//! its sizes, and sine and cosine of twice its angle.

use closecall_sensors::camera::{Backend, CHANNELS, Image, Network};
use closecall_traffic::{VehicleClass, maths};

use crate::aerial::error::AerialError;
use crate::aerial::image_box::ImageBox;
use crate::aerial::overlap::intersection_over_union;

/// The ONNX file of the network that ships with Closecall.
pub static SHIPPED_DETECTOR: &[u8] = include_bytes!("../../models/aerial-detector.onnx");

/// Pixels of a cell of the output, along each axis.
pub(crate) const STRIDE: usize = 8;
/// Numbers for each cell.
const OUTPUTS: usize = 8;
/// Sizes to which the network's logarithms refer (px).
const LENGTH_PX: f64 = 32.0;
const WIDTH_PX: f64 = 16.0;
/// Overlap from which the weaker of two boxes is dropped.
const SAME_VEHICLE: f64 = 0.3;
/// The classes, in the order of the network's output.
const CLASSES: [VehicleClass; 2] = [VehicleClass::Car, VehicleClass::Truck];

/// Score from which a detection counts.
pub const DETECTED_FROM: f64 = 0.3;

/// A vehicle that was found in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageDetection {
    /// The box around the visible body.
    pub image_box: ImageBox,
    /// Car or truck.
    pub class: VehicleClass,
    /// Score (0 to 1).
    pub score: f64,
}

/// The network, loaded into one inference session.
#[derive(Debug)]
pub struct Detector {
    network: Network,
    planes: Vec<f32>,
}

impl Detector {
    /// Loads the network that ships with Closecall on this backend.
    ///
    /// # Errors
    /// [`AerialError::Network`] if the backend cannot be loaded, or if the process uses another
    /// backend.
    pub fn shipped(backend: &Backend) -> Result<Self, AerialError> {
        Ok(Self { network: Network::new("aerial-detector.onnx", SHIPPED_DETECTOR, backend)?, planes: Vec::new() })
    }

    /// Returns the vehicles in a picture with a score of at least `from`, the best first. Both
    /// sides of the picture are multiples of 8 px. The same picture always gives the same bits.
    ///
    /// # Errors
    /// [`AerialError`] if inference fails, or if the output has another shape than expected.
    pub fn detect(&mut self, image: &Image, from: f64) -> Result<Vec<ImageDetection>, AerialError> {
        let (width, height) = (image.width as usize, image.height as usize);
        self.planes.resize(CHANNELS * width * height, 0.0);
        for (pixel, rgb) in image.rgb.chunks_exact(CHANNELS).enumerate() {
            for (channel, value) in rgb.iter().enumerate() {
                self.planes[channel * width * height + pixel] = f32::from(*value);
            }
        }
        let (shape, output) = self.network.run([1, CHANNELS, height, width], &self.planes)?;
        let expected = [1, OUTPUTS, height / STRIDE, width / STRIDE];
        if shape != expected {
            return Err(AerialError::Output { actual: shape, expected });
        }
        Ok(decode(&output, [height / STRIDE, width / STRIDE], from))
    }
}

/// Returns the vehicles that an output states: peaks of the score among the eight neighbours,
/// without doubles.
fn decode(output: &[f32], [rows, columns]: [usize; 2], from: f64) -> Vec<ImageDetection> {
    let at = |part: usize, row: usize, column: usize| output[(part * rows + row) * columns + column];
    let mut detections = Vec::new();
    for (kind, class) in CLASSES.into_iter().enumerate() {
        for row in 0..rows {
            for column in 0..columns {
                let logit = at(kind, row, column);
                let score = 1.0 / (1.0 + maths::exp(-f64::from(logit)));
                let around = (row.saturating_sub(1)..(row + 2).min(rows))
                    .flat_map(|y| (column.saturating_sub(1)..(column + 2).min(columns)).map(move |x| (y, x)));
                if score < from || around.into_iter().any(|(y, x)| at(kind, y, x) > logit) {
                    continue;
                }
                let value = |part: usize| f64::from(at(part, row, column));
                let centre = |cell: usize, offset: f64| (cell as f64 + 0.5 + offset) * STRIDE as f64;
                let image_box = ImageBox {
                    centre_px: [centre(column, value(2)), centre(row, value(3))],
                    length_px: LENGTH_PX * maths::exp(value(4)),
                    width_px: WIDTH_PX * maths::exp(value(5)),
                    angle_rad: 0.5 * maths::atan2(value(6), value(7)),
                };
                detections.push(ImageDetection { image_box, class, score });
            }
        }
    }
    detections.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<ImageDetection> = Vec::new();
    for detection in detections {
        let is_same = |other: &ImageDetection| {
            intersection_over_union(&detection.image_box.plane(), &other.image_box.plane()) >= SAME_VEHICLE
        };
        if !kept.iter().any(is_same) {
            kept.push(detection);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_decoded_and_its_neighbours_are_not() {
        let (rows, columns) = (4, 6);
        let mut output = vec![0.0_f32; OUTPUTS * rows * columns];
        let mut set = |part: usize, row: usize, column: usize, value: f32| {
            output[(part * rows + row) * columns + column] = value;
        };
        for (row, column, logit) in [(0, 0, -9.0), (1, 2, 3.0), (1, 3, 2.0)] {
            (0..rows * columns).for_each(|_| ());
            set(1, row, column, logit);
        }
        for part in 0..2 {
            for cell in 0..rows * columns {
                let (row, column) = (cell / columns, cell % columns);
                if part == 0 || ![(1, 2), (1, 3)].contains(&(row, column)) {
                    set(part, row, column, -9.0);
                }
            }
        }
        for (part, value) in [(2, 0.25), (3, -0.5), (4, 0.0), (5, 0.5), (6, 1.0), (7, 0.0)] {
            set(part, 1, 2, value);
        }
        let detections = decode(&output, [rows, columns], 0.3);
        assert_eq!(detections.len(), 1);
        let ImageDetection { image_box, class, score } = detections[0];
        assert_eq!((class, image_box.centre_px), (VehicleClass::Truck, [22.0, 8.0]));
        assert!(
            (image_box.length_px - 32.0).abs() < 1e-9 && (image_box.width_px - 16.0 * maths::exp(0.5)).abs() < 1e-9
        );
        assert!((image_box.angle_rad - std::f64::consts::FRAC_PI_4).abs() < 1e-9 && score > 0.9);
    }
}
