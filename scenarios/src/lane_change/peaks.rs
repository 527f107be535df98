//! Peaks of a signal: where they are, how far they stand out, and how wide they are.
//!
//! The definitions are those of SciPy's `find_peaks`, `peak_prominences` and `peak_widths`.

/// A peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Its sample; the middle one of a flat top, rounded down.
    pub index: usize,
    /// The signal there.
    pub height: f64,
    /// How far it rises above the higher one of the lowest points between it and higher ground on either side.
    pub prominence: f64,
}

/// Every peak with at least `min_prominence`, in order. The ends of the signal are none. NaN makes none.
pub fn find_peaks(signal: &[f64], min_prominence: f64) -> Vec<Peak> {
    let with_prominence = |index: usize| Peak { index, height: signal[index], prominence: prominence(signal, index) };
    local_maxima(signal).into_iter().map(with_prominence).filter(|peak| peak.prominence >= min_prominence).collect()
}

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

fn prominence(signal: &[f64], index: usize) -> f64 {
    let height = signal[index];
    let lowest_until_higher = |side: &mut dyn Iterator<Item = &f64>| {
        side.take_while(|value| **value <= height).fold(height, |lowest, value| lowest.min(*value))
    };
    let left = lowest_until_higher(&mut signal[..index].iter().rev());
    let right = lowest_until_higher(&mut signal[index + 1..].iter());
    height - left.max(right)
}

/// Where the signal, going outwards from `index`, first falls to `level` on either side, in fractional samples.
///
/// The end of the signal where it never does: then that side is cut.
pub fn width(signal: &[f64], index: usize, level: f64) -> (f64, f64) {
    let left = (0..=index).rev().find(|&k| signal[k] <= level);
    let right = (index..signal.len()).find(|&k| signal[k] <= level);
    // The share of the last step, where the signal passes the level.
    let share = |inner: usize, outer: usize| {
        let (above, below) = (signal[inner], signal[outer]);
        if above > below { (level - below) / (above - below) } else { 0.0 }
    };
    let left = left.map_or(0.0, |k| if k == index { k as f64 } else { k as f64 + share(k + 1, k) });
    let last = signal.len().saturating_sub(1) as f64;
    let right = right.map_or(last, |k| if k == index { k as f64 } else { k as f64 - share(k - 1, k) });
    (left, right)
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
    }

    #[test]
    fn a_ripple_on_a_hill_has_only_its_own_prominence() {
        let signal = [0.0, 5.0, 4.0, 4.5, 1.0, 2.0, 0.0];
        let found = find_peaks(&signal, 0.0);
        let prominences: Vec<f64> = found.iter().map(|peak| peak.prominence).collect();
        assert_eq!(prominences, [5.0, 0.5, 1.0]);
        assert_eq!(indices(&signal, 0.6), [1, 5]);
    }

    #[test]
    fn widths_are_interpolated_and_cut_at_the_ends() {
        let triangle = [0.0, 1.0, 2.0, 1.0, 0.0];
        assert_eq!(width(&triangle, 2, 0.5), (0.5, 3.5));
        assert_eq!(width(&[1.5, 2.0, 1.0, 0.0], 1, 0.5), (0.0, 2.5));
    }

    proptest! {
        #[test]
        fn peaks_do_not_depend_on_the_direction_of_time(mut signal in prop::collection::vec(-5.0..5.0, 3..60)) {
            let forwards = find_peaks(&signal, 0.3);
            signal.reverse();
            let backwards = find_peaks(&signal, 0.3);
            prop_assert_eq!(forwards.len(), backwards.len());
            for (a, b) in forwards.iter().zip(backwards.iter().rev()) {
                prop_assert_eq!(a.index, signal.len() - 1 - b.index);
                prop_assert_eq!(a.prominence.to_bits(), b.prominence.to_bits());
            }
        }
    }
}
