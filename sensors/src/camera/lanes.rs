//! The four moments of a pixel at once, in the lanes of one vector.
//!
//! Each lane takes the same steps in the same order as a single sample. Its bits are therefore the
//! same: additions, multiplications, divisions and square roots round alike, and nothing is fused.
//! Where the moments of a pixel differ in kind, such as at the edge of the road, they are computed
//! one by one instead.

use wide::{f32x4, i32x4};

use super::hash::{mix_at, unit};
use super::light::Illumination;
use super::mesh::Vec3;

/// Radiance by colour and moment.
pub(crate) type Radiance = [f32x4; 3];

/// Returns the mean over the moments, which are added in their order.
#[inline]
pub(crate) fn mean([red, green, blue]: Radiance) -> Vec3 {
    let moments = f32x4::transpose([red, green, blue, f32x4::splat(0.0)]);
    let sum = moments.into_iter().fold(f32x4::splat(0.0), |sum, moment| sum + moment);
    let [red, green, blue, _] = (sum / f32x4::splat(4.0)).to_array();
    [red, green, blue]
}

/// Returns true if a condition holds for no moment.
#[inline]
pub(crate) fn none(condition: f32x4) -> bool {
    !condition.any()
}

/// Splits each number into its integer part, rounded down, and its fractional part, as
/// [`super::hash::split`] does.
#[inline]
pub(crate) fn split(x: f32x4) -> (i32x4, f32x4) {
    let towards_zero = x.trunc_int();
    let is_above = towards_zero.round_float().simd_gt(x);
    let whole = is_above.select(towards_zero - i32x4::splat(1), towards_zero);
    (whole, x - whole.round_float())
}

/// Returns the remaining share of `radiance` behind this distance of air (m), plus the light that
/// the air adds.
#[inline]
pub(crate) fn through_air(light: &Illumination, radiance: Radiance, distance_m: f32x4) -> Radiance {
    let left = exp_negative(f32x4::splat(light.extinction_per_m) * distance_m);
    std::array::from_fn(|i| {
        let air = f32x4::splat(light.horizon[i]);
        air + (radiance[i] - air) * left
    })
}

/// Returns e^−x as the light's own series does.
#[inline]
fn exp_negative(x: f32x4) -> f32x4 {
    let [one, half, sixth, of_fourth] = [1.0, 0.5, 1.0 / 6.0, 24.0].map(f32x4::splat);
    let x = (x / f32x4::splat(16.0)).min(f32x4::splat(4.0));
    let inverse = one + x * (one + x * (half + x * (sixth + x / of_fourth)));
    let second = inverse * inverse;
    let fourth = second * second;
    let eighth = fourth * fourth;
    one / (eighth * eighth)
}

#[inline]
fn smoothstep(x: f32x4) -> f32x4 {
    x * x * (f32x4::splat(3.0) - f32x4::splat(2.0) * x)
}

/// [`super::hash::LineNoise`] of four moments.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LineNoise {
    is_filled: bool,
    cell: i32x4,
    ends: [[f32; 4]; 2],
}

impl LineNoise {
    /// Returns the noise of `key` at each `x`. The key must be the same in all calls.
    #[inline]
    pub(crate) fn at(&mut self, key: u64, x: f32x4) -> f32x4 {
        let (cell, within) = split(x);
        if !(self.is_filled && cell.simd_eq(self.cell).all()) {
            for (lane, cell) in cell.to_array().into_iter().enumerate() {
                self.ends[0][lane] = unit(mix_at(key, cell, 0));
                self.ends[1][lane] = unit(mix_at(key, cell.wrapping_add(1), 0));
            }
            (self.is_filled, self.cell) = (true, cell);
        }
        let [low, high] = self.ends.map(f32x4::from);
        low + (high - low) * smoothstep(within)
    }
}

/// [`super::hash::PlaneNoise`] of four moments.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PlaneNoise {
    is_filled: bool,
    cells: [i32x4; 2],
    /// The corners (i, j), (i + 1, j), (i, j + 1) and (i + 1, j + 1) of each moment's cell.
    corners: [[f32; 4]; 4],
}

