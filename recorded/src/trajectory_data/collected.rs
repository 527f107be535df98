//! Files that are read as a whole before their first row is known: vehicles have names instead of
//! numbers, frames have times instead of numbers, and positions lie in a plane.
//!
//! ```text
//!   SUMO ──────────────────────┐
//!   Vissim, with coordinates ──┴─▶ positions in a plane ─▶ inferred road ─┐
//!   Vissim, with links ────────┬─▶ positions on roads ───────────────────┴─▶ rows
//!   I-24 MOTION ───────────────┘
//! ```

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};

use closecall_traffic::{Side, Time, VehicleClass, maths};

use super::builder::PIECE_STRIDE;
use super::class_names::{UnknownClass, UnknownClasses};
use super::continuity::{JUMP_ACROSS_M, JUMP_ALONG_M, JUMP_ALONG_MPS, LONGEST_BRIDGE};
use super::data::MarkingDistances;
use super::error::TrajectoryFileProblem;
use super::file_layout::Layout;
use super::inferred_road::{InferredRoad, MIRRORED, Placed, Pose};
use super::lane_sides::LaneSides;
use super::markings::LaneMarkings;
use super::plain::allowed;
use super::plane_pieces::{PlaneMoment, PlanePieces};
use super::plane_steps::PlaneSteps;
use super::reference_line::Point;
use super::source::{Clock, FileInfo, ReadError, Row, RowSource};
use super::stated_lanes::StatedLane;

/// Largest number of rows of a file that is read as a whole: they take about 3 GiB.
const MAX_ROWS: usize = 20_000_000;

/// Shortest step between two frames: shorter ones are the rounding of a file.
const SHORTEST_STEP: Time = Time::from_ms(1);

/// The most frequent step counts if at least one in this number of steps is equal to it. If times
/// jitter, no step is so frequent, and the median step counts.
const RARE: usize = 10;
/// Share of a step by which steps may differ before their mean is taken (-), as in `assemble`.
const UNEVENNESS: f64 = 0.02;

/// Lateral movement within one step that makes a lane change a jump (m): half a narrow lane.
const JUMP_M: f64 = 1.5;
/// Lateral speed of such a jump (m/s): twice as fast as the fastest lane changes.
const JUMP_MPS: f64 = 4.0;
/// Lateral reach above which a vehicle changes lanes (m): half a lane, and above the swaying of two
/// drivers.
const LANE_CHANGE_M: f64 = 1.75;
/// Largest number of vehicles that are tried as references: of ten drivers on a section, one or two
/// change lanes.
const MAX_REFERENCES: usize = 20;

/// Number of lane changes within a single step that may have another cause.
const FEW_JUMPS: usize = 0;

/// A position, as the layout states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Position {
    /// In a plane; the point is the centre of the vehicle's box.
    Plane {
        point: Point,
        heading_rad: f64,
        /// `true` if the vehicle leaves its lane in this row.
        changes_lane: bool,
        /// The lane that the file names.
        named_lane: Option<StatedLane>,
    },
    /// On a road. A file may hold several. `s_m` is the centre of the vehicle's box.
    Road { road: u32, s_m: f64, d_m: f64, lane: u8 },
}

impl Position {
    /// Returns `true` if the file states, apart from the point, which lane is to the left.
    const fn names_sides(&self) -> bool {
        match self {
            Self::Road { .. } => true,
            Self::Plane { named_lane, .. } => matches!(named_lane, Some(StatedLane { index: Some(_), .. })),
        }
    }

    /// Returns `true` if both positions are of one vehicle.
    fn is_at(self, other: Self) -> bool {
        let (along_m, across_m) = match (self, other) {
            (Self::Plane { point: a, .. }, Self::Plane { point: b, .. }) => (a.0 - b.0, a.1 - b.1),
            (Self::Road { road: a, s_m, d_m, .. }, Self::Road { road: b, s_m: other_s_m, d_m: other_d_m, .. })
                if a == b =>
            {
                (s_m - other_s_m, d_m - other_d_m)
            }
            _ => return false,
        };
        maths::hypot(along_m, across_m) <= JUMP_ACROSS_M
    }
}

