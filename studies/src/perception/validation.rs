//! The object-level sensor against the full chain, over class, paint and weather: the behaviour of
//! their tracks, and the differences.
//!
//! The criteria of [`Difference`] precede the first comparison. They ask what matters to a function
//! that acts on the tracks, and not whether a difference can be told from chance.

use closecall_sensors::{Chain, RearFit, SensorMode, Validation, ValidationFigures};
use closecall_traffic::{Environment, VehicleClass};

use crate::perception::behaviour::Behaviour;
use crate::perception::cases::Case;
use crate::perception::fit::FitPlan;
use crate::perception::study::StudyError;

/// Reflectivities of the paint (-): black, dark, and the paint of a usual car.
const PAINTS: [f64; 3] = [0.1, 0.2, 0.5];
/// Weathers: visibility (m) and rain (mm/h). Clear air, strong rain (German Weather Service), and
/// two densities of fog.
const WEATHERS: [[f64; 2]; 4] = [[10_000.0, 0.0], [10_000.0, 10.0], [300.0, 0.0], [100.0, 0.0]];

/// Factor between two deviations, and between two correlation times, up to which they count as
/// equal (assumptions): a correlation time of some seconds is hardly better known from approaches
/// of some ten seconds.
const SD_FACTOR: f64 = 1.5;
const TIME_FACTOR: f64 = 3.0;
/// Differences of deviations up to which they count as equal: of positions (m), a hundredth of a
/// vehicle's width; of speeds (m/s), 2 % of the smallest closing speed (assumptions).
const SD_FLOORS: [f64; 3] = [0.02, 0.02, 0.05];
/// Difference of times up to which they count as equal (s): a control step.
const TIME_FLOOR_S: f64 = 0.04;
/// Difference of shares up to which they count as equal (-): one percentage point.
const SHARE_FLOOR: f64 = 0.01;

/// A figure in which the object-level sensor differs materially from the full chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Class of the vehicle.
    pub class: VehicleClass,
    /// Reflectivity of its paint (-).
    pub paint: f64,
    /// Visibility (m) and rain (mm/h).
    pub weather: [f64; 2],
    /// Name of the figure.
    pub figure: &'static str,
    /// The figure of the full chain.
    pub full: f64,
    /// The figure of the object-level sensor.
    pub object: f64,
}

/// A vehicle in a weather with the behaviour of its tracks.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The class, the paint (-), and visibility (m) and rain (mm/h).
    pub at: (VehicleClass, f64, [f64; 2]),
    /// In the full chain.
    pub full: Behaviour,
    /// The behaviour with the object-level sensor.
    pub object: Behaviour,
}

/// Measures both sensors of the scenario over the grid, or over the part of it that `is_asked`
/// names. The object-level sensor has the fit that ships, or another one.
///
/// # Errors
/// [`StudyError`] if the scenario cannot be used, or a sensor model fails.
pub fn measure(
    plan: &FitPlan<'_>,
    fit: Option<&RearFit>,
    is_asked: impl Fn(VehicleClass, f64, [f64; 2]) -> bool,
) -> Result<Vec<Measured>, StudyError> {
    let scenario = plan.file.concrete(&plan.file.space().nominal())?;
    // A sensor refers to its fit until the program ends, and a program validates few fits.
    let fit: Option<&'static RearFit> = fit.map(|fit| &*Box::leak(Box::new(fit.clone())));
    let mut measured = Vec::new();
    for class in VehicleClass::ALL {
        for paint in PAINTS {
            for weather in WEATHERS.into_iter().filter(|weather| is_asked(class, paint, *weather)) {
                let case = case(class, paint, weather);
                let behaviour = |mode| {
                    let sensors = scenario.sensors.with_mode(mode);
                    let sensors = fit.map_or(sensors, |fit| sensors.with_rear_fit(fit));
                    Behaviour::measure(&case, &sensors, &scenario.road, [plan.seed, plan.approaches])
                };
                let (full, object) = (behaviour(SensorMode::Full)?, behaviour(SensorMode::Object)?);
                measured.push(Measured { at: (class, paint, weather), full, object });
            }
        }
    }
    Ok(measured)
}

fn case(class: VehicleClass, paint: f64, [visibility_m, rain_mm_per_h]: [f64; 2]) -> Case {
    let environment = Environment { visibility_m, rain_mm_per_h, ..Environment::CLEAR_DAY };
    Case { class, paint, environment, ..Case::usual() }
}

/// Returns the table of the whole grid, for the file of the fit.
pub fn table(plan: &FitPlan<'_>, measured: &[Measured]) -> Validation {
    let of_class = |class, chain| {
        let rows = |value: &dyn Fn(&Behaviour) -> f64| -> Vec<Vec<f64>> {
            let of_paint = |paint: f64| {
                let cells =
                    measured.iter().filter(|measurement| (measurement.at.0, measurement.at.1) == (class, paint));
                cells.map(|measurement| rounded(value(measurement.of(chain)))).collect()
            };
            PAINTS.into_iter().map(of_paint).collect()
        };
        ValidationFigures {
            class,
            chain,
            along_sd_m: rows(&|behaviour| behaviour.sd[0]),
            across_sd_m: rows(&|behaviour| behaviour.sd[1]),
            speed_sd_mps: rows(&|behaviour| behaviour.sd[2]),
            along_time_s: rows(&|behaviour| behaviour.time_s[0]),
            across_time_s: rows(&|behaviour| behaviour.time_s[1]),
            speed_time_s: rows(&|behaviour| behaviour.time_s[2]),
            confirmed_after_s: rows(&|behaviour| behaviour.after_s[0]),
            classified_after_s: rows(&|behaviour| behaviour.after_s[1]),
            missed: rows(&|behaviour| behaviour.missed),
            longest_gap_s: rows(&|behaviour| behaviour.longest_gap_s),
            coasting: rows(&|behaviour| behaviour.coasting),
            braking_lag_s: rows(&|behaviour| behaviour.lag_s[0]),
            lateral_lag_s: rows(&|behaviour| behaviour.lag_s[1]),
        }
    };
    let of_both = |class| [Chain::Full, Chain::Object].map(|chain| of_class(class, chain));
    Validation {
        origin: plan.origin(),
        paints: PAINTS.to_vec(),
        visibilities_m: WEATHERS.map(|[visibility_m, _]| visibility_m).to_vec(),
        rain_mm_per_h: WEATHERS.map(|[_, rain]| rain).to_vec(),
        figures: VehicleClass::ALL.into_iter().flat_map(of_both).collect(),
    }
}

