//! Human speed keeping: the desired speed fluctuates around its long-term value.
//!
//! Herman, Montroll, Potts and Rothery (*Traffic Dynamics: Analysis of Stability in Car Following*,
//! Operations Research 7 (1959) 86–106) measured the standard deviation of the acceleration of free
//! drivers, "acceleration noise", as about 0.1 m/s² on a good road (the method is theirs; the value
//! was not found in a text at hand). Here the desired speed is white noise filtered by three lags.
//! The longest lag models a driver who checks the speedometer only occasionally. The driver model
//! decides how closely the vehicle follows the desired speed.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range, Stream, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::smooth_noise::{SmoothNoise, derivative_sds};

/// Lags of the desired speed (s): an assumption; 5 to 20 are plausible for the first.
const LAGS_S: [f64; 3] = [10.0, 1.0, 1.0];

/// Speed keeping of a driver as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SpeedKeepingConfig {
    /// Standard deviation of the rate of change of the desired speed (m/s²): 0 to 0.5; about 0.1
    /// for humans.
    pub acceleration_noise_mps2: Num,
}

/// Checked speed keeping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedKeeping {
    acceleration_noise_mps2: f64,
}

impl Check for SpeedKeepingConfig {
    type Checked = SpeedKeeping;

    fn check(&self, parameters: &Parameters) -> Result<SpeedKeeping, ConfigError> {
        let range = Range::closed(0.0, 0.5);
        let noise_mps2 = parameters.number(&self.acceleration_noise_mps2, "acceleration-noise-mps2", range)?;
        Ok(SpeedKeeping { acceleration_noise_mps2: noise_mps2 })
    }
}

impl SpeedKeeping {
    /// Creates the fluctuation of one run, or `None` if the desired speed is constant.
    pub fn wander(&self, rng: Stream) -> Option<DesiredSpeedNoise> {
        let [rate_per_s, _] = derivative_sds(LAGS_S);
        let sd_mps = self.acceleration_noise_mps2 / rate_per_s;
        (sd_mps > 0.0).then(|| DesiredSpeedNoise { noise: SmoothNoise::from_rest(sd_mps, LAGS_S, rng) })
    }
}

/// Generates the fluctuation of one driver's desired speed during a run. It starts at zero, because
/// the scenario gives the initial speeds.
#[derive(Clone, Debug)]
pub struct DesiredSpeedNoise {
    noise: SmoothNoise,
}

impl DesiredSpeedNoise {
    /// Returns the offset of the desired speed at `time`, which must not decrease from call to call
    /// (m/s).
    pub fn at(&mut self, time: Time) -> f64 {
        let [offset_mps, ..] = self.noise.at(time.s());
        offset_mps
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};

    use super::*;

    #[test]
    fn the_rate_of_the_desired_speed_has_the_given_standard_deviation() {
        let config = SpeedKeepingConfig { acceleration_noise_mps2: 0.1.into() };
        let rng = stream(1, 0, &ActorId::new("rear").unwrap(), "speed-keeping");
        let mut wander = config.check(&Parameters::default()).unwrap().wander(rng).unwrap();
        let speeds_mps: Vec<f64> = (0..200_000).map(|step| wander.at(Time::from_ms(100 * step))).collect();
        assert_eq!(speeds_mps[0], 0.0);
        let squares: f64 = speeds_mps.windows(2).map(|pair| (10.0 * (pair[1] - pair[0])).powi(2)).sum();
        let noise_mps2 = (squares / (speeds_mps.len() - 1) as f64).sqrt();
        assert!((noise_mps2 - 0.1).abs() < 0.003, "{noise_mps2}");
        let steady = SpeedKeepingConfig { acceleration_noise_mps2: 0.0.into() };
        let rng = stream(1, 0, &ActorId::new("rear").unwrap(), "speed-keeping");
        assert!(steady.check(&Parameters::default()).unwrap().wander(rng).is_none());
    }
}
