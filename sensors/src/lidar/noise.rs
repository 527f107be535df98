//! The noise of a scan. Its random numbers are addressed by beam instead of drawn in sequence.
//!
//! Each scan draws one key from its random stream. Every number then follows from (key, beam,
//! purpose) through a 64-bit mix (the finaliser of SplitMix64, Steele et al. 2014). An additional
//! vehicle in the scene therefore does not change the noise of the beams that do not hit it, as
//! paired runs require.

use closecall_traffic::Stream;
use rand::Rng;

/// The purpose of a random number.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    /// Noise of the received power.
    Detection = 0,
    /// Error of the measured range.
    Range = 1,
    /// Loss of a return regardless of its power.
    Dropout = 2,
    /// Density of a clump of droplets in a spray plume.
    Plume = 3,
    /// Optical depth at which spray returns the light.
    Depth = 4,
    /// Error of the measured pitch of the ego.
    Levelling = 5,
    /// Optical depth at which fog returns the light.
    FogDepth = 6,
    /// Density of a clump of droplets in fog.
    FogClump = 7,
}

/// Least number that [`Noise::uniform`] returns.
pub(crate) const LEAST_UNIFORM: f32 = 0.5 / 8_388_608.0;
/// Number of purposes.
const PURPOSES: u64 = 8;
/// 2⁶⁴ divided by the golden ratio, the increment of SplitMix64.
const INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;
/// What tells the key of the faults of a scan from the key of its noise: an arbitrary number.
const FAULTS: u64 = 0x5c0f_fa17_0b5e_55ed;
/// What tells the key of the false alarms of a scan from the key of its noise: an arbitrary number.
const FALSE_ALARMS: u64 = 0xfa15_ea1a_2735_0001;
/// Mask of the lower half of each 32 bits.
const LOW_HALVES: u64 = 0x0000_ffff_0000_ffff;
/// Factor that scales a sum of four uniform numbers, of variance 1/12 each, to variance 1.
const SQRT_3: f32 = 1.732_050_8;

/// Bound on the magnitude of a normal number: 2·√3.
pub(crate) const MAX_NORMAL: f32 = 3.465;

/// The noise of a scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    key: u64,
    /// Factor of all normal numbers: 1, or 0 for a scan without noise.
    scale: f32,
}

impl Noise {
    /// Draws the key of a scan from the stream, as exactly one number.
    pub(crate) fn draw(rng: &mut Stream) -> Self {
        Self { key: rng.next_u64(), scale: 1.0 }
    }

    /// Returns the same noise with all normal numbers at zero.
    pub(crate) fn silenced(self) -> Self {
        Self { scale: 0.0, ..self }
    }

    /// Returns other noise for the same scan, for what faults do to it.
    pub(crate) fn of_faults(self) -> Self {
        Self { key: self.key ^ FAULTS, scale: 1.0 }
    }

    /// Returns other noise for the same scan, for the beams in which the receiver's noise alone
    /// exceeds the threshold.
    pub(crate) fn of_false_alarms(self) -> Self {
        Self { key: self.key ^ FALSE_ALARMS, scale: 1.0 }
    }

    /// Returns 64 random bits for a beam and a purpose.
    #[inline(always)]
    fn bits(self, beam: usize, purpose: Purpose) -> u64 {
        let counter = beam as u64 * PURPOSES + purpose as u64 + 1;
        let mut z = self.key.wrapping_add(counter.wrapping_mul(INCREMENT));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number that is uniform in the open interval from 0 to 1, at least
    /// [`LEAST_UNIFORM`].
    #[inline(always)]
    pub(crate) fn uniform(self, beam: usize, purpose: Purpose) -> f32 {
        ((self.bits(beam, purpose) >> 41) as u32 as f32 + 0.5) * (1.0 / 8_388_608.0)
    }

    /// Returns an approximately normal number with mean 0 and standard deviation 1: a sum of four
    /// uniform numbers, hence within ±3.47.
    ///
    /// It is faster than an exact normal number, and the same on every machine. The missing tails
    /// do not matter for the measurement of a single point among several.
    #[inline(always)]
    pub(crate) fn normal(self, beam: usize, purpose: Purpose) -> f32 {
        let bits = self.bits(beam, purpose);
        // Two sums of two numbers side by side.
        let pairs = (bits & LOW_HALVES) + (bits >> 16 & LOW_HALVES);
        let sum = pairs as u32 + (pairs >> 32) as u32;
        ((sum as f32 + 2.0) * (1.0 / 65_536.0) - 2.0) * SQRT_3 * self.scale
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};

    use super::*;

    fn noise() -> Noise {
        Noise::draw(&mut stream(1, 2, &ActorId::new("ego").unwrap(), "lidar"))
    }

    #[test]
    fn moments_match_the_standard_normal_distribution() {
        let draws: Vec<f64> = (0..100_000).map(|beam| noise().normal(beam, Purpose::Range).into()).collect();
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        // The tolerances are four standard errors.
        assert!(mean.abs() < 4.0 / n.sqrt(), "{mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{variance}");
        let beyond_two = draws.iter().filter(|x| x.abs() > 2.0).count() as f64 / n;
        assert!((beyond_two - 0.0455).abs() < 0.006, "{beyond_two}");
    }

    #[test]
    fn uniform_numbers_stay_in_the_open_interval_and_differ_by_purpose() {
        for beam in 0..10_000 {
            let value = noise().uniform(beam, Purpose::Dropout);
            assert!(value > 0.0 && value < 1.0);
        }
        assert_ne!(noise().bits(3, Purpose::Range), noise().bits(3, Purpose::Detection));
        assert_ne!(noise().bits(0, Purpose::Levelling), noise().bits(1, Purpose::Detection));
    }
}
