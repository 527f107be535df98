//! A road that is inferred from its traffic: for layouts that state positions in a plane, and lanes
//! only by names.
//!
//! ```text
//!   ── ── ── ── ── ── ── ── ──   the lanes beside it, as far as 2 % of the rows reach
//!   ═══════════════════════════
//!   ── ── ── ── ── ── ── ── ──
//!     reference line: the axis of the road, from the paths of all vehicles
//! ```
//!
//! Each direction of travel has a reference line. Directions are placed 1 km beside each other, so
//! that their vehicles never meet. Vehicles on ramps count as being in the outermost lane.
//!
//! **Recorded lanes.** If rows name the lane of their vehicle (an edge with an index, a lanelet), a
//! vehicle is in the lane that the file names, wherever it drives. Names that follow one another
//! along the road are one lane; see `stated_lanes`. Lanes beside each other are numbered by their
//! indices, or by where they lie; see `lane_numbers`. Markings lie halfway between the median positions
//! in neighbouring lanes. Without names, lanes are steps of the lane width that rows state or that the traffic
//! shows, and a vehicle is in the lane at its position; see `unnamed_lanes`.
//!
//! **Reference line.** It begins as the longest path of a vehicle that keeps its lane, which contains
//! the weaving and the errors of that vehicle. If rows name lanes, the path is smoothed, and then moved
//! to where all vehicles show the axis of the road; see `road_axis`. Where fewer than ten vehicles show
//! it, a decimetre or two remain. If rows name no lanes, the movements and the positions of all vehicles
//! show the axis; see `unnamed_lanes`. If most vehicles then move to one side of the first path by more than
//! half a lane, its vehicle changes lanes, and another path is taken.
//!
//! **Doubts.** The lanes on the derived road are compared with the lane changes that the file states;
//! see `lane_comparison`. A result is in doubt if they disagree, if vehicles of one lane are spread
//! over more than a lane, if fewer than 15 vehicles show a bent road without names of lanes, if fewer than
//! three show parts of it that hold more than 5 % of the rows, or if the indices grow to the right although
//! the layouts count from there.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{Lane, Side, maths};

use super::error::TrajectoryFileProblem;
use super::estimated_lanes::LEAST_VEHICLES;
use super::lane_comparison::{ComparedRow, LaneComparison};
use super::lane_numbers::{LEAST_APART, LaneNumbers, StrandRows, lanes_of};
use super::markings::{DEFAULT_LANE_WIDTH_M, LaneMarkings};
use super::reference_line::{Point, Projection, ReferenceLine};
use super::road_axis::{AXIS_SECTION_M, Departures, LateralFit, LateralPositions};
use super::stated_lanes::{LaneObserver, LaneRow, StatedLane, Strand, Strands};
use super::unnamed_lanes::{LEAST_MOVING, Movements, axis, lane_width_m};

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

/// Distance by which each direction is shifted to the right of the previous one (m).
const SEPARATION_M: f64 = 1_000.0;

/// Largest angle between a vehicle and its road (rad). In a lane change it stays below 10°; a vehicle
/// that turns off at an intersection exceeds it. An assumption with a plausible range of 20° to 45°.
const ASTRAY_RAD: f64 = 30.0 * std::f64::consts::PI / 180.0;

/// Largest distance between a vehicle and the reference line (m): ten lanes.
const ASTRAY_M: f64 = 35.0;

/// Share of rows that go astray above which a reader of results is warned, and the share above which
/// the traffic is not on a road. Ramps of motorways stay below the first. Assumptions.
const WARNED_SHARE: f64 = 0.05;
const REFUSED_SHARE: f64 = 0.5;

/// Median deviation of vehicles from the middle of their lane above which they are spread over more
/// than a lane, as a share of the lane width (-): drivers in a lane have 0.07, drivers in two lanes 0.5.
/// An assumption with a plausible range of 0.2 to 0.4.
const LARGEST_SPREAD: f64 = 0.3;

/// Share of positions in such lanes above which a reader of results is warned (-). An assumption with
/// a plausible range of 0.05 to 0.2.
const WARNED_SPREAD: f64 = 0.1;

/// Length of the sections in which the weaving of the reference line is measured, and half the length
/// over which the line is smoothed (m): parts of the 150 to 300 m in which a driver weaves.
/// Assumptions with plausible ranges of 20 to 60 m and 40 to 80 m. In a bend with a radius of 150 m,
/// the smoothing shifts the line by 0.1 m.
const SECTION_M: f64 = 40.0;
const SMOOTHED_M: f64 = 60.0;
/// Least number of vehicles that show the weaving in a section: the mean of ten drivers with a
/// standard deviation of 0.3 m is accurate to a decimetre.
const LEAST_DRIVERS: usize = 10;
/// Share of a lane by which most vehicles move to one side of a path whose vehicle leaves its lane (-):
/// weaving stays below it.
const LEAVES_LANE: f64 = 0.5;
/// Distance of a path from a straight line above which it bends (m): above the 0.28 m with which the drivers of
/// US-101 weave, and below half a lane. An assumption with a plausible range of 0.4 to 1 m.
const STRAIGHT_M: f64 = 0.6;
/// Largest number of times that reference lines are chosen, because their vehicles leave their lanes.
const MOST_CHOICES: usize = 8;
/// Number of times that the reference line is moved to the axis of the road: after each time,
/// positions are measured from a better line.
const AXIS_TURNS: usize = 3;

