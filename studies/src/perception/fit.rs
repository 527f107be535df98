//! The fit of the rear object-level sensor to the full chain.
//!
//! ```text
//!  scenario ─▶ full chain ─┬▶ distances from which on a confirmed track lasts, and is classified as a vehicle,
//!                          │  over class, paint, plate, shape, extinction ─▶ ranges
//!                          ├▶ errors and losses of the tracks over class, paint, extinction ─▶ of the measurements
//!                          └▶ scores of the true class ─▶ confidence
//! ```
//!
//! Only perception is fitted: no controller runs, and no collision counts. A range is the mean
//! distance from which on a confirmed track lasts, plus the distance that the object-level sensor
//! itself needs to confirm a vehicle. Beyond, a body shape is seen at a share of the distances. The
//! spread of a range is its scatter under other noise of the sensors. The place of the vehicle in its
//! lane moves a range too, and the mean is over places. No spread stands for it: a drawn distance
//! does not follow the place that the vehicle has in a run. A
//! class range is the mean distance at which a track that lasts is first classified as a vehicle,
//! plus the distance that the latency costs. It is a distance and no
//! time, because the full chain recognises a vehicle in fog at nearly the same distance at all
//! closing speeds. The errors of the measurements are fitted until the tracks have the errors of
//! the full chain.
//!
//! The pitch of the ego decides whether a layer of the LiDAR meets the lamps and the plate of a
//! distant vehicle. Ranges under pitches are fitted in approaches of an ego that keeps its pitch.
//! Their spread is over places in the lane, closing speeds and noise.

use std::collections::BTreeMap;

use closecall_scenarios::{Scenario, ScenarioFile, Setting};
use closecall_sensors::{
    ByClass, FittedErrors, Origin, PitchedShapes, RangeGrid, RearFit, SensorMode, Sensors, ShapeRatios,
};
use closecall_traffic::{BodyShape, Environment, Plate, Vehicle, VehicleClass, maths};
use rayon::prelude::*;

use crate::perception::approach::{Address, Sightings, scores, sightings};
use crate::perception::cases::Case;
use crate::perception::study::StudyError;

mod errors;
#[cfg(test)]
mod tests;

pub use errors::at_bounds;

/// Reflectivities of the paint of the grid (-).
const PAINTS: [f64; 6] = [0.05, 0.1, 0.2, 0.35, 0.5, 0.8];
/// Visibilities of the grid (m), first the visibility of a clear day.
const VISIBILITIES_M: [f64; 9] = [10_000.0, 1_000.0, 500.0, 300.0, 200.0, 150.0, 100.0, 70.0, 50.0];
/// Extinction multiplied by visibility: Koschmieder's contrast threshold of 2 %.
const KOSCHMIEDER: f64 = 3.912;
/// Reflectivities (-) and visibilities (m) in which body shapes are compared: a coarser grid in fog.
const SHAPE_PAINTS: [f64; 6] = PAINTS;
const SHAPE_VISIBILITIES_M: [f64; 5] = [10_000.0, 500.0, 200.0, 100.0, 50.0];
/// Pitches of the ego under which body shapes are compared, positive nose down (rad). With the
/// brake dive of the ego, they belong to −1 to 2 m/s². Around zero they lie close: the acceleration
/// of an ego that follows a vehicle scatters by 0.05 m/s².
const PITCHES_RAD: [f64; 16] = [
    -2.7e-3, -1.2e-3, -6e-4, -3e-4, -2.1e-4, -1.4e-4, -7e-5, 0.0, 7e-5, 1.4e-4, 2.1e-4, 3e-4, 6e-4, 1.2e-3, 2.7e-3,
    5.4e-3,
];
/// Reflectivities (-) and visibilities (m) in which body shapes are compared under each pitch.
const PITCH_PAINTS: [f64; 4] = [0.05, 0.1, 0.2, 0.5];
const PITCH_VISIBILITIES_M: [f64; 3] = [10_000.0, 300.0, 100.0];
/// Gaps between which the class scores of tracks are taken (m).
const GAPS_M: [f64; 2] = [20.0, 80.0];
/// Ranges at which the object-level sensor's own time to confirm a vehicle, and to report a class,
/// is measured (m).
const TEST_RANGE_M: f64 = 100.0;
const TEST_CLASS_RANGE_M: f64 = 60.0;

