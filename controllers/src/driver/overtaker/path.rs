//! The shape of a lane change: the quintic with no speed and acceleration sideways at either end.
//!
//! y(u) = 10u³ − 15u⁴ + 6u⁵ of the way sideways at the share u of the way along the road.

/// Bisections when the shape is inverted: 2⁻³⁰ of the path is a micrometre.
const BISECTIONS: u32 = 30;

/// Share of the way sideways at the share `along` of the way along.
pub(super) fn sideways(along: f64) -> f64 {
    let u = along.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// Share of the way along at which the share `across` of the way sideways is reached.
pub(super) fn along(across: f64) -> f64 {
    if !(across > 0.0) {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if sideways(middle) < across { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_way_along_is_half_way_across() {
        assert_eq!(sideways(0.5), 0.5);
        assert!((along(0.5) - 0.5).abs() < 1e-8);
    }

    #[test]
    fn the_inverse_is_one() {
        for step in 0..=20 {
            let across = f64::from(step) / 20.0;
            assert!((sideways(along(across)) - across).abs() < 1e-8);
        }
        assert_eq!(along(f64::NAN), 0.0);
    }
}
