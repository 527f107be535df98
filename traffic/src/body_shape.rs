//! Body shapes of vehicles, as the LiDAR and the camera model them.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Dimensions, VehicleClass};

/// The body shape of a vehicle. Each shape belongs to one class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BodyShape {
    /// Car: a boot behind the rear window.
    Saloon,
    /// Car: a short car with a tailgate.
    Hatchback,
    /// Car: the roof extends to the rear end.
    Estate,
    /// Car: low, with a long bonnet.
    Coupe,
    /// Car: a sport utility vehicle.
    Suv,
    /// Car: a panel van.
    Van,
    /// Car: a small city car.
    CityCar,
    /// Car: a people carrier.
    Minivan,
    /// Car: an open bed behind the cab.
    Pickup,
    /// Truck: a tractor with a semi-trailer under a tarpaulin.
    TarpaulinTrailer,
    /// Truck: a tractor with a box semi-trailer.
    BoxTrailer,
    /// Truck: a tractor with a tank semi-trailer.
    Tanker,
    /// Truck: a tractor with a bonnet ahead of its cab, and a box semi-trailer.
    BonnetedTractor,
    /// Truck: a load on an open platform.
    PlatformTruck,
    /// Truck: a coach.
    Coach,
    /// Truck: a rigid truck with a box.
    BoxTruck,
    /// Motorcycle: without a fairing.
    NakedBike,
    /// Motorcycle: a fairing, and a rider who leans far forward.
    SportBike,
    /// Motorcycle: a shield and side cases.
    Tourer,
    /// Motorcycle: a scooter.
    Scooter,
    /// Motorcycle: a high handlebar, and a rider who leans back.
    Chopper,
    /// Motorcycle: for roads and trails, with an upright rider.
    TrailBike,
}

impl BodyShape {
    /// The shapes of cars.
    const CARS: [Self; 9] = [
        Self::Saloon,
        Self::Hatchback,
        Self::Estate,
        Self::Coupe,
        Self::Suv,
        Self::Van,
        Self::CityCar,
        Self::Minivan,
        Self::Pickup,
    ];
    /// The shapes of trucks.
    const TRUCKS: [Self; 7] = [
        Self::TarpaulinTrailer,
        Self::BoxTrailer,
        Self::Tanker,
        Self::BonnetedTractor,
        Self::PlatformTruck,
        Self::Coach,
        Self::BoxTruck,
    ];
    /// The shapes of motorcycles.
    const MOTORCYCLES: [Self; 6] =
        [Self::NakedBike, Self::SportBike, Self::Tourer, Self::Scooter, Self::Chopper, Self::TrailBike];

    /// Returns all shapes of a class. The first one is the default.
    pub const fn of_class(class: VehicleClass) -> &'static [Self] {
        match class {
            VehicleClass::Car => &Self::CARS,
            VehicleClass::Truck => &Self::TRUCKS,
            VehicleClass::Motorcycle => &Self::MOTORCYCLES,
        }
    }

    /// Returns the class that the shape belongs to.
    pub const fn class(self) -> VehicleClass {
        match self {
            Self::Saloon
            | Self::Hatchback
            | Self::Estate
            | Self::Coupe
            | Self::Suv
            | Self::Van
            | Self::CityCar
            | Self::Minivan
            | Self::Pickup => VehicleClass::Car,
            Self::TarpaulinTrailer
            | Self::BoxTrailer
            | Self::Tanker
            | Self::BonnetedTractor
            | Self::PlatformTruck
            | Self::Coach
            | Self::BoxTruck => VehicleClass::Truck,
            Self::NakedBike | Self::SportBike | Self::Tourer | Self::Scooter | Self::Chopper | Self::TrailBike => {
                VehicleClass::Motorcycle
            }
        }
    }

    /// Returns the name of the shape in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Saloon => "saloon",
            Self::Hatchback => "hatchback",
            Self::Estate => "estate",
            Self::Coupe => "coupe",
            Self::Suv => "suv",
            Self::Van => "van",
            Self::CityCar => "city-car",
            Self::Minivan => "minivan",
            Self::Pickup => "pickup",
            Self::TarpaulinTrailer => "tarpaulin-trailer",
            Self::BoxTrailer => "box-trailer",
            Self::Tanker => "tanker",
            Self::BonnetedTractor => "bonneted-tractor",
            Self::PlatformTruck => "platform-truck",
            Self::Coach => "coach",
            Self::BoxTruck => "box-truck",
            Self::NakedBike => "naked-bike",
            Self::SportBike => "sport-bike",
            Self::Tourer => "tourer",
            Self::Scooter => "scooter",
            Self::Chopper => "chopper",
            Self::TrailBike => "trail-bike",
        }
    }

    /// Returns the usual dimensions of vehicles of this shape.
    pub const fn usual_dimensions(self) -> Dimensions {
        let [length_m, width_m, height_m] = match self {
            Self::Saloon => [4.75, 1.84, 1.45],
            Self::Hatchback => [4.3, 1.8, 1.48],
            Self::Estate => [4.85, 1.86, 1.5],
            Self::Coupe => [4.5, 1.88, 1.33],
            Self::Suv => [4.7, 1.92, 1.72],
            Self::Van => [5.3, 2.0, 2.2],
            Self::CityCar => [3.6, 1.65, 1.5],
            Self::Minivan => [4.6, 1.84, 1.68],
            Self::Pickup => [5.3, 1.93, 1.8],
            Self::TarpaulinTrailer | Self::BoxTrailer => [16.5, 2.55, 4.0],
            Self::Tanker => [15.0, 2.55, 3.7],
            Self::BonnetedTractor => [18.0, 2.6, 4.1],
            Self::PlatformTruck => [12.0, 2.5, 3.2],
            Self::Coach => [12.5, 2.55, 3.6],
            Self::BoxTruck => [8.5, 2.4, 3.4],
            Self::NakedBike => [2.1, 0.80, 1.65],
            Self::SportBike => [2.05, 0.72, 1.5],
            Self::Tourer => [2.25, 0.95, 1.72],
            Self::Scooter => [1.9, 0.75, 1.62],
            Self::Chopper => [2.4, 0.90, 1.55],
            Self::TrailBike => [2.2, 0.85, 1.75],
        };
        Dimensions { length_m, width_m, height_m }
    }
}

impl fmt::Display for BodyShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use serde::de::IntoDeserializer;
    use serde::de::value::{self, StrDeserializer};

    use super::*;

    #[test]
    fn every_shape_belongs_to_the_class_that_lists_it_and_has_the_name_in_files() {
        for class in VehicleClass::ALL {
            for shape in BodyShape::of_class(class) {
                assert_eq!(shape.class(), class);
                let text: StrDeserializer<'_, value::Error> = shape.name().into_deserializer();
                assert_eq!(BodyShape::deserialize(text).as_ref(), Ok(shape));
            }
        }
    }
}
