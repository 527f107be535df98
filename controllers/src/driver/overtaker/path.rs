//! Shape of a lane change: the minimum-jerk path, whose lateral speed and acceleration are zero at
//! both ends.

use closecall_traffic::minimum_jerk;

/// Number of bisections to invert the shape: 2⁻³⁰ of the path is less than a micrometre.
const BISECTIONS: u32 = 30;
/// Number of cells into which the bisections divide the path.
const CELLS: f64 = (1_u32 << BISECTIONS) as f64;
/// Largest number of steps of Newton's method. Three are enough in the middle of the path.
const NEWTON_STEPS: u32 = 6;
/// Step after which the share is exact to rounding, as each step squares the error.
const LAST_STEP: f64 = 1e-7;
/// Lateral shares between which the shape is steep enough for Newton's method, and rises from cell
/// to cell by far more than rounding.
const STEEP: std::ops::Range<f64> = 0.02..0.98;

/// Returns the longitudinal share at which the lateral share `lateral` is reached, 0 for NaN: the
/// middle of the cell in which bisection ends.
pub(super) fn longitudinal_share(lateral: f64) -> f64 {
    if !(lateral > 0.0) {
        return 0.0;
    }
    if STEEP.contains(&lateral)
        && let Some(share) = by_newton(lateral)
    {
        return share;
    }
    by_bisection(lateral)
}

/// Returns the middle of the cell that Newton's method finds, if its two ends enclose the lateral
/// share.
fn by_newton(lateral: f64) -> Option<f64> {
    // The straight line with the shape's slope in the middle, and the shape's derivative 30·u²·(1 −
    // u)².
    let mut share = (0.5 + (lateral - 0.5) / 1.875).clamp(0.1, 0.9);
    for _ in 0..NEWTON_STEPS {
        let slope = share * (1.0 - share);
        let next = (share - (minimum_jerk(share) - lateral) / (30.0 * slope * slope)).clamp(0.01, 0.99);
        let step = (next - share).abs();
        share = next;
        if step < LAST_STEP {
            break;
        }
    }
    let low = (share * CELLS).floor() / CELLS;
    let high = low + 1.0 / CELLS;
    (minimum_jerk(low) < lateral && !(minimum_jerk(high) < lateral)).then_some(0.5 * (low + high))
}

fn by_bisection(lateral: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if minimum_jerk(middle) < lateral { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(10_000))]

        #[test]
        fn newtons_method_ends_in_the_cell_of_bisection(lateral in 0.0..1.2_f64) {
            prop_assert_eq!(longitudinal_share(lateral).to_bits(), by_bisection(lateral).to_bits());
        }
    }

    #[test]
    fn newtons_method_finds_the_cell_wherever_the_shape_is_steep() {
        let missed =
            (0..=1_000).map(|step| 0.02 + 0.96 * f64::from(step) / 1_000.0).filter(|at| by_newton(*at).is_none());
        // A share on the edge of a cell may be missed.
        assert!(missed.count() <= 2);
    }

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
