//! The fit of the errors and losses of the object-level sensor, by class, paint and extinction.
//!
//! ```text
//!   full chain ─▶ tracks ─▶ figures ────────────────────────┐
//!   errors ─▶ object-level sensor ─▶ tracks ─▶ figures ─▶ ratios ─▶ errors    ... until both err alike
//! ```
//!
//! In each point of the grid, errors are adapted by the ratios of figures of the tracks. The errors
//! of the two speeds adapt the white errors along and across the road. The errors of the positions
//! adapt the slow errors and their correlation times. The white and slow errors of a far vehicle
//! have separate ratios. The errors with the least sum of squared logarithms of all these ratios
//! are kept. The losses come from the full chain: the distance from which on, and the share in
//! which, its tracks coast. A vehicle beyond this distance is far.
//!
//! A slow error covers everything that lasts longer than a scan: noise, and errors that the full
//! chain repeats at the same distance.

use closecall_sensors::{ErrorGrid, ErrorGrids, FittedErrors, NamedGrid, RearFit, SensorMode, Sensors};
use closecall_traffic::{Appearance, CONTROL_STEP, Plate, Vehicle, VehicleClass, maths};
use rayon::prelude::*;

use super::{Fitter, extinctions_per_m, mean, rounded};
use crate::perception::approach::watching::{Step, steps};
use crate::perception::approach::{Address, GAPS_M};
use crate::perception::behaviour::GAPS_M as ERROR_GAPS_M;
use crate::perception::cases::Case;
use crate::perception::study::StudyError;

/// Reflectivities of the paint (-) and visibilities (m) of the grid. The validation shares only the
/// clear day with it.
const PAINTS: [f64; 4] = [0.05, 0.14, 0.3, 0.7];
const VISIBILITIES_M: [f64; 7] = [10_000.0, 700.0, 400.0, 250.0, 150.0, 80.0, 50.0];
/// Number of times that the errors of a point are adapted.
const ITERATIONS: usize = 16;
/// Number of approaches of the object-level sensor in each adaptation. A slow error is often one
/// draw in an approach, and a deviation of 64 draws scatters by 9 %.
const OBJECT_APPROACHES: u64 = 64;
/// Smallest number of steps with a track that determine the errors of a point. With fewer, the
/// errors in less fog hold.
const LEAST_STEPS: usize = 100;
/// Smallest number of steps with a far track that determine its errors. With fewer, the errors of a
/// near track hold.
const LEAST_FAR_STEPS: usize = 50;
/// Bounds of the deviations (m), and of the correlation times (s): an error with a shorter time is
/// a white error.
const SD_BOUNDS_M: [f64; 2] = [0.001, 1.0];
const TIME_BOUNDS_S: [f64; 2] = [0.2, 20.0];
/// Largest ratio of the deviation of a measurement's error to the error of the track (-): an
/// assumption. Beyond it, the filter takes a vehicle that changes lanes for noise.
const MOST_OF_TRACK: f64 = 1.5;
/// Share of the logarithm of a ratio by which errors are adapted (-), because they depend on each
/// other; and the bounds of a ratio.
const ADAPTED_SHARE: f64 = 0.7;
const RATIO_BOUNDS: [f64; 2] = [0.2, 5.0];
/// Longest lag at which correlations are taken (control steps): 3 s.
const LONGEST_LAG_STEPS: usize = 75;
/// Bounds of a correlation that has not fallen to 1/e by then (-), which leave its time finite.
const CORRELATION_BOUNDS: [f64; 2] = [0.37, 0.999];
/// Distance between the candidates for the distance from which on scans are lost (m).
const LOSS_STEP_M: f64 = 1.0;
/// The errors that a fit begins with.
const START: FittedErrors = FittedErrors {
    white_sd_m: [0.03; 2],
    far_white_sd_m: [0.03; 2],
    slow_sd_m: [0.03; 2],
    far_slow_sd_m: [0.03; 2],
    slow_time_s: [1.0; 2],
    all_scans_share: 1.0,
    lost_share: 0.0,
};

/// Errors of tracks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Figures {
    /// Of near vehicles, up to 80 m: root mean squares of the errors of the position along and
    /// across the road (m), and of the speed along and across it (m/s), and the correlation times
    /// of the position errors (s), within the bounds of the fit.
    pub(super) near: [f64; 6],
    /// Of far vehicles: the same root mean squares; `None` with too few steps.
    pub(super) far: Option<[f64; 4]>,
}

