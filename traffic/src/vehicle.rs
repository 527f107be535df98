//! Vehicles: their properties and their states.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{BodyShape, Check, Choice, ConfigError, Lane, Num, Parameters, Problem, Range, Road, Side};

/// The class of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VehicleClass {
    /// A passenger car.
    Car,
    /// A truck: tractor and trailer.
    Truck,
    /// A motorcycle with its rider.
    Motorcycle,
}

impl VehicleClass {
    /// All classes, in the order of the class scores.
    pub const ALL: [Self; 3] = [Self::Car, Self::Truck, Self::Motorcycle];

    /// Returns the name of the class in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Car => "car",
            Self::Truck => "truck",
            Self::Motorcycle => "motorcycle",
        }
    }

    /// Returns the typical dimensions of this class.
    pub const fn typical_dimensions(self) -> Dimensions {
        match self {
            Self::Car => Dimensions { length_m: 4.6, width_m: 1.85, height_m: 1.5 },
            Self::Truck => Dimensions { length_m: 16.5, width_m: 2.55, height_m: 4.0 },
            Self::Motorcycle => Dimensions { length_m: 2.2, width_m: 0.8, height_m: 1.6 },
        }
    }

    /// Returns the typical mass of this class, laden (kg).
    const fn typical_mass_kg(self) -> f64 {
        match self {
            Self::Car => 1_600.0,
            Self::Truck => 30_000.0,
            Self::Motorcycle => 300.0,
        }
    }
}

/// The size of a vehicle's box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dimensions {
    /// Length along the longitudinal axis (m).
    pub length_m: f64,
    /// Width along the lateral axis (m).
    pub width_m: f64,
    /// Height above the ground (m).
    pub height_m: f64,
}

/// Wheelbase as a fraction of a vehicle's length: an assumption; 0.5 to 0.65 are plausible.
const WHEELBASE_SHARE: f64 = 0.6;

impl Dimensions {
    /// Lengths of a vehicle of a scenario (m).
    pub const LENGTH_M: Range = Range::closed(1.0, 26.0);
    /// Widths of a vehicle of a scenario (m).
    pub const WIDTH_M: Range = Range::closed(0.4, 3.0);
    /// Heights of a vehicle of a scenario (m).
    pub const HEIGHT_M: Range = Range::closed(0.8, 4.5);

    /// Returns the distance from the rear axle to the front axle (m). The centre of the box lies
    /// half of it ahead of the rear axle.
    pub fn wheelbase_m(&self) -> f64 {
        WHEELBASE_SHARE * self.length_m
    }
}

/// The properties of a vehicle, beside its shape, that the sensors perceive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Appearance {
    /// Diffuse reflectivity of the paint at the wavelength of the LiDAR, 0 to 1.
    pub paint_reflectivity: f64,
    /// Colour of the paint, sRGB.
    pub paint_rgb: [u8; 3],
    /// Body shape.
    pub body_shape: BodyShape,
    /// State of the front registration plate.
    pub plate: Plate,
}

/// The state of the front registration plate of a vehicle: its retro-reflection carries the
/// detection of dark cars.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Plate {
    /// As on vehicles in use.
    #[default]
    Clean,
    /// Covered with road dirt, or shaded by the bumper.
    Dirty,
    /// Not mounted at the front.
    None,
}

/// A vehicle as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct VehicleConfig {
    /// Car, truck or motorcycle.
    pub class: Choice<VehicleClass>,
    /// Length (m); usual for `body-shape` or typical of the class if absent.
    pub length_m: Option<Num>,
    /// Width (m); usual for `body-shape` or typical of the class if absent.
    pub width_m: Option<Num>,
    /// Height (m); usual for `body-shape` or typical of the class if absent.
    pub height_m: Option<Num>,
    /// Mass (kg); typical of the class if absent.
    pub mass_kg: Option<Num>,
    /// Diffuse reflectivity of the paint at the wavelength of the LiDAR; 0.5 if absent.
    pub paint_reflectivity: Option<Num>,
    /// Colour of the paint, sRGB; grey if absent.
    pub paint_rgb: Option<[u8; 3]>,
    /// Body shape, which must belong to the class. If it is given, length, width and height are
    /// those that are usual for it, unless they are given, too; `saloon`, `tarpaulin-trailer` or
    /// `naked-bike` if absent.
    pub body_shape: Option<Choice<BodyShape>>,
    /// State of the front registration plate: `clean`, `dirty` or `none`; `clean` if absent. The
    /// worse of this state and of the one that `sensors.rear-lidar.plates` gives to all vehicles
    /// counts.
    pub plate: Option<Choice<Plate>>,
    /// Fleet of the library from which paint, colour, body shape with its height, and plate are
    /// drawn in each sample, such as `germany`. What else is given here is kept. If absent, nothing
    /// is drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fleet: Option<String>,
    /// Deceleration at which the brake light switches on (m/s²), 0.7 to 1.3; 0.7 if absent.
    pub brake_light_from_mps2: Option<Num>,
}

