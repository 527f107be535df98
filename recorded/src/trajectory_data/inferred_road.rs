//! A road that is inferred from its traffic: for layouts that state positions in a plane, and lanes
//! only by names.
//!
//! ```text
//!   ── ── ── ── ── ── ── ── ──   the lanes beside it, as far as 2 % of the rows reach
//!   ═══════════════════════════
//!   ── ── ── ── ── ── ── ── ──
//!     reference line: the longest path of a vehicle that keeps its lane
//! ```
//!
//! Each direction of travel has a reference line. Directions are placed 1 km beside each other, so
//! that their vehicles never meet. Vehicles on ramps count as being in the outermost lane.
//!
//! **Recorded lanes.** If rows name the lane of their vehicle (an edge with an index, a lanelet), each
//! name gets the lane number of its vehicles' mean position; names beside each other get different
//! numbers. A vehicle is then in the lane that the file names. Markings lie halfway between the median
//! positions in neighbouring lanes. A name whose vehicles are spread over more than a lane is ignored.
//! Without names, lanes are steps of the mean lane width, and a vehicle is in the lane at its position.
//!
//! **Weaving.** The reference line contains the weaving and the errors of one vehicle. If rows name
//! lanes, the line is smoothed first. Along the road, the median departure of all vehicles that keep
//! their lanes from the median position of their lane then shows the weaving, and it is subtracted.
//! Where fewer than ten vehicles show it, or rows name no lanes, a decimetre or two remain. If rows name
//! no lanes and most vehicles move to one side of a reference line by more than half a lane, its vehicle
//! changes lanes, and another path is taken.

use std::collections::{BTreeMap, BTreeSet};

use closecall_traffic::statistics::quantiles::median;
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

/// Largest standard deviation of the vehicles of a named lane, as a share of the lane width (-): that
/// of vehicles within a lane is 0.1, that of vehicles in two lanes 0.5.
const LARGEST_SPREAD: f64 = 0.4;

/// Least distance between the mean positions of two named lanes beside each other, as a share of the
/// lane width (-): vehicles that merge keep to the near side of a lane.
const LEAST_APART: f64 = 0.4;

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
/// Largest number of times that reference lines are chosen, because their vehicles leave their lanes.
const MOST_CHOICES: usize = 8;
/// Number of times that lanes and weaving are estimated in turns.
const TURNS: usize = 5;

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
    /// The lane that the file names, as a number of its own.
    pub(super) named_lane: Option<u64>,
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
    /// For each named lane, by how many lanes it lies to the left of the reference line's lane.
    named: BTreeMap<u64, i64>,
    /// Positions along the line and the distance of the lanes there to the left of where they usually
    /// are (m), in order.
    weaving_m: Vec<(f64, f64)>,
    /// Distances to the left of the line (m) of the edges of the lanes, from left to right.
    edges_m: Vec<f64>,
    /// Offset of the lane numbers, so that directions share no lane.
    first_lane: i64,
    /// Offset of the lateral position, so that directions do not meet (m).
    shift_m: f64,
}

/// The rows of one named lane.
#[derive(Clone, Debug, Default)]
struct NamedLane {
    rows: f64,
    sum_m: f64,
    squares_m2: f64,
    /// Positions of the vehicles that keep their lanes (m), one for each vehicle, by the section of the
    /// road.
    sections: BTreeMap<i64, Vec<f64>>,
    /// The first and the last section of its rows.
    reach: Option<(i64, i64)>,
}

impl NamedLane {
    fn add(&mut self, d_m: f64, section: i64) {
        let (first, last) = self.reach.unwrap_or((section, section));
        self.reach = Some((first.min(section), last.max(section)));
        self.rows += 1.0;
        self.sum_m += d_m;
        self.squares_m2 += d_m * d_m;
    }

    /// Returns true if both lanes are recorded in a section of the road, or in the next one.
    fn is_beside(&self, other: &Self) -> bool {
        self.reach.zip(other.reach).is_some_and(|((first, last), (others_first, others_last))| {
            first <= others_last + 1 && others_first <= last + 1
        })
    }

    fn mean_m(&self) -> f64 {
        self.sum_m / self.rows
    }

    fn sd_m(&self) -> f64 {
        (self.squares_m2 / self.rows - self.mean_m() * self.mean_m()).max(0.0).sqrt()
    }
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
    names_lanes: bool,
}

