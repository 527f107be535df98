//! The fit of the rear object-level sensor to the full chain.
//!
//! ```text
//!  scenario ─▶ full chain ─┬▶ distance of the first confirmed track, over class, paint, plate, shape, extinction ─▶ ranges
//!                          ├▶ errors of the tracks of a usual car ─▶ errors of the measurements
//!                          └▶ scores of the true class ─▶ confidence
//! ```
//!
//! Only what is perceived is fitted: no controller runs, and no collision counts. A range is the mean distance of the first
//! confirmed track, plus the distance that the object-level sensor itself needs to confirm a vehicle. The errors of the
//! measurements are those with which the errors of its tracks have the root mean squares of the full chain's; their correlation
//! time is that of the full chain's errors along the road.

use std::collections::BTreeMap;

use closecall_sensors::{ByClass, FittedErrors, Origin, RangeGrid, RearFit, SensorMode, Sensors};
use closecall_simulation::scenario::{Scenario, ScenarioFile, Setting};
use closecall_traffic::{BodyShape, CONTROL_STEP, Environment, Plate, VehicleClass};
use rayon::prelude::*;

use crate::approach::{Address, Watched, first_confirmed_m, watch};
use crate::cases::Case;
use crate::study::StudyError;

/// Reflectivities of the paint of the grid (-).
const PAINTS: [f64; 6] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.8];
/// Visibilities of the grid (m), the first that of a clear day.
const VISIBILITIES_M: [f64; 9] = [10_000.0, 1_000.0, 500.0, 300.0, 200.0, 150.0, 100.0, 70.0, 50.0];
/// Extinction times visibility: Koschmieder's contrast threshold of 2 %.
const KOSCHMIEDER: f64 = 3.912;
/// Paints and visibilities (m) in which body shapes are compared.
const SHAPES_IN: [(f64, f64); 4] = [(0.1, 10_000.0), (0.3, 10_000.0), (0.1, 150.0), (0.3, 150.0)];
/// Gaps between which the errors of tracks are compared (m).
const GAPS_M: [f64; 2] = [20.0, 80.0];
/// Range at which the object-level sensor's own time to confirm is measured (m).
const TEST_RANGE_M: f64 = 100.0;
/// Number of steps in which the errors are adapted; each scales them by the ratio of the root mean squares.
const ITERATIONS: usize = 6;
/// Lag at which the correlation of the errors is taken (control steps): 1 s.
const LAG_STEPS: usize = 25;
/// Bounds of the fitted standard deviations (m), and of the correlation time (s): those of the sensor's configuration.
const SD_BOUNDS_M: [f64; 2] = [0.01, 1.0];
const TIME_BOUNDS_S: [f64; 2] = [0.2, 10.0];

/// What a fit is made of.
#[derive(Clone, Debug)]
pub struct FitPlan<'a> {
    /// The scenario whose sensors are fitted.
    pub file: &'a ScenarioFile,
    /// The seed.
    pub seed: u64,
    /// Number of approaches of each point of the grid.
    pub approaches: u64,
    /// The command that the file names.
    pub command: String,
    /// The version of the program.
    pub version: String,
}

/// A run of the fitter: the sensors of both modes.
struct Fitter<'a> {
    plan: &'a FitPlan<'a>,
    scenario: Scenario,
    /// The LiDAR without the camera, which no detection depends on.
    lidar: Sensors,
}

/// Fits the rear object-level sensor to the full chain. The result does not depend on the number of threads.
///
/// # Errors
/// [`StudyError`] if the scenario cannot be used, or a sensor model fails.
pub fn fit(plan: &FitPlan<'_>) -> Result<RearFit, StudyError> {
    let nominal = plan.file.space().nominal();
    let without_camera = with_settings(plan.file, &["sensors.rear-camera.pipeline=\"off\"".to_owned()])?;
    let lidar = without_camera.concrete(&nominal)?.sensors.with_mode(SensorMode::Full);
    let fitter = Fitter { plan, scenario: plan.file.concrete(&nominal)?, lidar };
    let (range, range_spread) = fitter.ranges()?;
    let FitPlan { seed, approaches, command, version, file } = plan.clone();
    Ok(RearFit {
        origin: Origin { command, version, scenario: file.config().name.clone(), seed, approaches },
        errors: fitter.errors()?,
        class_confidence: fitter.class_confidence()?,
        range_spread,
        paints: PAINTS.to_vec(),
        extinctions_per_m: VISIBILITIES_M.iter().map(|visibility_m| rounded(KOSCHMIEDER / visibility_m, 1e6)).collect(),
        range,
        shapes: fitter.shapes()?,
    })
}