/// A checked vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// Class of the vehicle.
    pub class: VehicleClass,
    /// Size of the box.
    pub dimensions: Dimensions,
    /// Mass (kg).
    pub mass_kg: f64,
    /// Appearance to the sensors.
    pub appearance: Appearance,
    /// Deceleration at which the brake light switches on (m/s²).
    pub brake_light_from_mps2: f64,
}

/// Range of the deceleration (m/s²) at which the brake light of a vehicle that slows down without
/// its friction brakes switches on: it may from the first value on, and must from the second on (UN
/// R13-H, 5.2.22.4).
const BRAKE_LIGHT_MPS2: [f64; 2] = [0.7, 1.3];

impl Vehicle {
    /// Masses of a vehicle of a scenario (kg).
    pub const MASS_KG: Range = Range::closed(100.0, 60_000.0);

    /// Creates a vehicle with the typical properties of its class.
    pub const fn typical(class: VehicleClass) -> Self {
        Self {
            class,
            dimensions: class.typical_dimensions(),
            mass_kg: class.typical_mass_kg(),
            appearance: Appearance {
                paint_reflectivity: 0.5,
                paint_rgb: [128, 128, 132],
                body_shape: BodyShape::of_class(class)[0],
                plate: Plate::Clean,
            },
            brake_light_from_mps2: BRAKE_LIGHT_MPS2[0],
        }
    }
}

impl VehicleConfig {
    /// Returns the configuration of a vehicle that is typical of its class.
    pub fn typical(class: VehicleClass) -> Self {
        Self {
            class: Choice::Fixed(class),
            length_m: None,
            width_m: None,
            height_m: None,
            mass_kg: None,
            paint_reflectivity: None,
            paint_rgb: None,
            body_shape: None,
            plate: None,
            fleet: None,
            brake_light_from_mps2: None,
        }
    }

    /// Returns the body shape, or `None` if it is not given.
    fn check_body_shape(&self, class: VehicleClass, parameters: &Parameters) -> Result<Option<BodyShape>, ConfigError> {
        const KEY: &str = "body-shape";
        let Some(choice) = &self.body_shape else { return Ok(None) };
        let shape = parameters.word(choice, KEY)?;
        if shape.class() == class {
            return Ok(Some(shape));
        }
        let allowed: Vec<String> = BodyShape::of_class(class).iter().map(|shape| format!("`{shape}`")).collect();
        let rule = format!("a {} has one of the shapes {}, not `{shape}`", class.name(), allowed.join(", "));
        Err(ConfigError::new(KEY, Problem::Contradiction { other: "class", rule }))
    }
}

impl Check for VehicleConfig {
    type Checked = Vehicle;

