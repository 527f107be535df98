//! The fit of the rear object-level sensor to the full chain. It holds the distance at which a
//! vehicle is confirmed and the distance at which it is classified as a vehicle, by its class,
//! paint, plate and body shape and by the extinction of the air. It also holds the errors of the
//! vehicle's track.
//!
//! ```text
//!  full chain ─▶ approaches ─▶ `perception::fit` ─▶ data/rear-object.toml ─▶ RearFit ─▶ ObjectSensor
//! ```
//!
//! A grid over paint and extinction holds the ranges. Between its points they are interpolated
//! linearly in the logarithm of the paint's reflectivity and in the extinction. Beyond the grid,
//! its border holds. A coarser grid of the same kind holds the ratios of body shapes, and further
//! grids hold the errors ([`ErrorGrids`]).
//!
//! ```text
//!   ego ▕ seen without interruption ▏ seen at a share of the distances ▏ never seen
//!       0                           range                 intermittent · range
//! ```
//!
//! The LiDAR sees only lamps and plate of a distant dark vehicle. Whether enough of its beams return
//! enough light depends on where they hit, and so on the distance. The full chain has a track at some
//! distances, loses it, and has it again. It depends on the pitch of the ego, too: 0.008° move the
//! beams by 0.01 m at 100 m, and the range of a dark car by 5 m ([`PitchedShapes`]).

use std::collections::BTreeMap;
use std::sync::LazyLock;

use closecall_traffic::{Appearance, Environment, Plate, Vehicle, VehicleClass, maths};
use serde::{Deserialize, Serialize};

use super::errors::{ErrorGrids, FittedErrors};
use super::validated::Validation;
use crate::lidar::extinction_per_m;

/// The text of the fit that ships.
const SHIPPED: &str = include_str!("../../data/rear-object.toml");

static FIT: LazyLock<Result<RearFit, FitError>> = LazyLock::new(|| RearFit::parse(SHIPPED));

/// A file of a fit that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("failed to read the fit of the object-level sensor: {0}")]
pub struct FitError(String);

/// A fit of the rear object-level sensor to the full chain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RearFit {
    /// Where the fit comes from.
    pub origin: Origin,
    /// Score of the true class, by class.
    pub class_confidence: ByClass,
    /// Standard deviation of the logarithm of the range of one vehicle under other noise of the
    /// sensors (-).
    pub range_spread: f64,
    /// Reflectivities of the paint of the grid (-), in rising order.
    pub paints: Vec<f64>,
    /// Extinctions of the grid (1/m), in rising order.
    pub extinctions_per_m: Vec<f64>,
    /// Ranges of each class and plate.
    pub range: Vec<RangeGrid>,
    /// Ranges of body shapes, as ratios to the ranges of their class.
    pub shapes: ShapeRatios,
    /// The ranges of body shapes under pitches of the ego, in rising order. If there are some, they
    /// hold in place of `shapes` and `range_spread`. Between them, ranges are interpolated linearly;
    /// beyond them, the outermost ranges hold.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pitched: Vec<PitchedShapes>,
    /// Errors and losses of the measurements.
    pub errors: ErrorGrids,
    /// Comparison of the sensor's tracks with the tracks of the full chain, if it was measured. No
    /// sensor reads it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation: Option<Validation>,
}

/// Where a fit comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Origin {
    /// The command that writes the file.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// The scenario whose sensors were fitted.
    pub scenario: String,
    /// The seed.
    pub seed: u64,
    /// Number of approaches of each point of the grid.
    pub approaches: u64,
}

/// A value for each class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ByClass {
    /// The value of cars.
    pub car: f64,
    /// The value of trucks.
    pub truck: f64,
    /// The value of motorcycles.
    pub motorcycle: f64,
}

/// The ranges of vehicles of one class with plates in one state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RangeGrid {
    /// The class.
    pub class: VehicleClass,
    /// The state of the plates.
    pub plate: Plate,
    /// For each paint, the range in each extinction (m).
    pub range_m: Vec<Vec<f64>>,
    /// For each paint, the distance in each extinction from which on a vehicle is classified as one
    /// (m): at most the range.
    pub class_range_m: Vec<Vec<f64>>,
}

