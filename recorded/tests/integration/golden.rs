//! Low-pass filter and peak detection compared with SciPy. `golden/make_golden.py` generates the
//! reference values.

use closecall_recorded::filters::{CORNER_HZ, LowPass};
use closecall_recorded::lane_change::{find_peaks, peak_width};
use serde::Deserialize;

const REFERENCE: &str = include_str!("../golden/scipy.json");

#[derive(Deserialize)]
struct Golden {
    filter: Vec<FilterCase>,
    peaks: Vec<PeakCase>,
}

#[derive(Deserialize)]
struct FilterCase {
    name: String,
    rate_hz: f64,
    padding: usize,
    signal: Vec<f64>,
    filtered: Vec<f64>,
}

#[derive(Deserialize)]
struct PeakCase {
    name: String,
    signal: Vec<f64>,
    min_prominence: f64,
    peaks: Vec<usize>,
    prominences: Vec<f64>,
    left_bases: Vec<usize>,
    right_bases: Vec<usize>,
    widths: Vec<WidthCase>,
}

#[derive(Deserialize)]
struct WidthCase {
    rel_height: f64,
    widths: Vec<f64>,
    levels: Vec<f64>,
    left: Vec<f64>,
    right: Vec<f64>,
}

fn golden() -> Golden {
    serde_json::from_str(REFERENCE).unwrap()
}

/// Maximum error of a width, relative to the width.
const WIDTH_SHARE: f64 = 1e-9;

/// Maximum error of a filtered value, relative to the largest value of the signal.
const FILTER_SHARE: f64 = 1e-9;

#[test]
fn the_filter_agrees_with_scipy() {
    let cases = golden().filter;
    assert!(cases.len() > 100);
    for case in cases {
        let filter = LowPass::new(CORNER_HZ, case.rate_hz).unwrap();
        let filtered = filter.forwards_and_backwards(&case.signal, case.padding);
        assert_eq!(filtered.len(), case.filtered.len(), "{}", case.name);
        let largest = case.signal.iter().fold(1.0_f64, |largest, value| largest.max(value.abs()));
        for (filtered, expected) in filtered.iter().zip(&case.filtered) {
            let error = (filtered - expected).abs() / largest;
            assert!(error < FILTER_SHARE, "{}: {filtered} instead of {expected}", case.name);
        }
    }
}

#[test]
fn peaks_prominences_and_bases_agree_with_scipy() {
    let cases = golden().peaks;
    assert!(cases.iter().map(|case| case.peaks.len()).sum::<usize>() > 500);
    for case in cases {
        let peaks = find_peaks(&case.signal, case.min_prominence);
        let indices =
            |value: fn(&closecall_recorded::lane_change::Peak) -> usize| peaks.iter().map(value).collect::<Vec<_>>();
        assert_eq!(indices(|peak| peak.index), case.peaks, "{}", case.name);
        assert_eq!(indices(|peak| peak.left_base), case.left_bases, "{}", case.name);
        assert_eq!(indices(|peak| peak.right_base), case.right_bases, "{}", case.name);
        let prominences: Vec<f64> = peaks.iter().map(|peak| peak.prominence).collect();
        assert_eq!(prominences, case.prominences, "{}", case.name);
    }
}

#[test]
fn widths_agree_with_scipy() {
    for case in golden().peaks {
        let peaks = find_peaks(&case.signal, case.min_prominence);
        for expected in &case.widths {
            assert_eq!(peaks.len(), expected.widths.len(), "{}", case.name);
            for (k, peak) in peaks.iter().enumerate() {
                let measured = peak_width(&case.signal, peak, expected.rel_height);
                assert_eq!(measured.level, expected.levels[k], "{}", case.name);
                let width = expected.widths[k];
                for (measured, expected) in [
                    (measured.right - measured.left, width),
                    (measured.left, expected.left[k]),
                    (measured.right, expected.right[k]),
                ] {
                    let error = (measured - expected).abs();
                    assert!(error <= WIDTH_SHARE * width.abs(), "{}: {measured} instead of {expected}", case.name);
                }
            }
        }
    }
}