    fn check(&self, parameters: &Parameters) -> Result<Vehicle, ConfigError> {
        let typical = Vehicle::typical(parameters.word(&self.class, "class")?);
        let or_typical =
            |num: &Option<Num>, key, range, typical| parameters.number_or(num.as_ref(), key, range, typical);
        let look = typical.appearance;
        let body_shape = self.check_body_shape(typical.class, parameters)?;
        let size = body_shape.map_or(typical.dimensions, BodyShape::usual_dimensions);
        Ok(Vehicle {
            class: typical.class,
            dimensions: Dimensions {
                length_m: or_typical(&self.length_m, "length-m", Dimensions::LENGTH_M, size.length_m)?,
                width_m: or_typical(&self.width_m, "width-m", Dimensions::WIDTH_M, size.width_m)?,
                height_m: or_typical(&self.height_m, "height-m", Dimensions::HEIGHT_M, size.height_m)?,
            },
            mass_kg: or_typical(&self.mass_kg, "mass-kg", Vehicle::MASS_KG, typical.mass_kg)?,
            appearance: Appearance {
                paint_reflectivity: or_typical(
                    &self.paint_reflectivity,
                    "paint-reflectivity",
                    Range::above(0.0, 1.0),
                    look.paint_reflectivity,
                )?,
                paint_rgb: self.paint_rgb.unwrap_or(look.paint_rgb),
                body_shape: body_shape.unwrap_or(look.body_shape),
                plate: match &self.plate {
                    Some(plate) => parameters.word(plate, "plate")?,
                    None => look.plate,
                },
            },
            brake_light_from_mps2: or_typical(
                &self.brake_light_from_mps2,
                "brake-light-from-mps2",
                Range::closed(BRAKE_LIGHT_MPS2[0], BRAKE_LIGHT_MPS2[1]),
                typical.brake_light_from_mps2,
            )?,
        })
    }
}

/// The state of the direction indicator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Indicator {
    /// Not blinking.
    #[default]
    Off,
    /// Blinking to the left.
    Left,
    /// Blinking to the right.
    Right,
}

impl Indicator {
    /// Returns the indicator of a lane change to `side`.
    #[must_use]
    pub const fn towards(side: Side) -> Self {
        match side {
            Side::Left => Self::Left,
            Side::Right => Self::Right,
        }
    }

    /// Returns the same indicator in a mirror image: left and right are exchanged.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            Self::Off => Self::Off,
        }
    }
}

/// The position and motion of a vehicle in the road frame. The reference point is the centre of its
/// box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VehicleState {
    /// Position along the road (m).
    pub s_m: f64,
    /// Lateral position, positive to the left (m).
    pub d_m: f64,
    /// Heading relative to the road, positive to the left (rad).
    pub heading_rad: f64,
    /// Speed along the heading, 0 or more (m/s).
    pub speed_mps: f64,
    /// Acceleration along the heading (m/s²).
    pub acceleration_mps2: f64,
    /// Yaw rate, positive to the left (rad/s).
    pub yaw_rate_radps: f64,
    /// Whether the brake light is on.
    pub brake_light: bool,
    /// State of the direction indicator.
    pub indicator: Indicator,
}

impl Road {
    /// Returns the lane in which a vehicle is; beyond an edge, the lane at that edge.
    #[inline]
    pub fn lane_of(&self, vehicle: &VehicleState) -> Lane {
        self.lane_at(vehicle.s_m, vehicle.d_m)
    }
}

#[cfg(test)]
mod tests {
    use serde::de::IntoDeserializer;
    use serde::de::value::{self, StrDeserializer};

    use super::*;

    fn car(body_shape: Option<BodyShape>) -> VehicleConfig {
        VehicleConfig { body_shape: body_shape.map(Choice::Fixed), ..VehicleConfig::typical(VehicleClass::Car) }
    }

    #[test]
    fn a_body_shape_brings_its_usual_dimensions_and_has_a_default() {
        let none = Parameters::default();
        let van = car(Some(BodyShape::Van)).check(&none).unwrap();
        assert_eq!((van.appearance.body_shape, van.dimensions.height_m), (BodyShape::Van, 2.2));
        let usual = car(None).check(&none).unwrap();
        assert_eq!(usual, Vehicle::typical(VehicleClass::Car));
        assert_eq!(usual.appearance.body_shape, BodyShape::Saloon);
    }

    #[test]
    fn a_body_shape_of_another_class_and_an_unknown_word_are_refused_with_what_is_allowed() {
        let error = car(Some(BodyShape::Coach)).check(&Parameters::default()).unwrap_err().to_string();
        assert_eq!(
            error,
            "`body-shape` contradicts `class`: a car has one of the shapes `saloon`, `hatchback`, `estate`, `coupe`, \
             `suv`, `van`, `city-car`, `minivan`, `pickup`, not `coach`"
        );
        let word: StrDeserializer<'_, value::Error> = "limousine".into_deserializer();
        let error = Choice::<BodyShape>::deserialize(word).unwrap_err().to_string();
        assert!(error.contains("limousine") && error.contains("`saloon`, `hatchback`"), "{error}");
    }
}