/// A row whose vehicle has an index instead of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CollectedRow {
    pub(super) vehicle: u32,
    pub(super) time: Time,
    pub(super) position: Position,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: Option<f64>,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) class: VehicleClass,
    pub(super) line: u64,
}

impl CollectedRow {
    /// Returns the vehicle in the plane.
    fn moment(&self, point: Point, heading_rad: f64, clock: Clock) -> PlaneMoment {
        let (vehicle, time, speed_mps) = (u64::from(self.vehicle), self.time, self.speed_mps);
        PlaneMoment { vehicle, time, point, heading_rad, speed_mps, clock }
    }

    /// Returns `true` if the file states the same in both rows. `changes_lane` depends on the row
    /// before.
    fn repeats(&self, other: &Self) -> bool {
        let stated = |row: &Self| {
            let mut row = Self { line: 0, ..*row };
            if let Position::Plane { changes_lane, .. } = &mut row.position {
                *changes_lane = false;
            }
            row
        };
        stated(self) == stated(other)
    }
}

/// The facts about a file that its reader has collected after the last row.
#[derive(Debug)]
pub(super) struct Facts {
    pub(super) layout: Layout,
    pub(super) clock: Clock,
    /// Lane width, if the traffic or the layout gives it (m); for positions in a plane.
    pub(super) lane_width_m: Option<f64>,
    /// Lane markings; for positions on roads.
    pub(super) markings: Option<LaneMarkings>,
    pub(super) notes: Vec<String>,
    /// Why the file is mirrored, unless its caller says that it is.
    pub(super) mirrored: Option<&'static str>,
    pub(super) unknown_classes: UnknownClasses,
}

/// The rows of a file, in its order.
#[derive(Default)]
pub(super) struct Collected {
    /// Index of each vehicle, by its name in the file.
    vehicles: HashMap<String, u32>,
    names: Vec<String>,
    items: Vec<Result<CollectedRow, ReadError>>,
}

impl Collected {
    /// Returns the index of the vehicle with this name.
    pub(super) fn vehicle(&mut self, name: &str) -> u32 {
        if let Some(index) = self.vehicles.get(name) {
            return *index;
        }
        let index = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
        self.vehicles.insert(name.to_owned(), index);
        self.names.push(name.to_owned());
        index
    }

    /// Adds a row, or the reason why it cannot be used.
    ///
    /// # Errors
    /// The problem affects the whole file, or the file is too long.
    pub(super) fn push(&mut self, item: Result<CollectedRow, ReadError>) -> Result<(), ReadError> {
        if self.items.len() >= MAX_ROWS {
            return Err(ReadError::of_file(TrajectoryFileProblem::TooManyRows { allowed: MAX_ROWS }));
        }
        match item {
            Err(error) if !error.affects_one_row() => Err(error),
            item => {
                self.items.push(item);
                Ok(())
            }
        }
    }

    /// Changes the rows.
    pub(super) fn rows_mut(&mut self) -> impl Iterator<Item = &mut CollectedRow> {
        self.items.iter_mut().filter_map(|item| item.as_mut().ok())
    }

