//! Fleets: how the vehicles on a road look. A vehicle that names a fleet draws its paint, colour,
//! body shape and plate anew in each sample.
//!
//! ```text
//!  library/fleets/NAME.toml ─▶ Fleet ─(seed, sample, name of the actor)─▶ paint, colour, shape, height, plate
//! ```
//!
//! The drawn look decides the sensors' view, and nothing else: length, width and mass stay, and
//! neither positions nor contacts depend on the look. The look comes from a separate random stream,
//! and changes no other number of a sample. Values of the scenario file for a vehicle are kept.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use closecall_traffic::{
    ActorId, BodyShape, ConfigError, Plate, Problem, Stream, Vehicle, VehicleClass, VehicleConfig, stream,
};
use rand::RngExt;
use serde::Deserialize;

use crate::run_key::RunKey;

/// Name of the random stream.
const CHANNEL: &str = "fleet";
/// Shortest text that counts as a source.
const MIN_SOURCE_LEN: usize = 20;

/// The texts of the fleets.
const TEXTS: [&str; 1] = [include_str!("../library/fleets/germany.toml")];

/// The fleets that ship. A test reads each of them, and none is left out here.
static FLEETS: LazyLock<Vec<Fleet>> =
    LazyLock::new(|| TEXTS.iter().filter_map(|text| Fleet::parse(text).ok()).collect());

/// How the vehicles on a road look.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct Fleet {
    /// The name.
    name: String,
    plates: PlateShares,
    car: Looks,
    truck: Looks,
    motorcycle: Looks,
}

/// Shares of the states of registration plates.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct PlateShares {
    clean: f64,
    dirty: f64,
    none: f64,
    assumed: String,
}

/// How the vehicles of one class look.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct Looks {
    shapes: BTreeMap<String, f64>,
    shapes_source: String,
    paints: Vec<Paint>,
    paints_source: String,
    reflectivity_source: String,
}

/// A colour, from its darkest to its brightest paint.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct Paint {
    colour: String,
    share: f64,
    reflectivity: [f64; 2],
    rgb: [[u8; 3]; 2],
}

/// The fleet of a vehicle, and what of its look the scenario file gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FleetOf {
    fleet: &'static Fleet,
    has_paint: bool,
    has_colour: bool,
    has_shape: bool,
    has_height: bool,
    has_plate: bool,
}

impl FleetOf {
    /// Returns the fleet of a vehicle; `None` if it names none.
    ///
    /// # Errors
    /// [`ConfigError`] at `fleet` if there is no fleet of that name.
    pub(super) fn check(config: &VehicleConfig) -> Result<Option<Self>, ConfigError> {
        let Some(name) = &config.fleet else { return Ok(None) };
        Ok(Some(Self {
            fleet: Fleet::named(name)?,
            has_paint: config.paint_reflectivity.is_some(),
            has_colour: config.paint_rgb.is_some(),
            has_shape: config.body_shape.is_some(),
            has_height: config.height_m.is_some(),
            has_plate: config.plate.is_some(),
        }))
    }

    /// Returns the fleet of vehicles about which nothing is given.
    pub(super) fn of_name(name: &str) -> Result<Self, ConfigError> {
        let [has_paint, has_colour, has_shape, has_height, has_plate] = [false; 5];
        Ok(Self { fleet: Fleet::named(name)?, has_paint, has_colour, has_shape, has_height, has_plate })
    }

    /// Returns the vehicle of the actor `id` as it looks in the run `key`.
    pub(crate) fn vehicle_in_run(&self, vehicle: Vehicle, id: &ActorId, key: RunKey) -> Vehicle {
        self.draw(vehicle, &mut stream(key.seed, key.sample, id, CHANNEL))
    }

    /// Returns a vehicle with a look drawn from its fleet. It always draws four numbers.
    fn draw(&self, mut vehicle: Vehicle, rng: &mut Stream) -> Vehicle {
        let [shape, paint, shade, plate]: [f64; 4] = rng.random();
        let looks = self.fleet.looks(vehicle.class);
        let drawn = looks.shape(shape);
        if let Some(drawn) = drawn.filter(|_| !self.has_shape) {
            vehicle.appearance.body_shape = drawn;
            if !self.has_height {
                vehicle.dimensions.height_m = drawn.usual_dimensions().height_m;
            }
        }
        if let Some(paint) = pick(looks.paints.iter().map(|paint| (paint, paint.share)), paint) {
            if !self.has_paint {
                vehicle.appearance.paint_reflectivity = between(paint.reflectivity, shade);
            }
            if !self.has_colour {
                vehicle.appearance.paint_rgb = paint.colour_at(shade);
            }
        }
        if !self.has_plate {
            let PlateShares { clean, dirty, none, .. } = self.fleet.plates;
            let states = [(Plate::Clean, clean), (Plate::Dirty, dirty), (Plate::None, none)];
            vehicle.appearance.plate = pick(states, plate).unwrap_or_default();
        }
        vehicle
    }
}