/// Cosine of the smallest angle between two directions of one road, 150° (-).
const OPPOSITE: f64 = -0.866;
/// Largest distance to the other carriageway (m), as on a motorway with a wide median. An assumption with
/// a plausible range of 30 to 100 m.
const OTHER_CARRIAGEWAY_M: f64 = 60.0;
/// Share of the oncoming rows that are on one side of a direction (-): a road that turns back may have some on the
/// other side. An assumption with a plausible range of 0.7 to 0.95.
const ON_ONE_SIDE: f64 = 0.8;

/// The doubt about a file whose indices grow to the right, unless its reader is told that it is mirrored.
pub(super) const MIRRORED: &str = "lanes with higher indices lie further to the right, but the layout counts them from the right: the file is mirrored, \
     so that left is called right, or its traffic drives on the left";

/// The position of one vehicle in one row, with the lane that the row states.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) vehicle: u64,
    pub(super) point: Point,
    pub(super) heading_rad: f64,
    /// Width of the vehicle's lane (m), if the row states it.
    pub(super) lane_width_m: Option<f64>,
    /// `true` if the vehicle leaves its lane in this row.
    pub(super) changes_lane: bool,
    /// The lane that the file names.
    pub(super) named_lane: Option<StatedLane>,
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
    /// The vehicle whose path is the reference line.
    reference: Option<u64>,
    line: ReferenceLine,
    /// Number of lanes to the left of the reference line's own lane.
    left: i64,
    lanes: i64,
    /// Which named lanes follow one another.
    strands: Strands,
    /// For each strand, by how many lanes it lies to the left of the reference line's lane.
    numbers: BTreeMap<Strand, i64>,
    /// Distances along the line by which the lanes lie to the left of their usual position.
    weaving: Departures,
    /// Distances to the left of the line (m) of the edges of the lanes, from left to right.
    edges_m: Vec<f64>,
    /// Offset of the lane numbers, so that directions share no lane.
    first_lane: i64,
    /// Offset of the lateral position, so that directions do not meet (m).
    shift_m: f64,
}

/// The lanes of one direction, as its rows show them.
#[derive(Clone, Debug)]
struct ObservedLanes {
    observer: LaneObserver,
    positions: LateralPositions<StatedLane>,
    /// Vehicle, lane and section of the latest position.
    latest: Option<(u64, StatedLane, i64)>,
}

impl ObservedLanes {
    /// Creates an observation in sections of this length.
    fn new(section_m: f64) -> Self {
        let (observer, positions) = (LaneObserver::default(), LateralPositions::new(section_m));
        Self { observer, positions, latest: None }
    }

    /// Adds the position of a vehicle that follows the road: one for each section.
    fn add_position(&mut self, vehicle: u64, lane: StatedLane, projection: &Projection) -> Option<i64> {
        let section = self.positions.section(projection.s_m);
        let here = Some((vehicle, lane, section));
        if std::mem::replace(&mut self.latest, here) == here {
            return None;
        }
        self.positions.add(section, lane, projection.d_m);
        Some(section)
    }
}

/// Gives each vehicle the direction of its first row, as the reader of the rows does.
#[derive(Clone, Debug, Default)]
struct KeptDirection {
    latest: Option<(u64, usize)>,
}

impl KeptDirection {
    fn choose(&mut self, pose: &Pose, road: &InferredRoad) -> Option<usize> {
        let kept = self.latest.filter(|(vehicle, _)| *vehicle == pose.vehicle).map(|(_, direction)| direction);
        let direction = kept.or_else(|| road.direction(pose.heading_rad))?;
        self.latest = Some((pose.vehicle, direction));
        Some(direction)
    }
}

/// Returns `true` if the vehicle in `pose` follows the road whose line has this projection.
fn follows(pose: &Pose, projection: &Projection) -> bool {
    maths::cos(pose.heading_rad - projection.heading_rad) >= maths::cos(ASTRAY_RAD) && projection.d_m.abs() <= ASTRAY_M
}

