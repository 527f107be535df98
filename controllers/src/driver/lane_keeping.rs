//! Human lane keeping: the vehicle weaves around the path that the driver intends to take.
//!
//! The lateral deviation from the intended path is white noise in the steering, filtered by three
//! lags. The lags are fitted to the trajectory data US-101 (NGSIM, 120 vehicles that stay in one
//! lane for at least 8 s at more than 8 m/s, within 1.2 m of its centre; mean speed 14 m/s). There
//! the variogram of the lateral position, half of the mean squared difference, is 0.0105, 0.0224,
//! 0.0315, 0.049, 0.0685 and 0.080 m² at 1, 2, 3, 5, 8 and 12 s. With a standard deviation of 0.284
//! m, the lags below reproduce it within 17 %. At 1 s the variogram of the model is lower: the
//! variogram of the data contains measurement errors that no vehicle drives. The standard deviation
//! is a parameter of each driver (`sdlp-m`).
//!
//! The deviation is a function of the distance driven, as the path of a lane change is: a driver
//! who brakes stays on the path, and a vehicle at standstill does not move sideways. The lags hold
//! at 30 m/s. No trajectory data at hand show how drivers weave at that speed; it is an assumption
//! that they steer there as quickly as on US-101. As a function of distance, the lateral
//! acceleration then has a standard deviation of 0.3 m/s² (at 30 m/s, with 0.2 m of deviation).
//! With the recorded 14 m/s as reference speed it would be 1.3 m/s², which is unrealistic.
//!
//! A run starts on the intended path without deviation, because the scenario gives the initial
//! positions. After three times the longest lag, the deviation has its stationary standard
//! deviation.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range, Side, Stream};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::smooth_noise::{SmoothNoise, derivative_sds};

/// Lags of the lateral deviation at the reference speed (s).
const LAGS_S: [f64; 3] = [4.1, 0.4, 0.4];

/// Reference speed, at which the lags hold (m/s).
const REFERENCE_SPEED_MPS: f64 = 30.0;

/// Lane keeping of a driver as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LaneKeepingConfig {
    /// Standard deviation of the lateral position, SDLP (m): 0 to 0.5. Sober drivers on highways:
    /// about 0.2 m, an assumption (Verster and Roth, *International Journal of General Medicine* 4
    /// (2011) 359–371, describe the measure; the value was not found in a text at hand).
    pub sdlp_m: Num,
}

/// Checked lane keeping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneKeeping {
    sdlp_m: f64,
}

impl Check for LaneKeepingConfig {
    type Checked = LaneKeeping;

    fn check(&self, parameters: &Parameters) -> Result<LaneKeeping, ConfigError> {
        Ok(LaneKeeping { sdlp_m: parameters.number(&self.sdlp_m, "sdlp-m", Range::closed(0.0, 0.5))? })
    }
}

impl LaneKeeping {
    /// Returns the standard deviation of the lateral acceleration due to weaving at this speed
    /// (m/s²).
    pub fn lateral_acceleration_sd_mps2(&self, speed_mps: f64) -> f64 {
        let [_, second_per_s2] = derivative_sds(LAGS_S);
        self.sdlp_m * second_per_s2 * (speed_mps / REFERENCE_SPEED_MPS).powi(2)
    }

    /// Creates the weaving of one run, or `None` if the driver does not weave. It is mirrored if
    /// traffic overtakes on the right.
    pub fn weave(&self, overtaking_side: Side, rng: Stream) -> Option<Weave> {
        let sign = match overtaking_side {
            Side::Left => 1.0,
            Side::Right => -1.0,
        };
        (self.sdlp_m > 0.0).then(|| Weave { sign, noise: SmoothNoise::from_rest(self.sdlp_m, LAGS_S, rng) })
    }
}

/// Generates the lateral deviation of one driver during a run.
#[derive(Clone, Debug)]
pub struct Weave {
    sign: f64,
    noise: SmoothNoise,
}

/// Lateral deviation from the intended path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Deviation, positive to the left of the path (m).
    pub offset_m: f64,
    /// First derivative of the deviation with respect to the distance driven (dimensionless).
    pub slope: f64,
    /// Second derivative of the deviation with respect to the distance driven (1/m).
    pub second_derivative_per_m: f64,
}