fn with_settings(file: &ScenarioFile, settings: &[String]) -> Result<ScenarioFile, StudyError> {
    let settings: Vec<Setting> = settings.iter().filter_map(|text| text.parse().ok()).collect();
    Ok(ScenarioFile::parse(file.path(), file.text(), &settings)?)
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

impl Fitter<'_> {
    fn case(class: VehicleClass, paint: f64, plate: Plate, visibility_m: f64) -> Case {
        let environment = Environment { visibility_m, ..Environment::CLEAR_DAY };
        Case { class, paint, plate, environment, ..Case::usual() }
    }

    /// Returns the distances of the first confirmed track in all approaches of a case (m).
    fn first_m(&self, case: &Case, sensors: &Sensors) -> Result<Vec<f64>, StudyError> {
        let one = |run| {
            first_confirmed_m(case, sensors, &self.scenario.road, Address { seed: self.plan.seed, run })
                .map_err(|source| StudyError::Sensor { case: case.name.clone(), run, source })
        };
        (0..self.plan.approaches).into_par_iter().map(one).collect()
    }

    /// Returns the distance that the object-level sensor needs to confirm a vehicle (m).
    fn own_delay_m(&self) -> Result<f64, StudyError> {
        let sensors = self.object(&[format!("sensors.rear-object.range-m={TEST_RANGE_M:?}")])?;
        Ok(TEST_RANGE_M - mean(&self.first_m(&Case::usual(), &sensors)?))
    }

    /// Returns the object-level sensors with one range for all vehicles, and these settings.
    fn object(&self, settings: &[String]) -> Result<Sensors, StudyError> {
        let file = with_settings(self.plan.file, settings)?;
        let sensors = file.concrete(&file.space().nominal())?.sensors;
        Ok(sensors.with_mode(SensorMode::Object).without_range_fit())
    }

    /// Returns the ranges of all classes and plates, and the scatter of the logarithm of a car's range.
    fn ranges(&self) -> Result<(Vec<RangeGrid>, f64), StudyError> {
        let delay_m = self.own_delay_m()?;
        let (mut grids, mut squares, mut count) = (Vec::new(), 0.0, 0.0);
        for (class, plate) in [
            (VehicleClass::Car, Plate::Clean),
            (VehicleClass::Car, Plate::Dirty),
            (VehicleClass::Car, Plate::None),
            (VehicleClass::Truck, Plate::Clean),
            (VehicleClass::Motorcycle, Plate::Clean),
        ] {
            let mut range_m = Vec::new();
            for paint in PAINTS {
                let mut row = Vec::new();
                for visibility_m in VISIBILITIES_M {
                    let found_m = self.first_m(&Self::case(class, paint, plate, visibility_m), &self.lidar)?;
                    let centre_m = mean(&found_m);
                    if class == VehicleClass::Car {
                        squares += found_m.iter().map(|it| (it / centre_m).ln().powi(2)).sum::<f64>();
                        count += found_m.len() as f64 - 1.0;
                    }
                    row.push(rounded(centre_m + delay_m, 10.0));
                }
                range_m.push(row);
            }
            grids.push(RangeGrid { class, plate, range_m });
        }
        Ok((grids, rounded((squares / count.max(1.0)).sqrt(), 1e4)))
    }

    /// Returns the range of each body shape relative to the first of its class.
    fn shapes(&self) -> Result<BTreeMap<String, f64>, StudyError> {
        let mut factors = BTreeMap::new();
        for class in VehicleClass::ALL {
            let range_m = |shape: BodyShape| {
                let of = |&(paint, visibility_m): &(f64, f64)| {
                    let case = Case { shape: Some(shape), ..Self::case(class, paint, Plate::Clean, visibility_m) };
                    self.first_m(&case, &self.lidar).map(|found_m| mean(&found_m))
                };
                SHAPES_IN.iter().map(of).collect::<Result<Vec<f64>, StudyError>>()
            };
            let shapes = BodyShape::of_class(class);
            let first_m = range_m(shapes[0])?;
            for shape in &shapes[1..] {
                let ratios: Vec<f64> = range_m(*shape)?.iter().zip(&first_m).map(|(own, of)| own / of).collect();
                factors.insert(shape.name().to_owned(), rounded(mean(&ratios), 1e3));
            }
        }
        Ok(factors)
    }

    /// Returns what the tracks of a case show in all approaches.
    fn watched(&self, case: &Case, sensors: &Sensors) -> Result<Vec<Watched>, StudyError> {
        let one = |run| {
            watch(case, sensors, &self.scenario.road, Address { seed: self.plan.seed, run }, GAPS_M)
                .map_err(|source| StudyError::Sensor { case: case.name.clone(), run, source })
        };
        (0..self.plan.approaches).into_par_iter().map(one).collect()
    }

    /// Returns the errors of the measurements with which the tracks have the errors of the full chain.
    fn errors(&self) -> Result<FittedErrors, StudyError> {
        let usual = Case::usual();
        let full = self.watched(&usual, &self.lidar)?;
        let goal = root_mean_squares(&full);
        let correlation = correlation(&full).clamp(1e-3, 0.999);
        let lag_s = LAG_STEPS as f64 * CONTROL_STEP.s();
        let drift_time_s = rounded((-lag_s / correlation.ln()).clamp(TIME_BOUNDS_S[0], TIME_BOUNDS_S[1]), 1e2);
        // Errors of the speed follow from the white error along the road, those of the position from the slow one.
        let [mut range_sd_m, mut lateral_sd_m, mut drift_sd_m] = [0.1; 3];
        for _ in 0..ITERATIONS {
            let sensors = self.object(&[
                format!("sensors.rear-object.range-sd-m={range_sd_m:?}"),
                format!("sensors.rear-object.lateral-sd-m={lateral_sd_m:?}"),
                format!("sensors.rear-object.drift-sd-m={drift_sd_m:?}"),
                format!("sensors.rear-object.drift-time-s={drift_time_s:?}"),
            ])?;
            let own = root_mean_squares(&self.watched(&usual, &sensors)?);
            let scaled = |sd_m: f64, axis: usize| {
                rounded((sd_m * goal[axis] / own[axis]).clamp(SD_BOUNDS_M[0], SD_BOUNDS_M[1]), 1e4)
            };
            (drift_sd_m, lateral_sd_m, range_sd_m) =
                (scaled(drift_sd_m, 0), scaled(lateral_sd_m, 1), scaled(range_sd_m, 2));
        }
        Ok(FittedErrors { range_sd_m, lateral_sd_m, drift_sd_m, drift_time_s })
    }

    /// Returns the mean score of the true class, of each class.
    fn class_confidence(&self) -> Result<ByClass, StudyError> {
        let sensors = self.scenario.sensors.with_mode(SensorMode::Full);
        let of = |class| {
            let watched = self.watched(&Case { class, ..Case::usual() }, &sensors)?;
            let scores: Vec<f64> = watched.iter().flat_map(|one| one.scores.iter().copied()).collect();
            Ok::<f64, StudyError>(rounded(mean(&scores).clamp(0.25, 1.0), 1e4))
        };
        Ok(ByClass {
            car: of(VehicleClass::Car)?,
            truck: of(VehicleClass::Truck)?,
            motorcycle: of(VehicleClass::Motorcycle)?,
        })
    }
}

/// Returns the root mean squares of the errors along (m), across (m) and of the speed (m/s).
fn root_mean_squares(watched: &[Watched]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let squares: Vec<f64> =
            watched.iter().flat_map(|one| one.errors.iter().map(|it| it[axis] * it[axis])).collect();
        mean(&squares).sqrt()
    })
}

/// Returns the correlation of the errors along the road with those a second later.
fn correlation(watched: &[Watched]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for one in watched {
        for pair in one.errors.windows(LAG_STEPS + 1) {
            product += pair[0][0] * pair[LAG_STEPS][0];
            square += 0.5 * (pair[0][0].powi(2) + pair[LAG_STEPS][0].powi(2));
        }
    }
    product / square
}
