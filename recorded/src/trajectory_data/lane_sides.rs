//! What vehicles beside each other show of lanes that a file counts from the right: the width of the
//! lanes, and whether the counts agree with the positions.
//!
//! ```text
//!   index 1 ────■───────▶       index 0 ────■───────▶
//!   index 0 ──────■─────▶       index 1 ──────■─────▶
//!   as counted from the right   mirrored, or a network of left-hand traffic
//! ```
//!
//! SUMO's lane 0 and Vissim's lane 1 are the rightmost lanes of right-hand traffic (Eclipse SUMO,
//! documentation of network files; PTV Vissim, help on lanes). Networks of left-hand traffic count from
//! the left. No file states which one it is.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::{Time, maths};

use super::error::TrajectoryFileProblem;
use super::markings::LANE_WIDTHS_M;
use super::reference_line::Point;

/// Longest distance along the road at which two vehicles show the width of their lanes (m): a bend
/// of a motorway departs by less than a decimetre from its tangent.
const BESIDE_M: f64 = 30.0;
/// Number of comparisons after which the lanes are known.
const ENOUGH: usize = 20_000;
/// Number of later vehicles of the same instant with which a vehicle is compared.
const COMPARED: usize = 8;
/// Largest number of rows that are held. Beyond it, the earliest instant is left out: rows in the
/// order of time need one instant, and rows in the order of vehicles need all.
const MOST_HELD: usize = 1 << 18;

/// Least number of comparisons, and of pairs of vehicles, that contradict the count of the lanes.
const LEAST_COMPARISONS: usize = 20;
const LEAST_PAIRS: usize = 3;
/// Share of the comparisons above which the count is contradicted (-): vehicles in a bend, or between
/// two lanes, may seem to be on the other side. An assumption with a plausible range of 0.6 to 0.95.
const CONTRADICTED: f64 = 0.8;

/// A vehicle beside others.
pub(super) struct Beside {
    pub(super) vehicle: u32,
    /// Edge or link, on which lanes have one count.
    pub(super) road: String,
    /// Index of its lane, counted from the right.
    pub(super) index: i64,
    pub(super) point: Point,
    pub(super) heading_rad: f64,
}

/// What vehicles beside each other show of the lanes.
#[derive(Default)]
pub(super) struct LaneSides {
    /// The vehicles of each time.
    beside: BTreeMap<Time, Vec<Beside>>,
    held: usize,
    /// Lateral distances of vehicles whose lanes are on the side that their indices say, and on the
    /// other one (m).
    agreeing_m: Vec<f64>,
    contradicting_m: Vec<f64>,
    contradicting_pairs: BTreeSet<[u32; 2]>,
}

impl LaneSides {
    /// Compares a vehicle with those in the neighbouring lanes at the same time.
    pub(super) fn add(&mut self, time: Time, vehicle: Beside) {
        if self.agreeing_m.len() + self.contradicting_m.len() >= ENOUGH {
            self.beside.clear();
            return;
        }
        if self.held >= MOST_HELD {
            self.held -= self.beside.pop_first().map_or(0, |(_, earliest)| earliest.len());
        }
        let beside = self.beside.entry(time).or_default();
        for other in beside.iter().rev().take(COMPARED) {
            let (dx, dy) = (vehicle.point.0 - other.point.0, vehicle.point.1 - other.point.1);
            let (cos, sin) = (maths::cos(vehicle.heading_rad), maths::sin(vehicle.heading_rad));
            let (along_m, left_m) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let is_beside = other.road == vehicle.road && along_m.abs() < BESIDE_M;
            if !is_beside || !LANE_WIDTHS_M.contains(&left_m.abs()) {
                continue;
            }
            let (step, expected) = (vehicle.index.saturating_sub(other.index), if left_m > 0.0 { 1 } else { -1 });
            if step == expected {
                self.agreeing_m.push(left_m.abs());
            } else if step == -expected {
                self.contradicting_m.push(left_m.abs());
                let pair = [vehicle.vehicle.min(other.vehicle), vehicle.vehicle.max(other.vehicle)];
                self.contradicting_pairs.insert(pair);
            }
        }
        beside.push(vehicle);
        self.held += 1;
    }

    /// Returns the lane width (m), if vehicles drive beside each other.
    pub(super) fn lane_width_m(&self) -> Option<f64> {
        let is_reversed = self.contradicting_m.len() > self.agreeing_m.len();
        let mut widths_m = if is_reversed { self.contradicting_m.clone() } else { self.agreeing_m.clone() };
        let middle = widths_m.len() / 2;
        (!widths_m.is_empty()).then(|| *widths_m.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Checks that the lanes are counted from the right, after the positions are mirrored if
    /// `is_mirrored`.
    ///
    /// # Errors
    /// Most vehicles beside each other contradict the count.
    pub(super) fn check(&self, is_mirrored: bool) -> Result<(), TrajectoryFileProblem> {
        let comparisons = self.agreeing_m.len() + self.contradicting_m.len();
        let contradicting = if is_mirrored { self.agreeing_m.len() } else { self.contradicting_m.len() };
        let share = contradicting as f64 / comparisons.max(1) as f64;
        let has_pairs = is_mirrored || self.contradicting_pairs.len() >= LEAST_PAIRS;
        if comparisons >= LEAST_COMPARISONS && has_pairs && share > CONTRADICTED {
            return Err(TrajectoryFileProblem::IndexAgainstPosition { percent: 100.0 * share, comparisons });
        }
        Ok(())
    }
}
