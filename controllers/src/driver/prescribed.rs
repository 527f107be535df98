//! A driver that follows a list of times and speeds, whatever the others do.

use closecall_traffic::{Check, ConfigError, Num, Parameters, Problem, Range, Stream};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Driver, DriverAction, DriverError, DriverInput, finite};

/// How fast a deviation from the prescribed speed is removed [1/s]; well below the actuators' 1/0.15 s.
const SPEED_GAIN_PER_S: f64 = 2.0;

/// Strongest braking that is asked for to follow a profile [m/s²]: dry friction.
const STRONGEST_BRAKING_MPS2: f64 = 9.0;

/// Strongest acceleration that is asked for to follow a profile [m/s²].
const STRONGEST_ACCELERATION_MPS2: f64 = 5.0;

/// A profile as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct PrescribedConfig {
    /// Pairs of time [s] and speed [m/s], times rising; linear in between, constant before and after.
    pub profile: Vec<[Num; 2]>,
}

/// A checked profile: at least one point, times rising.
#[derive(Clone, Debug, PartialEq)]
pub struct Prescribed {
    points: Vec<(f64, f64)>,
}

impl Check for PrescribedConfig {
    type Checked = Prescribed;

    fn check(&self, parameters: &Parameters) -> Result<Prescribed, ConfigError> {
        if self.profile.is_empty() {
            return Err(ConfigError::new(
                "profile",
                Problem::Missing { needed: "at least one pair of time and speed" },
            ));
        }
        let mut points: Vec<(f64, f64)> = Vec::with_capacity(self.profile.len());
        for (place, [time, speed]) in self.profile.iter().enumerate() {
            let here = |error: ConfigError| error.within_index(place).within("profile");
            let earliest = match points.last() {
                Some((last, _)) => Range::above(*last, 1e6),
                None => Range::closed(0.0, 1e6),
            };
            let time_s = parameters.number(time, "time-s", earliest).map_err(here)?;
            let speed_mps = parameters.number(speed, "speed-mps", Range::closed(0.0, 100.0)).map_err(here)?;
            points.push((time_s, speed_mps));
        }
        Ok(Prescribed { points })
    }
}

impl Prescribed {
    /// Speed [m/s] and its slope [m/s²] at `time_s`.
    fn at(&self, time_s: f64) -> (f64, f64) {
        let after = self.points.partition_point(|(time, _)| *time <= time_s);
        match (after.checked_sub(1).map(|before| self.points[before]), self.points.get(after)) {
            (Some((t0, v0)), Some((t1, v1))) => {
                let slope = (v1 - v0) / (t1 - t0);
                (v0 + slope * (time_s - t0), slope)
            }
            (Some((_, speed)), None) | (None, Some(&(_, speed))) => (speed, 0.0),
            (None, None) => unreachable!("a checked profile has a point"),
        }
    }

    /// A driver for one run.
    pub(crate) fn driver(&self) -> PrescribedDriver {
        PrescribedDriver { profile: self.clone() }
    }
}

/// Follows a profile.
#[derive(Clone, Debug)]
pub(crate) struct PrescribedDriver {
    profile: Prescribed,
}

impl Driver for PrescribedDriver {
    fn step(&mut self, input: &DriverInput<'_>, _: &mut Stream) -> Result<DriverAction, DriverError> {
        let (speed_mps, slope_mps2) = self.profile.at(input.time.s());
        let wanted = slope_mps2 + SPEED_GAIN_PER_S * (speed_mps - input.own.speed_mps);
        let wanted = finite(wanted, "acceleration of a profile", input.time)?;
        let acceleration_mps2 = wanted.clamp(-STRONGEST_BRAKING_MPS2, STRONGEST_ACCELERATION_MPS2);
        Ok(DriverAction { acceleration_mps2, ..DriverAction::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(points: &[[f64; 2]]) -> PrescribedConfig {
        PrescribedConfig { profile: points.iter().map(|pair| pair.map(Num::Fixed)).collect() }
    }

    #[test]
    fn speeds_are_linear_in_between_and_constant_outside() {
        let profile = config(&[[1.0, 30.0], [3.0, 20.0]]).check(&Parameters::default()).unwrap();
        assert_eq!(profile.at(0.0), (30.0, 0.0));
        assert_eq!(profile.at(2.0), (25.0, -5.0));
        assert_eq!(profile.at(9.0), (20.0, 0.0));
    }

    #[test]
    fn times_that_do_not_rise_are_refused_with_their_place() {
        let error = config(&[[0.0, 30.0], [0.0, 20.0]]).check(&Parameters::default()).unwrap_err();
        assert_eq!(error.path.to_string(), "profile[1].time-s");
        assert!(config(&[]).check(&Parameters::default()).is_err());
    }
}
