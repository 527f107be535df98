//! The standard normal distribution between two bounds, accurate in both tails.
//!
//! Φ and its inverse are taken in whichever tail is the smaller one, so that neither 1 − 10⁻²⁰ nor a truncation at
//! five standard deviations costs any digits. The inverse comes from statrs with 11 digits, and one step of Newton's
//! method with libm's complementary error function makes them 15.

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

use libm::erfc;
use statrs::function::erf::erfc_inv;

/// The probability below `z`.
fn below(z: f64) -> f64 {
    0.5 * erfc(-z * FRAC_1_SQRT_2)
}

/// The z below which `probability` lies; infinite for 0.
fn quantile(probability: f64) -> f64 {
    let z = -SQRT_2 * erfc_inv(2.0 * probability);
    let density = (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
    let step = (below(z) - probability) / density;
    // The density is 0 where z is infinite, or so far out that its square has no exponential.
    if step.is_finite() { z - step } else { z }
}

/// The standard normal distribution, cut off at two bounds, of which either may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TruncatedStandardNormal {
    low: f64,
    high: f64,
    /// Probability below the lower bound, before the cut.
    below_low: f64,
    /// Probability above the upper bound, before the cut.
    above_high: f64,
    /// Probability between the bounds, before the cut.
    mass: f64,
}

impl TruncatedStandardNormal {
    /// The distribution between `low` and `high`; nothing where no probability is left between them.
    pub(super) fn new(low: f64, high: f64) -> Option<Self> {
        let mass = probability_between(low, high);
        // Not subnormal, or digits would be lost in dividing by it.
        (mass >= f64::MIN_POSITIVE).then(|| Self { low, high, below_low: below(low), above_high: below(-high), mass })
    }

    /// The z below which the share `u` of the probability between the bounds lies.
    pub(super) fn quantile(&self, u: f64) -> f64 {
        let from_below = self.below_low + u * self.mass;
        let from_above = self.above_high + (1.0 - u) * self.mass;
        let z = if from_below <= from_above { quantile(from_below) } else { -quantile(from_above) };
        z.clamp(self.low, self.high)
    }

    /// The share of the probability between the bounds that lies below `z`.
    pub(super) fn cdf(&self, z: f64) -> f64 {
        (probability_between(self.low, z.clamp(self.low, self.high)) / self.mass).clamp(0.0, 1.0)
    }
}

/// The probability between two bounds, from differences in the tail where they do not cancel.
fn probability_between(low: f64, high: f64) -> f64 {
    if low > 0.0 { below(-low) - below(-high) } else { below(high) - below(low) }
}