    /// Returns the source of the rows.
    ///
    /// # Errors
    /// The traffic shows no road.
    pub(super) fn into_source(self, facts: Facts) -> Result<CollectedSource, ReadError> {
        let Self { names, items, .. } = self;
        let mut notes = facts.notes;
        let numbers = numbers(&names, &mut notes);
        let rows: Vec<CollectedRow> = items.iter().filter_map(|item| item.as_ref().ok()).copied().collect();
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by_key(|&index| (rows[index].vehicle, rows[index].time, rows[index].line));
        let Doubled { mut contrary, repeated } = take_doubled(&rows, &mut order, &numbers);
        let period = period(&rows, &order);
        let road = check_steps((&rows, &order), (facts.layout, facts.clock))
            .and_then(|()| infer_road(&rows, &order, facts.lane_width_m, facts.clock));
        // Numbers of several vehicles are a reason why the traffic shows no road.
        let road = road.map_err(|error| contrary.pop_first().map_or(error, |(_, first)| first))?;
        notes.extend(road.iter().flat_map(InferredRoad::warnings));
        let is_in_doubt = road.as_ref().is_some_and(InferredRoad::is_in_doubt);
        let is_mirrored = road.as_ref().is_some_and(InferredRoad::is_mirrored);
        let mirrored = facts.mirrored.or_else(|| is_mirrored.then_some(MIRRORED));
        let oncoming_side = road.as_ref().and_then(InferredRoad::oncoming_side);
        let names_sides = rows.iter().any(|row| row.position.names_sides());
        let derives_lanes = road.as_ref().map_or(facts.layout == Layout::I24, |road| !road.names_lanes());
        let mut placed: Vec<Option<Row>> = vec![None; rows.len()];
        let start = rows.iter().map(|row| row.time).min().unwrap_or(Time::ZERO);
        let mut jumps: Vec<LaneJump> = Vec::new();
        for indices in order.chunk_by(|&a, &b| rows[a].vehicle == rows[b].vehicle) {
            let Some(&first) = indices.first() else { continue };
            let first_frame = steps(rows[first].time - start, period);
            let mut pieces = PlanePieces::default();
            // The piece of the vehicle, and its direction of travel.
            let mut direction: Option<(u64, usize)> = None;
            // The row before, its road and its piece.
            let mut before: Option<(Row, u32, u64)> = None;
            let mut visits = 0;
            for &index in indices {
                let row = &rows[index];
                let (place, road_index, piece) = match row.position {
                    Position::Road { road, s_m, d_m, lane } => (Some(Placed { s_m, d_m, lane }), road, 0),
                    Position::Plane { point, heading_rad, named_lane, .. } => {
                        let inferred = road.as_ref();
                        let piece = pieces.number(row.moment(point, heading_rad, facts.clock));
                        let chosen = || Some((piece, inferred?.direction(heading_rad)?));
                        direction = direction.filter(|(before, _)| *before == piece).or_else(chosen);
                        let place = inferred.zip(direction);
                        (place.and_then(|(road, (_, direction))| road.place(direction, point, named_lane)), 0, piece)
                    }
                };
                let Some(Placed { s_m, d_m, lane }) = place else { continue };
                let vehicle_id = numbers[row.vehicle as usize];
                // A vehicle that enters another road begins a track. So does one after a gap, whose track is split later.
                visits += u64::from(before.is_some_and(|(_, last_road, _)| last_road != road_index));
                before = before.filter(|(last, last_road, last_piece)| {
                    (*last_road, *last_piece) == (road_index, piece) && row.time - last.time <= period + LONGEST_BRIDGE
                });
                let row = Row {
                    number: vehicle_id + visits * PIECE_STRIDE,
                    origin: Time::ZERO,
                    vehicle_id,
                    frame: first_frame + steps(row.time - rows[first].time, period),
                    time: row.time,
                    clock: facts.clock,
                    s_m,
                    d_m,
                    lane,
                    speed_mps: row.speed_mps,
                    acceleration_mps2: row.acceleration_mps2,
                    length_m: row.length_m,
                    width_m: row.width_m,
                    class: row.class,
                    marking_distances: MarkingDistances::default(),
                    line: row.line,
                };
                if let Some((last, ..)) = before.filter(|(last, ..)| is_lane_jump(last, &row)) {
                    jumps.push(LaneJump { index, road: road_index, before: last, row });
                }
                before = Some((row, road_index, piece));
                placed[index] = Some(row);
            }
        }
        let exchanged = exchanges(&mut jumps);
        let exchanged_rows = exchanged.len();
        for index in exchanged {
            // A recording has no lane changes of a single step, so that this one splits the track.
            placed[index] = placed[index].map(|row| Row { clock: Clock::Continuous, ..row });
        }
        for Repetition { index, of } in repeated {
            placed[index] = placed[of].map(|row| Row { line: rows[index].line, ..row });
        }
        let single_steps = jumps.len() - exchanged_rows;
        if facts.clock == Clock::Simulated && single_steps > FEW_JUMPS {
            notes.push(format!(
                "{single_steps} lane changes take a single step, because the simulation does not model their movement: their times, lanes and \
                 distances hold, their durations, lateral speeds and lateral accelerations mean nothing"
            ));
        }
        let mut placed = placed.into_iter().enumerate();
        let items = items.into_iter().filter_map(|item| match item {
            Ok(_) => {
                let (index, row) = placed.next()?;
                contrary.remove(&index).map(Err).or_else(|| row.map(Ok))
            }
            Err(error) => Some(Err(error)),
        });
        let markings = facts.markings.or_else(|| road.as_ref().map(InferredRoad::markings));
        let info = FileInfo { layout: facts.layout, name: None, period: Some(period), markings };
        let (items, unknown_classes) = (items.collect(), facts.unknown_classes);
        let lane_sides = LaneSides::default();
        let road = RoadFacts { is_in_doubt, mirrored, names_sides, derives_lanes, oncoming_side };
        Ok(CollectedSource { items, info, notes, road, unknown_classes, lane_sides })
    }
}