/// The ranges of body shapes, as ratios to the ranges of the first shape of their class, and how
/// each shape is seen beyond its range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct ShapeRatios {
    /// Reflectivities of the paint of the grid (-), in rising order.
    pub paints: Vec<f64>,
    /// Extinctions of the grid (1/m), in rising order.
    pub extinctions_per_m: Vec<f64>,
    /// For each shape and paint, the ratio of the ranges in each extinction (-); 1 if a shape is
    /// absent.
    pub range: BTreeMap<String, Vec<Vec<f64>>>,
    /// For each shape and paint, the ratio of the distances from which on a vehicle is classified
    /// as one (-); 1 if a shape is absent.
    pub class_range: BTreeMap<String, Vec<Vec<f64>>>,
    /// For each shape and paint, the ratio of the largest distance at which a vehicle is seen to its
    /// range, within which it is seen without interruption, in each extinction (-); 1 if a shape is
    /// absent.
    pub intermittent: BTreeMap<String, Vec<Vec<f64>>>,
    /// For each shape and paint, the share of the distances between these two at which a vehicle is
    /// seen (-); 0 if a shape is absent.
    pub intermittent_share: BTreeMap<String, Vec<Vec<f64>>>,
}

/// The ranges of body shapes under one pitch of the ego, as ratios to the ranges of the first shape
/// of their class without pitch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct PitchedShapes {
    /// The pitch, positive nose down (rad).
    pub pitch_rad: f64,
    /// Reflectivities of the paint of the grid (-), in rising order.
    pub paints: Vec<f64>,
    /// Extinctions of the grid (1/m), in rising order.
    pub extinctions_per_m: Vec<f64>,
    /// For each shape and paint, the ratio of the ranges in each extinction (-); 1 if a shape is
    /// absent.
    pub range: BTreeMap<String, Vec<Vec<f64>>>,
    /// For each shape and paint, the ratio of the distances from which on a vehicle is classified
    /// as one (-); 1 if a shape is absent.
    pub class_range: BTreeMap<String, Vec<Vec<f64>>>,
    /// For each shape and paint, the standard deviation of the logarithm of the range over places in
    /// the lane and noise of the sensors (-); 0 if a shape is absent.
    pub spread: BTreeMap<String, Vec<Vec<f64>>>,
}

/// The distances at which one vehicle is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TargetRanges {
    /// Distance within which the vehicle is seen in all scans, or in all scans of one side of the
    /// mirror (m).
    pub(super) range_m: f64,
    /// Distance up to which its class is known (m).
    pub(super) class_range_m: f64,
    /// Distance beyond which it is never seen (m): at least the range.
    pub(super) intermittent_m: f64,
    /// Share of the distances between the range and `intermittent_m` at which it is seen (-).
    pub(super) intermittent_share: f64,
}

impl TargetRanges {
    /// The distances before they are known.
    pub(super) const UNKNOWN: Self =
        Self { range_m: f64::NAN, class_range_m: f64::NAN, intermittent_m: f64::NAN, intermittent_share: 0.0 };

    /// Returns the distances of a vehicle that is never seen beyond its range, and whose class is
    /// known up to `class_range_m` (m).
    pub(super) fn without_interruption(range_m: f64, class_range_m: f64) -> Self {
        Self { range_m, class_range_m, intermittent_m: range_m, intermittent_share: 0.0 }
    }

    /// Returns the distances, multiplied by a factor (-).
    pub(super) fn scaled(self, factor: f64) -> Self {
        Self {
            range_m: factor * self.range_m,
            class_range_m: factor * self.class_range_m,
            intermittent_m: factor * self.intermittent_m,
            ..self
        }
    }

    /// Returns the distances at this share of the way from these to others (-).
    fn on_the_way_to(self, to: &Self, share: f64) -> Self {
        let between = |from: f64, to: f64| if share == 0.0 { from } else { from + share * (to - from) };
        Self {
            range_m: between(self.range_m, to.range_m),
            class_range_m: between(self.class_range_m, to.class_range_m),
            intermittent_m: between(self.intermittent_m, to.intermittent_m),
            intermittent_share: between(self.intermittent_share, to.intermittent_share),
        }
    }
}

