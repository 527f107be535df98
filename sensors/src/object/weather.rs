//! How fog and rain shorten the range of an optical sensor.
//!
//! A target is just detected where its power ρ·exp(−2αR)/R² is that at the nominal range R₀ on a clear day (extinction
//! α₀), so that ln R + αR = ln R₀ + α₀R₀. The left side grows with R and is concave: Newton's method from a value that is
//! too small approaches the solution from below.

use closecall_traffic::Environment;

use crate::lidar::extinction_per_m;

/// Newton steps; the error is below a millimetre from 20 m of visibility on after seven.
const STEPS: usize = 12;

/// The range [m] in this weather of an optical sensor that reaches `clear_m` on a clear day.
pub(crate) fn range_in_weather_m(clear_m: f64, environment: &Environment) -> f64 {
    let clear_per_m = extinction_per_m(&Environment::CLEAR_DAY);
    let excess_per_m = extinction_per_m(environment) - clear_per_m;
    if excess_per_m <= 0.0 {
        return clear_m;
    }
    let per_m = clear_per_m + excess_per_m;
    let goal = clear_m.ln() + clear_per_m * clear_m;
    let mut range_m = clear_m * (-excess_per_m * clear_m).exp();
    for _ in 0..STEPS {
        range_m += (goal - range_m.ln() - per_m * range_m) / (1.0 / range_m + per_m);
    }
    range_m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fog(visibility_m: f64) -> Environment {
        Environment { visibility_m, ..Environment::CLEAR_DAY }
    }

    #[test]
    fn fog_shortens_the_range_by_the_power_law() {
        assert_eq!(range_in_weather_m(120.0, &fog(20_000.0)), 120.0);
        let mut last_m = 120.0;
        for visibility_m in [5_000.0, 1_000.0, 300.0, 100.0, 20.0] {
            let range_m = range_in_weather_m(120.0, &fog(visibility_m));
            assert!(range_m < last_m && range_m > 0.0, "{visibility_m}: {range_m}");
            let power = |range_m: f64, per_m: f64| (-2.0 * per_m * range_m).exp() / (range_m * range_m);
            let clear = power(120.0, extinction_per_m(&Environment::CLEAR_DAY));
            let here = power(range_m, extinction_per_m(&fog(visibility_m)));
            assert!((here / clear - 1.0).abs() < 1e-6, "{visibility_m}: {}", here / clear);
            last_m = range_m;
        }
    }
}