/// The road of a data set, as inferred from its traffic.
#[derive(Clone, Debug)]
pub(super) struct InferredRoad {
    lane_width_m: f64,
    /// `true` if rows state the lane width.
    states_lane_width: bool,
    directions: Vec<Direction>,
    /// Share of the rows whose vehicles do not follow the road (-).
    astray: f64,
    /// Why the lanes of the road are in doubt.
    doubts: Vec<String>,
    /// `true` if lanes with higher indices lie further to the right.
    is_mirrored: bool,
    /// The side on which vehicles pass the oncoming traffic, if the data show it.
    oncoming_side: Option<Side>,
    /// `true` if rows name their lanes.
    names_lanes: bool,
}

/// The path of one vehicle.
#[derive(Clone, Debug, Default)]
struct DrivenPath {
    vehicle: Option<u64>,
    heading_rad: f64,
    points: Vec<Point>,
    changes_lanes: bool,
    names_lanes: bool,
}

impl InferredRoad {
    /// Infers the road from the rows that `each_row` visits. `each_row` is called several times: for the
    /// reference lines, for the lanes beside them, and for the comparison with the file. The rows of a
    /// vehicle must be consecutive.
    ///
    /// # Errors
    /// The error of `each_row`, or the reason why the traffic shows no road.
    pub(super) fn of<E>(
        mut each_row: impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    ) -> Result<Result<Self, TrajectoryFileProblem>, E> {
        let mut changing: BTreeSet<u64> = BTreeSet::new();
        let (mut paths, stated_width_m) = best_paths(&mut each_row, &mut changing)?;
        let lane_width_m = stated_width_m.unwrap_or(FALLBACK_LANE_WIDTH_M);
        for _ in 1..MOST_CHOICES {
            let leaving = leaving_their_lanes(&mut each_row, &paths, lane_width_m)?;
            if leaving.is_empty() {
                break;
            }
            changing.extend(leaving);
            (paths, _) = best_paths(&mut each_row, &mut changing)?;
        }
        let directions = paths.into_iter().filter_map(|RatedPath { path, .. }| {
            let points = if path.names_lanes { smoothed(&path.points) } else { path.points };
            let line = ReferenceLine::through(points.into_iter());
            line.length_m()?;
            let heading_rad = path.heading_rad;
            Some(Direction { reference: path.vehicle, ..Direction::along(line, heading_rad) })
        });
        let mut road = Self {
            lane_width_m,
            states_lane_width: stated_width_m.is_some(),
            directions: directions.collect(),
            astray: 0.0,
            doubts: Vec::new(),
            is_mirrored: false,
            oncoming_side: None,
            names_lanes: false,
        };
        if road.directions.is_empty() {
            return Ok(Err(TrajectoryFileProblem::NothingMoves));
        }
        road.find_axes(&mut each_row)?;
        road.count_lanes(&mut each_row)?;
        if road.astray > REFUSED_SHARE {
            return Ok(Err(TrajectoryFileProblem::NoRoad { percent: 100.0 * road.astray }));
        }
        road.compare_lanes(&mut each_row)?;
        road.oncoming_side = road.side_of_oncoming_traffic(&mut each_row)?;
        Ok(Ok(road))
    }

    /// Returns the side on which vehicles pass the oncoming traffic, if nearly all of it is on one side.
    fn side_of_oncoming_traffic<E>(
        &self,
        each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    ) -> Result<Option<Side>, E> {
        let is_opposite = |a: &Direction, b: &Direction| maths::cos(a.heading_rad - b.heading_rad) < OPPOSITE;
        let opposite = |of: &Direction| self.directions.iter().find(|other| is_opposite(of, other));
        if !self.directions.iter().any(|direction| opposite(direction).is_some()) {
            return Ok(None);
        }
        let (mut left, mut right) = (0_u64, 0_u64);
        let mut vehicles: BTreeSet<u64> = BTreeSet::new();
        let mut kept = KeptDirection::default();
        each_row(&mut |pose| {
            let direction = kept.choose(&pose, self).map(|index| &self.directions[index]);
            let Some(other) = direction.and_then(opposite) else { return };
            let Projection { s_m, d_m, heading_rad } = other.line.project(pose.point);
            let is_beside = (0.0..=other.line.length_m().unwrap_or(0.0)).contains(&s_m);
            if is_beside && d_m.abs() <= OTHER_CARRIAGEWAY_M && maths::cos(pose.heading_rad - heading_rad) < OPPOSITE {
                *(if d_m > 0.0 { &mut left } else { &mut right }) += 1;
                vehicles.insert(pose.vehicle);
            }
        })?;
        let is_most = |rows: u64| rows as f64 > ON_ONE_SIDE * (left + right) as f64;
        let side = if left > right { Side::Left } else { Side::Right };
        Ok((vehicles.len() >= LEAST_MOVING && is_most(left.max(right))).then_some(side))
    }

