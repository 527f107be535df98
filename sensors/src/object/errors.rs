//! The size and the duration of the rear object-level sensor's errors, and its lost measurements,
//! by class, paint and extinction of the air.
//!
//! ```text
//!   error = slow (deviation, correlation time) + white (deviation), along and across the road
//!
//!   ego ▕ every scan measures the vehicle ▏ some scans do not ▏ none does
//!       0   white, slow              far-white, far-slow    range
//!                        all-scans-share · range
//! ```
//!
//! Dark paint and fog leave fewer returns of a vehicle, and its box in the full chain has a larger
//! error. The LiDAR's mirror scans with another side each time, and one side loses a distant
//! vehicle before the other side does. Losses therefore alternate: of each two scans, the even scan
//! is lost only if more than half of all scans are lost. A vehicle without a confirmed track is
//! measured in every scan: the range is the distance at which the full chain confirms it, and so
//! includes the cost of earlier losses.
//!
//! Grids over paint and extinction hold the figures. They are interpolated between the points of
//! the grid as the ranges are. They hold for all plates and body shapes of a class.

use closecall_traffic::{Appearance, CONTROL_STEP, Environment, VehicleClass, maths};
use serde::{Deserialize, Serialize};

use super::config::ObjectSensorModel;
use super::fit::{Origin, check_grid, check_knots, interpolated};
use crate::lidar::extinction_per_m;

/// Ranges of a deviation (m), and of a correlation time (s).
const SD_RANGE_M: [f64; 2] = [0.001, 10.0];
const TIME_RANGE_S: [f64; 2] = [0.04, 100.0];

/// The errors of one vehicle's measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedErrors {
    /// Standard deviations of the white errors along and across the road (m), of a vehicle that
    /// every scan measures.
    pub white_sd_m: [f64; 2],
    /// The same beyond, where some scans lose the vehicle.
    pub far_white_sd_m: [f64; 2],
    /// Standard deviations of the slow errors along and across the road (m), of a vehicle that
    /// every scan measures.
    pub slow_sd_m: [f64; 2],
    /// The same beyond.
    pub far_slow_sd_m: [f64; 2],
    /// Correlation times of the slow errors along and across the road (s).
    pub slow_time_s: [f64; 2],
    /// Share of the vehicle's range up to which every scan measures it (-).
    pub all_scans_share: f64,
    /// Share of the scans beyond that do not measure it (-).
    pub lost_share: f64,
}

/// The errors of all vehicles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ErrorGrids {
    /// Where the errors come from.
    pub origin: Origin,
    /// Reflectivities of the paint of the grids (-), in rising order.
    pub paints: Vec<f64>,
    /// Extinctions of the grids (1/m), in rising order.
    pub extinctions_per_m: Vec<f64>,
    /// The errors of cars.
    pub car: ErrorGrid,
    /// The errors of trucks.
    pub truck: ErrorGrid,
    /// The errors of motorcycles.
    pub motorcycle: ErrorGrid,
}

/// The errors of one class: each has a row for each paint, and in it a number for each extinction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ErrorGrid {
    /// Standard deviation of the white error along the road (m).
    pub white_along_m: Vec<Vec<f64>>,
    /// Standard deviation of the white error across the road (m).
    pub white_across_m: Vec<Vec<f64>>,
    /// Standard deviation of the white error along the road where some scans lose the vehicle (m).
    pub far_white_along_m: Vec<Vec<f64>>,
    /// Standard deviation of the white error across the road where some scans lose the vehicle (m).
    pub far_white_across_m: Vec<Vec<f64>>,
    /// Standard deviation of the slow error along the road (m).
    pub slow_along_m: Vec<Vec<f64>>,
    /// Standard deviation of the slow error across the road (m).
    pub slow_across_m: Vec<Vec<f64>>,
    /// Standard deviation of the slow error along the road where some scans lose the vehicle (m).
    pub far_slow_along_m: Vec<Vec<f64>>,
    /// Standard deviation of the slow error across the road where some scans lose the vehicle (m).
    pub far_slow_across_m: Vec<Vec<f64>>,
    /// Correlation time of the slow error along the road (s).
    pub slow_along_time_s: Vec<Vec<f64>>,
    /// Correlation time of the slow error across the road (s).
    pub slow_across_time_s: Vec<Vec<f64>>,
    /// Share of the vehicle's range up to which every scan measures it (-).
    pub all_scans_share: Vec<Vec<f64>>,
    /// Share of the scans beyond that do not measure it (-).
    pub lost_share: Vec<Vec<f64>>,
}