impl PlaneNoise {
    /// Returns the noise of `key` at each (x, y). The key must be the same in all calls.
    #[inline]
    pub(crate) fn at(&mut self, key: u64, x: f32x4, y: f32x4) -> f32x4 {
        let ((i, within_x), (j, within_y)) = (split(x), split(y));
        if !(self.is_filled && (i.simd_eq(self.cells[0]) & j.simd_eq(self.cells[1])).all()) {
            self.fill(key, [i, j]);
        }
        let [low, high, far_low, far_high] = self.corners.map(f32x4::from);
        let across = smoothstep(within_x);
        let near = low + (high - low) * across;
        let far = far_low + (far_high - far_low) * across;
        near + (far - near) * smoothstep(within_y)
    }

    /// Moves to other cells. Along a row of the image, the next cell often shares an edge with the
    /// latest one.
    fn fill(&mut self, key: u64, cells: [i32x4; 2]) {
        let [before_i, before_j] = self.cells.map(i32x4::to_array);
        let [to_i, to_j] = cells.map(i32x4::to_array);
        let [low, high, far_low, far_high] = &mut self.corners;
        for lane in 0..4 {
            let (i, j) = (to_i[lane], to_j[lane]);
            let (i1, j1) = (i.wrapping_add(1), j.wrapping_add(1));
            let edge = |j: i32| [i, i1].map(|i| unit(mix_at(key, i, j)));
            let is_beside = self.is_filled && i == before_i[lane];
            let is_next = is_beside && j == before_j[lane].wrapping_add(1);
            let is_previous = is_beside && j1 == before_j[lane];
            if is_beside && j == before_j[lane] {
                continue;
            }
            let near = if is_next { [far_low[lane], far_high[lane]] } else { edge(j) };
            let far = if is_previous { [low[lane], high[lane]] } else { edge(j1) };
            [low[lane], high[lane]] = near;
            [far_low[lane], far_high[lane]] = far;
        }
        (self.is_filled, self.cells) = (true, cells);
    }
}

#[cfg(test)]
mod tests {
    use super::super::hash;
    use super::*;

    #[test]
    fn noise_has_the_bits_of_a_single_sample_after_any_earlier_sample() {
        let (mut line, mut plane) = (LineNoise::default(), PlaneNoise::default());
        for step in 0_u16..4_000 {
            // To and fro, in steps of less and of more than a cell, and across 0.
            let x = [0.31, -0.7, 0.011, 2.3].map(|rate: f32| rate * (f32::from(step % 97) - 40.0));
            let y = [0.2, 0.9, -1.1, 0.0].map(|rate: f32| rate * (f32::from(step / 97) - 20.0));
            let on_line = line.at(9, x.into()).to_array();
            let in_plane = plane.at(7, x.into(), y.into()).to_array();
            for lane in 0..4 {
                let single = hash::LineNoise::default().at(9, x[lane]);
                assert_eq!(on_line[lane].to_bits(), single.to_bits(), "{x:?}");
                let single = hash::PlaneNoise::default().at(7, x[lane], y[lane]);
                assert_eq!(in_plane[lane].to_bits(), single.to_bits(), "{x:?} {y:?}");
            }
        }
    }

    #[test]
    fn numbers_are_split_like_single_numbers_even_beyond_the_integers() {
        let numbers =
            [-0.0, 0.0, -1.0, 1.0, -1.5, 0.999, 3e9, -3e9, f32::INFINITY, f32::NEG_INFINITY, 16_777_217.0, -7e-9];
        for four in numbers.chunks_exact(4) {
            let four: [f32; 4] = four.try_into().unwrap();
            let (whole, part) = split(four.into());
            for lane in 0..4 {
                let single = hash::split(four[lane]);
                assert_eq!(
                    (whole.to_array()[lane], part.to_array()[lane].to_bits()),
                    (single.0, single.1.to_bits()),
                    "{four:?}"
                );
            }
        }
    }
}
