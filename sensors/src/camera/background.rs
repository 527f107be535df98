//! The background of the pixels of one row, at all four moments at once.
//!
//! Most pixels show nothing but ground or sky, and the ego sees the same kind of it along a row. If
//! the moments of a pixel differ in kind, [`Frame::sample`] computes them one by one with the same
//! bits.

use wide::f32x4;

use super::Frame;
use super::body::MOMENTS;
use super::ground::GROUND_TO_M;
use super::ground::{GroundLight, GroundNoiseLanes, GroundRow};
use super::lanes::{mean, through_air};
use super::mesh::Vec3;
use super::sky::{SkyNoiseLanes, radiances};

/// What lies behind the vehicles in a row of the image.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Background {
    /// Ground or sky, which differs from pixel to pixel.
    #[default]
    Mixed,
    /// The ground.
    Ground {
        row: GroundRow,
        /// Depth by moment (m), and the sum of 1/depth over the moments (1/m).
        depth_m: f32x4,
        nearness: f32,
    },
    /// The sky and the woods, seen in directions with these parts against the camera's axis and up,
    /// by moment.
    Sky { ahead: f32x4, up: f32x4 },
}

/// The noise of the textures, with its latest cells.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BackgroundNoise {
    ground: GroundNoiseLanes,
    sky: SkyNoiseLanes,
}

impl Background {
    /// Returns the background of a row, given the y of its rays by moment, the largest magnitude of
    /// their x, and the distance that the ego has moved (m).
    pub(super) fn new(frame: &Frame, y: [f32; MOMENTS], widest: [f32; MOMENTS], travelled_m: [f32; MOMENTS]) -> Self {
        let height_m = frame.lens.height_m as f32;
        let is_ground =
            |[ahead, left, up]: [f32; 3]| up / (ahead * ahead + left * left).sqrt() * GROUND_TO_M < -height_m;
        let ray = |moment: usize, x: f32| frame.lens.ray_in_level_axes([x, y[moment]]);
        // Rounding is monotone: the outermost sample has the smallest slope, and a sample in the
        // middle the largest. If the outermost sample meets the ground, all samples meet it. If the
        // middle sample does not, no sample does.
        if (0..MOMENTS).all(|moment| is_ground(ray(moment, widest[moment]))) {
            if frame.lens.is_turned() {
                // The points of a row do not lie at one distance behind the ego.
                return Self::Mixed;
            }
            let [ahead, _, up] = lanes(|moment| ray(moment, 0.0));
            let depth_m: [f32; MOMENTS] = std::array::from_fn(|moment| -height_m / up[moment]);
            let x = std::array::from_fn(|moment| ahead[moment] * depth_m[moment]);
            let nearness = depth_m.iter().fold(0.0, |sum, depth_m| sum + 1.0 / depth_m);
            let row = GroundRow::new(x, travelled_m, &frame.light);
            return Self::Ground { row, depth_m: depth_m.into(), nearness };
        }
        if (0..MOMENTS).all(|moment| !is_ground(ray(moment, 0.0))) {
            let [ahead, _, up] = lanes(|moment| ray(moment, 0.0));
            return Self::Sky { ahead: ahead.into(), up: up.into() };
        }
        Self::Mixed
    }
}

/// Returns the three parts of the rays, each by moment.
fn lanes(ray: impl Fn(usize) -> [f32; 3]) -> [[f32; MOMENTS]; 3] {
    std::array::from_fn(|part| std::array::from_fn(|moment| ray(moment)[part]))
}

impl Frame {
    /// Returns the mean radiance of the background that a pixel shows, and the sum of 1/depth over
    /// its moments (1/m), which is 0 for the sky. `x` is the x of its rays, by moment, and `length`
    /// is the length of the ray through its middle. Returns `None` if the moments differ in kind.
    #[inline]
    pub(super) fn background(
        &self,
        background: &Background,
        x: f32x4,
        length: f32,
        lit: &GroundLight<'_>,
        noise: &mut BackgroundNoise,
    ) -> Option<(Vec3, f32)> {
        match background {
            Background::Mixed => None,
            Background::Ground { row, depth_m, nearness } => {
                let radiance = self.ground.radiances(row, x * *depth_m, lit, &mut noise.ground)?;
                let seen = through_air(&self.light, radiance, *depth_m * f32x4::splat(length));
                Some((mean(seen), *nearness))
            }
            Background::Sky { ahead, up } => {
                let slope = *up / (*ahead * *ahead + x * x).sqrt();
                let bearing = -x / *ahead + f32x4::splat(self.bearing_rad);
                Some((mean(radiances(slope, bearing, &self.light, &mut noise.sky)?), 0.0))
            }
        }
    }
}
