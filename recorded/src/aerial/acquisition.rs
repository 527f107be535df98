//! The rate and the size of the pictures of an aerial acquisition.
//!
//! The detector is trained on pictures with about 0.13 m of ground for each pixel. Finer pictures are
//! reduced to this before the search: the mean of each square of pixels.

use closecall_sensors::camera::{CHANNELS, Image};
use closecall_traffic::Time;
use serde::Serialize;

use crate::aerial::camera::{FOCAL_SHARE, HEIGHT_PX, WIDTH_PX};
use crate::aerial::detector::{ImageDetection, STRIDE};
use crate::aerial::image_box::ImageBox;

/// The rate and the size of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Acquisition {
    /// Time between two pictures.
    pub frame: Time,
    /// Columns and rows of a picture.
    pub size_px: [usize; 2],
    /// Number of pixels along each axis that the detector sees as one.
    pub reduced_by: usize,
    /// Number of rendered samples along each axis of a pixel.
    pub samples: usize,
}

impl Acquisition {
    /// A strip of the picture with the road in it, at every second picture of a video of 25 Hz, as
    /// highD has it. A picture takes about a tenth of a second.
    pub const STRIP: Self =
        Self { frame: Time::from_ms(80), size_px: [WIDTH_PX, HEIGHT_PX], reduced_by: 1, samples: 2 };
    /// The published rate and size: 20 Hz with 4104 × 3006 px. Per second of traffic it takes about a
    /// hundred times as long as [`Self::STRIP`].
    pub const PUBLISHED: Self = Self { frame: Time::from_ms(50), size_px: [4_104, 3_006], reduced_by: 3, samples: 1 };

    /// Returns the focal length of the lens (px).
    pub fn focal_px(&self) -> f64 {
        FOCAL_SHARE * self.size_px[0] as f64
    }

    /// Returns the picture that the detector sees: reduced, and cut to sides that are multiples of the
    /// cells of its output.
    pub fn reduced(&self, image: &Image) -> Image {
        let by = self.reduced_by;
        if by == 1 {
            return image.clone();
        }
        let [width, height] = [image.width, image.height].map(|side| side as usize / by / STRIDE * STRIDE);
        let columns = image.width as usize;
        let mut rgb = Vec::with_capacity(width * height * CHANNELS);
        for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
            for channel in 0..CHANNELS {
                let pixels = (0..by).flat_map(|dy| (0..by).map(move |dx| (row * by + dy) * columns + column * by + dx));
                let sum: u32 = pixels.map(|pixel| u32::from(image.rgb[pixel * CHANNELS + channel])).sum();
                let count = u32::try_from(by * by).unwrap_or(1);
                rgb.push(u8::try_from((sum + count / 2) / count).unwrap_or(u8::MAX));
            }
        }
        let side = |side: usize| u32::try_from(side).unwrap_or(0);
        Image { width: side(width), height: side(height), rgb }
    }

    /// Returns a detection in the reduced picture as one in the whole picture.
    pub fn enlarged(&self, detection: ImageDetection) -> ImageDetection {
        let by = self.reduced_by as f64;
        let ImageBox { centre_px, length_px, width_px, angle_rad } = detection.image_box;
        let image_box = ImageBox {
            centre_px: centre_px.map(|px| by * px),
            length_px: by * length_px,
            width_px: by * width_px,
            angle_rad,
        };
        ImageDetection { image_box, ..detection }
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::VehicleClass;

    use super::*;

    #[test]
    fn a_reduced_picture_has_the_means_and_its_boxes_lie_in_the_whole_picture() {
        let (width, height) = (50_usize, 30_usize);
        let rgb: Vec<u8> = (0..width * height).flat_map(|pixel| [u8::try_from(pixel % 50).unwrap(), 90, 0]).collect();
        let image = Image { width: 50, height: 30, rgb };
        let reduced = Acquisition::PUBLISHED.reduced(&image);
        assert_eq!((reduced.width, reduced.height), (16, 8));
        assert_eq!(reduced.pixel(0, 0), Some([1, 90, 0]));
        assert_eq!(reduced.pixel(15, 7), Some([46, 90, 0]));
        assert_eq!(Acquisition::STRIP.reduced(&image), image);
        let image_box = ImageBox { centre_px: [10.0, 4.0], length_px: 5.0, width_px: 2.0, angle_rad: 0.1 };
        let found = ImageDetection { image_box, class: VehicleClass::Car, score: 0.9 };
        let whole = Acquisition::PUBLISHED.enlarged(found).image_box;
        assert_eq!(whole, ImageBox { centre_px: [30.0, 12.0], length_px: 15.0, width_px: 6.0, angle_rad: 0.1 });
        assert!((Acquisition::PUBLISHED.focal_px() - 2_736.0).abs() < 1e-9);
    }
}
