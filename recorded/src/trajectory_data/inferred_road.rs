//! A road that is inferred from its traffic: for layouts that state positions in a plane, and no
//! lanes.
//!
//! ```text
//!   ── ── ── ── ── ── ── ── ──   the lanes beside it: steps of the mean lane width, as far as
//!   ═══════════════════════════   2 % of the rows reach
//!   ── ── ── ── ── ── ── ── ──
//!     reference line: the longest path of a vehicle that keeps its lane
//! ```
//!
//! Each direction of travel has a reference line. Directions are placed 1 km beside each other, so
//! that their vehicles never meet. Lateral positions are relative to the path of one driver and
//! contain its slow weaving of a decimetre or two. Vehicles on ramps count as being in the
//! outermost lane.

use std::collections::BTreeMap;

use closecall_traffic::{Lane, maths};

use super::error::TrajectoryFileProblem;
use super::markings::{DEFAULT_LANE_WIDTH_M, LaneMarkings};
use super::reference_line::{Point, ReferenceLine};

/// Lane width if the traffic gives none (m).
const FALLBACK_LANE_WIDTH_M: f64 = DEFAULT_LANE_WIDTH_M;

/// Minimum distance between two points of a path (m).
const SPACING_M: f64 = 2.0;

/// Maximum number of points of a path, which then has a length of 20 km.
const MAX_POINTS: usize = 10_000;

/// Maximum number of directions in one data set: two of the motorway and two of a crossing road.
const MAX_DIRECTIONS: usize = 4;

/// Minimum share of its direction's rows that a lane holds.
const MIN_SHARE: f64 = 0.02;

/// Maximum number of lanes considered on either side of the reference line.
const MAX_LANES_BESIDE: i64 = 20;

/// Distance by which each direction is shifted to the right of the previous one (m).
const SEPARATION_M: f64 = 1_000.0;

/// Largest angle between a vehicle and its road (rad). In a lane change it stays below 10°; a vehicle
/// that turns off at an intersection exceeds it. An assumption with a plausible range of 20° to 45°.
const ASTRAY_RAD: f64 = 30.0 * std::f64::consts::PI / 180.0;

/// Largest distance between a vehicle and the reference line (m): ten lanes.
const ASTRAY_M: f64 = 35.0;

/// Share of rows that go astray above which a reader of results is warned, and the share above which
/// the traffic is not that of a road. Ramps of motorways stay below the first. Assumptions.
const WARNED_SHARE: f64 = 0.05;
const REFUSED_SHARE: f64 = 0.5;

/// The position of one vehicle in one row, and what it says of the lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) vehicle: u64,
    pub(super) point: Point,
    pub(super) heading_rad: f64,
    /// Width of the vehicle's lane (m), if the row states it.
    pub(super) lane_width_m: Option<f64>,
    /// `true` if the vehicle leaves its lane in this row.
    pub(super) changes_lane: bool,
}

/// A position on the road.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) lane: u8,
}

/// One direction of the road, as inferred from the traffic.
#[derive(Clone, Debug)]
struct Direction {
    heading_rad: f64,
    line: ReferenceLine,
    /// Number of lanes to the left of the reference line's own lane.
    left: i64,
    lanes: i64,
    /// Offset of the lane numbers, so that directions share no lane.
    first_lane: i64,
    /// Offset of the lateral position, so that directions do not meet (m).
    shift_m: f64,
}

/// The road of a data set, as inferred from its traffic.
#[derive(Clone, Debug)]
pub(super) struct InferredRoad {
    lane_width_m: f64,
    directions: Vec<Direction>,
    /// Share of the rows whose vehicles do not follow the road (-).
    astray: f64,
}

/// The path of one vehicle.
#[derive(Clone, Debug, Default)]
struct DrivenPath {
    vehicle: Option<u64>,
    heading_rad: f64,
    points: Vec<Point>,
    changes_lanes: bool,
}

