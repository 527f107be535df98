//! What the rows of vehicles on the lanelets of a map show: whether the map lies where the traffic drives, and
//! whether vehicles that enter another lane of the road change lanes.
//!
//! ```text
//!   ──────────┬──────────
//!      A      │     B          A ─▶ D: a lane change
//!   ──────────┼──────────
//!      C      │ ╲   D          C ─▶ E: a turn, because E continues C
//!   ──────────┴──╲  E ╲
//! ```
//!
//! The lanes of a road are counted beside one chain of lanelets; see `lanelets`. Where another lanelet leads away
//! from the chain, a vehicle that follows it passes lane after lane.

use std::collections::BTreeMap;

use closecall_traffic::{Time, maths};

use super::axes::MISPLACED;
use super::lanelets::{RoadPosition, Roads};
use super::plausible::MIN_SPEED_MPS;
use super::reference_line::Point;
use crate::lane_change::is_stay;

/// Least number of rows that show whether the map lies where the traffic drives.
const LEAST_ROWS: usize = 50;
/// Share of the rows of moving vehicles off the lanes of the map above which the file is in doubt (-). If the map
/// is shifted by a lane, a fifth to a half of the traffic is off it; on shoulders drive single vehicles. An assumption
/// with a plausible range of 0.05 to 0.2.
const OFF_MAP: f64 = 0.1;
/// Cosine of the largest angle between a vehicle on a road and the road, 30° (-).
const MOST_TURNED: f64 = 0.866;
/// Share of the rows of moving vehicles that are turned by more, above which they are the reason why a file cannot be
/// followed (-), as the share of a derived road that causes a warning.
const OFF_ROAD: f64 = 0.05;
/// Least lateral speed of a vehicle that enters another lane (m/s): a lane that begins on the left changes the
/// numbers of the others, and no vehicle moves. An assumption with a plausible range of 0.1 to 0.5 m/s.
const SIDEWAYS_MPS: f64 = 0.3;
/// One in this number of lane changes may be a turn before a result is in doubt. An assumption with a plausible
/// range of 5 to 20.
const ONE_TURN_IN: usize = 10;

/// A vehicle on the road in one row.
#[derive(Clone, Copy, Debug)]
pub(super) struct MappedRow {
    pub(super) vehicle: u64,
    pub(super) time: Time,
    pub(super) point: Point,
    pub(super) heading_rad: f64,
    pub(super) speed_mps: f64,
    pub(super) place: RoadPosition,
}

/// A vehicle in a lane of the road.
#[derive(Clone, Copy, Debug)]
struct InLane {
    lane: u8,
    /// Time at which it enters the lane.
    since: Time,
    /// Its latest position.
    point: Point,
    /// Whether it entered by a turn, until it has stayed.
    entered_by_turn: Option<bool>,
}

/// The rows of vehicles that a map has lanes for. The rows of each vehicle are in the order of their times.
#[derive(Debug, Default)]
pub(super) struct MappedRows {
    /// Rows of moving vehicles, those beside all lanes, and those with a heading across the road.
    moving: usize,
    off_map: usize,
    across: usize,
    /// Each vehicle in its latest row.
    latest: BTreeMap<u64, InLane>,
    /// Changes of the lane by a lateral movement, from a stay to a stay, and those to a lanelet that continues the one
    /// before.
    changes: usize,
    turns: usize,
}

impl MappedRows {
    /// Adds a row.
    pub(super) fn add(&mut self, row: MappedRow, roads: &Roads) {
        let MappedRow { vehicle, time, point, heading_rad, speed_mps, place } = row;
        if speed_mps.abs() > MIN_SPEED_MPS {
            self.off_map += usize::from(!place.is_on_map);
            self.across += usize::from(maths::cos(heading_rad - place.heading_rad).abs() < MOST_TURNED);
            self.moving += 1;
        }
        let entered = InLane { lane: place.lane, since: time, point, entered_by_turn: None };
        let latest = self.latest.entry(vehicle).or_insert(entered);
        if latest.lane == place.lane {
            if let Some(is_turn) = latest.entered_by_turn.take_if(|_| is_stay(time - latest.since)) {
                self.changes += 1;
                self.turns += usize::from(is_turn);
            }
            latest.point = point;
            return;
        }
        let sideways_mps = speed_mps * maths::sin(heading_rad - place.heading_rad);
        let changes = is_stay(time - latest.since) && sideways_mps.abs() >= SIDEWAYS_MPS;
        *latest = InLane { entered_by_turn: changes.then(|| roads.goes_on(latest.point, point)), ..entered };
    }

    /// Returns the doubt about the lanes if many vehicles drive beside all of them.
    pub(super) fn doubt_of_place(&self) -> Option<String> {
        let share = self.off_map as f64 / self.moving.max(1) as f64;
        (self.moving >= LEAST_ROWS && share > OFF_MAP).then(|| {
            format!("in {:.0} % of the rows, a vehicle drives beside the lanes of the map: {MISPLACED}", 100.0 * share)
        })
    }