/// The distances at which one vehicle is seen, over the pitch of the ego (rad), in rising order.
#[derive(Clone, Debug, Default)]
pub(super) struct PitchedRanges(Vec<(f64, TargetRanges)>);

impl PitchedRanges {
    /// Returns distances that do not depend on the pitch.
    pub(super) fn constant(ranges: TargetRanges) -> Self {
        Self(vec![(0.0, ranges)])
    }

    /// Returns the distances after a change of each.
    pub(super) fn map(self, change: impl Fn(TargetRanges) -> TargetRanges) -> Self {
        Self(self.0.into_iter().map(|(pitch_rad, ranges)| (pitch_rad, change(ranges))).collect())
    }

    /// Returns the distances under a pitch (rad); none are known before the first.
    pub(super) fn at(&self, pitch_rad: f64) -> TargetRanges {
        let next = self.0.partition_point(|(knot_rad, _)| *knot_rad <= pitch_rad);
        match (self.0.get(next.saturating_sub(1)), self.0.get(next)) {
            (Some((from_rad, from)), Some((to_rad, to))) if next > 0 => {
                from.on_the_way_to(to, (pitch_rad - from_rad) / (to_rad - from_rad))
            }
            (Some((_, outermost)), _) => *outermost,
            (None, _) => TargetRanges::UNKNOWN,
        }
    }
}

impl ByClass {
    /// Returns the value of a class.
    pub const fn of(&self, class: VehicleClass) -> f64 {
        match class {
            VehicleClass::Car => self.car,
            VehicleClass::Truck => self.truck,
            VehicleClass::Motorcycle => self.motorcycle,
        }
    }
}

