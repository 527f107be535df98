//! A second-order Butterworth low-pass filter, run forwards and backwards.
//!
//! The bilinear transform with a pre-warped corner frequency discretizes the analogue prototype
//! 1/(s² + √2·s + 1) (Oppenheim and Schafer, Discrete-Time Signal Processing, chapter 7). The
//! filter runs in both directions with steady-state initial conditions and odd reflection at the
//! ends. SciPy calls this `filtfilt`; the tests compare with it.

use closecall_traffic::maths;
use std::f64::consts::{PI, SQRT_2};

/// A second-order low-pass filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    feed_forward: [f64; 3],
    feed_back: [f64; 2],
}

impl LowPass {
    /// Creates the filter with its −3 dB corner at `corner_hz` for signals sampled at `rate_hz`.
    ///
    /// Returns `None` unless 0 < `corner_hz` < `rate_hz` / 2.
    pub fn new(corner_hz: f64, rate_hz: f64) -> Option<Self> {
        if !(corner_hz > 0.0 && corner_hz < 0.5 * rate_hz && rate_hz.is_finite()) {
            return None;
        }
        let warped = maths::tan(PI * corner_hz / rate_hz);
        let squared = warped * warped;
        let norm = 1.0 / (1.0 + SQRT_2 * warped + squared);
        let gain = squared * norm;
        Some(Self {
            feed_forward: [gain, 2.0 * gain, gain],
            feed_back: [2.0 * (squared - 1.0) * norm, (1.0 - SQRT_2 * warped + squared) * norm],
        })
    }

    /// Filters `signal` with zero phase shift and returns one value for each input value.
    ///
    /// Odd reflection extends the signal by `padding` samples beyond each end (SciPy's `padlen`, 9
    /// by default), or by as many as the signal has.
    pub fn forwards_and_backwards(&self, signal: &[f64], padding: usize) -> Vec<f64> {
        let [.., last] = signal else { return Vec::new() };
        let (first, end) = (signal[0], signal.len() - 1);
        let padding = padding.min(end);
        let before = (1..=padding).rev().map(|i| 2.0 * first - signal[i]);
        let after = (1..=padding).map(|i| 2.0 * last - signal[end - i]);
        let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        self.filter_in_place(&mut extended);
        extended.reverse();
        self.filter_in_place(&mut extended);
        extended.reverse();
        extended[padding..padding + signal.len()].to_vec()
    }

    /// Filters `signal` once, in place, starting from the steady state for its first value.
    fn filter_in_place(&self, signal: &mut [f64]) {
        let ([b0, b1, b2], [a1, a2]) = (self.feed_forward, self.feed_back);
        let Some(&first) = signal.first() else { return };
        let mut state_2 = (b2 - a2) * first;
        let mut state_1 = (b1 - a1) * first + state_2;
        for value in signal {
            let input = *value;
            let output = b0 * input + state_1;
            state_1 = b1 * input - a1 * output + state_2;
            state_2 = b2 * input - a2 * output;
            *value = output;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const PADDING: usize = 9;

    fn filter() -> LowPass {
        LowPass::new(1.3, 10.0).unwrap()
    }

    #[test]
    fn a_corner_outside_the_valid_range_is_refused() {
        for (corner, rate) in [(0.0, 10.0), (5.0, 10.0), (-1.0, 10.0), (f64::NAN, 10.0), (1.0, f64::NAN), (1.0, 0.0)] {
            assert_eq!(LowPass::new(corner, rate), None, "{corner} {rate}");
        }
    }

    #[test]
    fn the_gain_at_the_corner_is_one_half() {
        let rate = 10.0;
        let wave = |k: usize| maths::sin(2.0 * PI * 1.3 * k as f64 / rate);
        let out = filter().forwards_and_backwards(&(0..2_000).map(wave).collect::<Vec<_>>(), PADDING);
        let largest = out[500..1_500].iter().fold(0.0_f64, |max, value| max.max(value.abs()));
        assert!((largest - 0.5).abs() < 0.01, "{largest}");
    }

    #[test]
    fn output_is_as_long_as_the_input() {
        assert!(filter().forwards_and_backwards(&[], PADDING).is_empty());
        assert_eq!(filter().forwards_and_backwards(&[3.5], PADDING).len(), 1);
    }

    proptest! {
        #[test]
        fn a_constant_passes_unchanged(value in -100.0..100.0, n in 1_usize..80) {
            for filtered in filter().forwards_and_backwards(&vec![value; n], PADDING) {
                prop_assert!((filtered - value).abs() < 1e-9, "{filtered} {value}");
            }
        }

        #[test]
        fn a_mirrored_signal_gives_the_mirrored_result(signal in prop::collection::vec(-10.0..10.0, 1..60)) {
            let plus = filter().forwards_and_backwards(&signal, PADDING);
            let minus = filter().forwards_and_backwards(&signal.iter().map(|x| -x).collect::<Vec<_>>(), PADDING);
            for (a, b) in plus.iter().zip(&minus) {
                prop_assert_eq!(a.to_bits(), (-b).to_bits());
            }
        }
    }
}