/// Key of a grid, its values, and their range.
pub type NamedGrid<'a> = (&'static str, &'a [Vec<f64>], [f64; 2]);

impl ErrorGrid {
    /// Returns the grids of points in rows of equal paint.
    pub fn of(rows: &[Vec<FittedErrors>]) -> Self {
        let grid =
            |value: &dyn Fn(&FittedErrors) -> f64| rows.iter().map(|row| row.iter().map(value).collect()).collect();
        Self {
            white_along_m: grid(&|errors| errors.white_sd_m[0]),
            white_across_m: grid(&|errors| errors.white_sd_m[1]),
            far_white_along_m: grid(&|errors| errors.far_white_sd_m[0]),
            far_white_across_m: grid(&|errors| errors.far_white_sd_m[1]),
            slow_along_m: grid(&|errors| errors.slow_sd_m[0]),
            slow_across_m: grid(&|errors| errors.slow_sd_m[1]),
            far_slow_along_m: grid(&|errors| errors.far_slow_sd_m[0]),
            far_slow_across_m: grid(&|errors| errors.far_slow_sd_m[1]),
            slow_along_time_s: grid(&|errors| errors.slow_time_s[0]),
            slow_across_time_s: grid(&|errors| errors.slow_time_s[1]),
            all_scans_share: grid(&|errors| errors.all_scans_share),
            lost_share: grid(&|errors| errors.lost_share),
        }
    }

    /// Returns the grids with their keys and the ranges of their values, in the order of the file.
    pub fn named(&self) -> [NamedGrid<'_>; 12] {
        [
            ("white-along-m", &self.white_along_m, SD_RANGE_M),
            ("white-across-m", &self.white_across_m, SD_RANGE_M),
            ("far-white-along-m", &self.far_white_along_m, SD_RANGE_M),
            ("far-white-across-m", &self.far_white_across_m, SD_RANGE_M),
            ("slow-along-m", &self.slow_along_m, SD_RANGE_M),
            ("slow-across-m", &self.slow_across_m, SD_RANGE_M),
            ("far-slow-along-m", &self.far_slow_along_m, SD_RANGE_M),
            ("far-slow-across-m", &self.far_slow_across_m, SD_RANGE_M),
            ("slow-along-time-s", &self.slow_along_time_s, TIME_RANGE_S),
            ("slow-across-time-s", &self.slow_across_time_s, TIME_RANGE_S),
            ("all-scans-share", &self.all_scans_share, [0.0, 1.0]),
            ("lost-share", &self.lost_share, [0.0, 1.0]),
        ]
    }
}

impl ErrorGrids {
    fn of(&self, class: VehicleClass) -> &ErrorGrid {
        match class {
            VehicleClass::Car => &self.car,
            VehicleClass::Truck => &self.truck,
            VehicleClass::Motorcycle => &self.motorcycle,
        }
    }

    /// Returns the errors of a vehicle in this weather.
    pub fn at(&self, class: VehicleClass, appearance: &Appearance, environment: &Environment) -> FittedErrors {
        let at = [appearance.paint_reflectivity, extinction_per_m(environment)];
        let knots = [&*self.paints, &*self.extinctions_per_m];
        let values = self.of(class).named().map(|(_, grid, _)| interpolated(knots, grid, at));
        let [
            white_along_m,
            white_across_m,
            far_white_along_m,
            far_white_across_m,
            slow_along_m,
            slow_across_m,
            far_slow_along_m,
            far_slow_across_m,
            along_s,
            across_s,
            all_scans_share,
            lost_share,
        ] = values;
        FittedErrors {
            white_sd_m: [white_along_m, white_across_m],
            far_white_sd_m: [far_white_along_m, far_white_across_m],
            slow_sd_m: [slow_along_m, slow_across_m],
            far_slow_sd_m: [far_slow_along_m, far_slow_across_m],
            slow_time_s: [along_s, across_s],
            all_scans_share,
            lost_share,
        }
    }

    /// Checks the grids and their values.
    ///
    /// # Errors
    /// The key, and what is allowed.
    pub(super) fn check(&self) -> Result<(), String> {
        let knots = [&*self.paints, &*self.extinctions_per_m];
        check_knots("errors.", knots)?;
        for class in VehicleClass::ALL {
            for (name, grid, range) in self.of(class).named() {
                check_grid(&format!("errors.{}.{name}", class.name()), grid, knots, range)?;
            }
        }
        Ok(())
    }
}