impl RearFit {
    /// Returns the fit that ships.
    ///
    /// # Errors
    /// [`FitError`] if the file is wrong, which is a defect of the program.
    pub fn shipped() -> Result<&'static Self, FitError> {
        FIT.as_ref().map_err(Clone::clone)
    }

    /// Parses and checks the text of a fit.
    ///
    /// # Errors
    /// [`FitError`] with the key, and what is allowed.
    pub fn parse(text: &str) -> Result<Self, FitError> {
        let fit: Self = toml::from_str(text).map_err(|error| FitError(error.to_string()))?;
        fit.check().map_err(FitError)?;
        Ok(fit)
    }

    fn check(&self) -> Result<(), String> {
        within("range-spread", self.range_spread, [0.0, 1.0])?;
        for class in VehicleClass::ALL {
            within(&format!("class-confidence.{}", class.name()), self.class_confidence.of(class), [0.25, 1.0])?;
            if !self.range.iter().any(|grid| grid.class == class && grid.plate == Plate::Clean) {
                return Err(format!("`range` lacks a {} with the plate `clean`", class.name()));
            }
        }
        let knots = [&*self.paints, &*self.extinctions_per_m];
        check_knots("", knots)?;
        for (index, grid) in self.range.iter().enumerate() {
            check_grid(&format!("range[{index}].range-m"), &grid.range_m, knots, [1.0, 500.0])?;
            check_grid(&format!("range[{index}].class-range-m"), &grid.class_range_m, knots, [1.0, 500.0])?;
        }
        self.shapes.check("shapes.")?;
        for (index, pitched @ PitchedShapes { pitch_rad, .. }) in self.pitched.iter().enumerate() {
            let key = format!("pitched[{index}].pitch-rad");
            within(&key, *pitch_rad, [-0.1, 0.1])?;
            let is_rising = index == 0 || self.pitched[index - 1].pitch_rad < *pitch_rad;
            if !is_rising {
                return Err(format!("`{key}` is {pitch_rad}, but a number above the one before is needed"));
            }
            pitched.check(&format!("pitched[{index}]."))?;
        }
        self.errors.check()?;
        self.validation.as_ref().map_or(Ok(()), Validation::check)
    }

    /// Returns the range of a usual car on a clear day (m): grey, with a clean plate. Like the
    /// grid, it has decimetres.
    pub(super) fn usual_m(&self) -> f64 {
        let clear_per_m = extinction_per_m(&Environment::CLEAR_DAY);
        let [range_m, _] = self.grid_m(VehicleClass::Car, Plate::Clean, [USUAL_PAINT, clear_per_m]);
        (10.0 * range_m).round() / 10.0
    }

    /// Returns the errors of a usual car on a clear day.
    pub(super) fn usual_errors(&self) -> FittedErrors {
        let usual = Vehicle::typical(VehicleClass::Car);
        self.errors.at(usual.class, &usual.appearance, &Environment::CLEAR_DAY)
    }

    /// Returns the origin of the fit, for reports.
    pub fn origin_text(&self) -> String {
        let Origin { version, scenario, seed, approaches, .. } = &self.origin;
        format!("fit of {version} to the full chain of {scenario}, seed {seed}, {approaches} approaches of each point")
    }

    /// Returns the distance up to which a vehicle is seen (m).
    pub fn range_m(&self, class: VehicleClass, appearance: &Appearance, environment: &Environment) -> f64 {
        self.ranges(class, appearance, environment).range_m
    }

    /// Returns the distances at which a vehicle is seen, over the pitch of the ego. They are
    /// multiplied by `factor` (-), and deviate by `deviation` standard deviations.
    pub(super) fn pitched_ranges(
        &self,
        class: VehicleClass,
        appearance: &Appearance,
        environment: &Environment,
        [factor, deviation]: [f64; 2],
    ) -> PitchedRanges {
        let scaled = |ranges: TargetRanges, spread: f64| ranges.scaled(factor * maths::exp(spread * deviation));
        if self.pitched.is_empty() {
            return PitchedRanges::constant(scaled(self.ranges(class, appearance, environment), self.range_spread));
        }
        let at = [appearance.paint_reflectivity, extinction_per_m(environment)];
        let [range_m, class_range_m] = self.grid_m(class, appearance.plate, at);
        let ranges = |pitched: &PitchedShapes| {
            let [range, class_range, spread] = pitched.at(appearance.body_shape.name(), at);
            let (range_m, class_range_m) = (range_m * range, class_range_m * class_range);
            let is_known_at_once = class_range_m >= KNOWN_AT_ONCE_SHARE * range_m;
            let class_range_m = if is_known_at_once { class_range_m.max(range_m) } else { class_range_m };
            scaled(TargetRanges::without_interruption(range_m, class_range_m), spread)
        };
        PitchedRanges(self.pitched.iter().map(|pitched| (pitched.pitch_rad, ranges(pitched))).collect())
    }

    /// Returns the distances at which a vehicle is seen.
    fn ranges(&self, class: VehicleClass, appearance: &Appearance, environment: &Environment) -> TargetRanges {
        let at = [appearance.paint_reflectivity, extinction_per_m(environment)];
        let [range_m, class_range_m] = self.grid_m(class, appearance.plate, at);
        let ShapeRatios { paints, extinctions_per_m, range, class_range, intermittent, intermittent_share } =
            &self.shapes;
        let shape = appearance.body_shape.name();
        let of_shape = |grids: &BTreeMap<String, Vec<Vec<f64>>>, absent: f64| {
            grids.get(shape).map_or(absent, |grid| interpolated([paints, extinctions_per_m], grid, at))
        };
        let (range_m, class_range_m) = (range_m * of_shape(range, 1.0), class_range_m * of_shape(class_range, 1.0));
        let intermittent_m = range_m * of_shape(intermittent, 1.0);
        // If the class is known within the whole range, it is also known beyond.
        let is_known_at_once = class_range_m >= KNOWN_AT_ONCE_SHARE * range_m;
        TargetRanges {
            range_m,
            class_range_m: if is_known_at_once { class_range_m.max(intermittent_m) } else { class_range_m },
            intermittent_m,
            intermittent_share: of_shape(intermittent_share, 0.0),
        }
    }

    /// Returns the ranges of the first body shape of a class, of a paint in air of an extinction
    /// (1/m).
    fn grid_m(&self, class: VehicleClass, plate: Plate, at: [f64; 2]) -> [f64; 2] {
        let grid_with = |plate| self.range.iter().find(|grid| grid.class == class && grid.plate == plate);
        // A motorcycle has no plate at its front, so that its state does not matter.
        let Some(grid) = grid_with(plate).or_else(|| grid_with(Plate::Clean)) else { return [0.0; 2] };
        let knots = [&*self.paints, &*self.extinctions_per_m];
        [interpolated(knots, &grid.range_m, at), interpolated(knots, &grid.class_range_m, at)]
    }
}

