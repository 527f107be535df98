//! Errors of the ego's odometry and of its position on the map, of which the ego does not know.
//!
//! The ego derives the speed of another vehicle from a position relative to itself and its own motion. With a wrong own motion
//! it believes in a scene that is shifted as a whole: everything that it sees is where it is seen, and the speeds over ground
//! and the lanes are wrong.

use closecall_traffic::{ConfigError, Num, Parameters, Range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Scene, SceneVehicle};

/// Errors of odometry and map as a scenario file describes them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct OdometryErrorConfig {
    /// Relative error of the measured own speed (-): 0.01 if the ego takes 30 m/s for 30.3 m/s. Wheel speeds err by the wear and
    /// the pressure of the tyres. Default: 0.
    pub speed_scale: Option<Num>,
    /// Error of the own lateral position on the map (m): positive if the ego believes itself too far left. Default: 0.
    pub lateral_m: Option<Num>,
}

/// Checked errors of odometry and map. None by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OdometryErrors {
    /// Relative error of the measured own speed (-).
    pub speed_scale: f64,
    /// Error of the own lateral position (m).
    pub lateral_m: f64,
}

impl OdometryErrorConfig {
    /// Checks the errors.
    ///
    /// # Errors
    /// [`ConfigError`] if a value is out of its range.
    pub fn check(&self, parameters: &Parameters) -> Result<OdometryErrors, ConfigError> {
        let number = |num: &Option<Num>, key, limit: f64| {
            parameters.number_or(num.as_ref(), key, Range::closed(-limit, limit), 0.0)
        };
        Ok(OdometryErrors {
            speed_scale: number(&self.speed_scale, "speed-scale", 0.1)?,
            lateral_m: number(&self.lateral_m, "lateral-m", 1.0)?,
        })
    }
}

impl OdometryErrors {
    /// Returns whether there is no error.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// What the ego believes about itself and the vehicles around it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Belief {
    errors: OdometryErrors,
    /// Position along the road at the first step (m).
    start_s_m: Option<f64>,
    others: Vec<SceneVehicle>,
}

impl Belief {
    /// Creates a belief with these errors.
    pub(crate) fn new(errors: OdometryErrors) -> Self {
        Self { errors, ..Self::default() }
    }

    /// Returns the scene as the ego believes it to be.
    pub(crate) fn of<'a>(&'a mut self, scene: &Scene<'a>) -> Scene<'a> {
        if self.errors.is_none() {
            return *scene;
        }
        let own = scene.ego.state;
        let start_s_m = *self.start_s_m.get_or_insert(own.s_m);
        let OdometryErrors { speed_scale, lateral_m } = self.errors;
        let (ahead_m, faster_mps) = (speed_scale * (own.s_m - start_s_m), speed_scale * own.speed_mps);
        let shifted = |mut vehicle: SceneVehicle| {
            vehicle.state.s_m += ahead_m;
            vehicle.state.d_m += lateral_m;
            vehicle.state.speed_mps += faster_mps;
            vehicle
        };
        self.others.clear();
        self.others.extend(scene.others.iter().copied().map(shifted));
        Scene { ego: shifted(scene.ego), others: &self.others, ..*scene }
    }
}