    /// Joins the named lanes that follow one another, and moves the reference lines to the axes that
    /// all vehicles show.
    fn find_axes<E>(&mut self, each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>) -> Result<(), E> {
        for turn in 0..AXIS_TURNS {
            let mut observed = vec![ObservedLanes::new(AXIS_SECTION_M); self.directions.len()];
            let mut names_lanes = false;
            let mut kept = KeptDirection::default();
            each_row(&mut |pose| {
                let Some((direction, lane)) = kept.choose(&pose, self).zip(pose.named_lane) else { return };
                names_lanes = true;
                let projection = self.directions[direction].line.project(pose.point);
                let observed = &mut observed[direction];
                if turn == 0 {
                    let Pose { vehicle, changes_lane, .. } = pose;
                    observed.observer.add(LaneRow { vehicle, lane, changes_lane, s_m: projection.s_m });
                }
                if follows(&pose, &projection) {
                    observed.add_position(pose.vehicle, lane, &projection);
                }
            })?;
            self.names_lanes = names_lanes;
            if !names_lanes {
                self.doubt_few_paths(each_row)?;
                return self.find_unnamed_axes(each_row);
            }
            for (direction, observed) in self.directions.iter_mut().zip(observed) {
                if turn == 0 {
                    direction.strands = observed.observer.strands();
                }
                let positions = observed.positions.in_lanes(|lane| direction.strands.of_lane(lane));
                direction.line = positions.axis(&direction.line);
            }
        }
        Ok(())
    }

    /// Doubts a bent road that few vehicles show: its line follows the path of one of them, which may change
    /// lanes.
    fn doubt_few_paths<E>(
        &mut self,
        each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut vehicles: Vec<BTreeSet<u64>> = vec![BTreeSet::new(); self.directions.len()];
        self.each_following(each_row, |direction, vehicle, _| {
            vehicles[direction].insert(vehicle);
        })?;
        for (direction, vehicles) in self.directions.iter().zip(vehicles) {
            let count = vehicles.len();
            if count < LEAST_VEHICLES && direction.line.bend_m() > STRAIGHT_M {
                self.doubts.push(format!(
                    "the file names no lanes, and the road is derived from the paths of {count} vehicles, which does not show whether the \
                     road bends or a vehicle changes lanes: {LEAST_VEHICLES} vehicles are needed"
                ));
            }
        }
        Ok(())
    }

    /// Moves the reference lines to the axes that all vehicles show, if rows name no lanes, and takes the
    /// lane width from the traffic; see `unnamed_lanes`.
    fn find_unnamed_axes<E>(
        &mut self,
        each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    ) -> Result<(), E> {
        self.directions.iter_mut().for_each(|direction| direction.line = direction.line.with_steady_ends());
        for turn in 0..=AXIS_TURNS {
            let mut movements = vec![Movements::default(); self.directions.len()];
            self.each_following(each_row, |direction, vehicle, projection| {
                movements[direction].add(vehicle, projection);
            })?;
            if turn == AXIS_TURNS {
                // A straight line goes on where few vehicles drive.
                let bent = self.directions.iter().zip(&movements).filter(|(road, _)| road.line.bend_m() > STRAIGHT_M);
                let unknown = bent.map(|(_, movements)| movements.unknown_share()).fold(0.0, f64::max);
                self.doubts.extend((unknown > WARNED_SHARE).then(|| doubt_of_sections(unknown)));
                break;
            }
            for (direction, movements) in self.directions.iter_mut().zip(movements) {
                direction.line = movements.departures().moved(&direction.line, 0.0);
            }
        }
        for _ in 0..AXIS_TURNS {
            let mut positions = vec![LateralPositions::new(AXIS_SECTION_M); self.directions.len()];
            let mut latest: Option<(u64, i64)> = None;
            self.each_following(each_row, |direction, vehicle, projection| {
                let section = positions[direction].section(projection.s_m);
                if latest.replace((vehicle, section)) != Some((vehicle, section)) {
                    positions[direction].add(section, vehicle, projection.d_m);
                }
            })?;
            let fullest = positions.iter().max_by_key(|positions| positions.all().count());
            let stated_m = self.states_lane_width.then_some(self.lane_width_m);
            let Some(width_m) = fullest.and_then(|positions| lane_width_m(positions, stated_m)) else { return Ok(()) };
            self.lane_width_m = width_m;
            for (direction, positions) in self.directions.iter_mut().zip(&positions) {
                if let Some(line) = axis(positions, &direction.line, width_m) {
                    direction.line = line;
                }
            }
        }
        Ok(())
    }

