//! Filter and peaks against SciPy; `golden/make_golden.py` makes the reference values.

use closecall_scenarios::filters::{CORNER_HZ, LowPass, PERIOD};
use closecall_scenarios::lane_change::{find_peaks, width};

const REFERENCE: &str = include_str!("../golden/scipy.csv");
const REL_HEIGHT: f64 = 0.75;
const MIN_PROMINENCE: f64 = 0.3;

fn signal(n: usize) -> Vec<f64> {
    let at = |k: f64| (0.11 * k).sin() + 0.4 * (0.57 * k + 1.0).sin() + 0.2 * (2.3 * k).cos() + 0.01 * k;
    (0..n).map(|k| at(k as f64)).collect()
}

/// The rows of one kind: number of samples and values.
fn reference(kind: &str) -> Vec<(usize, Vec<f64>)> {
    let rows = REFERENCE.lines().filter_map(|line| {
        let mut fields = line.split(',');
        (fields.next() == Some(kind)).then(|| {
            let n = fields.next().unwrap().parse().unwrap();
            (n, fields.map(|field| field.parse().unwrap()).collect())
        })
    });
    let rows: Vec<_> = rows.collect();
    assert!(!rows.is_empty(), "no rows of {kind}");
    rows
}

fn assert_close(found: &[f64], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-10, "{what}: {found} instead of {expected}");
    }
}

#[test]
fn the_filter_is_that_of_scipy() {
    let filter = LowPass::new(CORNER_HZ, 1.0 / PERIOD.s()).unwrap();
    for (n, expected) in reference("filtfilt") {
        assert_close(&filter.forwards_and_backwards(&signal(n)), &expected, &format!("filtfilt of {n}"));
    }
}

#[test]
fn peaks_and_prominences_are_those_of_scipy() {
    for ((n, places), (_, prominences)) in reference("peaks").into_iter().zip(reference("prominences")) {
        let found = find_peaks(&signal(n), MIN_PROMINENCE);
        assert_close(&found.iter().map(|peak| peak.index as f64).collect::<Vec<_>>(), &places, "peaks");
        assert_close(&found.iter().map(|peak| peak.prominence).collect::<Vec<_>>(), &prominences, "prominences");
    }
}

#[test]
fn widths_are_those_of_scipy() {
    for ((n, left), (_, right)) in reference("left").into_iter().zip(reference("right")) {
        let signal = signal(n);
        let peaks = find_peaks(&signal, MIN_PROMINENCE).into_iter().filter(|peak| peak.height > 0.0);
        let (found_left, found_right): (Vec<f64>, Vec<f64>) =
            peaks.map(|peak| width(&signal, peak.index, (1.0 - REL_HEIGHT) * peak.height)).unzip();
        assert_close(&found_left, &left, "left ends");
        assert_close(&found_right, &right, "right ends");
    }
}
