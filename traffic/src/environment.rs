//! Light, weather and road surface condition.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Check, Choice, ConfigError, Num, Parameters, Range};

/// The ambient light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Light {
    /// Daylight.
    Day,
    /// Twilight, headlights on.
    Dusk,
    /// Night, headlights on.
    Night,
}

/// The environment as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub struct EnvironmentConfig {
    /// Day, dusk or night.
    pub light: Choice<Light>,
    /// Meteorological visibility (m).
    pub visibility_m: Num,
    /// Rain rate (mm/h).
    pub rain_mm_per_h: Num,
    /// Depth of the water film on the road (mm); it determines the amount of spray.
    pub water_film_mm: Num,
    /// Friction coefficient between tyre and road.
    pub friction: Num,
}

impl Default for EnvironmentConfig {
    /// A clear, dry day.
    fn default() -> Self {
        Self {
            light: Choice::Fixed(Light::Day),
            visibility_m: Num::Fixed(10_000.0),
            rain_mm_per_h: Num::Fixed(0.0),
            water_film_mm: Num::Fixed(0.0),
            friction: Num::Fixed(0.9),
        }
    }
}

/// A checked environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Day, dusk or night.
    pub light: Light,
    /// Meteorological visibility (m), 20 or more.
    pub visibility_m: f64,
    /// Rain rate (mm/h), 0 or more.
    pub rain_mm_per_h: f64,
    /// Depth of the water film on the road (mm), 0 or more.
    pub water_film_mm: f64,
    /// Friction coefficient between tyre and road, above 0.
    pub friction: f64,
}

impl Environment {
    /// Rain that the models cover (mm/h).
    pub const RAIN_MM_PER_H: Range = Range::closed(0.0, 200.0);
    /// Friction that the models cover.
    pub const FRICTION: Range = Range::closed(0.1, 1.2);

    /// A clear, dry day: visibility 10 km, friction 0.9.
    pub const CLEAR_DAY: Self =
        Self { light: Light::Day, visibility_m: 10_000.0, rain_mm_per_h: 0.0, water_film_mm: 0.0, friction: 0.9 };
}

impl Check for EnvironmentConfig {
    type Checked = Environment;

    fn check(&self, parameters: &Parameters) -> Result<Environment, ConfigError> {
        let number = |num, key, range| parameters.number(num, key, range);
        Ok(Environment {
            light: parameters.word(&self.light, "light")?,
            visibility_m: number(&self.visibility_m, "visibility-m", Range::closed(20.0, 100_000.0))?,
            rain_mm_per_h: number(&self.rain_mm_per_h, "rain-mm-per-h", Environment::RAIN_MM_PER_H)?,
            water_film_mm: number(&self.water_film_mm, "water-film-mm", Range::closed(0.0, 10.0))?,
            friction: number(&self.friction, "friction", Environment::FRICTION)?,
        })
    }
}