/// Returns the fitted errors that lie on a bound, and the consequence.
pub fn at_bounds(fit: &RearFit) -> Vec<String> {
    let grids = &fit.errors;
    let of_class = |class: &str, grid: &ErrorGrid| {
        let warning = |(key, rows, _): NamedGrid<'_>| {
            let [low, high] = match key {
                _ if key.ends_with("-time-s") => TIME_BOUNDS_S,
                _ if key.ends_with("-m") => SD_BOUNDS_M,
                _ => return None,
            };
            let count = rows.iter().flatten().filter(|value| !(**value > low && **value < high)).count();
            (count > 0).then(|| {
                format!(
                    "`errors.{class}.{key}`: {count} of its values are {low} or {high}, a bound: the full chain may ask for values beyond it"
                )
            })
        };
        grid.named().into_iter().filter_map(warning).collect::<Vec<_>>()
    };
    let classes = [("car", &grids.car), ("truck", &grids.truck), ("motorcycle", &grids.motorcycle)];
    classes.into_iter().flat_map(|(class, grid)| of_class(class, grid)).collect()
}

impl Fitter<'_> {
    /// Returns the errors of a usual car, whatever its range.
    pub(super) fn usual_errors(&self) -> Result<FittedErrors, StudyError> {
        let sensors = self.scenario.sensors.with_mode(SensorMode::Object).without_range_fit(f64::INFINITY);
        Ok(self.errors_at(&Case::usual(), &sensors, f64::INFINITY)?.unwrap_or(START))
    }

    /// Returns the grids of a sensor with these errors for all vehicles.
    pub(super) fn same_errors(&self, errors: &FittedErrors) -> ErrorGrids {
        let same = ErrorGrid::of(&vec![vec![*errors; VISIBILITIES_M.len()]; PAINTS.len()]);
        self.grids([same.clone(), same.clone(), same])
    }

    fn grids(&self, [car, truck, motorcycle]: [ErrorGrid; 3]) -> ErrorGrids {
        ErrorGrids {
            origin: self.plan.origin(),
            paints: PAINTS.to_vec(),
            extinctions_per_m: extinctions_per_m(&VISIBILITIES_M),
            car,
            truck,
            motorcycle,
        }
    }

    /// Returns the errors of all vehicles, which have the ranges of this fit.
    pub(super) fn error_grids(&self, ranges: &RearFit) -> Result<ErrorGrids, StudyError> {
        // A sensor refers to its fit until the program ends, and a program makes few fits.
        let ranges: &'static RearFit = Box::leak(Box::new(ranges.clone()));
        let sensors = self.scenario.sensors.with_mode(SensorMode::Object).with_rear_fit(ranges);
        let errors_of = |class| self.class_errors(class, &sensors, ranges);
        Ok(self.grids([
            errors_of(VehicleClass::Car)?,
            errors_of(VehicleClass::Truck)?,
            errors_of(VehicleClass::Motorcycle)?,
        ]))
    }

    fn class_errors(&self, class: VehicleClass, sensors: &Sensors, ranges: &RearFit) -> Result<ErrorGrid, StudyError> {
        let mut rows = Vec::new();
        for paint in PAINTS {
            let mut row: Vec<FittedErrors> = Vec::new();
            for visibility_m in VISIBILITIES_M {
                let case = Self::case(class, paint, Plate::Clean, visibility_m);
                let appearance =
                    Appearance { paint_reflectivity: paint, plate: case.plate, ..Vehicle::typical(class).appearance };
                let range_m = ranges.range_m(class, &appearance, &case.environment);
                let errors = self.errors_at(&case, sensors, range_m)?;
                row.push(errors.or_else(|| row.last().copied()).unwrap_or(START));
            }
            rows.push(row);
        }
        Ok(ErrorGrid::of(&rows))
    }

    /// Returns the errors and losses of one case. With them, the tracks of `sensors`, at object
    /// level, have the errors of the full chain's tracks. Returns `None` if the full chain sees the
    /// vehicle for too short a time. The vehicle has the range `range_m` (m) at object level.
    pub(super) fn errors_at(
        &self,
        case: &Case,
        sensors: &Sensors,
        range_m: f64,
    ) -> Result<Option<FittedErrors>, StudyError> {
        let full = self.steps(case, &self.lidar, self.plan.approaches, self.plan.seed)?;
        let Losses { from_m, lost_share } = losses(&full);
        let Some(goal) = figures(&full, from_m) else { return Ok(None) };
        let [along_m, across_m, _, _, along_s, across_s] = goal.near;
        let [far_along_m, far_across_m, ..] = goal.far.unwrap_or([along_m, across_m, 0.0, 0.0]);
        let mut errors = FittedErrors {
            slow_sd_m: [along_m, across_m].map(within(SD_BOUNDS_M)),
            far_slow_sd_m: [far_along_m, far_across_m].map(within(SD_BOUNDS_M)),
            slow_time_s: [along_s, across_s].map(within(TIME_BOUNDS_S)),
            all_scans_share: rounded((from_m / range_m).min(1.0), 1e3),
            lost_share: rounded(lost_share, 1e3),
            ..START
        };
        let (mut best, mut least) = (errors, f64::INFINITY);
        for _ in 0..ITERATIONS {
            let achieved = self.steps(case, &sensors.with_rear_errors(errors), OBJECT_APPROACHES, !self.plan.seed)?;
            let Some(achieved) = figures(&achieved, from_m) else { break };
            let ratios = Ratios::of(&goal, &achieved);
            if ratios.distance() < least {
                (best, least) = (errors, ratios.distance());
            }
            errors = ratios.adapted(&errors, &goal);
        }
        let FittedErrors { white_sd_m, slow_sd_m, .. } = best;
        Ok(Some(match goal.far {
            Some(_) => best,
            None => FittedErrors { far_white_sd_m: white_sd_m, far_slow_sd_m: slow_sd_m, ..best },
        }))
    }

    /// Returns all steps of the first approaches of a case, with this seed.
    fn steps(&self, case: &Case, sensors: &Sensors, approaches: u64, seed: u64) -> Result<Vec<Vec<Step>>, StudyError> {
        let approach = |run| {
            steps(case, sensors, &self.scenario.road, Address { seed, run }, ERROR_GAPS_M[0])
                .map_err(|source| StudyError::Sensor { case: case.name.clone(), run, source })
        };
        (0..approaches).into_par_iter().map(approach).collect()
    }
}