    /// Returns the share of the rows in which a vehicle drives across its road (%), if it is large: as on intersections, the
    /// lanes of the map form no road that the vehicles follow.
    pub(super) fn off_road_percent(&self) -> Option<f64> {
        let share = self.across as f64 / self.moving.max(1) as f64;
        (self.moving >= LEAST_ROWS && share > OFF_ROAD).then_some(100.0 * share)
    }

    /// Returns the doubt about lane changes if many of them are turns.
    pub(super) fn doubt_of_turns(&self) -> Option<String> {
        let Self { changes, turns, .. } = *self;
        (ONE_TURN_IN * turns > changes).then(|| {
            format!(
                "in {turns} of {changes} changes of the lane, the vehicle follows the lanelet that continues its own, as at junctions and \
                 exits: the road has no lanes there, and turns count as lane changes"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::lanelets::Lanelet;
    use super::*;

    /// Two lanes along x, each of two lanelets that meet at x = 100 m, and a lanelet that leaves the right lane there
    /// to the left, across the other one.
    fn roads() -> Roads {
        let along = |y_m: f64, from_m: f64, slope: f64| {
            (0..=10).map(|k| 10.0 * f64::from(k)).map(|x_m| (from_m + x_m, y_m + slope * x_m)).collect()
        };
        let lanelet = |left_m: f64, from_m: f64, slope: f64| Lanelet {
            left: along(left_m, from_m, slope),
            right: along(left_m - 4.0, from_m, slope),
            ..Lanelet::default()
        };
        Roads::from_lanelets(&BTreeMap::from([
            (1, Lanelet { right_id: Some(2), successors: vec![11], ..lanelet(0.0, 0.0, 0.0) }),
            (2, Lanelet { left_id: Some(1), successors: vec![12, 20], ..lanelet(-4.0, 0.0, 0.0) }),
            (11, Lanelet { right_id: Some(12), ..lanelet(0.0, 100.0, 0.0) }),
            (12, Lanelet { left_id: Some(11), ..lanelet(-4.0, 100.0, 0.0) }),
            (20, lanelet(-4.0, 100.0, 0.5)),
        ]))
    }

    /// Drives at 10 m/s from x = 50 m to 150 m, in steps of 1 m along x, on the path y(x).
    fn drive(rows: &mut MappedRows, vehicle: u64, y_m: impl Fn(f64) -> f64) {
        let roads = roads();
        for k in 0..=100_i32 {
            let x_m = 50.0 + f64::from(k);
            let (point, heading_rad) = ((x_m, y_m(x_m)), maths::atan2(y_m(x_m + 1.0) - y_m(x_m), 1.0));
            let place = roads.locate(roads.road_at(point, heading_rad), point).unwrap();
            let time = Time::from_ms(100) * i64::from(k);
            rows.add(MappedRow { vehicle, time, point, heading_rad, speed_mps: 10.0, place }, &roads);
        }
    }

    #[test]
    fn a_turn_is_no_lane_change_and_a_lane_change_beside_it_is_one() {
        let lane_change = |x_m: f64| -6.0 + 4.0 * ((x_m - 55.0) / 40.0).clamp(0.0, 1.0);
        let turn = |x_m: f64| -6.0 + 0.5 * (x_m - 100.0).max(0.0);
        let mut rows = MappedRows::default();
        for vehicle in 0..10 {
            drive(&mut rows, vehicle, lane_change);
            drive(&mut rows, 100 + vehicle, |_| -6.0);
        }
        assert_eq!((rows.changes, rows.turns, rows.doubt_of_turns()), (10, 0, None));
        drive(&mut rows, 200, turn);
        assert_eq!((rows.changes, rows.turns, rows.doubt_of_turns()), (11, 1, None));
        drive(&mut rows, 201, turn);
        assert!(rows.doubt_of_turns().unwrap().starts_with("in 2 of 12 changes of the lane"));
    }

    #[test]
    fn vehicles_across_the_road_are_a_reason_why_a_file_cannot_be_followed() {
        let mut rows = MappedRows::default();
        drive(&mut rows, 1, |_| -6.0);
        assert_eq!(rows.off_road_percent(), None);
        drive(&mut rows, 2, |x_m| 3.0 * (x_m - 100.0));
        assert!(rows.off_road_percent().is_some_and(|percent| (45.0..=55.0).contains(&percent)));
    }

    #[test]
    fn a_map_is_in_doubt_if_much_of_the_moving_traffic_is_off_it() {
        let roads = roads();
        let doubt = |off_map: u32, speed_mps: f64| {
            let mut rows = MappedRows::default();
            for row in 0..100 {
                let point = (50.0, if row < off_map { -20.0 } else { -2.0 });
                let place = roads.locate(0, point).unwrap();
                rows.add(
                    MappedRow { vehicle: u64::from(row), time: Time::ZERO, point, heading_rad: 0.0, speed_mps, place },
                    &roads,
                );
            }
            rows.doubt_of_place()
        };
        assert!(doubt(25, 20.0).unwrap().contains("in 25 % of the rows"));
        assert!(doubt(25, -20.0).is_some());
        assert_eq!(doubt(7, 20.0), None, "single vehicles on the shoulder");
        assert_eq!(doubt(25, 0.0), None, "vehicles that stand");
    }
}
