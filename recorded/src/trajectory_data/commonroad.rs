//! CommonRoad XML (versions 2018b and 2020a): lanelets and dynamic obstacles.
//!
//! (M. Althoff, M. Koschi, S. Manzinger, "CommonRoad: Composable benchmarks for motion planning on
//! roads", IV 2017; and the format's documentation.)
//!
//! Each state of a dynamic obstacle becomes a row. The row's number is the obstacle's id, its frame
//! is the time step, and its position is the middle of the obstacle's shape, projected onto the
//! road that the lanelets form; see `lanelets`. Several roads, such as the roads of both
//! directions, are shifted 1 km apart. Static obstacles, planning problems and signs are ignored. A
//! first state that repeats the initial state is one state. If a state has no acceleration, it is
//! derived from neighbouring frames. The reader rejects states whose values are intervals instead
//! of exact values.

use std::collections::BTreeMap;
use std::io::BufRead;

use closecall_traffic::{Time, VehicleClass, maths};

use super::class_names::{UnknownClass, UnknownClasses};
use super::data::MarkingDistances;
use super::fields::{Bounds, FieldError, integer, number};
use super::file_layout::Layout;
use super::lanelets::{Lanelet, Roads};
use super::mapped_rows::{MappedRow, MappedRows};
use super::plain::allowed;
use super::plane_pieces::PlaneMoment;
use super::plane_steps::PlaneSteps;
use super::reference_line::Point;
use super::source::{Clock, FileInfo, ReadError, Row, RowSource};
use super::xml::{Node, Xml};

/// The attributes that the reader uses.
const ATTRIBUTES: &[&str] = &["id", "ref", "drivingDir", "timeStepSize", "benchmarkID"];
/// Allowed time step. Shorter steps vanish when rounded to whole nanoseconds, or make derivatives
/// overflow.
const STEP_S: Bounds = Bounds::closed(0.001, 100.0);
const PLANE_M: Bounds = allowed::PLANE_M;
const ANGLE_RAD: Bounds = Bounds::closed(-100.0, 100.0);
const VELOCITY_MPS: Bounds = Bounds::closed(-150.0, 150.0);
const LANELET_IDS: (i64, i64) = (-1_000_000_000_000, 1_000_000_000_000);

/// Maximum number of points of all lanelets. A scenario of some kilometres has some thousands.
const MAX_POINTS: usize = 200_000;

/// Reads the states of a CommonRoad scenario.
pub(super) struct CommonRoadSource<R> {
    xml: Xml<R>,
    name: Option<String>,
    step: Option<Time>,
    lanelets: BTreeMap<i64, Lanelet>,
    points: usize,
    roads: Option<Roads>,
    lanelet: Option<(i64, Lanelet)>,
    point: Point,
    obstacle: Option<Obstacle>,
    state: State,
    unknown_classes: UnknownClasses,
    steps: PlaneSteps,
    mapped: MappedRows,
    is_over: bool,
}

/// The dynamic obstacle that is being read.
#[derive(Default)]
struct Obstacle {
    id: u64,
    is_dynamic: bool,
    class: Option<VehicleClass>,
    length_m: Option<f64>,
    width_m: Option<f64>,
    road: Option<usize>,
    initial: Option<State>,
}

/// The state that is being read.
#[derive(Clone, Copy, Default, PartialEq)]
struct State {
    x_m: Option<f64>,
    y_m: Option<f64>,
    heading_rad: Option<f64>,
    step: Option<i64>,
    speed_mps: Option<f64>,
    acceleration_mps2: Option<f64>,
}

impl<R: BufRead> CommonRoadSource<R> {
    /// Opens a scenario and reads its root element.
    ///
    /// # Errors
    /// Fails if the root element is not a CommonRoad scenario.
    pub(super) fn new(source: R) -> Result<Self, ReadError> {
        let mut xml = Xml::new(source, ATTRIBUTES, "CommonRoad scenario");
        let Node::Begin { name, attributes } = xml.next()? else { return xml.fail("there is no element") };
        if name != "commonRoad" {
            return xml.fail(format!("the root element is `{name}`, but `commonRoad` is needed"));
        }
        let mut attributes: BTreeMap<_, _> = attributes.into_iter().collect();
        let step = match attributes.get("timeStepSize") {
            Some(text) => Time::from_s(with_line(&xml, number(text, "timeStepSize", STEP_S))?),
            None => return xml.fail("`commonRoad` has no attribute `timeStepSize`"),
        };
        Ok(Self {
            xml,
            name: attributes.remove("benchmarkID"),
            step: Some(step),
            lanelets: BTreeMap::new(),
            points: 0,
            roads: None,
            lanelet: None,
            point: (f64::NAN, f64::NAN),
            obstacle: None,
            state: State::default(),
            unknown_classes: UnknownClasses::default(),
            steps: PlaneSteps::default(),
            mapped: MappedRows::default(),
            is_over: false,
        })
    }