impl ShapeRatios {
    /// Checks the ratios, whose keys begin with `prefix`.
    fn check(&self, prefix: &str) -> Result<(), String> {
        let Self { paints, extinctions_per_m, range, class_range, intermittent, intermittent_share } = self;
        let knots = [&**paints, &**extinctions_per_m];
        check_knots(prefix, knots)?;
        for (name, ratios, bounds) in [
            ("range", range, [0.05, 20.0]),
            ("class-range", class_range, [0.05, 20.0]),
            ("intermittent", intermittent, [1.0, 50.0]),
            ("intermittent-share", intermittent_share, [0.0, 1.0]),
        ] {
            for (shape, ratios) in ratios {
                check_grid(&format!("{prefix}{name}.{shape}"), ratios, knots, bounds)?;
            }
        }
        Ok(())
    }
}

impl PitchedShapes {
    /// Checks the ratios, whose keys begin with `prefix`.
    fn check(&self, prefix: &str) -> Result<(), String> {
        let Self { pitch_rad: _, paints, extinctions_per_m, range, class_range, spread } = self;
        let knots = [&**paints, &**extinctions_per_m];
        check_knots(prefix, knots)?;
        for (name, values, bounds) in
            [("range", range, [0.05, 20.0]), ("class-range", class_range, [0.05, 20.0]), ("spread", spread, [0.0, 1.0])]
        {
            for (shape, values) in values {
                check_grid(&format!("{prefix}{name}.{shape}"), values, knots, bounds)?;
            }
        }
        Ok(())
    }

    /// Returns the ratios of range and class range, and the spread, of a shape with this paint (-)
    /// in air of this extinction (1/m).
    fn at(&self, shape: &str, at: [f64; 2]) -> [f64; 3] {
        let knots = [&*self.paints, &*self.extinctions_per_m];
        [(&self.range, 1.0), (&self.class_range, 1.0), (&self.spread, 0.0)]
            .map(|(grids, absent)| grids.get(shape).map_or(absent, |grid| interpolated(knots, grid, at)))
    }
}

/// Returns the value of a grid. It has a row for each paint and a column for each extinction.
pub(super) fn interpolated(
    [paints, extinctions_per_m]: [&[f64]; 2],
    grid: &[Vec<f64>],
    [paint, extinction_per_m]: [f64; 2],
) -> f64 {
    let logs: Vec<f64> = paints.iter().map(|paint| maths::ln(*paint)).collect();
    let (row, row_share) = place(&logs, maths::ln(paint));
    let (column, column_share) = place(extinctions_per_m, extinction_per_m);
    let in_row = |row: usize| {
        let values = &grid[row.min(paints.len() - 1)];
        let next = (column + 1).min(values.len() - 1);
        values[column] + column_share * (values[next] - values[column])
    };
    in_row(row) + row_share * (in_row(row + 1) - in_row(row))
}

/// Share of the range from which on a class range counts as the whole range (-): the means of few
/// approaches scatter by some 2 %.
const KNOWN_AT_ONCE_SHARE: f64 = 0.98;

/// Reflectivity of the paint of a usual car (-), and of a vehicle whose paint is not given.
const USUAL_PAINT: f64 = 0.5;

/// Returns the index of the last knot at or below `value`, and the share of the way to the next
/// knot.
fn place(knots: &[f64], value: f64) -> (usize, f64) {
    let index = knots.partition_point(|knot| *knot <= value).saturating_sub(1);
    match knots.get(index + 1) {
        Some(next) => (index, ((value - knots[index]) / (next - knots[index])).clamp(0.0, 1.0)),
        None => (index, 0.0),
    }
}

fn within(key: &str, value: f64, [low, high]: [f64; 2]) -> Result<(), String> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(format!("`{key}` is {value}, but a number from {low} to {high} is needed"))
}