/// Returns the speed at row `k` of `rows` of a vehicle (m/s), by the step before and the step after it.
/// `step` returns the distance (m) and the time (s) between two rows. Where one of both steps is one that no
/// vehicle makes, because a number was given to another vehicle, or one over a gap, the other one gives the speed.
pub(super) fn derived_speed_mps(k: usize, rows: usize, step: impl Fn(usize, usize) -> (f64, f64)) -> f64 {
    let speed_mps = |from: usize, to: usize| {
        let (along_m, span_s) = step(from, to);
        if span_s > 0.0 { along_m / span_s } else { 0.0 }
    };
    let (before, after) = (k.saturating_sub(1), (k + 1).min(rows.saturating_sub(1)));
    if before < k && k < after {
        let (arriving_mps, leaving_mps) = (speed_mps(before, k), speed_mps(k, after));
        let longer_s = step(k, after).1 - step(before, k).1;
        if longer_s.abs() > LONGEST_BRIDGE.s() {
            return if longer_s > 0.0 { arriving_mps } else { leaving_mps };
        }
        if (leaving_mps - arriving_mps).abs() > JUMP_ALONG_MPS {
            return if arriving_mps.abs() < leaving_mps.abs() { arriving_mps } else { leaving_mps };
        }
    }
    speed_mps(before, after)
}

/// Returns the number of each vehicle. If all names are numbers, it is the name. Otherwise vehicles are
/// numbered in the order in which they appear.
fn numbers(names: &[String], notes: &mut Vec<String>) -> Vec<u64> {
    if let Some(stated) = distinct_numbers(names.iter().map(String::as_str), allowed::IDS.1.unsigned_abs()) {
        return stated;
    }
    if let [first, .., last] = names {
        notes.push(format!(
            "the names of vehicles are not numbers: they are numbered in the order of their first rows, `{first}` is 1 and `{last}` is {}",
            names.len()
        ));
    }
    (1..=names.len() as u64).collect()
}

/// Returns the names as numbers, if all are numbers up to `largest` and no number occurs twice.
pub(super) fn distinct_numbers<'n>(names: impl Iterator<Item = &'n str>, largest: u64) -> Option<Vec<u64>> {
    let number = |name: &str| name.parse::<u64>().ok().filter(|number| *number <= largest);
    let numbers: Vec<u64> = names.map(number).collect::<Option<_>>()?;
    let distinct: BTreeSet<u64> = numbers.iter().copied().collect();
    (distinct.len() == numbers.len()).then_some(numbers)
}

/// Returns the number of periods in `span`.
fn steps(span: Time, period: Time) -> i64 {
    (span.ns() + period.ns() / 2).div_euclid(period.ns())
}

