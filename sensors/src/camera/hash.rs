//! Reproducible noise that is a function of place, not of order.
//!
//! A pixel's noise may depend on nothing but the key and the pixel, or a crop would differ from the whole image. So
//! the camera draws from a hash instead of from a stream: the finaliser of SplitMix64 (Steele, Lea and Flood, *Fast
//! splittable pseudorandom number generators*, 2014), which passes the usual test batteries when fed with counters.

/// Scrambles 64 bits.
#[inline]
pub(crate) const fn mix(bits: u64) -> u64 {
    let bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

/// Scrambles a key and two whole numbers.
#[inline]
pub(crate) const fn mix_at(key: u64, x: i32, y: i32) -> u64 {
    mix(key ^ ((x as u32 as u64) << 32 | y as u32 as u64))
}

/// The topmost bits as a number in [0, 1).
#[inline]
pub(crate) const fn unit(bits: u64) -> f32 {
    /// 2⁻²⁴: a `f32` has 24 significant bits.
    const STEP: f32 = 1.0 / 16_777_216.0;
    (bits >> 40) as f32 * STEP
}

/// Three roughly normal numbers of mean 0 and standard deviation 1, within ±3: each the sum of three uniform ones
/// of 7 bits (Irwin–Hall).
pub(crate) fn normal3(bits: u64) -> [f32; 3] {
    const BITS: u32 = 7;
    const MASK: u64 = (1 << BITS) - 1;
    /// Mean of the sum of three numbers 0 … 127.
    const MEAN: f32 = 1.5 * MASK as f32;
    /// 1 / standard deviation of that sum: √(3·(128² − 1)/12).
    const PER_SD: f32 = 1.0 / 64.0;
    [0, 1, 2].map(|channel| {
        let part = bits >> (3 * BITS * channel);
        let sum = (part & MASK) + ((part >> BITS) & MASK) + ((part >> (2 * BITS)) & MASK);
        (sum as f32 - MEAN) * PER_SD
    })
}

/// The whole number at or below `x`, and how far `x` lies above it.
#[inline]
pub(crate) fn split(x: f32) -> (i32, f32) {
    // Rounding down by a cast is several times as fast as calling the library's floor.
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates: far cells just share their noise")]
    let towards_zero = x as i32;
    let whole = if towards_zero as f32 > x { towards_zero.wrapping_sub(1) } else { towards_zero };
    (whole, x - whole as f32)
}

fn smooth(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}

/// Value noise in [0, 1) along a line, with cells of size 1.
pub(crate) fn noise_1d(key: u64, x: f32) -> f32 {
    let (cell, within) = split(x);
    let (low, high) = (unit(mix_at(key, cell, 0)), unit(mix_at(key, cell.wrapping_add(1), 0)));
    low + (high - low) * smooth(within)
}

/// Value noise in [0, 1) in a plane, with cells of size 1.
#[inline]
pub(crate) fn noise_2d(key: u64, x: f32, y: f32) -> f32 {
    let ((i, fx), (j, fy)) = (split(x), split(y));
    let (i1, j1) = (i.wrapping_add(1), j.wrapping_add(1));
    let corner = |i, j| unit(mix_at(key, i, j));
    let across = smooth(fx);
    let near = corner(i, j) + (corner(i1, j) - corner(i, j)) * across;
    let far = corner(i, j1) + (corner(i1, j1) - corner(i, j1)) * across;
    near + (far - near) * smooth(fy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_numbers_have_mean_0_and_deviation_1() {
        let drawn: Vec<f32> = (0..20_000).flat_map(|i| normal3(mix(i))).collect();
        let count = drawn.len() as f32;
        let mean = drawn.iter().sum::<f32>() / count;
        let variance = drawn.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / count;
        assert!(mean.abs() < 0.02, "{mean}");
        assert!((variance - 1.0).abs() < 0.03, "{variance}");
    }

    #[test]
    fn noise_is_continuous_across_cells() {
        for cell in -3_i16..3 {
            let edge = f32::from(cell);
            assert!((noise_1d(7, edge - 1e-4) - noise_1d(7, edge + 1e-4)).abs() < 1e-3);
            assert!((noise_2d(7, edge - 1e-4, 0.3) - noise_2d(7, edge + 1e-4, 0.3)).abs() < 1e-3);
        }
    }
}
