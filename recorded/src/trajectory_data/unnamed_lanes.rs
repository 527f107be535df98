//! The axis and the lane width of a road whose rows name no lanes, from all of its vehicles.
//!
//! ```text
//!   1. movements     ──╮  ──╮  ──╮      most vehicles move alike from a section to the next one:
//!                      ╰─   ╰─   ╰─     the line bends there, and not the vehicles
//!   2. lanes         ░░▓▓░░▓▓░░▓▓░░     positions repeat with the width of a lane
//!   3. axis          as for named lanes, with the lanes of step 2
//! ```
//!
//! 1. The first line follows the path of one vehicle, and continues straight beyond its ends, in the mean
//!    direction of the last 40 m. The median movement of all vehicles from section to section shows how it
//!    departs from the axis. A vehicle that changes lanes is an outlier. Medians add up along the road, so that errors do, too: 0.1 m in
//!    each section are 0.5 m after 500 m, less than half a lane.
//! 2. The period of the lateral positions is the lane width; see `estimated_lanes`. It shows in which
//!    lane each position is.
//! 3. With these lanes, each section is compared with the whole road; see `road_axis`. Errors
//!    then do not add up.
//!
//! Where one or two vehicles are recorded, their rows do not show whether the road bends or they change lanes.
//! The line continues straight there. If it bends elsewhere, and many rows are there, a result is in doubt.
//!
//! If few vehicles are recorded, or no lane width stands out, or all vehicles are in one lane, the road
//! ends with step 1.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use closecall_traffic::statistics::quantiles::median;

use super::estimated_lanes::{LEAST_RESULTANT, LEAST_VEHICLES, Period, WIDTHS_M};
use super::lane_numbers::lanes_of;
use super::reference_line::{Projection, ReferenceLine};
use super::road_axis::{Departures, LateralPositions};

/// Length of the sections in which movements are measured (m): vehicles that are recorded for 8 s
/// pass several. An assumption with a plausible range of 10 to 40 m.
const SECTION_M: f64 = 20.0;

/// Least number of vehicles that show a movement: the median of three holds if one of them changes lanes, and the
/// median of two does not. If drivers move by 0.1 m within 20 m, the median of three is accurate to 0.07 m.
pub(super) const LEAST_MOVING: usize = 3;

/// Least share of the positions that a lane holds (-), as in `inferred_road`.
const LEAST_SHARE: f64 = 0.02;

/// How vehicles move beside a line, by section.
#[derive(Clone, Debug, Default)]
pub(super) struct Movements {
    /// Movements to the left from the start of the section before to the start of the section (m).
    sections: BTreeMap<i64, Vec<f64>>,
    /// Number of rows in each section.
    rows: BTreeMap<i64, u64>,
    latest: Option<Visit>,
}

/// A vehicle in a section.
#[derive(Clone, Copy, Debug)]
struct Visit {
    vehicle: u64,
    section: i64,
    /// First position in the section, to the left of the line (m).
    d_m: f64,
    /// `true` if the vehicle is recorded from the start of the section on.
    is_whole: bool,
}

impl Movements {
    /// Adds the position of a vehicle that follows the road. The rows of a vehicle follow one another.
    pub(super) fn add(&mut self, vehicle: u64, projection: &Projection) {
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
        let section = (projection.s_m / SECTION_M).floor() as i64;
        *self.rows.entry(section).or_default() += 1;
        let before = self.latest.filter(|before| before.vehicle == vehicle);
        if before.is_some_and(|before| before.section == section) {
            return;
        }
        let before = before.filter(|before| before.section.checked_add(1) == Some(section));
        if let Some(before) = before.filter(|before| before.is_whole) {
            self.sections.entry(section).or_default().push(projection.d_m - before.d_m);
        }
        self.latest = Some(Visit { vehicle, section, d_m: projection.d_m, is_whole: before.is_some() });
    }

    /// Returns the share of the rows in sections in which too few vehicles show how the road goes on, neither
    /// from the section before nor to the section behind (-).
    pub(super) fn unknown_share(&self) -> f64 {
        let is_shown = |section: i64| self.sections.get(&section).is_some_and(|moved| moved.len() >= LEAST_MOVING);
        let unknown = self.rows.iter().filter(|(section, _)| !is_shown(**section) && !is_shown(**section + 1));
        let (unknown, all): (u64, u64) = (unknown.map(|(_, rows)| rows).sum(), self.rows.values().sum());
        if all > 0 { unknown as f64 / all as f64 } else { 0.0 }
    }

    /// Returns the departures of the line from the axis, about a median of 0. Without enough vehicles, a section
    /// shows no movement.
    pub(super) fn departures(self) -> Departures {
        let shown = self.sections.into_iter().filter(|(_, moved_m)| moved_m.len() >= LEAST_MOVING);
        let mut departures_m: Vec<(f64, f64)> = Vec::new();
        let mut left_m = 0.0;
        for (section, moved_m) in shown {
            let start_m = section as f64 * SECTION_M;
            if departures_m.last().is_none_or(|(before_m, _)| start_m - before_m > 1.5 * SECTION_M) {
                departures_m.push((start_m - SECTION_M, left_m));
            }
            left_m += median(moved_m);
            departures_m.push((start_m, left_m));
        }
        if departures_m.is_empty() {
            return Departures::default();
        }
        let usual_m = median(departures_m.iter().map(|(_, left_m)| *left_m).collect());
        departures_m.iter_mut().for_each(|(_, left_m)| *left_m -= usual_m);
        Departures::new(departures_m).averaged()
    }
}