/// The inputs of a fit.
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
    /// The full chain.
    full: Sensors,
    /// The LiDAR without the camera, which no error depends on.
    lidar: Sensors,
}

/// Fits the rear object-level sensor to the full chain. The result does not depend on the number of
/// threads.
///
/// # Errors
/// [`StudyError`] if the scenario cannot be used, or a sensor model fails.
pub fn fit(plan: &FitPlan<'_>) -> Result<RearFit, StudyError> {
    let fitter = Fitter::new(plan)?;
    let usual = fitter.usual_errors()?;
    let ranges = RearFit {
        origin: plan.origin(),
        errors: fitter.same_errors(&usual),
        class_confidence: fitter.class_confidence()?,
        range_spread: fitter.range_spread()?,
        paints: PAINTS.to_vec(),
        extinctions_per_m: extinctions_per_m(&VISIBILITIES_M),
        range: fitter.ranges(&usual)?,
        shapes: fitter.shapes()?,
        pitched: fitter.pitched()?,
        validation: None,
    };
    Ok(RearFit { errors: fitter.error_grids(&ranges)?, ..ranges })
}

/// Fits the ranges alone to the full chain. The errors, the losses and the scores are the same as
/// in another fit. The validation of that fit does not hold for the new one.
///
/// # Errors
/// Works like [`fit`].
pub fn fit_ranges(plan: &FitPlan<'_>, errors: &RearFit) -> Result<RearFit, StudyError> {
    let fitter = Fitter::new(plan)?;
    let usual = Vehicle::typical(VehicleClass::Car);
    let usual_errors = errors.errors.at(usual.class, &usual.appearance, &Environment::CLEAR_DAY);
    Ok(RearFit {
        origin: plan.origin(),
        range_spread: fitter.range_spread()?,
        paints: PAINTS.to_vec(),
        extinctions_per_m: extinctions_per_m(&VISIBILITIES_M),
        range: fitter.ranges(&usual_errors)?,
        shapes: fitter.shapes()?,
        pitched: fitter.pitched()?,
        validation: None,
        ..errors.clone()
    })
}

/// Fits the ranges under pitches of the ego alone to the full chain. All else is the same as in
/// another fit. The validation of that fit does not hold for the new one.
///
/// # Errors
/// Works like [`fit`].
pub fn fit_pitched(plan: &FitPlan<'_>, fit: &RearFit) -> Result<RearFit, StudyError> {
    let command = format!("{}; {}", fit.origin.command, plan.command);
    let origin = Origin { command, ..fit.origin.clone() };
    Ok(RearFit { origin, pitched: Fitter::new(plan)?.pitched()?, validation: None, ..fit.clone() })
}

/// Fits the errors alone to the full chain, with the ranges of another fit. The validation of that
/// fit does not hold for the new one.
///
/// # Errors
/// Works like [`fit`].
pub fn fit_errors(plan: &FitPlan<'_>, ranges: &RearFit) -> Result<RearFit, StudyError> {
    Ok(RearFit { errors: Fitter::new(plan)?.error_grids(ranges)?, validation: None, ..ranges.clone() })
}

impl FitPlan<'_> {
    /// Returns the statement of a file about the origin of its figures.
    pub(crate) fn origin(&self) -> Origin {
        let FitPlan { seed, approaches, command, version, file } = self.clone();
        Origin { command, version, scenario: file.config().name.clone(), seed, approaches }
    }
}

fn with_settings(file: &ScenarioFile, settings: &[String]) -> Result<ScenarioFile, StudyError> {
    let settings: Vec<Setting> = settings.iter().filter_map(|text| text.parse().ok()).collect();
    Ok(ScenarioFile::parse(file.path(), file.text(), &settings)?)
}

