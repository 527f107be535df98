//! The effect of a fault of the camera on the pixels that the classifier receives. Glare is light,
//! and part of the exposure ([`Frame::add_glare`](super::Frame::add_glare)). Dirt and blur change
//! the pixels of the exposure.

use super::image::{CHANNELS, CROP_PX, Crop, Image, sample_positions};
use super::picture::Resolution;
use super::sampling::Sampling;
use closecall_traffic::maths;

/// Side of the cells of the image that a blot of dirt covers or leaves (px of the usual image). On
/// a lens of 5 mm with 1280 pixels, a blot of 0.15 mm covers about 40 pixels (assumption).
const BLOT_PX: i32 = 40;
/// Colour of light that has passed through dirt, sRGB (assumption: dark brown, as of dried road
/// spray).
const DIRT_RGB: [f32; CHANNELS] = [70.0, 62.0, 52.0];
/// Key of the pattern of blots. The same for all runs, so that dirt does not change between paired
/// arms.
const BLOT_KEY: u64 = 0x0b10_7b10_7b10_70b1;

/// The effects of faults of a rear camera at one instant. None by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraFault {
    /// Name of the camera; `None` if each has the fault.
    pub sensor: Option<&'static str>,
    /// The camera delivers no image.
    pub is_dead: bool,
    /// The camera delivers its latest image again and again.
    pub is_frozen: bool,
    /// Stray light of the sun, relative to that in a healthy young eye.
    pub sun_glare: f64,
    /// Stray light of the main beam of the nearest vehicle behind, relative to that in a healthy
    /// young eye.
    pub main_beam_glare: f64,
    /// Share of the lens that dirt covers (0 to 1).
    pub dirt: f64,
    /// Standard deviation of the blur of an image out of focus (px).
    pub blur_px: f64,
}

impl CameraFault {
    /// Changes the pixels of a crop of an image of this size.
    #[expect(clippy::cast_possible_truncation, reason = "pixels need no more than single precision")]
    pub fn apply(&self, crop: &mut Crop, image: Resolution) {
        if self.dirt > 0.0 {
            self.cover(crop, image);
        }
        if self.blur_px > 0.0 {
            blur(crop, (self.blur_px * CROP_PX as f64 / f64::from(crop.window.width)) as f32);
        }
    }

    /// Changes the pixels of a picture of the columns and rows `sampling` of an image of this size.
    #[expect(clippy::cast_possible_truncation, reason = "pixels need no more than single precision")]
    pub fn apply_to_picture(&self, picture: &mut Image, sampling: &Sampling, image: Resolution) {
        if self.dirt > 0.0 {
            let places =
                sampling.rows().iter().flat_map(|row| sampling.columns().iter().map(move |column| [column, row]));
            for (pixel, place) in picture.rgb.chunks_exact_mut(CHANNELS).zip(places) {
                if is_blot(place.map(|at| cell_of(*at, image)), self.dirt) {
                    pixel.iter_mut().zip(DIRT_RGB).for_each(|(value, dirt)| *value = to_byte(dirt));
                }
            }
        }
        if self.blur_px > 0.0 {
            blur_picture(picture, sampling, self.blur_px as f32);
        }
    }

    /// Covers the pixels that lie behind a blot.
    fn cover(&self, crop: &mut Crop, image: Resolution) {
        let columns = sample_positions(crop.window.left, crop.window.width);
        let rows = sample_positions(crop.window.top, crop.window.height);
        for (index, pixel) in crop.rgb.chunks_exact_mut(CHANNELS).enumerate() {
            let cell = [columns[index % CROP_PX], rows[index / CROP_PX]].map(|at| cell_of(at, image));
            if is_blot(cell, self.dirt) {
                pixel.iter_mut().zip(DIRT_RGB).for_each(|(value, dirt)| *value = to_byte(dirt));
            }
        }
    }
}

/// Returns the cell that a column or a row of an image of this size is in. The cells cover the same
/// part of each image.
fn cell_of(at: i32, image: Resolution) -> i32 {
    image.in_usual(at).div_euclid(BLOT_PX)
}

/// Returns whether a cell of the image lies behind a blot: the cells are covered at random with the
/// probability `share`.
fn is_blot([column, row]: [i32; 2], share: f64) -> bool {
    let mut z = BLOT_KEY ^ ((column as u32 as u64) << 32 | row as u32 as u64);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 <= share && share > 0.0
}

/// Blurs a crop with a Gaussian kernel of this standard deviation (crop pixels), along rows and
/// columns.
fn blur(crop: &mut Crop, sd: f32) {
    if sd < 0.1 {
        return;
    }
    let side = CROP_PX as i32;
    let weights: [f32; CROP_PX] = std::array::from_fn(|at| maths::exp(-0.5 * (at as f32 / sd).powi(2)));
    let mut blurred = [0_u8; CROP_PX * CROP_PX * CHANNELS];
    for [step, across] in [[CHANNELS as i32, CHANNELS as i32 * side], [CHANNELS as i32 * side, CHANNELS as i32]] {
        for line in 0..side {
            for at in 0..side {
                for channel in 0..CHANNELS as i32 {
                    let (mut sum, mut total) = (0.0, 0.0);
                    for from in 0..side {
                        let weight = weights[(from - at).unsigned_abs() as usize];
                        sum += weight * f32::from(crop.rgb[(line * across + from * step + channel) as usize]);
                        total += weight;
                    }
                    blurred[(line * across + at * step + channel) as usize] = to_byte(sum / total);
                }
            }
        }
        crop.rgb.copy_from_slice(&blurred);
    }
}

/// Blurs a picture of these columns and rows with a Gaussian kernel of this standard deviation (px
/// of the image), along rows and columns. Pixels count by their distance in the image.
fn blur_picture(picture: &mut Image, sampling: &Sampling, sd_px: f32) {
    /// Distance beyond which a pixel does not count (standard deviations).
    const REACH: f32 = 3.0;
    let width = sampling.columns().len();
    for (places, lines, step, across) in
        [(sampling.columns(), sampling.rows().len(), 1, width), (sampling.rows(), width, width, 1)]
    {
        let sharp = picture.rgb.clone();
        for (at, place) in places.iter().enumerate() {
            let weights: Vec<(usize, f32)> = places
                .iter()
                .enumerate()
                .map(|(from, other)| (from, (other - place) as f32 / sd_px))
                .filter(|(_, apart)| apart.abs() <= REACH)
                .map(|(from, apart)| (from, maths::exp(-0.5 * apart * apart)))
                .collect();
            let total: f32 = weights.iter().map(|(_, weight)| weight).sum();
            for line in 0..lines {
                for channel in 0..CHANNELS {
                    let index = |along: usize| (line * across + along * step) * CHANNELS + channel;
                    let sum: f32 = weights.iter().map(|(from, weight)| weight * f32::from(sharp[index(*from)])).sum();
                    picture.rgb[index(at)] = to_byte(sum / total);
                }
            }
        }
    }
}

/// Rounds to a pixel's value.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn to_byte(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}
