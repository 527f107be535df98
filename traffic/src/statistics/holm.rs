//! Holm's correction of p-values for the number of tests.
//!
//! S. Holm, *A simple sequentially rejective multiple test procedure*, Scandinavian Journal of
//! Statistics 6 (1979) 65–70. The tests are ordered by their p-values. The i-th smallest of m is
//! multiplied by m − i + 1, and is at least as large as the corrected one before it. A study that
//! rejects every hypothesis below a level keeps the probability of any false rejection below that
//! level, whatever the dependence between the tests.

/// Returns the corrected p-values, in the order of the given p-values.
pub fn corrected(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut corrected = vec![1.0; p_values.len()];
    let mut largest = 0.0_f64;
    for (rank, &index) in order.iter().enumerate() {
        let tests_left = (p_values.len() - rank) as f64;
        largest = largest.max(tests_left * p_values[index]).min(1.0);
        corrected[index] = largest;
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_counts_once_for_each_test() {
        assert_eq!(corrected(&[]), Vec::<f64>::new());
        assert_eq!(corrected(&[0.03]), [0.03]);
        // An example by hand: 4·0.005, then 3·0.01 and 2·0.03; 0.04 must not fall below 0.06.
        let values = corrected(&[0.01, 0.04, 0.03, 0.005]);
        for (value, expected) in values.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((value - expected).abs() < 1e-12, "{value}, not {expected}");
        }
        assert_eq!(corrected(&[0.9, 0.8]), [1.0, 1.0]);
    }
}
