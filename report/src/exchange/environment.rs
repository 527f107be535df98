//! Light, weather and road surface.

use closecall_traffic::{Environment, EnvironmentConfig, Light};

use super::element::Element;
use super::expression::Values;
use super::vehicles::property;

/// Time of day and elevation of the sun (rad) for each light: assumptions that only pictures show.
const fn sun(light: Light) -> (&'static str, f64) {
    match light {
        Light::Day => ("2025-06-21T12:00:00", 1.0),
        Light::Dusk => ("2025-06-21T21:30:00", 0.0),
        Light::Night => ("2025-06-21T00:00:00", -0.3),
    }
}

/// Returns the action that sets the environment. The friction in it is relative to Closecall's
/// default, a dry road.
pub(super) fn action(config: &EnvironmentConfig, sample: &Environment, values: Values<'_>) -> Element {
    let (time, elevation_rad) = sun(sample.light);
    let friction = values.expression(&config.friction) / Environment::CLEAR_DAY.friction.into();
    let kind = if sample.rain_mm_per_h > 0.0 { "rain" } else { "dry" };
    let wetness = if sample.water_film_mm > 0.0 { "moist" } else { "dry" };
    let weather = Element::new("Weather")
        .child(Element::new("Sun").with("azimuth", 0).with("elevation", elevation_rad))
        .child(Element::new("Fog").with("visualRange", values.expression(&config.visibility_m)))
        .child(
            Element::new("Precipitation")
                .with("precipitationType", kind)
                .with("precipitationIntensity", values.expression(&config.rain_mm_per_h)),
        );
    let film = values.expression(&config.water_film_mm).to_string();
    let surface = Element::new("RoadCondition")
        .with("frictionScaleFactor", friction)
        .with("wetness", wetness)
        .child(Element::new("Properties").child(property("water-film-mm", &film)));
    Element::new("Environment")
        .with("name", "environment")
        .child(Element::new("TimeOfDay").with("animation", "false").with("dateTime", time))
        .child(weather)
        .child(surface)
        .within("EnvironmentAction")
        .within("GlobalAction")
}
