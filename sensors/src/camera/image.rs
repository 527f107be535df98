//! Pictures: the whole image, the crop that the classifier sees, and an image with its truth.

use super::pinhole::PixelRect;

/// Side of the classifier's input [px].
pub const CROP_PX: usize = 32;
/// Colour channels: red, green, blue.
pub const CHANNELS: usize = 3;

/// A picture: rows from the top, three bytes for each pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Red, green, blue of each pixel.
    pub rgb: Vec<u8>,
}

impl Image {
    /// The colour of a pixel, or nothing beyond the image.
    pub fn pixel(&self, column: u32, row: u32) -> Option<[u8; 3]> {
        if column >= self.width {
            return None;
        }
        let first = (row as usize * self.width as usize + column as usize) * CHANNELS;
        let bytes = self.rgb.get(first..first + CHANNELS)?;
        Some([bytes[0], bytes[1], bytes[2]])
    }
}

/// What the classifier sees of one object: 32 × 32 pixels picked out of a square window of the image.
///
/// A window of side n is sampled at columns `left + ⌊(2i + 1)·n/64⌋`, i = 0 … 31, and likewise in rows: every
/// (n/32)-th pixel of a near object, all of a far one's, some twice where it is farther still. No pixel is averaged
/// with others, so each is that of the whole image, bit for bit. Beyond the image all is black.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crop {
    /// The window of the image that was sampled: square.
    pub window: PixelRect,
    /// Red, green, blue of each of the 32 × 32 samples, rows from the top.
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

/// The pixels along one axis that a crop samples from a window starting at `start` and `extent` wide.
pub(crate) fn crop_places(start: i32, extent: u32) -> [i32; CROP_PX] {
    #[expect(clippy::cast_possible_wrap, reason = "windows are a few thousand pixels at most")]
    std::array::from_fn(|i| start + ((2 * i as u32 + 1) * extent / (2 * CROP_PX as u32)) as i32)
}

/// An image with the truth about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelledImage {
    /// The image.
    pub image: Image,
    /// For each pixel, rows from the top: 0, or 1 + the place of the vehicle in the scene's list of others.
    pub instances: Vec<u16>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_picks_every_nth_pixel_from_the_middle_of_its_cells() {
        assert_eq!(crop_places(10, 32)[..3], [10, 11, 12]);
        assert_eq!(crop_places(-5, 96)[..3], [-4, -1, 2]);
        assert_eq!(crop_places(0, 16)[..4], [0, 0, 1, 1]);
        assert_eq!(crop_places(0, 96)[CROP_PX - 1], 94);
    }
}