fn within([low, high]: [f64; 2]) -> impl Fn(f64) -> f64 {
    move |value| rounded(value.clamp(low, high), 1e4)
}

/// The ratios of the figures that tracks should have to the figures that they have.
#[derive(Clone, Copy, Debug)]
struct Ratios {
    near: [f64; 6],
    /// The ratios of far vehicles; 1 if either has too few steps.
    far: [f64; 4],
}

impl Ratios {
    fn of(goal: &Figures, achieved: &Figures) -> Self {
        Self {
            near: std::array::from_fn(|index| goal.near[index] / achieved.near[index]),
            far: match (goal.far, achieved.far) {
                (Some(goal), Some(achieved)) => std::array::from_fn(|index| goal[index] / achieved[index]),
                _ => [1.0; 4],
            },
        }
    }

    /// Returns the sum of the squared logarithms.
    fn distance(&self) -> f64 {
        self.near.iter().chain(&self.far).map(|ratio| maths::ln(*ratio).powi(2)).sum()
    }

    /// Returns errors that bring the figures of the tracks nearer to the goal.
    fn adapted(&self, errors: &FittedErrors, goal: &Figures) -> FittedErrors {
        let [low, high] = RATIO_BOUNDS;
        let damped = |ratio: f64| maths::powf(ratio.clamp(low, high), ADAPTED_SHARE);
        let [along, across, speed, speed_across, along_time, across_time] = self.near.map(damped);
        let [far_along, far_across, far_speed, far_speed_across] = self.far.map(damped);
        let FittedErrors { white_sd_m, far_white_sd_m, slow_sd_m, far_slow_sd_m, slow_time_s, .. } = errors;
        let bounded = |value_m: f64, track_m: f64| within(SD_BOUNDS_M)(value_m.min(MOST_OF_TRACK * track_m));
        let [along_m, across_m, ..] = goal.near;
        let [far_along_m, far_across_m, ..] = goal.far.unwrap_or([along_m, across_m, 0.0, 0.0]);
        FittedErrors {
            white_sd_m: [bounded(speed * white_sd_m[0], along_m), bounded(speed_across * white_sd_m[1], across_m)],
            far_white_sd_m: [
                bounded(far_speed * far_white_sd_m[0], far_along_m),
                bounded(far_speed_across * far_white_sd_m[1], far_across_m),
            ],
            far_slow_sd_m: [
                bounded(far_along * far_slow_sd_m[0], far_along_m),
                bounded(far_across * far_slow_sd_m[1], far_across_m),
            ],
            slow_sd_m: [bounded(along * slow_sd_m[0], along_m), bounded(across * slow_sd_m[1], across_m)],
            slow_time_s: [along_time * slow_time_s[0], across_time * slow_time_s[1]].map(within(TIME_BOUNDS_S)),
            ..*errors
        }
    }
}

