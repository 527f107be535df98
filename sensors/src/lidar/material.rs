//! The materials of surfaces and their reflectivity for the laser's light.
//!
//! The reflectivity of a material is the reflectivity of the Lambertian surface that returns the
//! same power at the laser's wavelength, 905 nm, at normal incidence. If no measurement is cited,
//! the value is an assumption within the usual range for the material.

use closecall_traffic::{Appearance, Environment, Plate};

/// The material of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    /// Painted sheet metal, whose reflectivity is set for each vehicle.
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
    /// The retro-reflective face of a road sign.
    Sign,
    /// The bark of a tree.
    Bark,
    /// The road's surface.
    Asphalt,
    /// Droplets in the air.
    Water,
}

/// Windows transmit nearly all light or reflect it away from the sensor. Only dust and the edge of
/// the dashboard return light (assumption).
const GLASS: f64 = 0.05;
/// A clear lens in front of a reflector (assumption).
const LAMP: f64 = 1.0;
/// Rubber with carbon black (assumption, in line with the reflectivity of dark rubber in the near
/// infrared).
const TYRE: f64 = 0.05;
/// Dark moulded plastic (assumption).
const PLASTIC: f64 = 0.10;
/// Textiles are bright in the near infrared, even if they look dark (assumption).
const TEXTILE: f64 = 0.35;
/// Coated fabric in usual colours (assumption).
const TARPAULIN: f64 = 0.5;
/// Weathered zinc; only its diffuse reflection counts (assumption).
const STEEL: f64 = 0.35;
/// A retro-reflector with the coefficient R_A (cd/(lx·m²)) looks like a Lambertian surface of ρ =
/// π·R_A. EN 12899-1 asks 250 of new white sheeting of class RA2.
const SIGN: f64 = std::f64::consts::PI * 250.0;
/// Bark in the near infrared (assumption).
const BARK: f64 = 0.3;
/// Worn asphalt in the near infrared: 0.1 to 0.2 (Herold and Roberts 2005, "Spectral
/// characteristics of asphalt road aging and deterioration").
const ASPHALT: f64 = 0.15;
/// Factor on the reflectivity of a wet road. A wet rough surface reflects diffusely about half as
/// much as a dry one (Lekner and Dorf 1988, "Why some things are darker when wet"). A closed film
/// of water also reflects light away from a sensor at a grazing angle.
const WET_SHARE: f64 = 0.4;
/// Height of the water film from which the surface counts as fully wet (mm).
const WET_FILM_MM: f64 = 0.2;

impl Material {
    /// Returns the equivalent Lambertian reflectivity on a vehicle of this appearance, in this
    /// weather.
    ///
    /// The LiDAR's configuration gives the reflectivity of a plate. Without a plate, the paint is
    /// seen.
    pub fn reflectivity(self, plate: Option<f64>, appearance: &Appearance, environment: &Environment) -> f64 {
        match self {
            Self::Paint => appearance.paint_reflectivity,
            Self::Glass => GLASS,
            Self::Plate => plate_of(plate, appearance.plate).unwrap_or(appearance.paint_reflectivity),
            Self::Lamp => LAMP,
            Self::Tyre => TYRE,
            Self::Plastic => PLASTIC,
            Self::Textile => TEXTILE,
            Self::Tarpaulin => TARPAULIN,
            Self::Steel => STEEL,
            Self::Sign => SIGN,
            Self::Bark => BARK,
            Self::Asphalt => asphalt(environment),
            Self::Water => 0.0,
        }
    }
}

/// Returns the reflectivity of a plate in this state, if plates usually have the reflectivity
/// `usual`; `None` if there is none.
fn plate_of(usual: Option<f64>, state: Plate) -> Option<f64> {
    match state {
        Plate::Clean => usual,
        Plate::Dirty => usual.map(|usual| usual.min(DIRTY_PLATE)),
        Plate::None => None,
    }
}

/// Returns the reflectivity of the road, which decreases with the height of the water film.
pub(crate) fn asphalt(environment: &Environment) -> f64 {
    let wetness = (environment.water_film_mm / WET_FILM_MM).clamp(0.0, 1.0);
    ASPHALT * (1.0 - (1.0 - WET_SHARE) * wetness)
}

/// A retro-reflector with the coefficient R_A (cd/(lx·m²)) looks like a Lambertian surface of ρ =
/// π·R_A. New plates have some tens (ISO 7591 sets the minimum). 20 is assumed for a plate in use.
pub(super) const PLATE: f64 = std::f64::consts::PI * 20.0;

/// Share of a plate's reflectivity that remains under dirt (assumption).
const DIRTY_SHARE: f64 = 0.2;

/// Equivalent Lambertian reflectivity of a dirty plate.
pub(super) const DIRTY_PLATE: f64 = DIRTY_SHARE * PLATE;
