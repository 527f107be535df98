//! The labels of a recording: where the other vehicles are.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use closecall_traffic::{Time, VehicleClass};

use super::error::{Origin, ScanFileError, ScanFileProblem};
use super::poses::{Mover, Pose, Poses, WrongMotion, check_motion};
use super::text_table::{TableFormat, TableRow, read_table};

/// Longest time between two labels of a vehicle between which it is interpolated (s).
const LONGEST_GAP: Time = Time::from_ms(500);
/// A table of labels.
const FORMAT: TableFormat = TableFormat {
    columns: &["time_s", "id", "class", "x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m"],
    needed: 9,
    gives: "the labels",
};

/// A vehicle at one time, in the ego's frame at that time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Label {
    /// Time.
    pub time: Time,
    /// Class of the vehicle.
    pub class: VehicleClass,
    /// Centre of its box ahead of the ego's centre, and to the left (m).
    pub at_m: [f64; 2],
    /// Heading relative to the ego's (rad).
    pub heading_rad: f64,
    /// Speed over ground along its heading (m/s).
    pub speed_mps: f64,
    /// Length and width (m).
    pub size_m: [f64; 2],
}

/// The labels of all vehicles.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    /// The names of the vehicles, in order.
    pub names: Vec<String>,
    /// The labels of each vehicle, in order of time.
    of_vehicles: Vec<Vec<Label>>,
}

impl Labels {
    /// Reads a table of labels. `poses` say where the ego is.
    ///
    /// # Errors
    /// [`ScanFileError`] with the line and the column that is wrong, or if the speeds or the headings
    /// of a vehicle contradict its path.
    pub fn read(path: &Path, poses: &Poses) -> Result<Self, ScanFileError> {
        let rows = read_table(path, FORMAT)?;
        let mut vehicles: BTreeMap<String, (Vec<Label>, Vec<&TableRow>)> = BTreeMap::new();
        for row in &rows {
            let id = row.needed_text(1)?;
            let class = row.needed_text(2)?;
            let class = VehicleClass::ALL.into_iter().find(|candidate| candidate.name() == class).ok_or_else(|| {
                let names = VehicleClass::ALL.map(|candidate| format!("`{}`", candidate.name())).join(", ");
                row.place(2).error(ScanFileProblem::UnknownWord { text: class.to_owned(), allowed: names })
            })?;
            let within = |column: usize, least: f64, most: f64, allowed: &'static str| match row.number(column)? {
                value if (least..=most).contains(&value) => Ok(value),
                value => Err(row.place(column).error(ScanFileProblem::OutOfRange { value, allowed })),
            };
            let label = Label {
                time: row.time(0)?,
                class,
                at_m: [row.number(3)?, row.number(4)?],
                heading_rad: within(5, -TAU, TAU, "an angle from -2π to 2π rad")?,
                speed_mps: row.number(6)?,
                size_m: [
                    within(7, 0.1, 40.0, "a length from 0.1 to 40 m")?,
                    within(8, 0.1, 5.0, "a width from 0.1 to 5 m")?,
                ],
            };
            let (of_vehicle, lines) = vehicles.entry(id.to_owned()).or_default();
            if let Some(previous) = of_vehicle.last().filter(|previous| previous.time >= label.time) {
                return Err(row.place(0).error(ScanFileProblem::TimeGoesBack {
                    time_s: label.time.s(),
                    previous_s: previous.time.s(),
                    of: format!(" of `{id}`"),
                }));
            }
            of_vehicle.push(label);
            lines.push(row);
        }
        for (name, (labels, lines)) in &vehicles {
            check(name, labels, poses).map_err(|wrong| match wrong {
                WrongMotion::All(problem) => Origin::file(path).error(problem),
                WrongMotion::Jump { pose, quantity, problem } => lines[pose].place(3 + quantity).error(problem),
            })?;
        }
        let (names, of_vehicles) = vehicles.into_iter().map(|(name, (labels, _))| (name, labels)).unzip();
        Ok(Self { names, of_vehicles })
    }

    /// Returns the times of the first and of the last label (s).
    pub fn span_s(&self) -> [f64; 2] {
        let times = || self.of_vehicles.iter().flatten().map(|label| label.time);
        [times().min(), times().max()].map(|time| time.map_or(0.0, Time::s))
    }

    /// Returns whether the labels of some vehicle reach from before `time` to after it.
    pub fn cover(&self, time: Time) -> bool {
        self.of_vehicles.iter().any(|labels| {
            labels.first().is_some_and(|first| first.time <= time)
                && labels.last().is_some_and(|last| last.time >= time)
        })
    }

    /// Returns the vehicles that are labelled at `time`, with their indices in `names`.
    pub fn at(&self, time: Time) -> impl Iterator<Item = (usize, Label)> {
        self.of_vehicles.iter().enumerate().filter_map(move |(index, labels)| Some((index, at(labels, time)?)))
    }
}

/// Refuses the speeds and headings of a vehicle that contradict its path.
fn check(name: &str, labels: &[Label], poses: &Poses) -> Result<(), WrongMotion> {
    let pose = |label: &Label| {
        let (at_m, yaw_rad) = poses.unmoved(label.time, label.at_m)?;
        let yaw_rad = yaw_rad + label.heading_rad;
        Some(Pose { time: label.time, at_m, yaw_rad, speed_mps: label.speed_mps, ..Pose::default() })
    };
    let (numbers, path): (Vec<usize>, Vec<Pose>) =
        labels.iter().enumerate().filter_map(|(number, label)| Some((number, pose(label)?))).unzip();
    let needed = [
        "m in the ego's frame (x ahead, y to the left) and m/s over ground are needed",
        "they are in rad relative to the ego's, counter-clockwise",
    ];
    check_motion(Mover { name: &format!("`{name}`"), needed, turns: false }, &path).map_err(|wrong| match wrong {
        WrongMotion::Jump { pose, quantity, problem } => WrongMotion::Jump { pose: numbers[pose], quantity, problem },
        all @ WrongMotion::All(_) => all,
    })
}

/// Returns the label at a time, interpolated between two that are near enough.
fn at(labels: &[Label], time: Time) -> Option<Label> {
    let next = labels.partition_point(|label| label.time < time);
    let after = labels.get(next)?;
    if after.time == time {
        return Some(*after);
    }
    let before = labels.get(next.checked_sub(1)?)?;
    let gap = after.time - before.time;
    let share = (time - before.time).s() / gap.s();
    let mixed = |a: f64, b: f64| a + share * (b - a);
    (gap <= LONGEST_GAP).then(|| Label {
        time,
        at_m: [0, 1].map(|axis| mixed(before.at_m[axis], after.at_m[axis])),
        heading_rad: mixed(before.heading_rad, after.heading_rad),
        speed_mps: mixed(before.speed_mps, after.speed_mps),
        ..*before
    })
}
