//! A Butterworth low-pass of second order, run forwards and backwards.
//!
//! The analogue prototype 1/(s² + √2·s + 1) is brought to discrete time by the bilinear transform with the corner
//! pre-warped (Oppenheim and Schafer, Discrete-Time Signal Processing, chapter 7). Running it in both directions with
//! steady initial states and odd reflection at the ends is what SciPy calls `filtfilt`; the tests compare with it.

use std::f64::consts::{PI, SQRT_2};

/// A low-pass filter of second order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    feed_forward: [f64; 3],
    feed_back: [f64; 2],
}

impl LowPass {
    /// The filter with its −3 dB corner at `corner_hz` for signals sampled at `rate_hz`, or nothing unless
    /// 0 < `corner_hz` < `rate_hz` / 2.
    pub fn new(corner_hz: f64, rate_hz: f64) -> Option<Self> {
        if !(corner_hz > 0.0 && corner_hz < 0.5 * rate_hz && rate_hz.is_finite()) {
            return None;
        }
        let warped = (PI * corner_hz / rate_hz).tan();
        let squared = warped * warped;
        let norm = 1.0 / (1.0 + SQRT_2 * warped + squared);
        let gain = squared * norm;
        Some(Self {
            feed_forward: [gain, 2.0 * gain, gain],
            feed_back: [2.0 * (squared - 1.0) * norm, (1.0 - SQRT_2 * warped + squared) * norm],
        })
    }

    /// `signal` filtered without any shift in time; one value out for each in.
    ///
    /// `reflected` samples are made up beyond each end (SciPy's `padlen`, whose own choice is 9), or as many as there are.
    pub fn forwards_and_backwards(&self, signal: &[f64], reflected: usize) -> Vec<f64> {
        let [.., last] = signal else { return Vec::new() };
        let (first, end) = (signal[0], signal.len() - 1);
        let reflected = reflected.min(end);
        let before = (1..=reflected).rev().map(|i| 2.0 * first - signal[i]);
        let after = (1..=reflected).map(|i| 2.0 * last - signal[end - i]);
        let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        self.run(&mut extended);
        extended.reverse();
        self.run(&mut extended);
        extended.reverse();
        extended[reflected..reflected + signal.len()].to_vec()
    }

    /// One pass in place, from the steady state that belongs to the first value.
    fn run(&self, signal: &mut [f64]) {
        let ([b0, b1, b2], [a1, a2]) = (self.feed_forward, self.feed_back);
        let Some(&first) = signal.first() else { return };
        let mut late = (b2 - a2) * first;
        let mut early = (b1 - a1) * first + late;
        for value in signal {
            let input = *value;
            let output = b0 * input + early;
            early = b1 * input - a1 * output + late;
            late = b2 * input - a2 * output;
            *value = output;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const REFLECTED: usize = 9;

    fn filter() -> LowPass {
        LowPass::new(1.3, 10.0).unwrap()
    }

    #[test]
    fn a_corner_that_cannot_be_is_refused() {
        for (corner, rate) in [(0.0, 10.0), (5.0, 10.0), (-1.0, 10.0), (f64::NAN, 10.0), (1.0, f64::NAN), (1.0, 0.0)] {
            assert_eq!(LowPass::new(corner, rate), None, "{corner} {rate}");
        }
    }

    #[test]
    fn the_gain_at_the_corner_is_one_half() {
        let rate = 10.0;
        let wave = |k: usize| (2.0 * PI * 1.3 * k as f64 / rate).sin();
        let out = filter().forwards_and_backwards(&(0..2_000).map(wave).collect::<Vec<_>>(), REFLECTED);
        let largest = out[500..1_500].iter().fold(0.0_f64, |max, value| max.max(value.abs()));
        assert!((largest - 0.5).abs() < 0.01, "{largest}");
    }

    #[test]
    fn nothing_in_gives_nothing_out() {
        assert!(filter().forwards_and_backwards(&[], REFLECTED).is_empty());
        assert_eq!(filter().forwards_and_backwards(&[3.5], REFLECTED).len(), 1);
    }

    proptest! {
        #[test]
        fn a_constant_passes_unchanged(value in -100.0..100.0, n in 1_usize..80) {
            for filtered in filter().forwards_and_backwards(&vec![value; n], REFLECTED) {
                prop_assert!((filtered - value).abs() < 1e-9, "{filtered} {value}");
            }
        }

        #[test]
        fn a_mirrored_signal_gives_the_mirrored_result(signal in prop::collection::vec(-10.0..10.0, 1..60)) {
            let plus = filter().forwards_and_backwards(&signal, REFLECTED);
            let minus = filter().forwards_and_backwards(&signal.iter().map(|x| -x).collect::<Vec<_>>(), REFLECTED);
            for (a, b) in plus.iter().zip(&minus) {
                prop_assert_eq!(a.to_bits(), (-b).to_bits());
            }
        }
    }
}
