//! Keeping a speed as humans do: the speed that they want wanders.
//!
//! Herman, Montroll, Potts and Rothery (*Traffic Dynamics: Analysis of Stability in Car Following*, Operations Research 7
//! (1959) 86–106) measured the scatter of the acceleration of free drivers, "acceleration noise", as about 0.1 m/s² on a
//! good road. The wish is white noise behind three lags, the longest that of a driver who looks at the speedometer now
//! and then. How nearly the vehicle follows it is the driver model's affair.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range, Stream, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::drift::{Drift, derivative_sds};

/// The lags of the wish [s].
const LAGS_S: [f64; 3] = [10.0, 1.0, 1.0];

/// How a driver keeps its speed, as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct SpeedKeepingConfig {
    /// Standard deviation of the rate at which the wanted speed changes [m/s²], from 0 to 0.5; about 0.1 for humans.
    pub acceleration_noise_mps2: Num,
}

/// A checked way of keeping a speed.
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
    /// The wander of one run, nothing for a driver whose wish is steady.
    pub fn wander(&self, rng: Stream) -> Option<Wander> {
        let [rate_per_s, _] = derivative_sds(LAGS_S);
        let sd_mps = self.acceleration_noise_mps2 / rate_per_s;
        (sd_mps > 0.0).then(|| Wander { drift: Drift::from_rest(sd_mps, LAGS_S, rng) })
    }
}

/// How the speed that one driver wants wanders in the course of a run. It starts at nothing: a scenario says how fast
/// everybody is at its start.
#[derive(Clone, Debug)]
pub struct Wander {
    drift: Drift,
}

impl Wander {
    /// What is to be added to the wanted speed at `time`, which never falls from call to call [m/s].
    pub fn at(&mut self, time: Time) -> f64 {
        let [offset_mps, ..] = self.drift.at(time.s());
        offset_mps
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, stream};

    use super::*;

    #[test]
    fn the_wish_changes_as_fast_as_asked() {
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