/// Returns the figures of tracks. Vehicles beyond `from_m` (m) are far. Returns `None` with too few
/// steps.
pub(super) fn figures(series: &[Vec<Step>], from_m: f64) -> Option<Figures> {
    let [near_m, _, far_m] = ERROR_GAPS_M;
    let between = |[low_m, high_m]: [f64; 2]| -> Vec<Vec<[f64; 4]>> {
        let is_within = |step: &&Step| step.gap_m >= low_m && step.gap_m <= high_m;
        let errors = |steps: &Vec<Step>| {
            steps.iter().filter(is_within).filter_map(|step| step.seen.map(|perceived| perceived.errors)).collect()
        };
        series.iter().map(errors).collect()
    };
    let root_mean_squares = |all: &[[f64; 4]]| {
        [0, 1, 2, 3].map(|axis| mean(&all.iter().map(|errors| errors[axis] * errors[axis]).collect::<Vec<_>>()).sqrt())
    };
    let near = between([near_m, far_m.min(from_m)]);
    let all_near = near.concat();
    if all_near.len() < LEAST_STEPS {
        return None;
    }
    let [along_m, across_m, along_mps, across_mps] = root_mean_squares(&all_near);
    // The fit does not tell apart times beyond its bounds.
    let time_s = |axis| within(TIME_BOUNDS_S)(correlation_time_s(&near, axis));
    let far = between([from_m.max(near_m), f64::INFINITY]).concat();
    Some(Figures {
        near: [along_m, across_m, along_mps, across_mps, time_s(0), time_s(1)],
        far: (far.len() >= LEAST_FAR_STEPS).then(|| root_mean_squares(&far)),
    })
}

/// Returns the time after which the correlation of an error has fallen to 1/e (s). If it has not
/// within the longest lag, returns the time that its value there implies.
fn correlation_time_s(errors: &[Vec<[f64; 4]>], axis: usize) -> f64 {
    let correlation = |lag: usize| {
        let (mut product, mut square) = (0.0, f64::MIN_POSITIVE);
        for steps in errors {
            for (first, last) in steps.iter().zip(steps.iter().skip(lag)) {
                product += first[axis] * last[axis];
                square += 0.5 * (first[axis].powi(2) + last[axis].powi(2));
            }
        }
        product / square
    };
    let mut before = 1.0;
    let level = maths::exp(-1.0);
    for lag in 1..=LONGEST_LAG_STEPS {
        let now = correlation(lag);
        if now <= level {
            let share = (before - level) / (before - now);
            return ((lag - 1) as f64 + share) * CONTROL_STEP.s();
        }
        before = now;
    }
    let [low, high] = CORRELATION_BOUNDS;
    -(LONGEST_LAG_STEPS as f64) * CONTROL_STEP.s() / maths::ln(before.clamp(low, high))
}

/// The scans that lose a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Losses {
    /// Gap up to which every scan measures it (m).
    pub(super) from_m: f64,
    /// Share of the scans beyond that lose it (-).
    pub(super) lost_share: f64,
}

/// Returns the losses with the least squared error to the lost scans.
pub(super) fn losses(series: &[Vec<Step>]) -> Losses {
    let tracked: Vec<(f64, bool)> =
        series.iter().flatten().filter_map(|step| Some((step.gap_m, step.seen?.is_coasting))).collect();
    let all_lost = tracked.iter().filter(|(_, is_lost)| *is_lost).count() as f64;
    let beyond = |from_m: f64| {
        let (mut count, mut lost) = (0.0, 0.0);
        for (_, is_lost) in tracked.iter().filter(|(gap_m, _)| *gap_m > from_m) {
            count += 1.0;
            lost += f64::from(u8::from(*is_lost));
        }
        let share = if count > 0.0 { lost / count } else { 0.0 };
        // A scan that is lost nearer counts in full; beyond, the variance of a share remains.
        (all_lost - lost + count * share * (1.0 - share), share)
    };
    let mut least = f64::INFINITY;
    let mut best = Losses { from_m: f64::INFINITY, lost_share: 0.0 };
    let mut from_m = GAPS_M[0];
    while from_m > 0.0 {
        let (error, share) = beyond(from_m);
        if error < least {
            least = error;
            best = Losses { from_m, lost_share: share };
        }
        from_m -= LOSS_STEP_M;
    }
    best
}