fn extinctions_per_m(visibilities_m: &[f64]) -> Vec<f64> {
    visibilities_m.iter().map(|visibility_m| rounded(KOSCHMIEDER / visibility_m, 1e6)).collect()
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the mean distances from which on tracks last, and are classified (m).
fn means_m(approaches: &[Sightings]) -> [f64; 2] {
    let mean_m = |distance_m: fn(&Sightings) -> f64| mean(&approaches.iter().map(distance_m).collect::<Vec<_>>());
    [mean_m(|sightings| sightings.lasting_m), mean_m(|sightings| sightings.classified_m)]
}

/// Returns the ratio of the largest distance of a track to the mean distance from which on tracks
/// last, and the share of the distances between with a track (-).
fn intermittent(approaches: &[Sightings]) -> [f64; 2] {
    let [lasting_m, _] = means_m(approaches);
    let first_m = approaches.iter().fold(0.0, |first_m, sightings| sightings.first_m.max(first_m));
    let (mut seen_m, mut between_m) = (0.0, 0.0);
    for sightings in approaches {
        seen_m += sightings.beyond_m;
        between_m += first_m - sightings.lasting_m;
    }
    let share = if between_m > 0.0 { (seen_m / between_m).min(1.0) } else { 0.0 };
    [rounded((first_m / lasting_m).max(1.0), 1e3), rounded(share, 1e3)]
}

/// Centre and spread of a distance over approaches.
struct Spread {
    /// Geometric mean (m).
    centre_m: f64,
    /// Standard deviation of the logarithm (-).
    sd: f64,
}

impl Spread {
    fn of(approaches: &[Sightings], distance_m: fn(&Sightings) -> f64) -> Self {
        let logs: Vec<f64> = approaches.iter().map(|sightings| maths::ln(distance_m(sightings))).collect();
        let centre = mean(&logs);
        let squares: f64 = logs.iter().map(|log| (log - centre).powi(2)).sum();
        Self { centre_m: maths::exp(centre), sd: (squares / (logs.len() as f64 - 1.0).max(1.0)).sqrt() }
    }
}

impl<'a> Fitter<'a> {
    fn new(plan: &'a FitPlan<'a>) -> Result<Self, StudyError> {
        let nominal = plan.file.space().nominal();
        let without_camera = with_settings(plan.file, &["sensors.rear-camera.pipeline=\"off\"".to_owned()])?;
        let lidar = without_camera.concrete(&nominal)?.sensors.with_mode(SensorMode::Full);
        let scenario = plan.file.concrete(&nominal)?;
        Ok(Self { plan, full: scenario.sensors.with_mode(SensorMode::Full), scenario, lidar })
    }
}

impl Fitter<'_> {
    fn case(class: VehicleClass, paint: f64, plate: Plate, visibility_m: f64) -> Case {
        let environment = Environment { visibility_m, ..Environment::CLEAR_DAY };
        // The ratios of body shapes are ratios to this shape, with its own height.
        let shape = BodyShape::of_class(class).first().copied();
        Case { class, paint, plate, shape, environment, ..Case::usual() }
    }

    /// Returns the gaps with a track in all approaches of a case.
    fn sightings(&self, case: &Case, sensors: &Sensors) -> Result<Vec<Sightings>, StudyError> {
        self.sightings_with_noise_of(0, case, sensors)
    }

    /// Returns the gaps with a track in all approaches of a case, each with the noise of the approach
    /// whose number is larger by `further`.
    fn sightings_with_noise_of(
        &self,
        further: u64,
        case: &Case,
        sensors: &Sensors,
    ) -> Result<Vec<Sightings>, StudyError> {
        let of_run = |run| {
            let at = |run| Address { seed: self.plan.seed, run };
            sightings(case, sensors, &self.scenario.road, at(run), at(run + further))
                .map_err(|source| StudyError::Sensor { case: case.name.clone(), run, source })
        };
        (0..self.plan.approaches).into_par_iter().map(of_run).collect()
    }

    /// Returns the standard deviation of the logarithm of a car's range under other noise of the
    /// sensors (-).
    fn range_spread(&self) -> Result<f64, StudyError> {
        let (mut squares, mut pairs) = (0.0, 0.0);
        for paint in PAINTS {
            for visibility_m in VISIBILITIES_M {
                let case = Self::case(VehicleClass::Car, paint, Plate::Clean, visibility_m);
                let first = self.sightings(&case, &self.full)?;
                let second = self.sightings_with_noise_of(self.plan.approaches, &case, &self.full)?;
                for (first, second) in first.iter().zip(&second) {
                    squares += maths::ln(first.lasting_m / second.lasting_m).powi(2);
                    pairs += 1.0;
                }
            }
        }
        // The variance of a difference is twice the variance of each.
        Ok(rounded((0.5 * squares / pairs).sqrt(), 1e4))
    }

    /// Returns the distances that the object-level sensor with these errors needs to confirm a
    /// vehicle, and to report its class (m).
    fn own_delays_m(&self, errors: &FittedErrors) -> Result<[f64; 2], StudyError> {
        let file = with_settings(self.plan.file, &[format!("sensors.rear-object.range-m={TEST_RANGE_M:?}")])?;
        let sensors = file.concrete(&file.space().nominal())?.sensors.with_mode(SensorMode::Object);
        let sensors = sensors.without_range_fit(TEST_CLASS_RANGE_M).with_rear_errors(*errors);
        let [lasting_m, classified_m] = means_m(&self.sightings(&Case::usual(), &sensors)?);
        Ok([TEST_RANGE_M - lasting_m, TEST_CLASS_RANGE_M - classified_m])
    }

    /// Returns the ranges of all classes and plates.
    fn ranges(&self, errors: &FittedErrors) -> Result<Vec<RangeGrid>, StudyError> {
        let [delay_m, class_delay_m] = self.own_delays_m(errors)?;
        let mut grids = Vec::new();
        for (class, plate) in [
            (VehicleClass::Car, Plate::Clean),
            (VehicleClass::Car, Plate::Dirty),
            (VehicleClass::Car, Plate::None),
            (VehicleClass::Truck, Plate::Clean),
            (VehicleClass::Motorcycle, Plate::Clean),
        ] {
            let mut grid = RangeGrid { class, plate, range_m: Vec::new(), class_range_m: Vec::new() };
            for paint in PAINTS {
                let (mut row_m, mut class_row_m) = (Vec::new(), Vec::new());
                for visibility_m in VISIBILITIES_M {
                    let approaches = self.sightings(&Self::case(class, paint, plate, visibility_m), &self.full)?;
                    let [centre_m, classified_m] = means_m(&approaches);
                    let range_m = rounded(centre_m + delay_m, 10.0);
                    // A class that the full chain knows at the confirmation of the track limits
                    // nothing.
                    let is_known_at_once =
                        approaches.iter().all(|approach| approach.classified_m == approach.lasting_m);
                    let class_range_m = rounded(classified_m + class_delay_m, 10.0).min(range_m);
                    row_m.push(range_m);
                    class_row_m.push(if is_known_at_once { range_m } else { class_range_m });
                }
                grid.range_m.push(row_m);
                grid.class_range_m.push(class_row_m);
            }
            grids.push(grid);
        }
        Ok(grids)
    }

    /// Returns the ranges of each body shape relative to the ranges of the first shape of its
    /// class.
    fn shapes(&self) -> Result<ShapeRatios, StudyError> {
        let (mut range, mut class_range) = (BTreeMap::new(), BTreeMap::new());
        let (mut intermittent_m, mut intermittent_share) = (BTreeMap::new(), BTreeMap::new());
        for class in VehicleClass::ALL {
            let figures = |shape: BodyShape| {
                let figures_at = |paint: f64, visibility_m: f64| {
                    let case = Case { shape: Some(shape), ..Self::case(class, paint, Plate::Clean, visibility_m) };
                    let approaches = self.sightings(&case, &self.full)?;
                    let ([lasting_m, classified_m], [ratio, share]) = (means_m(&approaches), intermittent(&approaches));
                    Ok::<_, StudyError>([lasting_m, classified_m, ratio, share])
                };
                let row =
                    |paint| SHAPE_VISIBILITIES_M.iter().map(|visibility_m| figures_at(paint, *visibility_m)).collect();
                SHAPE_PAINTS.into_iter().map(row).collect::<Result<Vec<Vec<[f64; 4]>>, StudyError>>()
            };
            let shapes = BodyShape::of_class(class);
            let first_shape = figures(shapes[0])?;
            for shape in shapes {
                let own = if *shape == shapes[0] { first_shape.clone() } else { figures(*shape)? };
                let grid = |value: &dyn Fn(&[f64; 4], &[f64; 4]) -> f64| -> Vec<Vec<f64>> {
                    let rows = own.iter().zip(&first_shape);
                    rows.map(|(row, first_row)| {
                        row.iter().zip(first_row).map(|(own, first)| rounded(value(own, first), 1e3)).collect()
                    })
                    .collect()
                };
                let name = || shape.name().to_owned();
                if *shape != shapes[0] {
                    range.insert(name(), grid(&|own, first| own[0] / first[0]));
                    class_range.insert(name(), grid(&|own, first| own[1] / first[1]));
                }
                intermittent_m.insert(name(), grid(&|own, _| own[2]));
                intermittent_share.insert(name(), grid(&|own, _| own[3]));
            }
        }
        Ok(ShapeRatios {
            paints: SHAPE_PAINTS.to_vec(),
            extinctions_per_m: extinctions_per_m(&SHAPE_VISIBILITIES_M),
            range,
            class_range,
            intermittent: intermittent_m,
            intermittent_share,
        })
    }

    /// Returns the ranges of each body shape under each pitch, relative to the ranges of the first
    /// shape of its class without pitch.
    fn pitched(&self) -> Result<Vec<PitchedShapes>, StudyError> {
        let by = |pitch_rad| self.pitched_by(pitch_rad, &PITCH_PAINTS, &PITCH_VISIBILITIES_M);
        PITCHES_RAD.into_iter().map(by).collect()
    }

    /// Returns the ranges of each body shape under a pitch (rad), over paint (-) and visibility (m),
    /// relative to the ranges of the first shape of its class without pitch.
    fn pitched_by(&self, pitch_rad: f64, paints: &[f64], visibilities_m: &[f64]) -> Result<PitchedShapes, StudyError> {
        let [mut range, mut class_range, mut spread] = [const { BTreeMap::new() }; 3];
        for class in VehicleClass::ALL {
            let shapes = BodyShape::of_class(class);
            let grid = |shape: BodyShape, ego_pitch_rad: f64| {
                let spreads = |paint: f64, visibility_m: f64| {
                    let case = Self::case(class, paint, Plate::Clean, visibility_m);
                    let case = Case { shape: Some(shape), ego_pitch_rad, ..case };
                    let approaches = self.sightings(&case, &self.full)?;
                    Ok::<_, StudyError>([
                        Spread::of(&approaches, |sightings| sightings.lasting_m),
                        Spread::of(&approaches, |sightings| sightings.classified_m),
                    ])
                };
                let row = |paint| visibilities_m.iter().map(|visibility_m| spreads(paint, *visibility_m)).collect();
                paints.iter().map(|paint| row(*paint)).collect::<Result<Vec<Vec<[Spread; 2]>>, StudyError>>()
            };
            let level = grid(shapes[0], 0.0)?;
            for shape in shapes {
                let own = grid(*shape, pitch_rad)?;
                let figures = |figure: &dyn Fn(&[Spread; 2], &[Spread; 2]) -> f64| -> Vec<Vec<f64>> {
                    let rows = own.iter().zip(&level);
                    rows.map(|(row, level)| {
                        row.iter().zip(level).map(|(own, level)| rounded(figure(own, level), 1e3)).collect()
                    })
                    .collect()
                };
                let name = || shape.name().to_owned();
                range.insert(name(), figures(&|[own, _], [level, _]| own.centre_m / level.centre_m));
                class_range.insert(name(), figures(&|[_, own], [_, level]| own.centre_m / level.centre_m));
                spread.insert(name(), figures(&|[own, _], _| own.sd));
            }
        }
        let extinctions_per_m = extinctions_per_m(visibilities_m);
        Ok(PitchedShapes { pitch_rad, paints: paints.to_vec(), extinctions_per_m, range, class_range, spread })
    }

    /// Returns the mean score of the true class, of each class.
    fn class_confidence(&self) -> Result<ByClass, StudyError> {
        let confidence = |class| {
            let case = Case { class, ..Case::usual() };
            let scores = |run| {
                scores(&case, &self.full, &self.scenario.road, Address { seed: self.plan.seed, run }, GAPS_M)
                    .map_err(|source| StudyError::Sensor { case: case.name.clone(), run, source })
            };
            let scores: Result<Vec<Vec<f64>>, StudyError> =
                (0..self.plan.approaches).into_par_iter().map(scores).collect();
            Ok::<f64, StudyError>(rounded(mean(&scores?.concat()).clamp(0.25, 1.0), 1e4))
        };
        Ok(ByClass {
            car: confidence(VehicleClass::Car)?,
            truck: confidence(VehicleClass::Truck)?,
            motorcycle: confidence(VehicleClass::Motorcycle)?,
        })
    }
}