/// Returns the time between two frames. It is the most frequent time between two successive rows of a
/// vehicle, or the mean of such times if they are rounded or jitter.
fn period(rows: &[CollectedRow], order: &[usize]) -> Time {
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    let mut steps_us: Vec<i64> = Vec::new();
    for pair in order.windows(2) {
        let (before, after) = (&rows[pair[0]], &rows[pair[1]]);
        let step = after.time - before.time;
        if before.vehicle == after.vehicle && step >= SHORTEST_STEP {
            // Times since 1970 are accurate to a microsecond.
            let microseconds = (step.ns() + 500) / 1_000;
            *counts.entry(microseconds).or_default() += 1;
            steps_us.push(microseconds);
        }
    }
    let usual = counts.into_iter().rev().max_by_key(|(_, count)| *count);
    let Some((usual_us, count)) = usual else { return Time::from_ms(1_000) };
    let middle = steps_us.len() / 2;
    let is_rare = RARE * count < steps_us.len();
    let usual_us = if is_rare { *steps_us.select_nth_unstable(middle).1 } else { usual_us };
    // Longer steps are gaps.
    steps_us.retain(|step_us| 2 * step_us > usual_us && 2 * step_us < 3 * usual_us);
    let is_uneven = |step_us: &i64| (step_us - usual_us).abs() as f64 > UNEVENNESS * usual_us as f64;
    if !steps_us.iter().any(is_uneven) {
        return Time::from_ns(1_000 * usual_us);
    }
    Time::from_ns(1_000 * steps_us.iter().sum::<i64>() / steps_us.len().max(1) as i64)
}

/// Checks the steps of vehicles whose positions lie in a plane.
///
/// # Errors
/// Positions contradict headings, speeds or times.
fn check_steps((rows, order): (&[CollectedRow], &[usize]), (layout, clock): (Layout, Clock)) -> Result<(), ReadError> {
    let mut steps = PlaneSteps::default();
    for &index in order {
        if let Position::Plane { point, heading_rad, .. } = rows[index].position {
            steps.add(rows[index].moment(point, heading_rad, clock));
        }
    }
    steps.check(layout).map_err(ReadError::of_file)
}

/// A row with the values of another one.
struct Repetition {
    index: usize,
    /// Index of the other row.
    of: usize,
}

/// The rows of vehicles that already have a row at that time.
#[derive(Default)]
struct Doubled {
    /// The problem of each row with other values, by its index.
    contrary: BTreeMap<usize, ReadError>,
    repeated: Vec<Repetition>,
}

/// Takes the rows of a vehicle that already has a row at that time out of `order`, which is sorted by vehicle and
/// time.
fn take_doubled(rows: &[CollectedRow], order: &mut Vec<usize>, numbers: &[u64]) -> Doubled {
    let period = period(rows, order);
    let start = rows.iter().map(|row| row.time).min().unwrap_or(Time::ZERO);
    let mut doubled = Doubled::default();
    let mut kept: Option<usize> = None;
    order.retain(|&index| {
        let row = &rows[index];
        let at_once = |of: &usize| (rows[*of].vehicle, rows[*of].time) == (row.vehicle, row.time);
        let Some(of) = kept.filter(at_once) else {
            kept = Some(index);
            return true;
        };
        let CollectedRow { position, line: first_line, .. } = rows[of];
        if row.repeats(&rows[of]) {
            doubled.repeated.push(Repetition { index, of });
            return false;
        }
        let (vehicle, frame) = (numbers[row.vehicle as usize], steps(row.time - start, period));
        let problem = if position.is_at(row.position) {
            TrajectoryFileProblem::DuplicateRow { vehicle, frame, first_line }
        } else {
            TrajectoryFileProblem::SharedNumber { vehicle, frame, first_line }
        };
        doubled.contrary.insert(index, ReadError::new(row.line, problem));
        false
    });
    doubled
}

