//! Values that the pixels of one row share. They are computed once per row or once per column, not
//! in each sample.
//!
//! All values have the bits that a single sample would compute. The noise of the textures is
//! remembered for each moment, because the samples of one moment follow a line on the road.

use wide::f32x4;

use super::Frame;
use super::background::{Background, BackgroundNoise};
use super::body::MOMENTS;
use super::effects::Effects;
use super::ground::GROUND_TO_M;
use super::ground::GroundNoise;
use super::line_memory::LineMemory;
use super::raster::SUBPIXEL_STEPS;
use super::sky::SkyNoise;

/// Offset within the pixel of its middle (1/256 px).
const MIDDLE: i32 = SUBPIXEL_STEPS / 2;

/// A row of the pixels that are being rendered.
pub(super) struct Line<'a> {
    /// Columns of the pixels.
    pub(super) columns: &'a [i32],
    /// The row.
    pub(super) row: i32,
    /// The effects that may touch the row.
    pub(super) effects: Effects,
    /// For each moment, whether all samples meet the ground.
    pub(super) is_ground: [bool; MOMENTS],
    /// Depth at which they do (m).
    pub(super) ground_depth_m: [f32; MOMENTS],
    /// Distance that the ego has moved along s, relative to the middle of the exposure (m).
    pub(super) travelled_m: [f32; MOMENTS],
    pub(super) noise: [(GroundNoise, SkyNoise); MOMENTS],
    /// What lies behind the vehicles, and the noise of its textures.
    pub(super) background: Background,
    pub(super) background_noise: BackgroundNoise,
    /// Whether a column of the image has one x and a row one y, which a distorted lens does not
    /// give.
    is_straight: bool,
    /// The x of the rays through each column: one for each moment, and one for the middle of the
    /// exposure.
    x: Vec<[f32; MOMENTS + 1]>,
    /// The y of the rays through the row, likewise.
    y: [f32; MOMENTS + 1],
    /// Largest magnitude of the x of each moment.
    widest: [f32; MOMENTS],
}

impl<'a> Line<'a> {
    /// Prepares the rendering of rows with these columns.
    pub(super) fn new(frame: &Frame, columns: &'a [i32], memory: LineMemory) -> Self {
        let LineMemory { effects, mut x } = memory;
        let is_straight = frame.lens.optics.is_straight();
        let width_px = frame.lens.image.width_px;
        let x_at = |column: &i32| {
            std::array::from_fn(|moment| coordinate(frame, [*column, width_px.into()], subpixel(frame, moment)[0]))
        };
        x.clear();
        if is_straight {
            x.extend(columns.iter().map(x_at));
        }
        let widest = std::array::from_fn(|moment| x.iter().map(|x| x[moment].abs()).fold(0.0, f32::max));
        Self {
            columns,
            row: 0,
            effects,
            is_ground: [false; MOMENTS],
            ground_depth_m: [0.0; MOMENTS],
            travelled_m: [0.0; MOMENTS],
            noise: Default::default(),
            background: Background::Mixed,
            background_noise: BackgroundNoise::default(),
            is_straight,
            x,
            y: [0.0; MOMENTS + 1],
            widest,
        }
    }

    /// Returns the memory for the next rendering.
    pub(super) fn into_memory(self) -> LineMemory {
        LineMemory { effects: self.effects, x: self.x }
    }

    /// Begins a row. `effects` may affect the tile that it is part of.
    pub(super) fn begin(&mut self, frame: &Frame, row: i32, effects: &Effects) {
        self.row = row;
        let [left, right] = [self.columns.first(), self.columns.last()].map(|column| column.map_or(0, |at| *at) as f32);
        self.effects.select(effects, &[left, row as f32, right + 1.0, row as f32 + 1.0]);
        let height_px = frame.lens.image.height_px;
        self.y = std::array::from_fn(|moment| coordinate(frame, [row, height_px.into()], subpixel(frame, moment)[1]));
        let further = frame.travelled_at(row);
        self.travelled_m = frame.travelled_m.map(|travelled_m| travelled_m + further);
        if !self.is_straight {
            return;
        }
        let [y @ .., _] = self.y;
        self.background = Background::new(frame, y, self.widest, self.travelled_m);
        let height = frame.lens.height_m as f32;
        for moment in 0..MOMENTS {
            // Rounding is monotone, so that the outermost sample has the smallest slope: if it
            // meets the ground, all do.
            let [ahead, left, up] = frame.lens.ray_in_level_axes([self.widest[moment], self.y[moment]]);
            let slope = up / (ahead * ahead + left * left).sqrt();
            self.is_ground[moment] = slope * GROUND_TO_M < -height;
            self.ground_depth_m[moment] = -height / up;
        }
    }

    /// Returns the ray of a moment through a pixel, in camera axes with depth 1: its (x, y).
    #[inline]
    pub(super) fn ray(&self, frame: &Frame, place: usize, moment: usize) -> [f32; 2] {
        if self.is_straight {
            return [self.x[place][moment], self.y[moment]];
        }
        let width_px = frame.lens.image.width_px;
        let x = coordinate(frame, [self.columns[place], width_px.into()], subpixel(frame, moment)[0]);
        frame.lens.optics.undistorted([x, self.y[moment]].map(f64::from)).map(|part| part as f32)
    }

    /// Returns the x of the rays through a pixel of the row, by moment. The lens must be straight.
    #[inline]
    pub(super) fn x(&self, place: usize) -> f32x4 {
        let [x @ .., _] = self.x[place];
        x.into()
    }

    /// Returns the ray through the middle of a pixel: its (x, y), and its length.
    #[inline]
    pub(super) fn centre(&self, frame: &Frame, place: usize) -> ([f32; 2], f32) {
        let [x, y] = self.ray(frame, place, MOMENTS);
        ([x, y], (x * x + y * y + 1.0).sqrt())
    }
}

/// Returns the offset within the pixel of the sample of a moment, or of the middle after the last
/// moment (1/256 px).
fn subpixel(frame: &Frame, moment: usize) -> [i32; 2] {
    frame.subpixel.get(moment).copied().unwrap_or([MIDDLE; 2])
}

/// Returns the position of a sample along an axis of an image that has this extent (px), in units
/// of the focal length.
fn coordinate(frame: &Frame, [pixel, extent]: [i32; 2], subpixel: i32) -> f32 {
    let position = (pixel * SUBPIXEL_STEPS + subpixel) as f32 / SUBPIXEL_STEPS as f32;
    (position - extent as f32 / 2.0) / frame.lens.focal_px as f32
}