impl InferredRoad {
    /// Infers the road from the rows that `each_row` visits. It is called twice: first for the
    /// reference lines, then for the lanes beside them. The rows of a vehicle have to follow one
    /// another.
    ///
    /// # Errors
    /// The error of `each_row`, or the reason why the traffic shows no road.
    pub(super) fn of<E>(
        mut each_row: impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    ) -> Result<Result<Self, TrajectoryFileProblem>, E> {
        let mut paths: Vec<(bool, f64, DrivenPath)> = Vec::new();
        let mut current = DrivenPath::default();
        let (mut width_sum_m, mut widths) = (0.0, 0_u32);
        each_row(&mut |pose| {
            if let Some(metres) = pose.lane_width_m {
                width_sum_m += metres;
                widths = widths.saturating_add(1);
            }
            if current.vehicle != Some(pose.vehicle) {
                keep_best_path(&mut paths, std::mem::take(&mut current));
                let (vehicle, heading_rad) = (Some(pose.vehicle), pose.heading_rad);
                current = DrivenPath { vehicle, heading_rad, ..DrivenPath::default() };
            }
            current.changes_lanes |= pose.changes_lane;
            let point = pose.point;
            let is_far = |last: &Point| maths::hypot(point.0 - last.0, point.1 - last.1) >= SPACING_M;
            if current.points.last().is_none_or(is_far) && current.points.len() < MAX_POINTS {
                current.points.push(point);
            }
        })?;
        keep_best_path(&mut paths, current);
        let lane_width_m = if widths > 0 { width_sum_m / f64::from(widths) } else { FALLBACK_LANE_WIDTH_M };
        let directions = paths.into_iter().filter_map(|(_, _, path)| {
            let line = ReferenceLine::through(path.points.into_iter());
            line.length_m()?;
            let heading_rad = path.heading_rad;
            Some(Direction { heading_rad, line, left: 0, lanes: 1, first_lane: 0, shift_m: 0.0 })
        });
        let mut road = Self { lane_width_m, directions: directions.collect(), astray: 0.0 };
        if road.directions.is_empty() {
            return Ok(Err(TrajectoryFileProblem::NothingMoves));
        }
        road.count_lanes(each_row)?;
        if road.astray > REFUSED_SHARE {
            return Ok(Err(TrajectoryFileProblem::NoRoad { percent: 100.0 * road.astray }));
        }
        Ok(Ok(road))
    }

    /// Counts the rows in each lane, and from them sets the lanes of each direction.
    fn count_lanes<E>(&mut self, mut each_row: impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>) -> Result<(), E> {
        let mut rows: BTreeMap<(usize, i64), u64> = BTreeMap::new();
        let (mut astray, mut all) = (0_u64, 0_u64);
        let mut latest: Option<(u64, usize)> = None;
        each_row(&mut |pose| {
            // A vehicle keeps the direction of its first row, as when its rows are read.
            let kept = latest.filter(|(vehicle, _)| *vehicle == pose.vehicle).map(|(_, direction)| direction);
            let Some(direction) = kept.or_else(|| self.direction(pose.heading_rad)) else { return };
            latest = Some((pose.vehicle, direction));
            let projection = self.directions[direction].line.project(pose.point);
            let follows = maths::cos(pose.heading_rad - projection.heading_rad) >= maths::cos(ASTRAY_RAD)
                && projection.d_m.abs() <= ASTRAY_M;
            all += 1;
            astray += u64::from(!follows);
            *rows.entry((direction, self.lane_beside(projection.d_m))).or_default() += 1;
        })?;
        self.astray = if all > 0 { astray as f64 / all as f64 } else { 0.0 };
        let (mut first_lane, mut shift_m) = (0, 0.0);
        for (index, direction) in self.directions.iter_mut().enumerate() {
            let in_direction = || rows.iter().filter(|((other, _), _)| *other == index);
            let least = MIN_SHARE * in_direction().map(|(_, count)| *count).sum::<u64>() as f64;
            let used = || in_direction().filter(|(_, count)| **count as f64 >= least).map(|((_, lane), _)| *lane);
            let (left, right) = (used().max().unwrap_or(0).max(0), used().min().unwrap_or(0).min(0));
            (direction.left, direction.lanes) = (left, left - right + 1);
            (direction.first_lane, direction.shift_m) = (first_lane, shift_m);
            first_lane += direction.lanes + 1;
            shift_m -= self.lane_width_m * direction.lanes as f64 + SEPARATION_M;
        }
        Ok(())
    }

