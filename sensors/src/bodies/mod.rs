//! Body shapes: the proportions from which the LiDAR and the camera both build the bodies of vehicles.
//!
//! ```text
//!                  ┌─▶ lidar/shapes   convex solids with materials ─▶ points
//!  BodyShape ─▶ Proportions
//!                  └─▶ camera/shapes  meshes with colours and lamps ─▶ images
//! ```
//!
//! Proportions are scaled to the vehicle's own length, width and height. They are typical values read off drawings, not
//! those of a specific model.

mod car;
mod motorcycle;
#[cfg(test)]
mod tests;
mod truck;

use closecall_traffic::BodyShape;

pub(crate) use car::{CarProportions, GREENHOUSE_FOOT_HALF_WIDTH};
pub(crate) use motorcycle::{HEAD_BACK_M, HIP_X_M, Lamps, MotorcycleProportions, RIDER, WHEEL_RADIUS_M};
pub(crate) use truck::{
    CAB_M, CRATE, DECK, LOAD_FLOOR_M, LOAD_GAP_M, Load, SCREEN_RAKE_M, Slab, TANK_FLOOR_M, TruckProportions, VISOR,
};

/// The proportions of a body shape.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Proportions {
    Car(&'static CarProportions),
    Truck(&'static TruckProportions),
    Motorcycle(&'static MotorcycleProportions),
}

impl Proportions {
    /// Returns the proportions of a body shape.
    pub(crate) const fn of(shape: BodyShape) -> Self {
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

/// Half of the width and half of the height of a part of the front, as shares of the vehicle's width and height.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfExtent {
    pub(crate) width: f32,
    pub(crate) height: f32,
}
