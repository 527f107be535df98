//! Image types: the whole image, the crop that the classifier receives, and an image with its
//! ground truth.

use super::picture::PixelRect;

/// Side of the classifier's input (px).
pub const CROP_PX: usize = 32;
/// Number of colour channels: red, green and blue.
pub const CHANNELS: usize = 3;

/// An 8-bit colour image, stored row by row from the top, with three bytes per pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Red, green and blue of each pixel.
    pub rgb: Vec<u8>,
}

impl Image {
    /// Returns the colour of a pixel, or `None` if the pixel lies outside the image.
    pub fn pixel(&self, column: u32, row: u32) -> Option<[u8; 3]> {
        if column >= self.width {
            return None;
        }
        let first = (row as usize * self.width as usize + column as usize) * CHANNELS;
        let bytes = self.rgb.get(first..first + CHANNELS)?;
        Some([bytes[0], bytes[1], bytes[2]])
    }

    /// Returns the image as a PNG file.
    ///
    /// # Errors
    /// The reason of the encoder, such as a size that does not agree with the number of bytes.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// The classifier's input for one object: 32 × 32 pixels sampled from a square window of the image.
///
/// A window of side n is sampled at the columns `left + ⌊(2i + 1)·n/64⌋`, i = 0 … 31, and at the
/// rows by the same formula. A large window (a near object) contributes every (n/32)-th pixel, a
/// window of 32 px every pixel, and a smaller window some pixels more than once. Pixels are not
/// averaged, so that each sample is identical, bit for bit, to a pixel of the whole image. Samples
/// outside the image are black.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crop {
    /// The square window of the image that was sampled.
    pub window: PixelRect,
    /// Red, green and blue of each of the 32 × 32 samples, row by row from the top.
    pub rgb: Vec<u8>,
}

impl Default for Crop {
    fn default() -> Self {
        Self {
            window: PixelRect { left: 0, top: 0, width: CROP_PX as u32, height: CROP_PX as u32 },
            rgb: vec![0; CROP_PX * CROP_PX * CHANNELS],
        }
    }
}

/// Returns the pixel coordinates that a crop samples along one axis of a window, which begins at
/// `start` and is `extent` pixels wide.
pub(crate) fn sample_positions(start: i32, extent: u32) -> [i32; CROP_PX] {
    #[expect(clippy::cast_possible_wrap, reason = "windows are a few thousand pixels at most")]
    std::array::from_fn(|i| start + ((2 * i as u32 + 1) * extent / (2 * CROP_PX as u32)) as i32)
}

/// An image with its ground truth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelledImage {
    /// The image.
    pub image: Image,
    /// The instance number of each pixel, row by row from the top: 1 + the index of the visible
    /// vehicle in [`Scene::others`](closecall_traffic::Scene::others), or 0 if the pixel shows no
    /// vehicle.
    pub instances: Vec<u16>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_samples_the_middle_pixel_of_each_of_its_cells() {
        assert_eq!(sample_positions(10, 32)[..3], [10, 11, 12]);
        assert_eq!(sample_positions(-5, 96)[..3], [-4, -1, 2]);
        assert_eq!(sample_positions(0, 16)[..4], [0, 0, 1, 1]);
        assert_eq!(sample_positions(0, 96)[CROP_PX - 1], 94);
    }
}