    /// Calls `visit` with the direction, the vehicle and the projection of each row whose vehicle follows
    /// the road.
    fn each_following<E>(
        &self,
        each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
        mut visit: impl FnMut(usize, u64, &Projection),
    ) -> Result<(), E> {
        let mut kept = KeptDirection::default();
        each_row(&mut |pose| {
            let Some(direction) = kept.choose(&pose, self) else { return };
            let projection = self.directions[direction].line.project(pose.point);
            if follows(&pose, &projection) {
                visit(direction, pose.vehicle, &projection);
            }
        })
    }

    /// Compares the lanes in which the rows are placed with the lane changes that the file states.
    fn compare_lanes<E>(&mut self, each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>) -> Result<(), E> {
        let mut comparison = LaneComparison::default();
        let mut kept = KeptDirection::default();
        each_row(&mut |pose| {
            let Some(direction) = kept.choose(&pose, self).filter(|_| pose.named_lane.is_some()) else { return };
            let placed = self.place(direction, pose.point, pose.named_lane);
            let Some(Placed { s_m, d_m, lane }) = placed else { return };
            let Pose { vehicle, changes_lane, .. } = pose;
            comparison.add(ComparedRow { vehicle, changes_lane, s_m, d_m, lane }, self.lane_width_m);
        })?;
        comparison.end_vehicle(self.lane_width_m);
        self.doubts.extend(comparison.doubts());
        Ok(())
    }

    /// Counts the rows in each lane, and from them sets the lanes of each direction.
    fn count_lanes<E>(&mut self, each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>) -> Result<(), E> {
        let mut rows: BTreeMap<(usize, Option<Strand>, i64), u64> = BTreeMap::new();
        let mut strands: BTreeMap<(usize, Strand), StrandRows> = BTreeMap::new();
        let mut observed = vec![ObservedLanes::new(SECTION_M); self.directions.len()];
        let (mut astray, mut all) = (0_u64, 0_u64);
        let mut kept = KeptDirection::default();
        each_row(&mut |pose| {
            let Some(index) = kept.choose(&pose, self) else { return };
            let direction = &self.directions[index];
            let projection = direction.line.project(pose.point);
            let follows = follows(&pose, &projection);
            all += 1;
            astray += u64::from(!follows);
            let lane = pose.named_lane;
            let strand = lane.and_then(|lane| direction.strands.of_lane(lane));
            *rows.entry((index, strand, self.lane_beside(projection.d_m))).or_default() += 1;
            let Some((lane, strand)) = lane.zip(strand) else { return };
            let measured = strands.entry((index, strand)).or_default();
            measured.add(projection.d_m);
            let section = if follows { observed[index].add_position(pose.vehicle, lane, &projection) } else { None };
            if let Some(section) = section {
                measured.add_in_section(section, projection.d_m);
            }
        })?;
        self.astray = if all > 0 { astray as f64 / all as f64 } else { 0.0 };
        let mut by_direction = vec![BTreeMap::new(); self.directions.len()];
        for ((index, strand), measured) in strands {
            by_direction[index].insert(strand, measured);
        }
        let mut doubts = BTreeSet::new();
        let (mut first_lane, mut shift_m) = (0, 0.0);
        let of_directions = by_direction.into_iter().zip(observed).enumerate();
        for (direction, (index, (measured, observed))) in self.directions.iter_mut().zip(of_directions) {
            let LaneNumbers { numbers, is_mirrored } =
                LaneNumbers::of_strands(measured, &direction.strands, self.lane_width_m);
            direction.numbers = numbers;
            self.is_mirrored |= is_mirrored;
            let mut counts: BTreeMap<i64, u64> = BTreeMap::new();
            for ((_, strand, beside), count) in rows.iter().filter(|((other, ..), _)| *other == index) {
                let lane = strand.and_then(|strand| direction.numbers.get(&strand)).unwrap_or(beside);
                *counts.entry(*lane).or_default() += count;
            }
            let least = MIN_SHARE * counts.values().sum::<u64>() as f64;
            let used = || counts.iter().filter(|(_, count)| **count as f64 >= least).map(|(lane, _)| *lane);
            let (mut left, mut right) = (used().max().unwrap_or(0).max(0), used().min().unwrap_or(0).min(0));
            // A named lane next to the others counts, however few vehicles use it. Separate ramps do not count.
            let is_named = |lane: i64| direction.numbers.values().any(|named| *named == lane);
            while is_named(left + 1) {
                left += 1;
            }
            while is_named(right - 1) {
                right -= 1;
            }
            (direction.left, direction.lanes) = (left, left - right + 1);
            (direction.first_lane, direction.shift_m) = (first_lane, shift_m);
            let positions = observed.positions.in_lanes(|lane| direction.number(lane));
            doubts.extend(direction.place_lanes(&positions, self.lane_width_m));
            first_lane += direction.lanes + 1;
            shift_m -= direction.width_m() + SEPARATION_M;
        }
        self.doubts.extend(doubts);
        Ok(())
    }