/// Infers the road, if positions lie in a plane.
///
/// If no row says who changes lanes, the vehicle whose path is the reference line may do so. Most
/// vehicles then seem to move to the other side, and another path becomes the reference line.
fn infer_road(
    rows: &[CollectedRow],
    order: &[usize],
    lane_width_m: Option<f64>,
    clock: Clock,
) -> Result<Option<InferredRoad>, ReadError> {
    if !rows.iter().any(|row| matches!(row.position, Position::Plane { .. })) {
        return Ok(None);
    }
    let infer = |changing: &BTreeSet<u64>| {
        let road = InferredRoad::of(|visit: &mut dyn FnMut(Pose)| {
            let mut pieces = PlanePieces::default();
            let mut before: Option<(u32, Option<StatedLane>)> = None;
            for &index in order {
                let row = &rows[index];
                if let Position::Plane { point, heading_rad, changes_lane, named_lane } = row.position {
                    let vehicle = pieces.number(row.moment(point, heading_rad, clock));
                    let last_lane = before.filter(|(vehicle, _)| *vehicle == row.vehicle).and_then(|(_, lane)| lane);
                    before = Some((row.vehicle, named_lane));
                    // A file that is not in order of time cannot say who changes lanes, row by row.
                    let changes_lane = match named_lane {
                        Some(StatedLane { edge, index: Some(index) }) => {
                            last_lane.is_some_and(|last| last.edge == edge && last.index != Some(index))
                        }
                        _ => changes_lane,
                    };
                    let changes_lane = changes_lane || changing.contains(&vehicle);
                    visit(Pose { vehicle, point, heading_rad, lane_width_m, changes_lane, named_lane });
                }
            }
            Ok::<(), ReadError>(())
        })?;
        road.map_err(ReadError::of_file)
    };
    let mut changing = BTreeSet::new();
    let mut road = infer(&changing)?;
    let is_silent =
        |position: &Position| matches!(position, Position::Plane { changes_lane: false, named_lane: None, .. });
    if rows.iter().all(|row| is_silent(&row.position)) {
        for _ in 0..MAX_REFERENCES {
            let before = changing.len();
            changing.extend(changing_references(&road, rows, order));
            if changing.len() == before {
                break;
            }
            road = infer(&changing)?;
        }
    }
    Ok(Some(road))
}

/// Returns the vehicle of the reference line of each direction in which most vehicles seem to change
/// lanes.
fn changing_references(road: &InferredRoad, rows: &[CollectedRow], order: &[usize]) -> Vec<u64> {
    let mut reaches_m: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for indices in order.chunk_by(|&a, &b| rows[a].vehicle == rows[b].vehicle) {
        let mut direction = None;
        let (mut left_m, mut right_m) = (f64::NEG_INFINITY, f64::INFINITY);
        for &index in indices {
            let Position::Plane { point, heading_rad, .. } = rows[index].position else { continue };
            direction = direction.or_else(|| road.direction(heading_rad));
            let Some(placed) = direction.and_then(|direction| road.place(direction, point, None)) else { continue };
            (left_m, right_m) = (left_m.max(placed.d_m), right_m.min(placed.d_m));
        }
        if let Some(direction) = direction {
            reaches_m.entry(direction).or_default().push(left_m - right_m);
        }
    }
    let changing = reaches_m.into_iter().filter_map(|(direction, mut reaches_m)| {
        let middle = reaches_m.len() / 2;
        let (_, usual_m, _) = reaches_m.select_nth_unstable_by(middle, f64::total_cmp);
        road.reference(direction).filter(|_| *usual_m > LANE_CHANGE_M)
    });
    changing.collect()
}

/// A change of the lane within a single step.
#[derive(Clone, Copy, Debug)]
struct LaneJump {
    /// Index of the later row.
    index: usize,
    road: u32,
    before: Row,
    row: Row,
}

impl LaneJump {
    /// Returns true if the vehicle takes the place of the vehicle of `other`, as that drives on.
    fn takes_place_of(&self, other: &Self) -> bool {
        let step_s = (other.row.time - other.before.time).s();
        let along_m = self.row.s_m - other.before.s_m - other.before.speed_mps * step_s;
        let across_m = self.row.d_m - other.before.d_m;
        along_m.abs() <= JUMP_ALONG_M && across_m.abs() <= JUMP_ACROSS_M
    }
}

/// Sorts the jumps by time, and returns the indices of the rows of those in which two vehicles beside each
/// other exchange their places: their numbers were exchanged, and no vehicle changes lanes.
fn exchanges(jumps: &mut [LaneJump]) -> Vec<usize> {
    jumps.sort_by_key(|jump| (jump.road, jump.row.time, jump.index));
    let mut exchanged = Vec::new();
    for at_once in jumps.chunk_by(|a, b| (a.road, a.row.time) == (b.road, b.row.time)) {
        for (k, jump) in at_once.iter().enumerate() {
            let is_mutual = |other: &LaneJump| jump.takes_place_of(other) && other.takes_place_of(jump);
            if at_once.iter().enumerate().any(|(other_k, other)| other_k != k && is_mutual(other)) {
                exchanged.push(jump.index);
            }
        }
    }
    exchanged
}

