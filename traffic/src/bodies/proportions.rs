//! The proportions of each body shape.

use super::{CarProportions, MotorcycleProportions, TruckProportions, car, motorcycle, truck};
use crate::BodyShape;

/// The proportions of a body shape.
#[derive(Clone, Copy, Debug)]
pub enum Proportions {
    /// The proportions of a car.
    Car(&'static CarProportions),
    /// The proportions of a truck.
    Truck(&'static TruckProportions),
    /// The proportions of a motorcycle.
    Motorcycle(&'static MotorcycleProportions),
}

impl Proportions {
    /// Returns the proportions of a body shape.
    pub const fn of(shape: BodyShape) -> Self {
        match shape {
            BodyShape::Saloon => Self::Car(&car::SALOON),
            BodyShape::Hatchback => Self::Car(&car::HATCHBACK),
            BodyShape::Estate => Self::Car(&car::ESTATE),
            BodyShape::Coupe => Self::Car(&car::COUPE),
            BodyShape::Suv => Self::Car(&car::SUV),
            BodyShape::Van => Self::Car(&car::VAN),
            BodyShape::CityCar => Self::Car(&car::CITY_CAR),
            BodyShape::Minivan => Self::Car(&car::MINIVAN),
            BodyShape::Pickup => Self::Car(&car::PICKUP),
            BodyShape::TarpaulinTrailer => Self::Truck(&truck::TARPAULIN_TRAILER),
            BodyShape::BoxTrailer => Self::Truck(&truck::BOX_TRAILER),
            BodyShape::Tanker => Self::Truck(&truck::TANKER),
            BodyShape::BonnetedTractor => Self::Truck(&truck::BONNETED_TRACTOR),
            BodyShape::PlatformTruck => Self::Truck(&truck::PLATFORM_TRUCK),
            BodyShape::Coach => Self::Truck(&truck::COACH),
            BodyShape::BoxTruck => Self::Truck(&truck::BOX_TRUCK),
            BodyShape::NakedBike => Self::Motorcycle(&motorcycle::NAKED_BIKE),
            BodyShape::SportBike => Self::Motorcycle(&motorcycle::SPORT_BIKE),
            BodyShape::Tourer => Self::Motorcycle(&motorcycle::TOURER),
            BodyShape::Scooter => Self::Motorcycle(&motorcycle::SCOOTER),
            BodyShape::Chopper => Self::Motorcycle(&motorcycle::CHOPPER),
            BodyShape::TrailBike => Self::Motorcycle(&motorcycle::TRAIL_BIKE),
        }
    }
}

/// Half of the width and half of the height of a part of the front, as shares of the vehicle's
/// width and height.
#[derive(Clone, Copy, Debug)]
pub struct HalfExtent {
    /// Half of the width (share of the width).
    pub width: f32,
    /// Half of the height (share of the height).
    pub height: f32,
}