    /// Processes the beginning of an element.
    fn begin(&mut self, name: &str, attributes: &[(&'static str, String)]) -> Result<(), ReadError> {
        let attribute = |wanted| attributes.iter().find(|(name, _)| *name == wanted).map(|(_, text)| text.as_str());
        let depth = self.xml.path().len();
        match name {
            "lanelet" if depth == 2 => {
                if self.roads.is_some() {
                    return self.xml.fail("lanelets have to stand before the obstacles");
                }
                let id = with_line(&self.xml, integer(attribute("id").unwrap_or_default(), "id", LANELET_IDS))?;
                if self.lanelets.contains_key(&id) {
                    return self.xml.fail(format!("lanelet {id} stands there twice"));
                }
                self.lanelet = Some((id, Lanelet::default()));
            }
            "dynamicObstacle" | "obstacle" if depth == 2 => {
                let id = with_line(&self.xml, integer(attribute("id").unwrap_or_default(), "id", allowed::IDS))?
                    .unsigned_abs();
                self.obstacle = Some(Obstacle { id, is_dynamic: name == "dynamicObstacle", ..Obstacle::default() });
            }
            "adjacentLeft" | "adjacentRight" | "successor" if depth == 3 => {
                let other = with_line(&self.xml, integer(attribute("ref").unwrap_or_default(), "ref", LANELET_IDS));
                let is_same = attribute("drivingDir").is_none_or(|direction| direction == "same");
                let Some((_, lanelet)) = &mut self.lanelet else { return Ok(()) };
                match name {
                    "successor" => lanelet.successors.push(other?),
                    "adjacentLeft" => lanelet.left_id = Some(other?).filter(|_| is_same),
                    _ => lanelet.right_id = Some(other?).filter(|_| is_same),
                }
            }
            "state" | "initialState" => self.state = State::default(),
            "point" => self.point = (f64::NAN, f64::NAN),
            _ => {}
        }
        Ok(())
    }

    /// Processes the end of the element at `path`, which contains `text`.
    fn end(&mut self, path: &[&str], text: &str) -> Result<Option<Row>, ReadError> {
        let checked = match path {
            [_, "lanelet", _, "point", "x"] => number(text, "x", PLANE_M).map(|x_m| self.point.0 = x_m),
            [_, "lanelet", _, "point", "y"] => number(text, "y", PLANE_M).map(|y_m| self.point.1 = y_m),
            [_, "lanelet", bound @ ("leftBound" | "rightBound"), "point"] => {
                let is_left = *bound == "leftBound";
                return self.add_point(is_left).map(|()| None);
            }
            [_, "lanelet"] => {
                if let Some((id, lanelet)) = self.lanelet.take() {
                    if lanelet.left.len() < 2 || lanelet.right.len() < 2 {
                        return self.xml.fail(format!("each bound of lanelet {id} needs at least two points"));
                    }
                    self.lanelets.insert(id, lanelet);
                }
                Ok(())
            }
            [_, "dynamicObstacle" | "obstacle", inner @ ..] => {
                return self.end_in_obstacle(inner, text);
            }
            _ => Ok(()),
        };
        with_line(&self.xml, checked).map(|()| None)
    }

    /// Adds the point that has just ended to a bound of the current lanelet.
    fn add_point(&mut self, is_left: bool) -> Result<(), ReadError> {
        let (x_m, y_m) = self.point;
        if !(x_m.is_finite() && y_m.is_finite()) {
            return self.xml.fail("a point needs `x` and `y`");
        }
        self.points += 1;
        if self.points > MAX_POINTS {
            return self.xml.fail(format!("the lanelets have more than {MAX_POINTS} points"));
        }
        if let Some((_, lanelet)) = &mut self.lanelet {
            if is_left { lanelet.left.push((x_m, y_m)) } else { lanelet.right.push((x_m, y_m)) }
        }
        Ok(())
    }

    /// Processes the end of an element inside an obstacle; `inner` is its path within the obstacle.
    fn end_in_obstacle(&mut self, inner: &[&str], text: &str) -> Result<Option<Row>, ReadError> {
        let Some(obstacle) = &mut self.obstacle else { return Ok(None) };
        let state = &mut self.state;
        let checked = match inner {
            ["role"] => {
                obstacle.is_dynamic = text == "dynamic";
                Ok(())
            }
            ["type"] => {
                let class = self.unknown_classes.resolve(class_named(text), text, "type");
                class.map(|class| obstacle.class = Some(class))
            }
            ["shape", "rectangle", "length"] => {
                number(text, "length", allowed::LENGTH_M).map(|metres| obstacle.length_m = Some(metres))
            }
            ["shape", "rectangle", "width"] => {
                number(text, "width", allowed::WIDTH_M).map(|metres| obstacle.width_m = Some(metres))
            }
            ["shape", "circle", "radius"] => number(text, "radius", allowed::WIDTH_M).map(|metres| {
                (obstacle.length_m, obstacle.width_m) = (Some(2.0 * metres), Some(2.0 * metres));
            }),
            ["trajectory", "state", value @ ..] | ["initialState", value @ ..] if !value.is_empty() => {
                state_value(state, value, text)
            }
            ["initialState"] => {
                obstacle.initial = Some(*state);
                return self.row();
            }
            ["trajectory", "state"] if obstacle.initial.is_some_and(|initial| initial.is_repeated_by(state)) => Ok(()),
            ["trajectory", "state"] => return self.row(),
            _ => Ok(()),
        };
        with_line(&self.xml, checked).map(|()| None)
    }

    /// Returns the row of the state that has just ended.
    fn row(&mut self) -> Result<Option<Row>, ReadError> {
        if self.roads.is_none() {
            self.roads = Some(Roads::from_lanelets(&std::mem::take(&mut self.lanelets)));
        }
        let state = std::mem::take(&mut self.state);
        let (Some(obstacle), Some(roads)) = (&mut self.obstacle, &self.roads) else { return Ok(None) };
        if !obstacle.is_dynamic {
            return Ok(None);
        }
        if roads.is_empty() {
            return self.xml.fail("there are no lanelets before the first obstacle");
        }
        let (Some(x_m), Some(y_m), Some(frame)) = (state.x_m, state.y_m, state.step) else {
            return self.xml.fail("a state needs an exact `time` and a `position` that is a point");
        };
        let (Some(heading_rad), Some(velocity_mps)) = (state.heading_rad, state.speed_mps) else {
            return self.xml.fail("a state needs an exact `orientation` and `velocity`");
        };
        let (Some(class), Some(length_m), Some(width_m)) = (obstacle.class, obstacle.length_m, obstacle.width_m) else {
            return self
                .xml
                .fail("an obstacle needs a `type` and a `shape` that is a rectangle or a circle before its states");
        };
        let road = *obstacle.road.get_or_insert_with(|| roads.road_at((x_m, y_m), heading_rad));
        let Some(position) = roads.locate(road, (x_m, y_m)) else { return Ok(None) };
        let along = maths::cos(heading_rad - position.heading_rad);
        let (number, period) = (obstacle.id, self.step.unwrap_or_default());
        let (vehicle, time, point, speed_mps) = (number, period * frame, (x_m, y_m), velocity_mps);
        let moment = PlaneMoment { vehicle, time, point, heading_rad, speed_mps, clock: Clock::Continuous };
        self.mapped.add(MappedRow { vehicle, time, point, heading_rad, speed_mps, place: position }, roads);
        self.steps.add(moment);
        Ok(Some(Row {
            number,
            origin: Time::ZERO,
            vehicle_id: number,
            frame,
            time,
            clock: Clock::Continuous,
            s_m: position.s_m,
            d_m: position.d_m,
            lane: position.lane,
            speed_mps: velocity_mps * along,
            acceleration_mps2: state.acceleration_mps2.map(|acceleration| acceleration * along),
            length_m,
            width_m,
            class,
            marking_distances: MarkingDistances::default(),
            line: self.xml.line(),
        }))
    }
}

impl State {
    /// Returns `true` if `other` states the same values at the same time. Some files repeat the
    /// initial state as the first state of the trajectory; one of the two may lack the
    /// acceleration.
    fn is_repeated_by(&self, other: &Self) -> bool {
        let acceleration_mps2 = other.acceleration_mps2.or(self.acceleration_mps2);
        let completed = Self { acceleration_mps2: self.acceleration_mps2.or(acceleration_mps2), ..*self };
        self.step.is_some() && completed == Self { acceleration_mps2, ..*other }
    }
}

/// Stores a value of a state.
fn state_value(state: &mut State, value: &[&str], text: &str) -> Result<(), FieldError> {
    match value {
        ["position", "point", "x"] => state.x_m = Some(number(text, "x", PLANE_M)?),
        ["position", "point", "y"] => state.y_m = Some(number(text, "y", PLANE_M)?),
        ["orientation", "exact"] => state.heading_rad = Some(number(text, "orientation", ANGLE_RAD)?),
        ["time", "exact"] => state.step = Some(integer(text, "time", allowed::FRAMES)?),
        ["velocity", "exact"] => state.speed_mps = Some(number(text, "velocity", VELOCITY_MPS)?),
        ["acceleration", "exact"] => {
            state.acceleration_mps2 = Some(number(text, "acceleration", allowed::ACCELERATION_MPS2)?);
        }
        _ => {}
    }
    Ok(())
}

/// Attaches the current line to an error.
fn with_line<R: BufRead, T>(xml: &Xml<R>, result: Result<T, FieldError>) -> Result<T, ReadError> {
    result.map_err(|error| ReadError::new(xml.line(), error))
}

/// Returns the class of CommonRoad's obstacle types. Trucks and buses count as trucks, bicycles and
/// pedestrians as motorcycles, and the other road users as cars.
fn class_named(text: &str) -> Option<VehicleClass> {
    match text {
        "car" | "taxi" | "parkedVehicle" | "priorityVehicle" | "unknown" => Some(VehicleClass::Car),
        "truck" | "bus" => Some(VehicleClass::Truck),
        "motorcycle" | "bicycle" | "pedestrian" => Some(VehicleClass::Motorcycle),
        _ => None,
    }
}

impl<R: BufRead> RowSource for CommonRoadSource<R> {
    fn info(&self) -> FileInfo {
        FileInfo {
            layout: Layout::Commonroad,
            name: self.name.clone(),
            period: self.step,
            markings: self.roads.as_ref().map(Roads::markings),
        }
    }

    fn unknown_classes(&self) -> &[UnknownClass] {
        self.unknown_classes.names()
    }

    fn check_sides(&self, _is_mirrored: bool) -> Result<(), ReadError> {
        let neighbours = self.roads.as_ref().map_or(Ok(()), Roads::check_neighbours);
        neighbours.and_then(|()| self.steps.check(Layout::Commonroad)).map_err(ReadError::of_file)
    }

    fn warnings(&self) -> Vec<String> {
        self.mapped.doubt_of_turns().into_iter().collect()
    }

    fn is_in_doubt(&self) -> bool {
        self.mapped.doubt_of_turns().is_some()
    }

    fn off_road_percent(&self) -> Option<f64> {
        self.mapped.off_road_percent()
    }

    fn map_doubt(&self) -> Option<String> {
        self.mapped.doubt_of_place()
    }

    fn next_row(&mut self) -> Result<Option<Row>, ReadError> {
        while !self.is_over {
            match self.xml.next()? {
                Node::Begin { name, attributes } => self.begin(&name, &attributes)?,
                Node::End { text } => {
                    let names = self.xml.leave();
                    let path: Vec<&str> = names.iter().map(String::as_str).collect();
                    let row = self.end(&path, text.trim())?;
                    self.xml.back_to(names);
                    if row.is_some() {
                        return Ok(row);
                    }
                }
                Node::EndOfFile => self.is_over = true,
            }
        }
        let is_without_rows = self.roads.is_none();
        if is_without_rows && self.lanelets.is_empty() {
            return self.xml.fail("there are neither lanelets nor dynamic obstacles");
        }
        Ok(None)
    }
}
