//! Attributes of the operational design domain.
//!
//! The names and the limits of the classes come from ISO 34503:2023, as the OpenODD taxonomy of the
//! Autoware Foundation lists them (`Domain_Concepts_Definition_ISO_34503.yaml`). ISO 34503 has no
//! class for what is absent: `none` and `dry` are ours.

use closecall_traffic::{Environment, Light, Road};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An attribute of the operational design domain that a scenario determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OddAttribute {
    /// Rain rate: no-rain, light-rain (below 2.5 mm/h), moderate-rain (below 7.6), heavy-rain (below 50), violent-rain (up to
    /// 100), cloudburst.
    RainfallIntensity,
    /// Daylight: day, low-ambient (dusk), night.
    NaturalIlluminance,
    /// Particulates: none, or non-precipitating-water-droplets (fog, a visibility below 1 km).
    Particulates,
    /// State of the road: dry or wet.
    SurfaceCondition,
    /// Course of the road: straight-lines or curves.
    HorizontalPlane,
    /// Edge of the road: solid-barriers (guard rails) or line-markers.
    DrivableAreaEdge,
}

/// Upper limits of the classes of rain (mm/h), ISO 34503:2023.
const RAIN_MM_PER_H: [(f64, &str); 4] =
    [(2.5, "light-rain"), (7.6, "moderate-rain"), (50.0, "heavy-rain"), (100.0, "violent-rain")];
/// Visibility below which water droplets in the air are fog (m): the definition of the World Meteorological Organization.
const FOG_VISIBILITY_M: f64 = 1_000.0;

/// The part of a concrete scenario on which the attributes depend.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// Light, weather and surface.
    pub environment: Environment,
    /// The road.
    pub road: Road,
}

impl OddAttribute {
    /// Returns the name in scenario files.
    pub fn name(self) -> String {
        let name = serde_json::to_value(self).ok().and_then(|value| value.as_str().map(str::to_owned));
        name.unwrap_or_default()
    }

    /// Returns the classes.
    pub const fn labels(self) -> &'static [&'static str] {
        match self {
            Self::RainfallIntensity => {
                &["no-rain", "light-rain", "moderate-rain", "heavy-rain", "violent-rain", "cloudburst"]
            }
            Self::NaturalIlluminance => &["day", "low-ambient", "night"],
            Self::Particulates => &["none", "non-precipitating-water-droplets"],
            Self::SurfaceCondition => &["dry", "wet"],
            Self::HorizontalPlane => &["straight-lines", "curves"],
            Self::DrivableAreaEdge => &["line-markers", "solid-barriers"],
        }
    }

    /// Returns the class of a scenario.
    pub fn of(self, Surroundings { environment, road }: &Surroundings) -> &'static str {
        let second = |holds: bool| self.labels()[usize::from(holds)];
        match self {
            Self::RainfallIntensity if environment.rain_mm_per_h <= 0.0 => "no-rain",
            Self::RainfallIntensity => {
                let class = RAIN_MM_PER_H.iter().find(|(limit, _)| environment.rain_mm_per_h < *limit);
                class.map_or("cloudburst", |(_, name)| name)
            }
            Self::NaturalIlluminance => match environment.light {
                Light::Day => "day",
                Light::Dusk => "low-ambient",
                Light::Night => "night",
            },
            Self::Particulates => second(environment.visibility_m < FOG_VISIBILITY_M),
            Self::SurfaceCondition => second(environment.water_film_mm > 0.0),
            Self::HorizontalPlane => second(!road.is_straight()),
            Self::DrivableAreaEdge => second(road.has_guard_rails()),
        }
    }
}