    /// Returns the vehicle whose path is the reference line of a direction.
    pub(super) fn reference(&self, direction: usize) -> Option<u64> {
        self.directions.get(direction)?.reference
    }

    /// Returns `true` if lanes with higher indices lie further to the right.
    pub(super) fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// Returns `true` if rows name their lanes.
    pub(super) fn names_lanes(&self) -> bool {
        self.names_lanes
    }

    /// Returns the side on which vehicles pass the oncoming traffic, if the data show it.
    pub(super) fn oncoming_side(&self) -> Option<Side> {
        self.oncoming_side
    }

    /// Returns `true` if the lanes of the road are in doubt, as a warning says.
    pub(super) fn is_in_doubt(&self) -> bool {
        !self.doubts.is_empty()
    }

    /// Returns warnings about the road for a reader of results.
    pub(super) fn warnings(&self) -> Vec<String> {
        let astray = (self.astray > WARNED_SHARE).then(|| {
            format!(
                "in {:.0} % of the rows, a vehicle does not follow the road that was derived from the traffic: on intersections and \
                 roundabouts, lanes and lane changes mean nothing",
                100.0 * self.astray
            )
        });
        astray.into_iter().chain(self.doubts.iter().cloned()).collect()
    }

    /// Places a point on the road in the given direction, in the lane that the file names, if it does.
    /// Returns `None` if there is no such direction.
    pub(super) fn place(&self, direction: usize, point: Point, named_lane: Option<StatedLane>) -> Option<Placed> {
        let direction = self.directions.get(direction)?;
        let projection = direction.line.project(point);
        let d_m = projection.d_m - direction.weaving.at(projection.s_m);
        let lane = match named_lane.and_then(|lane| direction.number(lane)) {
            Some(lanes) => direction.left - lanes + 1,
            None => direction.edges_m.iter().skip(1).filter(|edge_m| d_m < **edge_m).count() as i64 + 1,
        };
        Some(Placed {
            s_m: projection.s_m,
            d_m: d_m - direction.left_edge_m() + direction.shift_m,
            lane: u8::try_from(lane.clamp(1, direction.lanes) + direction.first_lane).unwrap_or(u8::MAX),
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
        lanes_of(d_m, self.lane_width_m)
    }

    /// Returns the lane markings of all directions.
    pub(super) fn markings(&self) -> LaneMarkings {
        let edges = self.directions.iter().flat_map(|direction| {
            // Lane 0 of the first direction does not exist. Lane 0 of a later direction is the
            // omitted lane, whose right edge is the direction's left edge.
            direction.edges_m.iter().zip(0..).map(move |(edge_m, lane)| {
                let edge_m = direction.shift_m + edge_m - direction.left_edge_m();
                (u8::try_from(direction.first_lane + lane).unwrap_or(u8::MAX), edge_m)
            })
        });
        LaneMarkings::from_right_edges(edges.filter(|(lane, _)| *lane > 0).map(|(lane, edge_m)| (Lane(lane), edge_m)))
    }
}

impl Direction {
    /// Creates a direction of a single lane.
    fn along(line: ReferenceLine, heading_rad: f64) -> Self {
        let (strands, numbers, weaving) = (Strands::default(), BTreeMap::new(), Departures::default());
        let (reference, first_lane, shift_m, edges_m) = (None, 0, 0.0, Vec::new());
        let (left, lanes) = (0, 1);
        Self { heading_rad, reference, line, left, lanes, strands, numbers, weaving, edges_m, first_lane, shift_m }
    }

    /// Returns by how many lanes a named lane lies to the left of the reference line's lane.
    fn number(&self, lane: StatedLane) -> Option<i64> {
        self.numbers.get(&self.strands.of_lane(lane)?).copied()
    }

    /// Sets the edges of the lanes, and the weaving of the reference line, from the positions of
    /// vehicles in the lanes. Returns why the lanes are in doubt, if they are.
    fn place_lanes(&mut self, positions: &LateralPositions<i64>, lane_width_m: f64) -> Option<String> {
        let fit = positions.fit();
        let middles_m = in_order(&fit, lane_width_m);
        let middle_m = |lanes: i64| middles_m.get(&lanes).copied();
        let edge_m = |right_of: i64| match (middle_m(right_of), middle_m(right_of - 1)) {
            (Some(left_m), Some(right_m)) => 0.5 * (left_m + right_m),
            (Some(left_m), None) => left_m - 0.5 * lane_width_m,
            (None, Some(right_m)) => right_m + 0.5 * lane_width_m,
            (None, None) => (right_of as f64 - 0.5) * lane_width_m,
        };
        self.edges_m = (0..=self.lanes).map(|lane| edge_m(self.left + 1 - lane)).collect();
        let doubt = spread(positions, &fit, lane_width_m);
        self.weaving = fit.departures;
        doubt
    }

    /// Returns the left edge of the leftmost lane (m to the left of the line).
    fn left_edge_m(&self) -> f64 {
        self.edges_m.first().copied().unwrap_or_default()
    }

    /// Returns the width of all lanes (m).
    fn width_m(&self) -> f64 {
        self.left_edge_m() - self.edges_m.last().copied().unwrap_or_default()
    }
}

/// Returns the middles of the lanes (m to the left of the line), each at least [`LEAST_APART`] beside
/// its neighbours. Vehicles that merge drive in the lane of others, so that measured middles may lie
/// too close. The lane with the most positions stays where it is.
fn in_order(fit: &LateralFit<i64>, lane_width_m: f64) -> BTreeMap<i64, f64> {
    let mut middles_m = fit.middles_m.clone();
    let Some((&fullest, _)) = fit.counts.iter().max_by_key(|(_, count)| **count) else { return middles_m };
    let apart_m = |lanes: i64| LEAST_APART * lane_width_m * lanes as f64;
    let mut latest: Option<(i64, f64)> = None;
    for (lane, middle_m) in middles_m.range_mut(fullest..) {
        if let Some((right, right_m)) = latest {
            *middle_m = middle_m.max(right_m + apart_m(lane - right));
        }
        latest = Some((*lane, *middle_m));
    }
    latest = None;
    for (lane, middle_m) in middles_m.range_mut(..=fullest).rev() {
        if let Some((left, left_m)) = latest {
            *middle_m = middle_m.min(left_m - apart_m(left - lane));
        }
        latest = Some((*lane, *middle_m));
    }
    middles_m
}

/// Returns the doubt about lanes whose vehicles are spread over more than the width of a lane.
/// Returns no doubt if too few vehicles show how the reference line weaves.
fn spread(positions: &LateralPositions<i64>, fit: &LateralFit<i64>, lane_width_m: f64) -> Option<String> {
    if fit.departures.is_empty() {
        return None;
    }
    let (mut spread, mut all) = (0_usize, 0_usize);
    for deviations_m in positions.deviations_m(fit).into_values() {
        let positions = deviations_m.len();
        all += positions;
        let usual_m = median(deviations_m.into_iter().map(f64::abs).collect());
        spread += if usual_m > LARGEST_SPREAD * lane_width_m { positions } else { 0 };
    }
    let share = spread as f64 / all.max(1) as f64;
    (share > WARNED_SPREAD).then(|| {
        format!(
            "the file names lanes that are not the lanes of the road, and lane changes are missing: {:.0} % of the vehicles drive \
             in a named lane whose vehicles are spread over more than the width of a lane",
            100.0 * share
        )
    })
}

/// Returns a path without the deviations that are shorter than [`SMOOTHED_M`]. The result is twice the
/// moving average minus the moving average of that average, which keeps bends where they are (J. W.
/// Tukey, *Exploratory Data Analysis*, 1977, "twicing").
fn smoothed(points: &[Point]) -> Vec<Point> {
    let mut along_m = vec![0.0];
    for pair in points.windows(2) {
        let step_m = maths::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        along_m.push(along_m.last().copied().unwrap_or_default() + step_m);
    }
    let length_m = along_m.last().copied().unwrap_or_default();
    let average = |values: &[Point]| -> Vec<Point> {
        let at = |&middle_m: &f64| {
            // The window is symmetrical, so that it shrinks towards both ends.
            let half_m = SMOOTHED_M.min(middle_m).min(length_m - middle_m);
            let first = along_m.partition_point(|m| *m < middle_m - half_m);
            let after = along_m.partition_point(|m| *m <= middle_m + half_m).max(first + 1);
            let window = &values[first.min(values.len() - 1)..after.min(values.len())];
            let sum = window.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
            (sum.0 / window.len() as f64, sum.1 / window.len() as f64)
        };
        along_m.iter().take(values.len()).map(at).collect()
    };
    let once = average(points);
    let twice = average(&once);
    once.iter().zip(&twice).map(|(once, twice)| (2.0 * once.0 - twice.0, 2.0 * once.1 - twice.1)).collect()
}

/// Returns the doubt about a road if too few vehicles show how parts of it go on.
fn doubt_of_sections(unknown: f64) -> String {
    format!(
        "the file names no lanes, and {:.0} % of its rows are where fewer than {LEAST_MOVING} vehicles show whether the road bends or a \
         vehicle changes lanes: lane changes there may be wrong or missing",
        100.0 * unknown
    )
}

/// Returns the section of the road at `s_m`.
fn section(s_m: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
    let section = (s_m / SECTION_M).floor() as i64;
    section
}

/// A path, with the properties that decide which path is the best.
struct RatedPath {
    stays_in_lane: bool,
    length_m: f64,
    path: DrivenPath,
}

impl RatedPath {
    /// Returns true if the vehicle may leave its lane although no row says so.
    const fn may_leave_its_lane(&self) -> bool {
        self.stays_in_lane && !self.path.names_lanes
    }
}

/// The place at which a vehicle enters a section of a path.
#[derive(Clone, Copy)]
struct SectionEntry {
    vehicle: u64,
    /// Index of the path.
    path: usize,
    section: i64,
    /// Lateral position (m).
    d_m: f64,
}

/// Returns the best path of each direction, and the mean lane width that the rows state (m), if they do.
/// `changing` holds vehicles that change lanes; those whose rows say so are added.
fn best_paths<E>(
    each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    changing: &mut BTreeSet<u64>,
) -> Result<(Vec<RatedPath>, Option<f64>), E> {
    let mut paths: Vec<RatedPath> = Vec::new();
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
        if pose.changes_lane {
            changing.insert(pose.vehicle);
        }
        current.changes_lanes |= changing.contains(&pose.vehicle);
        current.names_lanes |= pose.named_lane.is_some();
        let point = pose.point;
        let is_far = |last: &Point| maths::hypot(point.0 - last.0, point.1 - last.1) >= SPACING_M;
        if current.points.last().is_none_or(is_far) && current.points.len() < MAX_POINTS {
            current.points.push(point);
        }
    })?;
    keep_best_path(&mut paths, current);
    Ok((paths, (widths > 0).then(|| width_sum_m / f64::from(widths))))
}

