//! Shape of a lane change: the quintic path with zero lateral speed and acceleration at both ends.
//!
//! At the share u of the distance along the road, the lateral share is y(u) = 10u³ − 15u⁴ + 6u⁵.

/// Number of bisections to invert the shape: 2⁻³⁰ of the path is less than a micrometre.
const BISECTIONS: u32 = 30;

/// Returns the lateral share of the lane change at the longitudinal share `longitudinal`.
pub(super) fn lateral_share(longitudinal: f64) -> f64 {
    let u = longitudinal.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// Returns the longitudinal share at which the lateral share `lateral` is reached, 0 for NaN.
pub(super) fn longitudinal_share(lateral: f64) -> f64 {
    if !(lateral > 0.0) {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if lateral_share(middle) < lateral { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_longitudinal_distance_is_half_of_the_lateral_one() {
        assert_eq!(lateral_share(0.5), 0.5);
        assert!((longitudinal_share(0.5) - 0.5).abs() < 1e-8);
    }

    #[test]
    fn the_two_shares_are_inverse_functions() {
        for step in 0..=20 {
            let lateral = f64::from(step) / 20.0;
            assert!((lateral_share(longitudinal_share(lateral)) - lateral).abs() < 1e-8);
        }
        assert_eq!(longitudinal_share(f64::NAN), 0.0);
    }
}