    /// Returns what a reader of results has to know of the road.
    pub(super) fn warning(&self) -> Option<String> {
        (self.astray > WARNED_SHARE).then(|| {
            format!(
                "in {:.0} % of the rows, a vehicle does not follow the road that was derived from the traffic: on intersections and \
                 roundabouts, lanes and lane changes mean nothing",
                100.0 * self.astray
            )
        })
    }

    /// Places a point on the road in the given direction. Returns `None` if there is no such
    /// direction.
    pub(super) fn place(&self, direction: usize, point: Point) -> Option<Placed> {
        let direction = self.directions.get(direction)?;
        let projection = direction.line.project(point);
        let lane = (direction.left - self.lane_beside(projection.d_m) + 1).clamp(1, direction.lanes);
        Some(Placed {
            s_m: projection.s_m,
            d_m: projection.d_m - self.lane_width_m * (direction.left as f64 + 0.5) + direction.shift_m,
            lane: u8::try_from(lane + direction.first_lane).unwrap_or(u8::MAX),
        })
    }

    /// Returns the index of the direction that agrees best with `heading_rad`.
    pub(super) fn direction(&self, heading_rad: f64) -> Option<usize> {
        let agrees = |direction: &Direction| maths::cos(heading_rad - direction.heading_rad);
        let ranked = self.directions.iter().map(agrees).enumerate();
        ranked.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }

    /// Returns by how many lanes `d_m` lies to the left of the reference line's lane.
    fn lane_beside(&self, d_m: f64) -> i64 {
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, and what is far away is clamped")]
        let lane = (d_m / self.lane_width_m).round() as i64;
        lane.clamp(-MAX_LANES_BESIDE, MAX_LANES_BESIDE)
    }

    /// Returns the lane markings of all directions.
    pub(super) fn markings(&self) -> LaneMarkings {
        let edges = self.directions.iter().flat_map(|direction| {
            // Lane 0 of the first direction does not exist. Lane 0 of a later direction is the
            // omitted lane, whose right edge is the direction's left edge.
            (0..=direction.lanes).map(move |lane| {
                let edge_m = direction.shift_m - self.lane_width_m * lane as f64;
                (u8::try_from(direction.first_lane + lane).unwrap_or(u8::MAX), edge_m)
            })
        });
        LaneMarkings::from_right_edges(edges.filter(|(lane, _)| *lane > 0).map(|(lane, edge_m)| (Lane(lane), edge_m)))
    }
}

/// Keeps the best path of each direction. A path without a lane change is better than a path with
/// one, and a longer path is better than a shorter path.
fn keep_best_path(paths: &mut Vec<(bool, f64, DrivenPath)>, path: DrivenPath) {
    let Some(length_m) = ReferenceLine::through(path.points.iter().copied()).length_m() else { return };
    let stays = !path.changes_lanes;
    let same = |kept: &&mut (bool, f64, DrivenPath)| maths::cos(kept.2.heading_rad - path.heading_rad) > 0.0;
    match paths.iter_mut().find(same) {
        Some(kept) if (stays, length_m) > (kept.0, kept.1) => *kept = (stays, length_m, path),
        Some(_) => {}
        None => {
            paths.push((stays, length_m, path));
            paths.truncate(MAX_DIRECTIONS);
        }
    }
}
