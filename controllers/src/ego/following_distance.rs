//! The minimum following distance of UN Regulation 157 (automated lane keeping systems), paragraph
//! 5.2.3.3.
//!
//! The distance is the speed multiplied by a minimum time gap. The text of the regulation was not
//! at hand. A copy of the paragraph (clause collection of lawinsider.com) shows the first rows of
//! its table: 1.0 s at 7.2 km/h, 1.1 s at 10 km/h, 1.2 s at 20 km/h. The simulator esmini, which
//! implements the paragraph (`ControllerALKS_R157SM.cpp`), continues them by 0.1 s per 10 km/h to
//! every higher speed: 1.6 s at 60 km/h, 2.08 s at 30 m/s.

/// Speed and time gap of the first row of the table (km/h, s).
const FIRST_ROW: (f64, f64) = (7.2, 1.0);
/// Speed from which the time gap rises in proportion to the speed (km/h).
const PROPORTIONAL_FROM_KMPH: f64 = 10.0;
/// Rise of the time gap from there on (s per km/h).
const RISE_S_PER_KMPH: f64 = 0.01;

/// Returns the minimum time gap at `speed_mps` (s).
pub(crate) fn r157_time_gap_s(speed_mps: f64) -> f64 {
    let speed_kmph = 3.6 * speed_mps;
    let proportional_s = |speed_kmph: f64| 1.0 + RISE_S_PER_KMPH * speed_kmph;
    if speed_kmph >= PROPORTIONAL_FROM_KMPH {
        return proportional_s(speed_kmph);
    }
    let (first_kmph, first_s) = FIRST_ROW;
    let share = ((speed_kmph - first_kmph) / (PROPORTIONAL_FROM_KMPH - first_kmph)).max(0.0);
    first_s + share * (proportional_s(PROPORTIONAL_FROM_KMPH) - first_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gap_follows_the_table_and_grows_with_the_speed() {
        for (speed_kmph, time_gap_s) in [(0.0, 1.0), (7.2, 1.0), (10.0, 1.1), (20.0, 1.2), (60.0, 1.6), (108.0, 2.08)] {
            assert!((r157_time_gap_s(speed_kmph / 3.6) - time_gap_s).abs() < 1e-9, "{speed_kmph} km/h");
        }
        let gaps: Vec<f64> = (0..400).map(|step| r157_time_gap_s(0.1 * f64::from(step))).collect();
        assert!(gaps.windows(2).all(|pair| pair[0] <= pair[1]), "{gaps:?}");
    }
}