/// Returns the lane width that the positions of vehicles show (m), or `None` if they show no lanes.
/// `stated_m` is the width that the rows state.
pub(super) fn lane_width_m(positions: &LateralPositions<u64>, stated_m: Option<f64>) -> Option<f64> {
    let period = period_of(positions, stated_m.map_or(WIDTHS_M, |stated_m| stated_m..=stated_m))?;
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    let all: Vec<f64> = positions.all().map(|(_, d_m)| d_m).collect();
    for d_m in &all {
        *counts.entry(lanes_of(d_m - period.phase_m, period.width_m)).or_default() += 1;
    }
    let least = LEAST_SHARE * all.len() as f64;
    (counts.into_values().filter(|count| *count as f64 >= least).count() > 1).then_some(period.width_m)
}

/// Returns the line, moved to the axis of the middle of a lane with this width, or `None` if the positions
/// show no lanes.
pub(super) fn axis(
    positions: &LateralPositions<u64>,
    line: &ReferenceLine,
    lane_width_m: f64,
) -> Option<ReferenceLine> {
    let period = period_of(positions, lane_width_m..=lane_width_m)?;
    // The middle of the lane nearest to the line.
    let middle_m = period.phase_m - lane_width_m * (period.phase_m / lane_width_m).round();
    let in_lanes = positions.by_position(|d_m| lanes_of(d_m - middle_m, lane_width_m));
    Some(in_lanes.fit().departures.averaged().moved(line, middle_m))
}

/// Returns the period of the positions, if they have one within `widths_m`.
fn period_of(positions: &LateralPositions<u64>, widths_m: RangeInclusive<f64>) -> Option<Period> {
    let vehicles: BTreeSet<u64> = positions.all().map(|(vehicle, _)| vehicle).collect();
    if vehicles.len() < LEAST_VEHICLES {
        return None;
    }
    let all: Vec<f64> = positions.all().map(|(_, d_m)| d_m).collect();
    Some(Period::of(&all, widths_m)).filter(|period| period.resultant >= LEAST_RESULTANT)
}

#[cfg(test)]
mod tests {
    use closecall_traffic::maths;

    use super::super::road_axis::AXIS_SECTION_M;
    use super::*;

    /// Vehicles in three lanes along x, each recorded for 200 m of a straight road of 700 m. One in six changes
    /// to the lane beside it.
    fn paths() -> Vec<Vec<(f64, f64)>> {
        let path = |vehicle: u32| {
            let (lane, first_m) = (vehicle % 3, 10.0 * f64::from(vehicle));
            let at = |step: u32| {
                let share = if vehicle % 6 == 1 { (f64::from(step) / 40.0 - 0.5).clamp(0.0, 1.0) } else { 0.0 };
                let y_m =
                    3.4 * (f64::from(lane) + share) + 0.3 * maths::sin(f64::from(vehicle) + f64::from(step) / 20.0);
                (first_m + 2.5 * f64::from(step), y_m)
            };
            (0..=80).map(at).collect()
        };
        (0..48).map(path).collect()
    }

    /// The departures of a line from the lanes of the paths: the largest less the smallest (m).
    fn spread_m(line: &ReferenceLine) -> f64 {
        let at = (1..33_u32).map(|k| line.project((20.0 * f64::from(k), 0.0)).d_m);
        let (least_m, most_m) =
            at.fold((f64::MAX, f64::MIN), |(least_m, most_m), d_m| (least_m.min(d_m), most_m.max(d_m)));
        most_m - least_m
    }

    fn moved_by_movements(line: &ReferenceLine) -> ReferenceLine {
        let mut movements = Movements::default();
        for (vehicle, path) in (0..).zip(paths()) {
            path.into_iter().for_each(|point| movements.add(vehicle, &line.project(point)));
        }
        movements.departures().moved(line, 0.0)
    }

    #[test]
    fn a_line_that_leaves_the_road_beyond_the_path_of_its_vehicle_returns_to_the_lanes() {
        // The path covers 200 m, and points away from the road by 0.01 rad.
        let first = ReferenceLine::through([(300.0, 0.0), (500.0, 2.0)].into_iter());
        assert!(spread_m(&first) > 6.0);
        let mut line = first.clone();
        for _ in 0..3 {
            line = moved_by_movements(&line);
        }
        assert!(spread_m(&line) < 1.2, "{} m", spread_m(&line));
        for _ in 0..3 {
            let mut positions = LateralPositions::new(AXIS_SECTION_M);
            for (vehicle, path) in (0_u64..).zip(paths()) {
                let placed = path.into_iter().map(|point| line.project(point));
                placed.for_each(|at| positions.add(positions.section(at.s_m), vehicle, at.d_m));
            }
            let width_m = lane_width_m(&positions, None).unwrap();
            assert!((width_m - 3.4).abs() < 0.1, "{width_m} m");
            line = axis(&positions, &line, width_m).unwrap();
        }
        assert!(spread_m(&line) < 0.6, "{} m", spread_m(&line));
    }

    #[test]
    fn few_vehicles_move_no_line_and_a_single_lane_shows_no_width() {
        let line = ReferenceLine::through([(0.0, 0.0), (100.0, 1.0)].into_iter());
        let mut movements = Movements::default();
        for vehicle in 0..2 {
            (0..50_u32).for_each(|k| movements.add(vehicle, &line.project((2.0 * f64::from(k), 0.0))));
        }
        assert_eq!(movements.unknown_share(), 1.0);
        assert!(movements.departures().is_empty());
        let mut positions = LateralPositions::new(AXIS_SECTION_M);
        for vehicle in 0..40_u64 {
            (0..10).for_each(|section| positions.add(section, vehicle, 0.3 * maths::sin(vehicle as f64)));
        }
        assert_eq!(lane_width_m(&positions, None), None);
        assert_eq!(axis(&LateralPositions::new(AXIS_SECTION_M), &line, 3.5), None);
    }
}