/// Rounds to a thousandth, which is finer than any criterion.
fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

impl Measured {
    /// Returns the figures of one of the sensors.
    pub fn of(&self, chain: Chain) -> &Behaviour {
        match chain {
            Chain::Full => &self.full,
            Chain::Object => &self.object,
        }
    }
}

/// Returns the figures of a table in which the sensors differ materially.
pub fn differences(table: &Validation) -> Vec<Difference> {
    let mut differences = Vec::new();
    for class in VehicleClass::ALL {
        let figures = |chain| table.figures.iter().find(|row| (row.class, row.chain) == (class, chain));
        let (Some(full), Some(object)) = (figures(Chain::Full), figures(Chain::Object)) else { continue };
        for (row, paint) in table.paints.iter().enumerate() {
            for (column, weather) in table.visibilities_m.iter().zip(&table.rain_mm_per_h).enumerate() {
                for ((figure, full), (_, object)) in full.named().into_iter().zip(object.named()) {
                    let (full, object) = (full[row][column], object[row][column]);
                    if is_material(figure, full, object) {
                        let weather = [*weather.0, *weather.1];
                        differences.push(Difference { class, paint: *paint, weather, figure, full, object });
                    }
                }
            }
        }
    }
    differences
}

/// Returns whether two values of a figure differ materially. The longest time without a track
/// follows from the share of the steps without one, and has no separate criterion.
fn is_material(figure: &str, full: f64, object: f64) -> bool {
    if full == object {
        return false;
    }
    let ratio = full.max(object) / full.min(object);
    // Rounded values are compared: a difference of exactly one control step is not material by its
    // rounding.
    let apart = (full - object).abs() - 1e-9;
    match figure {
        "along-sd-m" => ratio > SD_FACTOR && apart > SD_FLOORS[0],
        "across-sd-m" => ratio > SD_FACTOR && apart > SD_FLOORS[1],
        "speed-sd-mps" => ratio > SD_FACTOR && apart > SD_FLOORS[2],
        "along-time-s" | "across-time-s" | "speed-time-s" => ratio > TIME_FACTOR,
        "missed" | "coasting" => apart > SHARE_FLOOR,
        "longest-gap-s" => false,
        _ => apart > TIME_FLOOR_S,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use closecall_scenarios::source;
    use closecall_sensors::Origin;

    use super::*;

    #[test]
    fn what_is_immaterial_is_so_on_both_sides_of_the_criterion() {
        let both = |figure, full, object| {
            assert_eq!(is_material(figure, full, object), is_material(figure, object, full));
            is_material(figure, full, object)
        };
        // A factor alone, or a difference alone, does not matter.
        assert!(!both("across-sd-m", 0.01, 0.025) && !both("across-sd-m", 0.20, 0.25));
        assert!(both("across-sd-m", 0.03, 0.09) && both("speed-sd-mps", 0.1, 0.2));
        assert!(!both("confirmed-after-s", 0.20, 0.24) && both("confirmed-after-s", 0.20, 0.25));
        assert!(
            both("confirmed-after-s", 0.2, f64::INFINITY) && !both("confirmed-after-s", f64::INFINITY, f64::INFINITY)
        );
        assert!(!both("missed", 0.0, 0.01) && both("missed", 0.0, 0.011) && both("coasting", 0.0, 0.05));
        assert!(!both("along-time-s", 2.0, 5.9) && both("along-time-s", 2.0, 6.1));
        assert!(!both("longest-gap-s", 0.0, 1.0));
    }

    #[test]
    fn the_table_that_ships_is_what_is_measured() {
        let shipped = RearFit::shipped().unwrap().validation.as_ref().unwrap();
        let file = source::load(Path::new("low-thw-overtake"), &[]).unwrap();
        let Origin { command, version, seed, approaches, .. } = shipped.origin.clone();
        let plan = FitPlan { file: &file, seed, approaches, command, version };
        // The nearest of the ranges keeps the measurement short.
        let at = (VehicleClass::Motorcycle, PAINTS[0], WEATHERS[3]);
        let measured = measure(&plan, None, |class, paint, weather| (class, paint, weather) == at).unwrap();
        let table = table(&plan, &measured);
        for chain in [Chain::Full, Chain::Object] {
            let figures = |table: &Validation| {
                table.figures.iter().find(|row| (row.class, row.chain) == (at.0, chain)).unwrap().clone()
            };
            let (shipped, measured) = (figures(shipped), figures(&table));
            for ((name, shipped), (_, measured)) in shipped.named().into_iter().zip(measured.named()) {
                assert!(
                    !is_material(name, shipped[0][3], measured[0][0]),
                    "{chain:?}, {name}: {shipped:?} {measured:?}"
                );
                assert!(
                    (shipped[0][3] - measured[0][0]).abs() < 0.011 || shipped[0][3] == measured[0][0],
                    "{chain:?}, {name}"
                );
            }
        }
    }
}
