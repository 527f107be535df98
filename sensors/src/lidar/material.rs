//! What surfaces are made of, and how much of the laser's light they send back.
//!
//! A reflectivity is that of a Lambertian surface which would send back as much at the laser's wavelength, 905 nm, seen
//! at a right angle. Where no measurement is named, the value is an assumption within what is usual for the material.

use closecall_traffic::{Appearance, Environment};

/// The material of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    /// Painted sheet metal; its reflectivity is the vehicle's own.
    Paint,
    /// A window.
    Glass,
    /// A registration plate.
    Plate,
    /// A headlamp.
    Lamp,
    /// Rubber.
    Tyre,
    /// Unpainted plastic: grille, lower bumper, trim.
    Plastic,
    /// A rider's clothes and helmet.
    Textile,
    /// The side of a trailer.
    Tarpaulin,
    /// Galvanised steel.
    Steel,
    /// The road's surface.
    Asphalt,
    /// Droplets in the air.
    Water,
}

/// Windows let through or mirror away nearly all; what comes back is dust and the edge of the dashboard (assumption).
const GLASS: f64 = 0.05;
/// A retro-reflector of R_A (cd/(lx·m²)) looks like a Lambertian surface of ρ = π·R_A. New plates have some tens
/// (ISO 7591 sets the minimum); 20 is assumed for one in use.
const PLATE: f64 = std::f64::consts::PI * 20.0;
/// A clear lens before a reflector (assumption).
const LAMP: f64 = 1.0;
/// Carbon black (assumption, in line with what dark rubber shows in the near infrared).
const TYRE: f64 = 0.05;
/// Dark moulded plastic (assumption).
const PLASTIC: f64 = 0.10;
/// Textiles stay bright in the near infrared, even dark ones (assumption).
const TEXTILE: f64 = 0.35;
/// Coated fabric of usual colours (assumption).
const TARPAULIN: f64 = 0.5;
/// Weathered zinc, diffuse share (assumption).
const STEEL: f64 = 0.35;
/// Worn asphalt in the near infrared: 0.1 to 0.2 (Herold and Roberts 2005, "Spectral characteristics of asphalt road
/// aging and deterioration").
const ASPHALT: f64 = 0.15;
/// A wet rough surface reflects about half as much diffusely (Lekner and Dorf 1988, "Why some things are darker when
/// wet"); a closed film mirrors the rest away from a sensor at a grazing angle.
const WET_SHARE: f64 = 0.4;
/// Height of water at which the surface counts as wholly wet (mm).
const WET_FILM_MM: f64 = 0.2;

impl Material {
    /// Equivalent Lambertian reflectivity (dimensionless) on a vehicle of this appearance, in this weather.
    pub fn reflectivity(self, appearance: &Appearance, environment: &Environment) -> f64 {
        match self {
            Self::Paint => appearance.paint_reflectivity,
            Self::Glass => GLASS,
            Self::Plate => PLATE,
            Self::Lamp => LAMP,
            Self::Tyre => TYRE,
            Self::Plastic => PLASTIC,
            Self::Textile => TEXTILE,
            Self::Tarpaulin => TARPAULIN,
            Self::Steel => STEEL,
            Self::Asphalt => asphalt(environment),
            Self::Water => 0.0,
        }
    }
}

/// Reflectivity of the road (dimensionless): the wetter, the darker.
pub(crate) fn asphalt(environment: &Environment) -> f64 {
    let wetness = (environment.water_film_mm / WET_FILM_MM).clamp(0.0, 1.0);
    ASPHALT * (1.0 - (1.0 - WET_SHARE) * wetness)
}