impl Fleet {
    /// Returns the fleet of this name.
    ///
    /// # Errors
    /// [`ConfigError`] at `fleet` if there is none.
    fn named(name: &str) -> Result<&'static Self, ConfigError> {
        FLEETS.iter().find(|fleet| fleet.name == name).ok_or_else(|| {
            let allowed = FLEETS.iter().map(|fleet| &*fleet.name).collect::<Vec<_>>().join(", ");
            ConfigError::new("fleet", Problem::UnknownWord { value: name.to_owned(), allowed })
        })
    }

    /// Parses and checks the text of a fleet.
    ///
    /// # Errors
    /// A message that names the key and the allowed values.
    fn parse(text: &str) -> Result<Self, String> {
        let fleet: Self = toml::from_str(text).map_err(|error| error.to_string())?;
        let shares = [fleet.plates.clean, fleet.plates.dirty, fleet.plates.none];
        check_shares("plates", &shares)?;
        check_source("plates.assumed", &fleet.plates.assumed)?;
        for class in VehicleClass::ALL {
            fleet.looks(class).check(class).map_err(|error| format!("{}.{error}", class.name()))?;
        }
        Ok(fleet)
    }

    fn looks(&self, class: VehicleClass) -> &Looks {
        match class {
            VehicleClass::Car => &self.car,
            VehicleClass::Truck => &self.truck,
            VehicleClass::Motorcycle => &self.motorcycle,
        }
    }
}

impl Looks {
    fn check(&self, class: VehicleClass) -> Result<(), String> {
        check_shares("shapes", &self.shapes.values().copied().collect::<Vec<_>>())?;
        if let Some(name) = self.shapes.keys().find(|name| shape_of(class, name).is_none()) {
            return Err(format!("shapes: `{name}` is not a shape of a {}", class.name()));
        }
        check_shares("paints", &self.paints.iter().map(|paint| paint.share).collect::<Vec<_>>())?;
        for Paint { colour, reflectivity: [dark, bright], .. } in &self.paints {
            if !(*dark > 0.0 && dark <= bright && *bright <= 1.0) {
                return Err(format!(
                    "paints: the reflectivity of `{colour}` is {dark} to {bright}, but numbers above 0 and up to 1 in rising order are needed"
                ));
            }
        }
        check_source("shapes-source", &self.shapes_source)?;
        check_source("paints-source", &self.paints_source)?;
        check_source("reflectivity-source", &self.reflectivity_source)
    }

    /// Returns the shape that a number from 0 to 1 draws.
    fn shape(&self, drawn: f64) -> Option<BodyShape> {
        let shapes = BodyShape::of_class(VehicleClass::Car)
            .iter()
            .chain(BodyShape::of_class(VehicleClass::Truck))
            .chain(BodyShape::of_class(VehicleClass::Motorcycle));
        pick(shapes.filter_map(|shape| Some((*shape, *self.shapes.get(shape.name())?))), drawn)
    }
}

impl Paint {
    fn colour_at(&self, shade: f64) -> [u8; 3] {
        let [dark, bright] = self.rgb;
        std::array::from_fn(|channel| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes")]
            let value = between([dark[channel].into(), bright[channel].into()], shade).round() as u8;
            value
        })
    }
}

fn between([low, high]: [f64; 2], share: f64) -> f64 {
    low + (high - low) * share
}

fn shape_of(class: VehicleClass, name: &str) -> Option<BodyShape> {
    BodyShape::of_class(class).iter().copied().find(|shape| shape.name() == name)
}

/// Returns the choice that a number from 0 to 1 draws, by shares.
fn pick<T>(choices: impl IntoIterator<Item = (T, f64)>, drawn: f64) -> Option<T> {
    let choices: Vec<(T, f64)> = choices.into_iter().collect();
    let mut left = drawn * choices.iter().map(|(_, share)| share).sum::<f64>();
    let mut last = None;
    for (choice, share) in choices {
        left -= share;
        last = Some(choice);
        if left < 0.0 {
            break;
        }
    }
    last
}

fn check_shares(key: &str, shares: &[f64]) -> Result<(), String> {
    let sum: f64 = shares.iter().sum();
    if shares.iter().all(|share| *share >= 0.0) && (sum - 1.0).abs() < 0.005 {
        return Ok(());
    }
    Err(format!("{key}: the shares add up to {sum:.3}, but shares of 0 or more that add up to 1 are needed"))
}

fn check_source(key: &str, source: &str) -> Result<(), String> {
    if source.len() > MIN_SOURCE_LEN {
        return Ok(());
    }
    Err(format!("{key}: `{source}` is not a source; more than {MIN_SOURCE_LEN} characters are needed"))
}

#[cfg(test)]
mod tests;
