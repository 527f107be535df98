//! The range of an object-level sensor in the weather of the latest scan.

use closecall_traffic::{Environment, Vehicle, VehicleClass};

use super::config::ObjectSensorModel;
use super::errors::TargetErrors;
use super::fit::{PitchedRanges, TargetRanges};
use super::weather::range_in_weather_m;
use crate::surroundings::OtherVehicle;

/// The ranges of a sensor in the weather of the latest scan.
#[derive(Clone, Debug)]
pub(super) struct Ranges {
    /// The weather that `usual_m` holds for.
    weather: Option<Environment>,
    /// Range of a usual car (m).
    usual_m: f64,
}

impl Ranges {
    /// Creates the ranges before the first scan: the ranges in clear air.
    pub(super) fn new(model: &ObjectSensorModel) -> Self {
        Self { weather: None, usual_m: model.range_m }
    }

    /// Returns the range of a usual car (m).
    pub(super) fn usual_m(&self) -> f64 {
        self.usual_m
    }

    /// Sets the weather, and returns whether it has changed.
    pub(super) fn update(&mut self, model: &ObjectSensorModel, environment: &Environment) -> bool {
        if self.weather == Some(*environment) {
            return false;
        }
        self.weather = Some(*environment);
        self.usual_m = match model.fit {
            Some(fit) => {
                let usual = Vehicle::typical(VehicleClass::Car);
                model.range_m / fit.usual_m() * fit.range_m(usual.class, &usual.appearance, environment)
            }
            None => range_in_weather_m(model.range_m, environment),
        };
        true
    }

    /// Returns the distances at which one vehicle is seen, over the pitch of the ego. `deviation` is
    /// the deviation of the vehicle's ranges, in standard deviations.
    pub(super) fn of(&self, model: &ObjectSensorModel, other: &OtherVehicle, deviation: f64) -> PitchedRanges {
        let pitched = match (model.fit, &self.weather) {
            (Some(fit), Some(weather)) => {
                let relative = model.range_m / fit.usual_m();
                fit.pitched_ranges(other.class, &other.appearance, weather, [relative, deviation])
            }
            _ => PitchedRanges::constant(TargetRanges::without_interruption(self.usual_m, f64::INFINITY)),
        };
        let class_range_m = |ranges: &TargetRanges| model.class_range_m.unwrap_or(ranges.class_range_m);
        pitched.map(|ranges| TargetRanges { class_range_m: class_range_m(&ranges), ..ranges })
    }

    /// Returns the errors of one vehicle whose range is `range_m` (m).
    pub(super) fn errors(&self, model: &ObjectSensorModel, other: &OtherVehicle, range_m: f64) -> TargetErrors {
        let environment = self.weather.unwrap_or(Environment::CLEAR_DAY);
        let fitted = model.fitted_errors(|grids| grids.at(other.class, &other.appearance, &environment));
        TargetErrors::new(model, fitted.as_ref(), range_m)
    }
}
