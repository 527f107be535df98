//! The minimum following distance of UN Regulation 157 (automated lane keeping systems), paragraph 5.2.3.3.
//!
//! The distance is the speed multiplied by a minimum time gap. A table gives the time gap at seven speeds; between them it is
//! interpolated. The table ends at 60 km/h, the speed up to which the original series of the regulation holds. For higher
//! speeds, the later series refers to the rules of the country.
//!
//! The text of the regulation was not at hand. A copy of the paragraph (clause collection of lawinsider.com) shows the first
//! rows of the table.

/// Speeds (km/h) and minimum time gaps (s) of the table. The rows from 30 km/h on could not be looked up: an assumption, they
/// continue those before them by 0.1 s per 10 km/h.
const TABLE: [(f64, f64); 7] =
    [(7.2, 1.0), (10.0, 1.1), (20.0, 1.2), (30.0, 1.3), (40.0, 1.4), (50.0, 1.5), (60.0, 1.6)];

/// Rise of the time gap above the last row of the table (s per km/h): an assumption, that of the last rows; 0 to 0.01 are
/// plausible.
const RISE_ABOVE_TABLE_S_PER_KMPH: f64 = 0.01;

/// Longest time gap (s): an assumption, the two-second rule of many countries, and the gap at which the reference driver of the
/// regulation follows in the comparison of the Joint Research Centre (JRC-FSM); 1.8 to 2.4 are plausible.
const LONGEST_TIME_GAP_S: f64 = 2.0;

/// Returns the minimum time gap at `speed_mps` (s).
pub(crate) fn r157_time_gap_s(speed_mps: f64) -> f64 {
    let speed_kmph = 3.6 * speed_mps;
    let [first, .., last] = TABLE;
    if speed_kmph >= last.0 {
        return (last.1 + RISE_ABOVE_TABLE_S_PER_KMPH * (speed_kmph - last.0)).min(LONGEST_TIME_GAP_S);
    }
    let between = |rows: &[(f64, f64)]| {
        let [(from, low_s), (to, high_s)] = *rows else { return None };
        (speed_kmph >= from && speed_kmph < to).then(|| low_s + (high_s - low_s) * (speed_kmph - from) / (to - from))
    };
    TABLE.windows(2).find_map(between).unwrap_or(first.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gap_is_that_of_the_table_and_grows_with_the_speed() {
        for (speed_kmph, time_gap_s) in TABLE {
            assert!((r157_time_gap_s(speed_kmph / 3.6) - time_gap_s).abs() < 1e-9, "{speed_kmph} km/h");
        }
        assert_eq!(r157_time_gap_s(0.0), 1.0);
        assert!((r157_time_gap_s(25.0 / 3.6) - 1.25).abs() < 1e-9);
        assert!((r157_time_gap_s(80.0 / 3.6) - 1.8).abs() < 1e-9);
        assert_eq!(r157_time_gap_s(130.0 / 3.6), 2.0);
        let gaps: Vec<f64> = (0..400).map(|step| r157_time_gap_s(0.1 * f64::from(step))).collect();
        assert!(gaps.windows(2).all(|pair| pair[0] <= pair[1]), "{gaps:?}");
    }
}