/// Which errors the scenario gives for all vehicles, in place of the errors of the fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Given {
    /// The white errors along and across the road.
    pub(super) white: [bool; 2],
    /// The deviation of the slow errors, and their correlation time.
    pub(super) slow: bool,
    pub(super) slow_time: bool,
    /// The share of lost measurements.
    pub(super) dropout: bool,
}

/// A figure of a near vehicle, and of a far one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NearFar<T> {
    pub(super) near: T,
    pub(super) far: T,
}

impl<T: Copy> NearFar<T> {
    /// Returns one figure for all vehicles.
    pub(super) fn same(figure: T) -> Self {
        Self { near: figure, far: figure }
    }

    /// Returns the figure of a vehicle that is far or not.
    pub(super) fn of(&self, is_far: bool) -> T {
        if is_far { self.far } else { self.near }
    }
}

/// Which measurements of a vehicle in range are lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Losses {
    /// Each with the same probability (-).
    Even(f64),
    /// This share of the far scans (-).
    Far(f64),
}

/// The errors of one vehicle in the weather of the latest scan, as the noise and the filter take
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TargetErrors {
    /// Standard deviations of the white errors along and across the road (m), of a near vehicle and
    /// of a far one.
    pub(super) white_sd_m: NearFar<[f64; 2]>,
    /// Distance beyond which a vehicle is far (m).
    pub(super) far_m: f64,
    /// Standard deviations of the slow errors along and across the road (m).
    pub(super) slow_sd_m: NearFar<[f64; 2]>,
    /// Shares of the slow errors that remain after one scan (-).
    pub(super) slow_decay: [f64; 2],
    pub(super) losses: Losses,
}

/// Returns the share of a slow error with this correlation time (s) that remains after one scan
/// (-).
pub(super) fn decay(time_s: f64) -> f64 {
    maths::exp(-CONTROL_STEP.s() / time_s)
}

impl TargetErrors {
    /// Returns the errors of a vehicle with the range `range_m` (m): the errors of the fit, except
    /// where the scenario gives them.
    pub(super) fn new(model: &ObjectSensorModel, fitted: Option<&FittedErrors>, range_m: f64) -> Self {
        let stated = Self {
            white_sd_m: NearFar::same(model.white_sd_m),
            far_m: f64::INFINITY,
            slow_sd_m: NearFar::same([model.drift_sd_m; 2]),
            slow_decay: [model.drift_decay; 2],
            losses: Losses::Even(model.dropout),
        };
        let Some(fitted) = fitted else { return stated };
        let Given { white, slow, slow_time, dropout } = model.given;
        let white =
            |fitted_m: [f64; 2]| [0, 1].map(|axis| if white[axis] { model.white_sd_m[axis] } else { fitted_m[axis] });
        Self {
            white_sd_m: NearFar { near: white(fitted.white_sd_m), far: white(fitted.far_white_sd_m) },
            far_m: fitted.all_scans_share * range_m,
            slow_sd_m: match slow {
                true => stated.slow_sd_m,
                false => NearFar { near: fitted.slow_sd_m, far: fitted.far_slow_sd_m },
            },
            slow_decay: if slow_time { stated.slow_decay } else { fitted.slow_time_s.map(decay) },
            losses: if dropout { stated.losses } else { Losses::Far(fitted.lost_share) },
        }
    }
}

