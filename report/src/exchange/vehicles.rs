//! The catalogue of vehicles, with dimensions and performance.

use closecall_simulation::Performance;
use closecall_traffic::{ActorId, Dimensions, Environment, Vehicle, VehicleClass};

use super::element::Element;
use super::scenario::header;

/// Name of the catalogue, and of its file without the extension, by which players find it.
pub(super) const CATALOG: &str = "VehicleCatalog";
/// Speed that no vehicle exceeds (m/s): the highest speed of a scenario file.
const MAX_SPEED_MPS: f64 = 100.0;
/// Wheel diameter (m), by class: assumptions; 0.6 to 0.7, 0.9 to 1.1, and 0.6 to 0.7 are plausible.
/// No run depends on it.
const WHEEL_DIAMETER_M: [(VehicleClass, f64); 3] =
    [(VehicleClass::Car, 0.65), (VehicleClass::Truck, 1.0), (VehicleClass::Motorcycle, 0.63)];
/// Largest steering angle (rad): an assumption; 0.5 to 0.7 are plausible. No run depends on it.
const MAX_STEERING_RAD: f64 = 0.6;
/// Track width as a share of the width of the vehicle: an assumption; 0.8 to 0.9 are plausible. No
/// run depends on it.
const TRACK_SHARE: f64 = 0.85;

/// Returns the distance from the rear axle forwards to the centre of the box (m).
pub(super) fn axle_to_centre_m(dimensions: &Dimensions) -> f64 {
    0.5 * dimensions.wheelbase_m()
}

/// Returns the word of OpenSCENARIO for a class.
pub(super) const fn category(class: VehicleClass) -> &'static str {
    match class {
        VehicleClass::Car => "car",
        VehicleClass::Truck => "truck",
        VehicleClass::Motorcycle => "motorbike",
    }
}

/// End of the name of an entry that would otherwise have the name of another one.
const ITSELF: &str = "-itself";

/// Returns the name of a vehicle's entry in the catalogue: the name of the vehicle, unless a class
/// has it, whose entry stands there too, or another vehicle's entry could have it.
pub(super) fn entry_name(actor: &ActorId) -> String {
    let stem = actor.as_str().trim_end_matches(ITSELF);
    let is_class = VehicleClass::ALL.iter().any(|class| class.name() == stem);
    format!("{actor}{}", if is_class { ITSELF } else { "" })
}

/// Returns the catalogue of these vehicles with their names, as a document.
pub(super) fn document<'a>(vehicles: impl IntoIterator<Item = &'a (String, Vehicle)>) -> String {
    let entries = vehicles.into_iter().map(|(name, vehicle)| element(name, vehicle));
    let catalog = Element::new("Catalog").with("name", CATALOG).children(entries);
    Element::new("OpenSCENARIO").child(header("vehicles of a case of Closecall", &[], None)).child(catalog).document()
}

/// Returns the element of a vehicle, in a catalogue.
fn element(name: &str, vehicle: &Vehicle) -> Element {
    let Dimensions { length_m, width_m, height_m } = vehicle.dimensions;
    let centre =
        Element::new("Center").with("x", axle_to_centre_m(&vehicle.dimensions)).with("y", 0).with("z", 0.5 * height_m);
    let size = Element::new("Dimensions").with("width", width_m).with("length", length_m).with("height", height_m);
    let performance = Performance::of(vehicle.class, Environment::CLEAR_DAY.friction);
    let diameter_m =
        WHEEL_DIAMETER_M.iter().find(|(class, _)| *class == vehicle.class).map_or(0.65, |(_, diameter)| *diameter);
    let track_m = if vehicle.class == VehicleClass::Motorcycle { 0.0 } else { TRACK_SHARE * width_m };
    let axle = |name, x_m: f64, steering_rad: f64| {
        Element::new(name)
            .with("maxSteering", steering_rad)
            .with("wheelDiameter", diameter_m)
            .with("trackWidth", track_m)
            .with("positionX", x_m)
            .with("positionZ", 0.5 * diameter_m)
    };
    Element::new("Vehicle")
        .with("name", name)
        .with("vehicleCategory", category(vehicle.class))
        .with("mass", vehicle.mass_kg)
        .child(Element::new("BoundingBox").child(centre).child(size))
        .child(
            Element::new("Performance")
                .with("maxSpeed", MAX_SPEED_MPS)
                .with("maxAcceleration", performance.max_acceleration_mps2)
                .with("maxDeceleration", performance.max_deceleration_mps2),
        )
        .child(
            Element::new("Axles")
                .child(axle("FrontAxle", vehicle.dimensions.wheelbase_m(), MAX_STEERING_RAD))
                .child(axle("RearAxle", 0.0, 0.0)),
        )
        .child(Element::new("Properties").child(property("body-shape", &vehicle.appearance.body_shape.to_string())))
}

/// Returns a property of this name.
pub(super) fn property(name: &str, value: &str) -> Element {
    Element::new("Property").with("name", name).with("value", value)
}
