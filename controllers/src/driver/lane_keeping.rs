//! Keeping a lane as humans do: they weave.
//!
//! The deviation from the way that a driver means to take is white steering behind three lags. Their course over time is
//! fitted to US-101 (NGSIM, 120 vehicles that stay in one lane for at least 8 s at more than 8 m/s, within 1.2 m of its
//! centre; mean speed 14 m/s). There the variogram of the lateral position, half of the mean squared difference, is 0.0105,
//! 0.0224, 0.0315, 0.049, 0.0685 and 0.080 m² at 1, 2, 3, 5, 8 and 12 s. With a standard deviation of 0.284 m the lags below are
//! within 17 % of that: less at 1 s, where the errors of the recording count, which no vehicle drives. The width is each
//! driver's own (`sdlp-m`).
//!
//! The weave is written over the way driven, as lane changes are: one who brakes stays on its path, and a vehicle that
//! stands does not move sideways. The lags are those at 30 m/s, where no recording at hand says how drivers weave: that they
//! steer with the same haste there as on US-101 is an assumption. Over the way they would steer with 0.3 m/s² (standard
//! deviation at 30 m/s and 0.2 m); had the recorded 14 m/s been taken for the reference, with 1.3 m/s², which nobody does.
//!
//! A run starts on the path and at rest beside it, as the scenario says where everybody is; after three of the longest lag
//! the weave is as wide as in the long run.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Range, Side, Stream};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::drift::{Drift, derivative_sds};

/// The lags of the steering [s].
const LAGS_S: [f64; 3] = [4.1, 0.4, 0.4];

/// The speed at which the lags are those of the steering [m/s].
const REFERENCE_MPS: f64 = 30.0;

/// How a driver keeps its lane, as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct LaneKeepingConfig {
    /// Standard deviation of the lateral position (SDLP) [m], from 0 to 0.5. Sober drivers on highways: about 0.2 m (Verster
    /// and Roth, *International Journal of General Medicine* 4 (2011) 359–371).
    pub sdlp_m: Num,
}

/// A checked way of keeping a lane.
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
    /// Standard deviation of the lateral acceleration with which it steers at this speed [m/s²].
    pub fn lateral_acceleration_sd_mps2(&self, speed_mps: f64) -> f64 {
        let [_, second_per_s2] = derivative_sds(LAGS_S);
        self.sdlp_m * second_per_s2 * (speed_mps / REFERENCE_MPS).powi(2)
    }

    /// The weave of one run, nothing for a driver who does not weave. It is mirrored where one overtakes on the right.
    pub fn weave(&self, overtaking_side: Side, rng: Stream) -> Option<Weave> {
        let sign = match overtaking_side {
            Side::Left => 1.0,
            Side::Right => -1.0,
        };
        (self.sdlp_m > 0.0).then(|| Weave { sign, drift: Drift::from_rest(self.sdlp_m, LAGS_S, rng) })
    }
}

/// How one driver weaves in the course of a run.
#[derive(Clone, Debug)]
pub struct Weave {
    sign: f64,
    drift: Drift,
}

/// The deviation from the path that a driver means to take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// To the left of the path [m].
    pub offset_m: f64,
    /// Its derivative by the way driven [1].
    pub slope: f64,
    /// Its second derivative [1/m].
    pub bend_per_m: f64,
}

impl Weave {
    /// The deviation after driving `way_m`, which never falls from call to call.
    pub fn at(&mut self, way_m: f64) -> Deviation {
        let [value, first, second] = self.drift.at(way_m / REFERENCE_MPS).map(|part| self.sign * part);
        Deviation {
            offset_m: value,
            slope: first / REFERENCE_MPS,
            bend_per_m: second / (REFERENCE_MPS * REFERENCE_MPS),
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
    fn the_variogram_is_that_of_us_101() {
        const RECORDED_M2: [(f64, f64); 6] =
            [(1.0, 0.0105), (2.0, 0.0224), (3.0, 0.0315), (5.0, 0.049), (8.0, 0.0685), (12.0, 0.080)];
        let mut weave = weave(0.284, 1, Side::Left).unwrap();
        let step_s = 0.5;
        let offsets_m: Vec<f64> =
            (60..80_000).map(|step| weave.at(f64::from(step) * step_s * REFERENCE_MPS).offset_m).collect();
        for (lag_s, recorded_m2) in RECORDED_M2 {
            let apart = (lag_s / step_s) as usize;
            let pairs = offsets_m.iter().zip(&offsets_m[apart..]);
            let squares: f64 = pairs.map(|(one, other)| (one - other) * (one - other)).sum();
            let variogram_m2 = 0.5 * squares / (offsets_m.len() - apart) as f64;
            let ratio = variogram_m2 / recorded_m2;
            assert!((0.81..1.17).contains(&ratio), "at {lag_s} s: {variogram_m2} m², recorded {recorded_m2} m²");
        }
    }

    #[test]
    fn the_lateral_acceleration_is_one_that_drivers_steer() {
        let config = LaneKeepingConfig { sdlp_m: 0.2.into() };
        let keeping = config.check(&Parameters::default()).unwrap();
        let mut weave = weave(0.2, 3, Side::Left).unwrap();
        let squares = (0..100_000).map(|step| {
            let bend_per_m = weave.at(f64::from(step) * 0.01 * REFERENCE_MPS).bend_per_m;
            (bend_per_m * REFERENCE_MPS * REFERENCE_MPS).powi(2)
        });
        let sd_mps2 = (squares.sum::<f64>() / 100_000.0).sqrt();
        assert!((0.2..0.35).contains(&sd_mps2), "{sd_mps2}");
        // The quintics between the knots are a little calmer.
        let expected_mps2 = keeping.lateral_acceleration_sd_mps2(REFERENCE_MPS);
        assert!((0.85..1.05).contains(&(sd_mps2 / expected_mps2)), "{sd_mps2} {expected_mps2}");
        assert_eq!(keeping.lateral_acceleration_sd_mps2(2.0 * REFERENCE_MPS), 4.0 * expected_mps2);
    }

    #[test]
    fn in_the_mirror_it_is_mirrored_and_with_none_there_is_none() {
        let (mut one, mut image) = (weave(0.2, 4, Side::Left).unwrap(), weave(0.2, 4, Side::Right).unwrap());
        let (one, image) = (one.at(400.0), image.at(400.0));
        assert_eq!((image.offset_m, image.slope, image.bend_per_m), (-one.offset_m, -one.slope, -one.bend_per_m));
        assert!(weave(0.0, 4, Side::Left).is_none());
        let too_much = LaneKeepingConfig { sdlp_m: 0.6.into() };
        assert_eq!(too_much.check(&Parameters::default()).unwrap_err().path.to_string(), "sdlp-m");
    }
}
