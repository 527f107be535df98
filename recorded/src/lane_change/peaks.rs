//! Peaks of a signal, with their position, prominence and width.
//!
//! The definitions follow SciPy's `find_peaks`, `peak_prominences` (without `wlen`) and
//! `peak_widths`. The results are identical to the bit if sums are taken in the same order.
//! `tests/golden/make_golden.py` generates the values with which the tests compare.

/// A peak of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Index of its sample; on a flat top the middle one, rounded down.
    pub index: usize,
    /// Value of the signal at the peak.
    pub height: f64,
    /// Prominence: height above the higher one of its two bases.
    pub prominence: f64,
    /// Index of the left base: the lowest value between the peak and the next higher value on the
    /// left, or the end of the signal. Of several equal values it is the nearest.
    pub left_base: usize,
    /// Index of the right base, defined in the same way.
    pub right_base: usize,
}

/// The width of a peak at some height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Width {
    /// Value of the signal at which the width is measured.
    pub level: f64,
    /// Left end (fractional samples).
    pub left: f64,
    /// Right end (fractional samples).
    pub right: f64,
}

/// Finds all peaks with a prominence of at least `min_prominence`, in order.
///
/// The ends of a signal are not peaks, and neither is NaN.
pub fn find_peaks(signal: &[f64], min_prominence: f64) -> Vec<Peak> {
    let peaks = local_maxima(signal).into_iter().map(|index| peak_at(signal, index));
    peaks.filter(|peak| peak.prominence >= min_prominence).collect()
}

/// Returns the indices of all local maxima, in order.
fn local_maxima(signal: &[f64]) -> Vec<usize> {
    let mut maxima = Vec::new();
    let mut k = 1;
    while k + 1 < signal.len() {
        if signal[k - 1] < signal[k] {
            let top = signal[k..].iter().take_while(|value| **value == signal[k]).count();
            let after = k + top;
            if after < signal.len() && signal[after] < signal[k] {
                maxima.push((k + after - 1) / 2);
            }
            k = after;
        } else {
            k += 1;
        }
    }
    maxima
}

/// Returns the peak at `index`, with the prominence and the bases of SciPy's `peak_prominences`.
pub(super) fn peak_at(signal: &[f64], index: usize) -> Peak {
    let height = signal[index];
    let lowest = |side: &mut dyn Iterator<Item = usize>| {
        let mut base = index;
        for k in side.take_while(|&k| signal[k] <= height) {
            if signal[k] < signal[base] {
                base = k;
            }
        }
        base
    };
    let left_base = lowest(&mut (0..index).rev());
    let right_base = lowest(&mut (index + 1..signal.len()));
    let prominence = height - signal[left_base].max(signal[right_base]);
    Peak { index, height, prominence, left_base, right_base }
}

/// Measures the width of `peak` at the height that lies `rel_height` times its prominence below its
/// top.
///
/// The ends are interpolated linearly and lie no further out than the bases.
pub fn peak_width(signal: &[f64], peak: &Peak, rel_height: f64) -> Width {
    let level = peak.height - peak.prominence * rel_height;
    let (mut i, mut j) = (peak.index, peak.index);
    while i > peak.left_base && level < signal[i] {
        i -= 1;
    }
    while j < peak.right_base && level < signal[j] {
        j += 1;
    }
    let left = if signal[i] < level { i as f64 + (level - signal[i]) / (signal[i + 1] - signal[i]) } else { i as f64 };
    let right = if signal[j] < level { j as f64 - (level - signal[j]) / (signal[j - 1] - signal[j]) } else { j as f64 };
    Width { level, left, right }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn indices(signal: &[f64], min_prominence: f64) -> Vec<usize> {
        find_peaks(signal, min_prominence).iter().map(|peak| peak.index).collect()
    }

    #[test]
    fn flat_tops_count_once_and_ends_not_at_all() {
        assert_eq!(indices(&[0.0, 2.0, 2.0, 2.0, 2.0, 0.0], 0.0), [2]);
        assert_eq!(indices(&[3.0, 1.0, 2.0, 1.0, 3.0], 0.0), [2]);
        assert_eq!(indices(&[0.0, 1.0, 1.0], 0.0), [0_usize; 0]);
        assert_eq!(indices(&[], 0.0), [0_usize; 0]);
        assert_eq!(indices(&[0.0, f64::NAN, 0.0, 1.0, f64::NAN], 0.0), [0_usize; 0]);
    }

    #[test]
    fn a_small_peak_beside_a_high_one_has_its_own_prominence() {
        let signal = [0.0, 5.0, 4.0, 4.5, 1.0, 2.0, 0.0];
        let peaks = find_peaks(&signal, 0.0);
        let prominences: Vec<f64> = peaks.iter().map(|peak| peak.prominence).collect();
        assert_eq!(prominences, [5.0, 0.5, 1.0]);
        assert_eq!(indices(&signal, 0.6), [1, 5]);
    }

    #[test]
    fn widths_are_interpolated() {
        let triangle = [0.0, 1.0, 2.0, 1.0, 0.0];
        let top = find_peaks(&triangle, 0.0)[0];
        assert_eq!(peak_width(&triangle, &top, 0.75), Width { level: 0.5, left: 0.5, right: 3.5 });
    }

    proptest! {
        #[test]
        fn peaks_of_a_reversed_signal_are_the_reversed_peaks(mut signal in prop::collection::vec(-5.0..5.0, 3..60)) {
            let widths = |signal: &[f64]| -> Vec<_> {
                find_peaks(signal, 0.3).iter().map(|peak| (*peak, peak_width(signal, peak, 0.7))).collect()
            };
            let forwards = widths(&signal);
            signal.reverse();
            let backwards = widths(&signal);
            prop_assert_eq!(forwards.len(), backwards.len());
            let last = signal.len() - 1;
            for ((a, a_width), (b, b_width)) in forwards.iter().zip(backwards.iter().rev()) {
                prop_assert_eq!(a.index, last - b.index);
                prop_assert_eq!(a.prominence.to_bits(), b.prominence.to_bits());
                prop_assert!((a_width.left - (last as f64 - b_width.right)).abs() < 1e-9);
            }
        }
    }
}