impl InferredRoad {
    /// Infers the road from the rows that `each_row` visits. It is called several times: for the
    /// reference lines, and for the lanes beside them. The rows of a vehicle have to follow one
    /// another.
    ///
    /// # Errors
    /// The error of `each_row`, or the reason why the traffic shows no road.
    pub(super) fn of<E>(
        mut each_row: impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    ) -> Result<Result<Self, TrajectoryFileProblem>, E> {
        let mut changing: BTreeSet<u64> = BTreeSet::new();
        let (mut paths, mut lane_width_m) = best_paths(&mut each_row, &mut changing)?;
        for _ in 1..MOST_CHOICES {
            let leaving = leaving_their_lanes(&mut each_row, &paths, lane_width_m)?;
            if leaving.is_empty() {
                break;
            }
            changing.extend(leaving);
            (paths, lane_width_m) = best_paths(&mut each_row, &mut changing)?;
        }
        let directions = paths.into_iter().filter_map(|(_, _, path)| {
            let points = if path.names_lanes { smoothed(&path.points) } else { path.points };
            let line = ReferenceLine::through(points.into_iter());
            line.length_m()?;
            let heading_rad = path.heading_rad;
            Some(Direction { reference: path.vehicle, ..Direction::along(line, heading_rad) })
        });
        let mut road = Self { lane_width_m, directions: directions.collect(), astray: 0.0 };
        if road.directions.is_empty() {
            return Ok(Err(TrajectoryFileProblem::NothingMoves));
        }
        road.count_lanes(each_row, &changing)?;
        if road.astray > REFUSED_SHARE {
            return Ok(Err(TrajectoryFileProblem::NoRoad { percent: 100.0 * road.astray }));
        }
        Ok(Ok(road))
    }