fn rising(key: &str, values: &[f64], range: [f64; 2]) -> Result<(), String> {
    values.iter().try_for_each(|value| within(key, *value, range))?;
    if values.len() > 1 && values.windows(2).all(|pair| pair[0] < pair[1]) {
        return Ok(());
    }
    Err(format!("`{key}` needs at least two numbers in rising order"))
}

pub(super) fn check_knots(prefix: &str, [paints, extinctions_per_m]: [&[f64]; 2]) -> Result<(), String> {
    rising(&format!("{prefix}paints"), paints, [0.01, 1.0])?;
    rising(&format!("{prefix}extinctions-per-m"), extinctions_per_m, [0.0, 1.0])
}

pub(super) fn check_grid(
    key: &str,
    rows: &[Vec<f64>],
    [paints, extinctions]: [&[f64]; 2],
    range: [f64; 2],
) -> Result<(), String> {
    if rows.len() != paints.len() || rows.iter().any(|row| row.len() != extinctions.len()) {
        return Err(format!("`{key}` needs a row for each of `paints` with a number for each of `extinctions-per-m`"));
    }
    rows.iter().flatten().try_for_each(|value| within(key, *value, range))
}

#[cfg(test)]
mod tests {
    use closecall_traffic::Parameters;

    use super::super::config::ObjectSensorConfig;
    use super::*;

    #[test]
    fn the_fit_that_ships_is_read_and_names_its_origin() {
        let fit = RearFit::shipped().unwrap();
        assert!(fit.origin.command.contains("fit-object-sensors") && !fit.origin.version.is_empty());
        assert_eq!(RearFit::parse(&toml::to_string(fit).unwrap()).as_ref(), Ok(fit));
    }