/// Returns the vehicles of `paths` that leave their lanes although no row says so: from section to
/// section, most vehicles move to the other side of the path.
fn leaving_their_lanes<E>(
    each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    paths: &[RatedPath],
    lane_width_m: f64,
) -> Result<Vec<u64>, E> {
    if !paths.iter().any(RatedPath::may_leave_its_lane) {
        return Ok(Vec::new());
    }
    let line = |path: &DrivenPath| ReferenceLine::through(path.points.iter().copied());
    let lines: Vec<(f64, ReferenceLine)> =
        paths.iter().map(|rated| (rated.path.heading_rad, line(&rated.path))).collect();
    // For each path, the movements of vehicles to its left since the section before (m), by section.
    let mut movements_m: Vec<BTreeMap<i64, Vec<f64>>> = vec![BTreeMap::new(); lines.len()];
    let mut latest: Option<SectionEntry> = None;
    each_row(&mut |pose| {
        let before = latest.filter(|entry| entry.vehicle == pose.vehicle);
        let agrees = |(heading_rad, _): &(f64, ReferenceLine)| maths::cos(pose.heading_rad - heading_rad);
        let nearest =
            || lines.iter().map(agrees).enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index);
        let Some(index) = before.map(|entry| entry.path).or_else(nearest) else { return };
        let projection = lines[index].1.project(pose.point);
        let here = section(projection.s_m);
        if let Some(entry) = before {
            if entry.section == here {
                return;
            }
            if entry.section + 1 == here {
                movements_m[index].entry(here).or_default().push(projection.d_m - entry.d_m);
            }
        }
        latest = Some(SectionEntry { vehicle: pose.vehicle, path: index, section: here, d_m: projection.d_m });
    })?;
    let leaves = |movements_m: BTreeMap<i64, Vec<f64>>| {
        let (mut moved_m, mut least_m, mut most_m) = (0.0_f64, 0.0_f64, 0.0_f64);
        for values in movements_m.into_values().filter(|values| values.len() >= LEAST_DRIVERS) {
            moved_m += median(values);
            (least_m, most_m) = (least_m.min(moved_m), most_m.max(moved_m));
        }
        most_m - least_m > LEAVES_LANE * lane_width_m
    };
    let judged = paths.iter().zip(movements_m).filter(|(rated, _)| rated.may_leave_its_lane());
    Ok(judged.filter_map(|(rated, movements_m)| rated.path.vehicle.filter(|_| leaves(movements_m))).collect())
}

/// Keeps the best path of each direction. A path without a lane change is better than a path with
/// one, and a longer path is better than a shorter path.
fn keep_best_path(paths: &mut Vec<RatedPath>, path: DrivenPath) {
    let Some(length_m) = ReferenceLine::through(path.points.iter().copied()).length_m() else { return };
    let rated = RatedPath { stays_in_lane: !path.changes_lanes, length_m, path };
    let same = |kept: &&mut RatedPath| maths::cos(kept.path.heading_rad - rated.path.heading_rad) > 0.0;
    match paths.iter_mut().find(same) {
        Some(kept) if (rated.stays_in_lane, rated.length_m) > (kept.stays_in_lane, kept.length_m) => *kept = rated,
        Some(_) => {}
        None => {
            paths.push(rated);
            paths.truncate(MAX_DIRECTIONS);
        }
    }
}