/// Returns true if a vehicle changes its lane within the step from `before` to `row`, and not by driving across the
/// marking.
pub(super) fn is_lane_jump(before: &Row, row: &Row) -> bool {
    let (across_m, step_s) = ((row.d_m - before.d_m).abs(), (row.time - before.time).s());
    before.lane != row.lane && across_m > JUMP_M.max(JUMP_MPS * step_s).min(0.9 * 2.0 * JUMP_M)
}

/// The rows of a file that was read as a whole.
pub(super) struct CollectedSource {
    items: VecDeque<Result<Row, ReadError>>,
    info: FileInfo,
    notes: Vec<String>,
    road: RoadFacts,
    unknown_classes: UnknownClasses,
    lane_sides: LaneSides,
}

/// What the rows show of the road.
#[derive(Clone, Copy, Debug)]
struct RoadFacts {
    is_in_doubt: bool,
    /// Why the file is mirrored, if no option says that it is.
    mirrored: Option<&'static str>,
    /// `true` if the file states, apart from its positions, which lane is to the left.
    names_sides: bool,
    /// `true` if the file states no lanes.
    derives_lanes: bool,
    oncoming_side: Option<Side>,
}

impl CollectedSource {
    /// Adds the order of the lanes that vehicles beside each other show.
    pub(super) fn with_lane_sides(self, lane_sides: LaneSides) -> Self {
        Self { lane_sides, ..self }
    }
}

impl RowSource for CollectedSource {
    fn info(&self) -> FileInfo {
        self.info.clone()
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.unknown_classes.names()
    }

    fn warnings(&self) -> Vec<String> {
        self.notes.iter().cloned().chain(self.road.mirrored.map(str::to_owned)).collect()
    }

    fn expect_mirrored(&mut self) {
        self.road.mirrored = None;
    }

    fn names_sides(&self) -> bool {
        self.road.names_sides
    }

    fn derives_lanes(&self) -> bool {
        self.road.derives_lanes
    }

    fn oncoming_side(&self) -> Option<Side> {
        self.road.oncoming_side
    }

    fn check_lane_sides(&self, is_mirrored: bool) -> Result<(), ReadError> {
        self.lane_sides.check(is_mirrored).map_err(ReadError::of_file)
    }

    fn is_in_doubt(&self) -> bool {
        self.road.is_in_doubt || self.road.mirrored.is_some()
    }

    fn next_row(&mut self) -> Result<Option<Row>, ReadError> {
        self.items.pop_front().transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_no_vehicle_makes_gives_no_speed() {
        // 20 m/s, and a jump of 200 m between rows 2 and 3.
        let s_m = |k: usize| 2.0 * k as f64 + if k > 2 { 200.0 } else { 0.0 };
        let step = |from: usize, to: usize| (s_m(to) - s_m(from), 0.1 * (to - from) as f64);
        for k in 0..6 {
            assert!((derived_speed_mps(k, 6, step) - 20.0).abs() < 1e-9, "row {k}");
        }
        // Braking is no jump: the speed is the mean of both steps.
        let at_m = [0.0, 1.6, 3.0];
        let braking = |from: usize, to: usize| (at_m[to] - at_m[from], 0.1 * (to - from) as f64);
        assert!((derived_speed_mps(1, 3, braking) - 15.0).abs() < 1e-9);
        assert_eq!(derived_speed_mps(0, 1, |_, _| (0.0, 0.0)).to_bits(), 0.0_f64.to_bits());
        // After 3 s, another vehicle is 10 m further on.
        let (at_m, at_s) = ([0.0, 2.0, 12.0, 15.0], [0.0, 0.1, 3.1, 3.2]);
        let with_gap = |from: usize, to: usize| (at_m[to] - at_m[from], at_s[to] - at_s[from]);
        assert!((derived_speed_mps(1, 4, with_gap) - 20.0).abs() < 1e-9);
        assert!((derived_speed_mps(2, 4, with_gap) - 30.0).abs() < 1e-9);
    }
}