    #[test]
    fn the_sensor_has_the_figures_of_the_file() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/rear-object.toml");
        let file: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
        let model = ObjectSensorConfig::default().check_rear_object(&Parameters::default()).unwrap();
        let fit = model.fit.unwrap();
        let number = |value: &toml::Value| value.as_float().unwrap();
        assert_eq!(number(&file["errors"]["truck"]["slow-across-m"][1][2]), fit.errors.truck.slow_across_m[1][2]);
        assert_eq!(number(&file["class-confidence"]["car"]), model.class_confidence.car);
        let mut other = fit.clone();
        other.range[0].range_m.iter_mut().for_each(|row| row[0] = 50.0);
        assert_eq!(model.with_fit(Box::leak(Box::new(other))).range_m, 50.0);
    }

    /// Returns shapes under these pitches (rad), under which saloons have these ratios of the ranges
    /// (-).
    fn pitched(pitches: &[(f64, f64)]) -> Vec<PitchedShapes> {
        let with_ratio = |(pitch_rad, ratio): &(f64, f64)| {
            let grid = |value| BTreeMap::from([("saloon".to_owned(), vec![vec![value; 2]; 2])]);
            PitchedShapes {
                pitch_rad: *pitch_rad,
                paints: vec![0.1, 0.5],
                extinctions_per_m: vec![0.0, 0.1],
                range: grid(*ratio),
                class_range: BTreeMap::new(),
                spread: grid(0.1),
            }
        };
        pitches.iter().map(with_ratio).collect()
    }

    #[test]
    fn ranges_follow_the_pitch_of_the_ego() {
        let mut fit = RearFit::shipped().unwrap().clone();
        let saloon = Vehicle::typical(VehicleClass::Car);
        let range_m = |fit: &RearFit, pitch_rad, deviation| {
            let environment = Environment::CLEAR_DAY;
            let pitched = fit.pitched_ranges(saloon.class, &saloon.appearance, &environment, [2.0, deviation]);
            0.5 * pitched.at(pitch_rad).range_m
        };
        fit.pitched.clear();
        let level_m = range_m(&fit, 0.0, 0.0);
        assert_eq!([-1.0, 1.0].map(|pitch_rad| range_m(&fit, pitch_rad, 0.0)), [level_m; 2]);
        assert!((range_m(&fit, 0.0, 2.0) / level_m - maths::exp(2.0 * fit.range_spread)).abs() < 1e-9);
        fit.pitched = pitched(&[(-1e-3, 0.8), (0.0, 1.0), (1e-3, 1.1), (2e-3, 1.5)]);
        assert!((range_m(&fit, 1e-3, -2.0) / level_m - 1.1 * maths::exp(-0.2)).abs() < 1e-9);
        for (pitch_rad, ratio) in
            [(-1.0, 0.8), (-1e-3, 0.8), (-5e-4, 0.9), (0.0, 1.0), (5e-4, 1.05), (1.5e-3, 1.3), (2e-3, 1.5), (1.0, 1.5)]
        {
            let found = range_m(&fit, pitch_rad, 0.0) / level_m;
            assert!((found - ratio).abs() < 1e-9, "{pitch_rad} rad: {found} instead of {ratio}");
        }
    }

    #[test]
    fn wrong_files_are_refused_with_key_and_range() {
        let fit = RearFit::shipped().unwrap();
        let refused = |change: &dyn Fn(&mut RearFit)| {
            let mut wrong = fit.clone();
            change(&mut wrong);
            RearFit::parse(&toml::to_string(&wrong).unwrap()).unwrap_err().to_string()
        };
        for (message, key, range) in [
            (refused(&|fit| fit.range_spread = f64::NAN), "range-spread", "0 to 1"),
            (refused(&|fit| fit.errors.car.lost_share[0][0] = 2.0), "errors.car.lost-share", "0 to 1"),
            (refused(&|fit| fit.class_confidence.truck = 1.5), "class-confidence.truck", "0.25 to 1"),
            (refused(&|fit| fit.paints.reverse()), "paints", "rising order"),
            (refused(&|fit| fit.range[0].range_m[0][0] = 0.0), "range[0].range-m", "1 to 500"),
            (refused(&|fit| drop(fit.range[0].range_m.pop())), "range[0].range-m", "a row for each of `paints`"),
            (refused(&|fit| fit.range[1].class_range_m[0][0] = 0.0), "range[1].class-range-m", "1 to 500"),
            (refused(&|fit| fit.shapes.paints.reverse()), "shapes.paints", "rising order"),
            (
                refused(&|fit| fit.shapes.class_range.get_mut("pickup").unwrap()[0][0] = -1.0),
                "shapes.class-range.pickup",
                "0.05 to 20",
            ),
            (
                refused(&|fit| {
                    let grid = vec![vec![1.5; fit.shapes.extinctions_per_m.len()]; fit.shapes.paints.len()];
                    fit.shapes.intermittent_share.insert("suv".to_owned(), grid);
                }),
                "shapes.intermittent-share.suv",
                "0 to 1",
            ),
            (refused(&|fit| fit.range.retain(|grid| grid.class != VehicleClass::Truck)), "range", "truck"),
            (
                refused(&|fit| fit.pitched = pitched(&[(1e-3, 1.0), (-1e-3, 1.0)])),
                "pitched[1].pitch-rad",
                "above the one before",
            ),
            (refused(&|fit| fit.pitched = pitched(&[(0.2, 1.0)])), "pitched[0].pitch-rad", "-0.1 to 0.1"),
            (refused(&|fit| fit.pitched = pitched(&[(1e-3, 50.0)])), "pitched[0].range.saloon", "0.05 to 20"),
        ] {
            assert!(message.contains(key) && message.contains(range), "{message}");
        }
        let text = toml::to_string(fit).unwrap();
        assert!(RearFit::parse(&format!("colour = 1\n{text}")).unwrap_err().to_string().contains("colour"));
    }

    #[test]
    fn ranges_lie_between_the_points_of_the_grid_and_end_at_its_border() {
        let fit = RearFit::shipped().unwrap();
        let at = |paint, extinction| fit.grid_m(VehicleClass::Car, Plate::Clean, [paint, extinction])[0];
        let [low, high] = [fit.paints[1], fit.paints[2]];
        let first = fit.extinctions_per_m[0];
        let between = at((low * high).sqrt(), first);
        assert!((between - 0.5 * (at(low, first) + at(high, first))).abs() < 1e-9);
        assert_eq!(at(1e-6, first), at(fit.paints[0], first));
        assert_eq!(at(1.0, 10.0), *fit.range[0].range_m.last().unwrap().last().unwrap());
    }
}