impl Losses {
    /// Returns the probability that the scan of this step loses a vehicle. `may_lose_far` tells
    /// whether it is far and has a confirmed track.
    pub(super) fn probability(&self, step: usize, may_lose_far: bool) -> f64 {
        match *self {
            Self::Even(share) => share,
            Self::Far(share) if may_lose_far => {
                // The odd scans are lost first.
                (2.0 * share - if step.is_multiple_of(2) { 1.0 } else { 0.0 }).clamp(0.0, 1.0)
            }
            Self::Far(_) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Parameters, Vehicle};

    use super::super::config::ObjectSensorConfig;
    use super::super::fit::RearFit;
    use super::*;

    const POINT: FittedErrors = FittedErrors {
        white_sd_m: [0.01, 0.02],
        far_white_sd_m: [0.05, 0.06],
        slow_sd_m: [0.03, 0.04],
        far_slow_sd_m: [0.07, 0.08],
        slow_time_s: [5.0, 0.5],
        all_scans_share: 0.8,
        lost_share: 0.5,
    };

    /// Grids of two paints and extinctions, with dark cars that err three times as much across.
    fn grids() -> ErrorGrids {
        let even = ErrorGrid::of(&vec![vec![POINT; 2]; 2]);
        ErrorGrids {
            origin: RearFit::shipped().unwrap().origin.clone(),
            paints: vec![0.1, 0.4],
            extinctions_per_m: vec![0.001, 0.04],
            car: ErrorGrid { slow_across_m: vec![vec![0.12, 0.12], vec![0.04, 0.04]], ..even.clone() },
            truck: even.clone(),
            motorcycle: ErrorGrid { white_along_m: vec![vec![0.05; 2]; 2], ..even },
        }
    }

    #[test]
    fn errors_depend_on_class_and_paint_and_are_interpolated_between_the_points() {
        let grids = grids();
        assert_eq!(grids.check(), Ok(()));
        let errors_at = |class, paint_reflectivity| {
            let appearance = Appearance { paint_reflectivity, ..Vehicle::typical(class).appearance };
            grids.at(class, &appearance, &Environment::CLEAR_DAY)
        };
        assert_eq!(errors_at(VehicleClass::Truck, 0.1), POINT);
        assert_eq!(errors_at(VehicleClass::Car, 0.8), POINT);
        assert_eq!(errors_at(VehicleClass::Car, 0.05), FittedErrors { slow_sd_m: [0.03, 0.12], ..POINT });
        assert_eq!(errors_at(VehicleClass::Motorcycle, 0.4), FittedErrors { white_sd_m: [0.05, 0.02], ..POINT });
        // Halfway between the logarithms of the paints.
        assert!((errors_at(VehicleClass::Car, 0.2).slow_sd_m[1] - 0.08).abs() < 1e-12);
    }

    #[test]
    fn grids_that_lack_a_number_or_have_a_wrong_one_are_refused() {
        let refused = |change: fn(&mut ErrorGrids)| {
            let mut wrong = grids();
            change(&mut wrong);
            wrong.check().unwrap_err()
        };
        for (message, key) in [
            (refused(|model| model.truck.slow_along_m[1].truncate(1)), "errors.truck.slow-along-m"),
            (refused(|model| model.car.white_across_m[0][0] = 0.0), "errors.car.white-across-m"),
            (refused(|model| model.car.slow_across_time_s[0][1] = f64::NAN), "errors.car.slow-across-time-s"),
            (refused(|model| model.motorcycle.lost_share[0][0] = 1.5), "errors.motorcycle.lost-share"),
            (refused(|model| model.paints.reverse()), "errors.paints"),
        ] {
            assert!(message.contains(key), "{message}");
        }
    }

    #[test]
    fn an_error_in_the_scenario_replaces_that_error_alone() {
        let model = |text: &str| {
            let config: ObjectSensorConfig = toml::from_str(text).unwrap();
            config.check_rear_object(&Parameters::default()).unwrap()
        };
        let errors_with = |text| TargetErrors::new(&model(text), Some(&POINT), 100.0);
        let fitted = errors_with("");
        let of_both = |near, far| NearFar { near, far };
        assert_eq!(fitted.white_sd_m, of_both([0.01, 0.02], [0.05, 0.06]));
        assert_eq!(fitted.slow_sd_m, of_both([0.03, 0.04], [0.07, 0.08]));
        assert_eq!((fitted.far_m, fitted.losses), (80.0, Losses::Far(0.5)));
        assert_eq!(
            errors_with("range-sd-m = 0.3"),
            TargetErrors { white_sd_m: of_both([0.3, 0.02], [0.3, 0.06]), ..fitted }
        );
        assert_eq!(
            errors_with("lateral-sd-m = 0.3"),
            TargetErrors { white_sd_m: of_both([0.01, 0.3], [0.05, 0.3]), ..fitted }
        );
        assert_eq!(errors_with("drift-sd-m = 0.0"), TargetErrors { slow_sd_m: NearFar::same([0.0; 2]), ..fitted });
        assert_eq!(errors_with("drift-time-s = 2.0"), TargetErrors { slow_decay: [decay(2.0); 2], ..fitted });
        assert_eq!(errors_with("dropout = 0.3"), TargetErrors { losses: Losses::Even(0.3), ..fitted });
    }

    #[test]
    fn beyond_its_distance_one_of_two_scans_is_lost_first() {
        let losses = |share: f64, is_far| [0, 1].map(|step| Losses::Far(share).probability(step, is_far));
        assert_eq!((losses(0.5, true), losses(0.25, true), losses(0.75, true)), ([0.0, 1.0], [0.0, 0.5], [0.5, 1.0]));
        assert_eq!(losses(0.5, false), [0.0; 2]);
        assert_eq!([0, 1].map(|step| Losses::Even(0.2).probability(step, false)), [0.2; 2]);
    }
}