impl Weave {
    /// Returns the deviation after the distance `distance_m`, which must not decrease from call to
    /// call.
    pub fn at(&mut self, distance_m: f64) -> Deviation {
        let [value, first, second] = self.noise.at(distance_m / REFERENCE_SPEED_MPS).map(|part| self.sign * part);
        Deviation {
            offset_m: value,
            slope: first / REFERENCE_SPEED_MPS,
            second_derivative_per_m: second / (REFERENCE_SPEED_MPS * REFERENCE_SPEED_MPS),
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};

    use super::*;

    fn weave(sdlp_m: f64, seed: u64, side: Side) -> Option<Weave> {
        let config = LaneKeepingConfig { sdlp_m: sdlp_m.into() };
        let rng = stream(seed, 0, &ActorId::new("rear").unwrap(), "lane-keeping");
        config.check(&Parameters::default()).unwrap().weave(side, rng)
    }

    #[test]
    fn the_variogram_agrees_with_us_101() {
        const RECORDED_M2: [(f64, f64); 6] =
            [(1.0, 0.0105), (2.0, 0.0224), (3.0, 0.0315), (5.0, 0.049), (8.0, 0.0685), (12.0, 0.080)];
        let mut weave = weave(0.284, 1, Side::Left).unwrap();
        let step_s = 0.5;
        let offsets_m: Vec<f64> =
            (60..80_000).map(|step| weave.at(f64::from(step) * step_s * REFERENCE_SPEED_MPS).offset_m).collect();
        for (lag_s, recorded_m2) in RECORDED_M2 {
            let lag_steps = (lag_s / step_s) as usize;
            let pairs = offsets_m.iter().zip(&offsets_m[lag_steps..]);
            let squares: f64 = pairs.map(|(a, b)| (a - b) * (a - b)).sum();
            let variogram_m2 = 0.5 * squares / (offsets_m.len() - lag_steps) as f64;
            let ratio = variogram_m2 / recorded_m2;
            assert!((0.81..1.17).contains(&ratio), "at {lag_s} s: {variogram_m2} m², recorded {recorded_m2} m²");
        }
    }

    #[test]
    fn the_lateral_acceleration_is_realistic() {
        let config = LaneKeepingConfig { sdlp_m: 0.2.into() };
        let keeping = config.check(&Parameters::default()).unwrap();
        let mut weave = weave(0.2, 3, Side::Left).unwrap();
        let squares = (0..100_000).map(|step| {
            let second_derivative_per_m =
                weave.at(f64::from(step) * 0.01 * REFERENCE_SPEED_MPS).second_derivative_per_m;
            (second_derivative_per_m * REFERENCE_SPEED_MPS * REFERENCE_SPEED_MPS).powi(2)
        });
        let sd_mps2 = (squares.sum::<f64>() / 100_000.0).sqrt();
        assert!((0.2..0.35).contains(&sd_mps2), "{sd_mps2}");
        // Between the knots, the quintic varies slightly less than the noise.
        let expected_mps2 = keeping.lateral_acceleration_sd_mps2(REFERENCE_SPEED_MPS);
        assert!((0.85..1.05).contains(&(sd_mps2 / expected_mps2)), "{sd_mps2} {expected_mps2}");
        assert_eq!(keeping.lateral_acceleration_sd_mps2(2.0 * REFERENCE_SPEED_MPS), 4.0 * expected_mps2);
    }

    #[test]
    fn weaving_is_mirrored_on_the_right_and_absent_at_zero_sdlp() {
        let (mut left, mut right) = (weave(0.2, 4, Side::Left).unwrap(), weave(0.2, 4, Side::Right).unwrap());
        let (left, right) = (left.at(400.0), right.at(400.0));
        assert_eq!(
            (right.offset_m, right.slope, right.second_derivative_per_m),
            (-left.offset_m, -left.slope, -left.second_derivative_per_m)
        );
        assert!(weave(0.0, 4, Side::Left).is_none());
        let too_much = LaneKeepingConfig { sdlp_m: 0.6.into() };
        assert_eq!(too_much.check(&Parameters::default()).unwrap_err().path.to_string(), "sdlp-m");
    }
}