    /// Counts the rows in each lane, and from them sets the lanes of each direction. `changing` holds
    /// the vehicles that change lanes.
    fn count_lanes<E>(
        &mut self,
        mut each_row: impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
        changing: &BTreeSet<u64>,
    ) -> Result<(), E> {
        let mut rows: BTreeMap<(usize, Option<u64>, i64), u64> = BTreeMap::new();
        let mut named: BTreeMap<(usize, u64), NamedLane> = BTreeMap::new();
        let mut latest_section: Option<(u64, u64, i64)> = None;
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
            *rows.entry((direction, pose.named_lane, self.lane_beside(projection.d_m))).or_default() += 1;
            if let Some(name) = pose.named_lane {
                let lane = named.entry((direction, name)).or_default();
                let section = section(projection.s_m);
                lane.add(projection.d_m, section);
                let here = Some((pose.vehicle, name, section));
                if follows && latest_section != here && !changing.contains(&pose.vehicle) {
                    lane.sections.entry(section).or_default().push(projection.d_m);
                }
                latest_section = here;
            }
        })?;
        self.astray = if all > 0 { astray as f64 / all as f64 } else { 0.0 };
        let (mut first_lane, mut shift_m) = (0, 0.0);
        for (index, direction) in self.directions.iter_mut().enumerate() {
            let of_direction = named.iter().filter(|((other, _), _)| *other == index);
            let usable = of_direction.filter(|(_, lane)| lane.sd_m() <= LARGEST_SPREAD * self.lane_width_m);
            let usable: Vec<(u64, &NamedLane)> = usable.map(|((_, name), lane)| (*name, lane)).collect();
            direction.named = numbered(&usable, self.lane_width_m);
            let mut counts: BTreeMap<i64, u64> = BTreeMap::new();
            for ((_, name, beside), count) in rows.iter().filter(|((other, ..), _)| *other == index) {
                let lane = name.and_then(|name| direction.named.get(&name)).unwrap_or(beside);
                *counts.entry(*lane).or_default() += count;
            }
            let least = MIN_SHARE * counts.values().sum::<u64>() as f64;
            let used = || counts.iter().filter(|(_, count)| **count as f64 >= least).map(|(lane, _)| *lane);
            let (mut left, mut right) = (used().max().unwrap_or(0).max(0), used().min().unwrap_or(0).min(0));
            // A named lane next to the others counts, however few vehicles use it. Ramps apart do not.
            let is_named = |lane: i64| direction.named.values().any(|named| *named == lane);
            while is_named(left + 1) {
                left += 1;
            }
            while is_named(right - 1) {
                right -= 1;
            }
            (direction.left, direction.lanes) = (left, left - right + 1);
            (direction.first_lane, direction.shift_m) = (first_lane, shift_m);
            direction.place_lanes(&usable, self.lane_width_m);
            first_lane += direction.lanes + 1;
            shift_m -= direction.width_m() + SEPARATION_M;
        }
        Ok(())
    }

    /// Returns the vehicle whose path is the reference line of a direction.
    pub(super) fn reference(&self, direction: usize) -> Option<u64> {
        self.directions.get(direction)?.reference
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

    /// Places a point on the road in the given direction, in the lane that the file names, if it does.
    /// Returns `None` if there is no such direction.
    pub(super) fn place(&self, direction: usize, point: Point, named_lane: Option<u64>) -> Option<Placed> {
        let direction = self.directions.get(direction)?;
        let projection = direction.line.project(point);
        let d_m = projection.d_m - direction.weaving_at(projection.s_m);
        let lane = match named_lane.and_then(|name| direction.named.get(&name)) {
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
        let (named, weaving_m, edges_m) = (BTreeMap::new(), Vec::new(), Vec::new());
        let (reference, first_lane, shift_m) = (None, 0, 0.0);
        Self { heading_rad, reference, line, left: 0, lanes: 1, named, weaving_m, edges_m, first_lane, shift_m }
    }

    /// Sets the edges of the lanes, and the weaving of the reference line, from the named lanes.
    fn place_lanes(&mut self, named: &[(u64, &NamedLane)], lane_width_m: f64) {
        let mut sections: BTreeMap<i64, Vec<(i64, f64)>> = BTreeMap::new();
        for (name, lane) in named {
            let lanes = self.named.get(name).copied().unwrap_or_default();
            for (section, positions_m) in &lane.sections {
                sections.entry(*section).or_default().extend(positions_m.iter().map(|d_m| (lanes, *d_m)));
            }
        }
        let mut middles_m: BTreeMap<i64, f64> = BTreeMap::new();
        for _ in 0..TURNS {
            let mut positions_m: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
            for (section, vehicles) in &sections {
                let weaving_m = self.weaving_at(middle_of(*section));
                for (lanes, d_m) in vehicles {
                    positions_m.entry(*lanes).or_default().push(d_m - weaving_m);
                }
            }
            middles_m = positions_m.into_iter().map(|(lanes, values)| (lanes, median(values))).collect();
            let shown = sections.iter().filter(|(_, vehicles)| vehicles.len() >= LEAST_DRIVERS);
            let weaving = shown.map(|(section, vehicles)| {
                let departures = vehicles.iter().filter_map(|(lanes, d_m)| Some(d_m - middles_m.get(lanes)?));
                (middle_of(*section), median(departures.collect()))
            });
            self.weaving_m = weaving.collect();
        }
        let middle_m = |lanes: i64| middles_m.get(&lanes).copied();
        let edge_m = |right_of: i64| match (middle_m(right_of), middle_m(right_of - 1)) {
            (Some(left_m), Some(right_m)) => 0.5 * (left_m + right_m),
            (Some(left_m), None) => left_m - 0.5 * lane_width_m,
            (None, Some(right_m)) => right_m + 0.5 * lane_width_m,
            (None, None) => (right_of as f64 - 0.5) * lane_width_m,
        };
        self.edges_m = (0..=self.lanes).map(|lane| edge_m(self.left + 1 - lane)).collect();
    }

    /// Returns the left edge of the leftmost lane (m to the left of the line).
    fn left_edge_m(&self) -> f64 {
        self.edges_m.first().copied().unwrap_or_default()
    }

    /// Returns the width of all lanes (m).
    fn width_m(&self) -> f64 {
        self.left_edge_m() - self.edges_m.last().copied().unwrap_or_default()
    }

    /// Returns by how much the lanes are to the left of where they usually are (m), because the
    /// reference line weaves.
    fn weaving_at(&self, s_m: f64) -> f64 {
        let next = self.weaving_m.partition_point(|(at_m, _)| *at_m < s_m);
        match (next.checked_sub(1).and_then(|before| self.weaving_m.get(before)), self.weaving_m.get(next)) {
            (Some((from_m, from)), Some((to_m, to))) => from + (to - from) * (s_m - from_m) / (to_m - from_m),
            (Some((_, value)), None) | (None, Some((_, value))) => *value,
            (None, None) => 0.0,
        }
    }
}

/// Returns the number of each named lane: by how many lanes it lies to the left of the reference line.
/// The nearest lanes are numbered first.
fn numbered(named: &[(u64, &NamedLane)], lane_width_m: f64) -> BTreeMap<u64, i64> {
    let mut by_distance = named.to_vec();
    by_distance.sort_by(|(_, a), (_, b)| a.mean_m().abs().total_cmp(&b.mean_m().abs()));
    let mut placed: Vec<(u64, &NamedLane, i64)> = Vec::new();
    for (name, lane) in by_distance {
        let mut number = lanes_of(lane.mean_m(), lane_width_m);
        for (_, other, others_number) in placed.iter().filter(|(_, other, _)| lane.is_beside(other)) {
            let left_m = lane.mean_m() - other.mean_m();
            if left_m > LEAST_APART * lane_width_m {
                number = number.max(others_number + 1);
            } else if left_m < -LEAST_APART * lane_width_m {
                number = number.min(others_number - 1);
            }
        }
        placed.push((name, lane, number));
    }
    placed.into_iter().map(|(name, _, number)| (name, number)).collect()
}

/// Returns a path without what is shorter than [`SMOOTHED_M`]: twice its moving average less the
/// average of that, which keeps bends where they are (J. W. Tukey, *Exploratory Data Analysis*, 1977,
/// "twicing").
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

/// Returns the number of lane widths in a distance.
fn lanes_of(d_m: f64, lane_width_m: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates, and what is far away is clamped")]
    let lanes = (d_m / lane_width_m).round() as i64;
    lanes.clamp(-MAX_LANES_BESIDE, MAX_LANES_BESIDE)
}

/// Returns the section of the road at `s_m`.
fn section(s_m: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
    let section = (s_m / SECTION_M).floor() as i64;
    section
}

/// Returns the middle of a section (m).
fn middle_of(section: i64) -> f64 {
    (section as f64 + 0.5) * SECTION_M
}

/// Whether the vehicle of a path stays in its lane, the length of the path (m), and the path.
type RatedPath = (bool, f64, DrivenPath);

/// Returns the best path of each direction, and the mean lane width that the rows state, or else the
/// usual one (m). `changing` holds vehicles that change lanes; those whose rows say so are added.
fn best_paths<E>(
    each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    changing: &mut BTreeSet<u64>,
) -> Result<(Vec<RatedPath>, f64), E> {
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
    let lane_width_m = if widths > 0 { width_sum_m / f64::from(widths) } else { FALLBACK_LANE_WIDTH_M };
    Ok((paths, lane_width_m))
}

/// Returns the vehicles of `paths` that leave their lanes although no row says so: from section to
/// section, most vehicles move to the other side of the path.
fn leaving_their_lanes<E>(
    each_row: &mut impl FnMut(&mut dyn FnMut(Pose)) -> Result<(), E>,
    paths: &[RatedPath],
    lane_width_m: f64,
) -> Result<Vec<u64>, E> {
    if !paths.iter().any(|(stays, _, path)| *stays && !path.names_lanes) {
        return Ok(Vec::new());
    }
    let line = |path: &DrivenPath| ReferenceLine::through(path.points.iter().copied());
    let lines: Vec<(f64, ReferenceLine)> = paths.iter().map(|(_, _, path)| (path.heading_rad, line(path))).collect();
    // For each path, the movements of vehicles to its left since the section before (m), by section.
    let mut movements_m: Vec<BTreeMap<i64, Vec<f64>>> = vec![BTreeMap::new(); lines.len()];
    // Vehicle, path, section, and the lateral position at its start (m).
    let mut latest: Option<(u64, usize, i64, f64)> = None;
    each_row(&mut |pose| {
        let before = latest.filter(|(vehicle, ..)| *vehicle == pose.vehicle);
        let agrees = |(heading_rad, _): &(f64, ReferenceLine)| maths::cos(pose.heading_rad - heading_rad);
        let nearest =
            || lines.iter().map(agrees).enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index);
        let Some(index) = before.map(|(_, index, ..)| index).or_else(nearest) else { return };
        let projection = lines[index].1.project(pose.point);
        let here = section(projection.s_m);
        if let Some((_, _, section_before, d_m)) = before {
            if section_before == here {
                return;
            }
            if section_before + 1 == here {
                movements_m[index].entry(here).or_default().push(projection.d_m - d_m);
            }
        }
        latest = Some((pose.vehicle, index, here, projection.d_m));
    })?;
    let leaves = |movements_m: BTreeMap<i64, Vec<f64>>| {
        let (mut moved_m, mut least_m, mut most_m) = (0.0_f64, 0.0_f64, 0.0_f64);
        for values in movements_m.into_values().filter(|values| values.len() >= LEAST_DRIVERS) {
            moved_m += median(values);
            (least_m, most_m) = (least_m.min(moved_m), most_m.max(moved_m));
        }
        most_m - least_m > LEAVES_LANE * lane_width_m
    };
    let judged = paths.iter().zip(movements_m).filter(|((stays, _, path), _)| *stays && !path.names_lanes);
    Ok(judged.filter_map(|((_, _, path), movements_m)| path.vehicle.filter(|_| leaves(movements_m))).collect())
}

/// Keeps the best path of each direction. A path without a lane change is better than a path with
/// one, and a longer path is better than a shorter path.
fn keep_best_path(paths: &mut Vec<RatedPath>, path: DrivenPath) {
    let Some(length_m) = ReferenceLine::through(path.points.iter().copied()).length_m() else { return };
    let stays = !path.changes_lanes;
    let same = |kept: &&mut RatedPath| maths::cos(kept.2.heading_rad - path.heading_rad) > 0.0;
    match paths.iter_mut().find(same) {
        Some(kept) if (stays, length_m) > (kept.0, kept.1) => *kept = (stays, length_m, path),
        Some(_) => {}
        None => {
            paths.push((stays, length_m, path));
            paths.truncate(MAX_DIRECTIONS);
        }
    }
}
