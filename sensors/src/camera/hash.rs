//! Reproducible noise that depends on the position, not on the order of evaluation.
//!
//! The noise of a pixel depends only on a key and on the pixel's coordinates, so a crop has the
//! same noise as the whole image. The camera therefore uses a hash instead of a random stream: the
//! finaliser of SplitMix64 (Steele, Lea and Flood, *Fast splittable pseudorandom number
//! generators*, 2014). With a counter as input it passes the usual statistical test batteries.

/// Hashes 64 bits.
#[inline]
pub const fn mix(bits: u64) -> u64 {
    let bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// Hashes a key and two integers, such as the coordinates of a pixel or of a cell.
#[inline]
pub(crate) const fn mix_at(key: u64, x: i32, y: i32) -> u64 {
    mix(key ^ ((x as u32 as u64) << 32 | y as u32 as u64))
}

/// Converts the topmost bits to a number from 0 (inclusive) to 1 (exclusive).
#[inline]
pub(crate) const fn unit(bits: u64) -> f32 {
    /// 2⁻²⁴, because an `f32` has 24 significant bits.
    const STEP: f32 = 1.0 / 16_777_216.0;
    (bits >> 40) as f32 * STEP
}

/// Returns three approximately normal numbers with mean 0 and standard deviation 1, within ±3. Each
/// is the sum of three uniform numbers of 7 bits (Irwin–Hall distribution).
pub(crate) fn normal3(bits: u64) -> [f32; 3] {
    const BITS: u32 = 7;
    const MASK: u64 = (1 << BITS) - 1;
    /// Mean of the sum of three uniform numbers from 0 to 127.
    const MEAN: f32 = 1.5 * MASK as f32;
    /// Reciprocal of the standard deviation of that sum, √(3·(128² − 1)/12).
    const PER_SD: f32 = 1.0 / 64.0;
    [0, 1, 2].map(|channel| {
        let part = bits >> (3 * BITS * channel);
        let sum = (part & MASK) + ((part >> BITS) & MASK) + ((part >> (2 * BITS)) & MASK);
        (sum as f32 - MEAN) * PER_SD
    })
}

/// Splits `x` into its integer part, rounded down, and its fractional part.
#[inline]
pub(crate) fn split(x: f32) -> (i32, f32) {
    // Rounding down by a cast is several times as fast as a call of `f32::floor`.
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates: far cells just share their noise")]
    let towards_zero = x as i32;
    let whole = if towards_zero as f32 > x { towards_zero.wrapping_sub(1) } else { towards_zero };
    (whole, x - whole as f32)
}

fn smoothstep(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}

/// Value noise along a line, with cells of size 1, which remembers its latest cell.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LineNoise {
    cell: Option<i32>,
    ends: [f32; 2],
}

impl LineNoise {
    /// Returns the noise of `key` at `x`, from 0 (inclusive) to 1 (exclusive). The key must be the
    /// same in all calls.
    #[inline]
    pub(crate) fn at(&mut self, key: u64, x: f32) -> f32 {
        let (cell, within) = split(x);
        if self.cell != Some(cell) {
            self.cell = Some(cell);
            self.ends = [unit(mix_at(key, cell, 0)), unit(mix_at(key, cell.wrapping_add(1), 0))];
        }
        let [low, high] = self.ends;
        low + (high - low) * smoothstep(within)
    }
}

/// Value noise in a plane, with cells of size 1, which remembers the corners of its latest cell:
/// neighbouring samples often share it, and hashing its corners takes most of the time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PlaneNoise {
    cell: Option<[i32; 2]>,
    corners: [f32; 4],
}

impl PlaneNoise {
    /// Returns the noise of `key` at (x, y), from 0 (inclusive) to 1 (exclusive). The key must be
    /// the same in all calls.
    #[inline]
    pub(crate) fn at(&mut self, key: u64, x: f32, y: f32) -> f32 {
        let ((i, fx), (j, fy)) = (split(x), split(y));
        if self.cell != Some([i, j]) {
            let (i1, j1) = (i.wrapping_add(1), j.wrapping_add(1));
            self.cell = Some([i, j]);
            self.corners = [(i, j), (i1, j), (i, j1), (i1, j1)].map(|(i, j)| unit(mix_at(key, i, j)));
        }
        let [low, high, far_low, far_high] = self.corners;
        let across = smoothstep(fx);
        let near = low + (high - low) * across;
        let far = far_low + (far_high - far_low) * across;
        near + (far - near) * smoothstep(fy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_numbers_have_mean_0_and_standard_deviation_1() {
        let samples: Vec<f32> = (0..20_000).flat_map(|i| normal3(mix(i))).collect();
        let count = samples.len() as f32;
        let mean = samples.iter().sum::<f32>() / count;
        let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / count;
        assert!(mean.abs() < 0.02, "{mean}");
        assert!((variance - 1.0).abs() < 0.03, "{variance}");
    }

    #[test]
    fn noise_is_continuous_across_cells() {
        for cell in -3_i16..3 {
            let edge = f32::from(cell);
            let (mut line, mut plane) = (LineNoise::default(), PlaneNoise::default());
            assert!((line.at(7, edge - 1e-4) - line.at(7, edge + 1e-4)).abs() < 1e-3);
            assert!((plane.at(7, edge - 1e-4, 0.3) - plane.at(7, edge + 1e-4, 0.3)).abs() < 1e-3);
        }
    }

    #[test]
    fn earlier_samples_do_not_change_the_noise() {
        let (mut line, mut plane) = (LineNoise::default(), PlaneNoise::default());
        for step in 0_u16..2_000 {
            let (x, y) = (0.37 * f32::from(step % 50) - 9.0, 0.29 * f32::from(step / 50) - 5.0);
            assert_eq!(line.at(7, x).to_bits(), LineNoise::default().at(7, x).to_bits());
            assert_eq!(plane.at(7, x, y).to_bits(), PlaneNoise::default().at(7, x, y).to_bits());
        }
        assert_ne!(plane.at(7, 0.5, 1.5), plane.at(7, 0.5, 2.5));
        assert_ne!(plane.at(7, 0.5, 1.5), plane.at(7, 1.5, 1.5));
    }
}
