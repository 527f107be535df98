//! Shape of a lane change: the minimum-jerk path, whose lateral speed and acceleration are zero at both ends.

use closecall_traffic::minimum_jerk;

/// Number of bisections to invert the shape: 2⁻³⁰ of the path is less than a micrometre.
const BISECTIONS: u32 = 30;

/// Returns the longitudinal share at which the lateral share `lateral` is reached, 0 for NaN.
pub(super) fn longitudinal_share(lateral: f64) -> f64 {
    if !(lateral > 0.0) {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if minimum_jerk(middle) < lateral { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_longitudinal_distance_is_half_of_the_lateral_one() {
        assert_eq!(minimum_jerk(0.5), 0.5);
        assert!((longitudinal_share(0.5) - 0.5).abs() < 1e-8);
    }

    #[test]
    fn the_two_shares_are_inverse_functions() {
        for step in 0..=20 {
            let lateral = f64::from(step) / 20.0;
            assert!((minimum_jerk(longitudinal_share(lateral)) - lateral).abs() < 1e-8);
        }
        assert_eq!(longitudinal_share(f64::NAN), 0.0);
    }
}
