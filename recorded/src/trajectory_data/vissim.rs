//! The layout of Vissim's vehicle record (`.fzp`).
//!
//! (PTV Vissim, help on the vehicle record and on the list of vehicles in the network.)
//!
//! ```text
//!   $VISION
//!   * SPEED: Speed, Speed of the vehicle [km/h]
//!   $VEHICLE:SIMSEC;NO;LANE\LINK\NO;LANE\INDEX;POS;POSLAT;SPEED;VEHTYPE;LENGTH
//!   0.20;1;1;2;10.53;0.50;50.00;100;4.50
//! ```
//!
//! The user chooses the columns. Units follow the comments above the header; without them, metres
//! and km/h. Coordinates have a unit of their own. Two sets of columns give a position:
//!
//! - `COORDFRONT` and `COORDREAR` (or these with `X` and `Y`): the middle of the front and of the
//!   rear in a plane. The road is inferred from the traffic; see `inferred_road`. If `LANE\LINK\NO`
//!   and `LANE\INDEX` are there as well, they name the lane of the vehicle.
//! - `LANE\LINK\NO`, `LANE\INDEX`, `POS`: the distance of the front from the start of a link, and a
//!   lane, counted from the right. `POSLAT` is the position across the lane, from 0 to 1, and grows
//!   as the lanes are counted: a vehicle that changes lanes moves steadily. If it jumps, the positions or
//!   the lanes are counted from the other side, and the file is in doubt. Each link is a road of its
//!   own: a track ends where its link ends.

use std::collections::BTreeMap;
use std::io::BufRead;

use closecall_traffic::{Lane, Time, VehicleClass, maths};

use super::class_names::UnknownClasses;
use super::collected::{Collected, CollectedRow, CollectedSource, Facts, Position};
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, FieldError, integer, number, wrong_value};
use super::file_layout::Layout;
use super::header::Header;
use super::lane_sides::{Beside, LaneSides};
use super::markings::{DEFAULT_LANE_WIDTH_M, LaneMarkings};
use super::plain::allowed;
use super::rows::{Fields, Lines, Separator, each_row};
use super::source::{Clock, ReadError};
use super::stated_lanes::StatedLane;

/// The start of the header.
const HEADER: &str = "$VEHICLE:";

/// The doubt about a file whose positions across the lane grow against the numbers of its lanes.
const AGAINST_LANES: &str = "POSLAT grows against the numbers of the lanes, as the lane changes show: it is read as growing to the right, and the lanes as \
     counted from the right; if they are counted from the left, left is called right";

const FORMAT: &str = "vehicle record of Vissim (.fzp)";

/// Vissim's vehicle types as it delivers them (`VEHTYPE`).
const TYPES: [(&str, VehicleClass); 4] = [
    ("100", VehicleClass::Car),
    ("200", VehicleClass::Truck),
    ("300", VehicleClass::Truck),
    ("600", VehicleClass::Motorcycle),
];

const LINKS: (i64, i64) = (0, u32::MAX as i64);
/// Number of lanes of a link.
const LANE_INDICES: (i64, i64) = (1, 12);
/// Position across the lane; a wide vehicle may leave its lane.
const ACROSS: Bounds = Bounds::closed(-1.0, 2.0);

/// Distance by which each link is shifted to the right of the previous one (m).
const SEPARATION_M: f64 = 1_000.0;
/// Largest number of lanes of all links together, with one unused number for each link.
const MAX_LANES: u32 = 250;

/// Metres in a foot, and metres per second in a kilometre and in a mile per hour.
const FOOT_M: f64 = 0.3048;
const KMH_MPS: f64 = 1.0 / 3.6;
const MPH_MPS: f64 = 0.447_04;

/// Factors from the units of the file to SI.
#[derive(Clone, Copy, Debug)]
struct Units {
    length: f64,
    /// Of coordinates in the plane.
    plane: f64,
    speed: f64,
    acceleration: f64,
    are_stated: bool,
}

impl Default for Units {
    fn default() -> Self {
        Self { length: 1.0, plane: 1.0, speed: KMH_MPS, acceleration: 1.0, are_stated: false }
    }
}

impl Units {
    /// Takes the unit of a comment such as `* SPEED: Speed, Speed of the vehicle [km/h]`.
    fn note(&mut self, comment: &str) -> Result<(), TrajectoryFileProblem> {
        let Some((name, rest)) = comment.trim_start_matches(['*', ' ']).split_once(':') else { return Ok(()) };
        let Some((_, unit)) = rest.rsplit_once('[') else { return Ok(()) };
        let unit = unit.trim_end().trim_end_matches(']').trim();
        let (target, allowed): (&mut f64, &[(&str, f64)]) = match name.trim() {
            "POS" | "LENGTH" | "WIDTH" => (&mut self.length, &[("m", 1.0), ("ft", FOOT_M)]),
            name if name.starts_with("COORDFRONT") || name.starts_with("COORDREAR") => {
                (&mut self.plane, &[("m", 1.0), ("ft", FOOT_M)])
            }
            "SPEED" => (
                &mut self.speed,
                &[("km/h", KMH_MPS), ("mph", MPH_MPS), ("mi/h", MPH_MPS), ("m/s", 1.0), ("ft/s", FOOT_M)],
            ),
            "ACCELERATION" => {
                (&mut self.acceleration, &[("m/s2", 1.0), ("m/s²", 1.0), ("ft/s2", FOOT_M), ("ft/s²", FOOT_M)])
            }
            _ => return Ok(()),
        };
        let Some((_, factor)) = allowed.iter().find(|(name, _)| *name == unit) else {
            let names: Vec<&str> = allowed.iter().map(|(name, _)| *name).collect();
            let reason = format!("the unit of {} is `{unit}`, but one of {} is needed", name.trim(), names.join(", "));
            return Err(TrajectoryFileProblem::Unreadable { format: FORMAT, reason });
        };
        *target = *factor;
        self.are_stated = true;
        Ok(())
    }
}

/// How the columns state a position.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// Front and rear, each as one column `x y z`.
    Points([usize; 2]),
    /// Front and rear, each as two columns.
    Coordinates([usize; 4]),
    /// Link, lane and distance; the position across the lane if it is there.
    Link { link: usize, index: usize, along: usize, across: Option<usize> },
}

/// The column indices.
struct Columns {
    time: usize,
    number: usize,
    speed: usize,
    place: Place,
    /// Link and index of the lane, which names lanes in a plane.
    lane: Option<(usize, usize)>,
    acceleration: Option<usize>,
    length: Option<usize>,
    width: Option<usize>,
    vehicle_type: Option<usize>,
}

impl Columns {
    fn new(header: &Header) -> Result<Self, TrajectoryFileProblem> {
        let need = |name| header.require(name, "Vissim");
        let all = |names: &[&str]| names.iter().map(|name| header.find(name)).collect::<Option<Vec<usize>>>();
        let coordinates = all(&["COORDFRONTX", "COORDFRONTY", "COORDREARX", "COORDREARY"]);
        let place = if let Some([front, rear]) = all(&["COORDFRONT", "COORDREAR"]).as_deref() {
            Place::Points([*front, *rear])
        } else if let Some([front_x, front_y, rear_x, rear_y]) = coordinates.as_deref() {
            Place::Coordinates([*front_x, *front_y, *rear_x, *rear_y])
        } else {
            let across = header.find("POSLAT");
            Place::Link { link: need(r"LANE\LINK\NO")?, index: need(r"LANE\INDEX")?, along: need("POS")?, across }
        };
        Ok(Self {
            time: need("SIMSEC")?,
            number: need("NO")?,
            speed: need("SPEED")?,
            place,
            lane: header.find(r"LANE\LINK\NO").zip(header.find(r"LANE\INDEX")),
            acceleration: header.find("ACCELERATION"),
            length: header.find("LENGTH"),
            width: header.find("WIDTH"),
            vehicle_type: header.find("VEHTYPE"),
        })
    }
}

/// The road that a link is.
#[derive(Clone, Copy, Debug)]
struct LinkRoad {
    /// The number before its first lane.
    first_lane: u8,
    shift_m: f64,
    lanes: u8,
}

/// What is gathered while the file is read.
struct Reader {
    columns: Columns,
    units: Units,
    collected: Collected,
    unknown_classes: UnknownClasses,
    /// Number of lanes of each link.
    lanes: BTreeMap<u32, u8>,
    /// Link, lane and position across the lane in the latest row of each vehicle.
    latest: BTreeMap<u32, (u32, u8, f64)>,
    lane_sides: LaneSides,
    /// `true` if rows with positions in a plane name lanes.
    names_lanes: bool,
    /// Steps across the road at all lane changes (lanes), if the position across the lane grows to the
    /// left, and if it grows to the right.
    steps: [f64; 2],
}

/// Reads a vehicle record.
///
/// # Errors
/// The header or a column is missing, or the traffic shows no road.
pub(super) fn read(input: impl BufRead) -> Result<CollectedSource, ReadError> {
    let mut lines = Lines::new(input);
    let at_line = |(line, problem): (u64, TrajectoryFileProblem)| ReadError::new(line, problem);
    let mut units = Units::default();
    let (header, width) = loop {
        let Some((number, line)) = lines.next().map_err(at_line)? else {
            let reason = format!("it has no header `{HEADER}SIMSEC;NO;…`, as Vissim writes it since version 6");
            return Err(ReadError::of_file(TrajectoryFileProblem::Unreadable { format: FORMAT, reason }));
        };
        let start = line.get(..HEADER.len()).filter(|start| start.eq_ignore_ascii_case(HEADER));
        if let Some(start) = start {
            let names = &line[start.len()..];
            let (header, _, width) = Header::parse(names).map_err(|problem| ReadError::new(number, problem))?;
            header.check_no_duplicates().map_err(|problem| ReadError::new(number, problem))?;
            break ((header, number), width);
        }
        if !line.starts_with(['*', '$']) {
            let start: String = line.chars().take(40).collect();
            let reason = format!("`{start}` stands before the header `{HEADER}SIMSEC;NO;…`");
            return Err(ReadError::new(number, TrajectoryFileProblem::Unreadable { format: FORMAT, reason }));
        }
        units.note(line).map_err(|problem| ReadError::new(number, problem))?;
    };
    let columns = Columns::new(&header.0).map_err(|problem| ReadError::new(header.1, problem))?;
    let mut reader = Reader {
        columns,
        units,
        collected: Collected::default(),
        unknown_classes: UnknownClasses::default(),
        lanes: BTreeMap::new(),
        latest: BTreeMap::new(),
        lane_sides: LaneSides::default(),
        names_lanes: false,
        steps: [0.0; 2],
    };
    each_row(&mut lines, Separator::Semicolon, width, |(number, split)| {
        let row = split.map_err(FieldError::from).and_then(|(line, fields)| reader.row(line, fields, number));
        reader.collected.push(row.map_err(|error| ReadError::new(number, error)))
    })?;
    reader.finish()
}

impl Reader {
    fn row(&mut self, line: &str, fields: &Fields, line_number: u64) -> Result<CollectedRow, FieldError> {
        let text = |index: usize| fields.get(line, index);
        let Columns { time, number: vehicle, speed, place, lane, acceleration, length, width, vehicle_type } =
            self.columns;
        let real = |index: usize, name: &'static str, factor: f64, bounds: Bounds| {
            let value = factor * number(text(index), name, Bounds::closed(f64::MIN, f64::MAX))?;
            if bounds.contains(value) {
                Ok(value)
            } else {
                number("", name, bounds).map_err(|error| named(error, text(index)))
            }
        };
        integer(text(vehicle), "NO", allowed::IDS)?;
        let class = self.class(vehicle_type.map_or("", text));
        let typical = class.typical_dimensions();
        let Units {
            length: length_unit, plane: plane_unit, speed: speed_unit, acceleration: acceleration_unit, ..
        } = self.units;
        let stated_length = length.map(|index| real(index, "LENGTH", length_unit, allowed::LENGTH_M)).transpose()?;
        let width_m = width.map(|index| real(index, "WIDTH", length_unit, allowed::WIDTH_M)).transpose()?;
        let (position, length_m) = match place {
            Place::Link { link, index, along, across } => {
                let link = integer(text(link), r"LANE\LINK\NO", LINKS)?.unsigned_abs() as u32;
                let index = integer(text(index), r"LANE\INDEX", LANE_INDICES)?.unsigned_abs() as u8;
                let front_m = real(along, "POS", length_unit, allowed::POSITION_M)?;
                let across = across.map_or(Ok(0.5), |index| number(text(index), "POSLAT", ACROSS))?;
                let lanes = self.lanes.entry(link).or_default();
                *lanes = (*lanes).max(index);
                let length_m = stated_length.unwrap_or(typical.length_m);
                self.compare_senses(text(vehicle), (link, index, across));
                // The lanes of a link are known after the last row; until then they count from the
                // right edge.
                let d_m = DEFAULT_LANE_WIDTH_M * (f64::from(index) - 1.0 + across);
                (Position::Road { road: link, s_m: front_m - 0.5 * length_m, d_m, lane: index }, length_m)
            }
            Place::Points(columns) => {
                let [front, rear] = columns.map(|index| point(text(index), plane_unit));
                in_plane(front?, rear?)?
            }
            Place::Coordinates([front_x, front_y, rear_x, rear_y]) => {
                let plane = |index: usize, name: &'static str| {
                    number(text(index), name, allowed::PLANE_M).map(|value| plane_unit * value)
                };
                let front = (plane(front_x, "COORDFRONTX")?, plane(front_y, "COORDFRONTY")?);
                in_plane(front, (plane(rear_x, "COORDREARX")?, plane(rear_y, "COORDREARY")?))?
            }
        };
        let lane = lane.map(|(link, index)| (text(link), text(index)));
        let time = Time::from_s(number(text(time), "SIMSEC", allowed::TIME_S)?);
        let position = self.in_named_lane(position, lane, text(vehicle), time);
        let acceleration_mps2 = acceleration
            .map(|index| real(index, "ACCELERATION", acceleration_unit, allowed::ACCELERATION_MPS2))
            .transpose()?;
        Ok(CollectedRow {
            vehicle: self.collected.vehicle(text(vehicle)),
            time,
            position,
            speed_mps: real(speed, "SPEED", speed_unit, allowed::SPEED_MPS)?,
            acceleration_mps2,
            length_m,
            width_m: width_m.unwrap_or(typical.width_m),
            class,
            line: line_number,
        })
    }

    /// Adds the lane that a row names to a position in a plane. Texts that name no lane are left out.
    fn in_named_lane(&mut self, position: Position, lane: Option<(&str, &str)>, vehicle: &str, time: Time) -> Position {
        let lane = lane.and_then(|(link, index)| Some((link.parse::<u32>().ok()?, index.parse::<u8>().ok()?)));
        let (Position::Plane { point, heading_rad, .. }, Some((link, index))) = (position, lane) else {
            return position;
        };
        self.names_lanes = true;
        let vehicle = self.collected.vehicle(vehicle);
        let before = self.latest.insert(vehicle, (link, index, 0.0));
        let beside = Beside { vehicle, road: link.to_string(), index: i64::from(index), point, heading_rad };
        self.lane_sides.add(time, beside);
        let changes_lane = before.is_some_and(|(last_link, last_index, _)| last_link == link && last_index != index);
        let named_lane = Some(StatedLane { edge: u64::from(link), index: Some(i64::from(index)) });
        Position::Plane { point, heading_rad, changes_lane, named_lane }
    }

    /// Adds the step of a lane change to the two sums of steps.
    fn compare_senses(&mut self, vehicle: &str, now: (u32, u8, f64)) {
        let vehicle = self.collected.vehicle(vehicle);
        let Some(before) = self.latest.insert(vehicle, now).filter(|before| before.0 == now.0 && before.1 != now.1)
        else {
            return;
        };
        let step = |sense: f64| {
            let at = |(_, index, across): (u32, u8, f64)| f64::from(index) + sense * across;
            (at(now) - at(before)).abs()
        };
        self.steps[0] += step(1.0);
        self.steps[1] += step(-1.0);
    }

    fn class(&mut self, text: &str) -> VehicleClass {
        let listed = TYPES.iter().find(|(name, _)| text.is_empty() || *name == text);
        listed.map_or_else(|| self.unknown_classes.nearest_of(&format!("type {text}")), |(_, class)| *class)
    }

    fn finish(mut self) -> Result<CollectedSource, ReadError> {
        let mut notes = Vec::new();
        if !self.units.are_stated {
            notes.push("the file states no units: metres and km/h are assumed".to_owned());
        }
        if matches!(self.columns.place, Place::Link { .. }) && self.columns.length.is_none() {
            notes.push("the file states no lengths of vehicles: each has the typical size of its class".to_owned());
        }
        if !matches!(self.columns.place, Place::Link { .. }) && !self.names_lanes {
            notes.push(format!("the file states no lanes: lanes of {DEFAULT_LANE_WIDTH_M} m are assumed"));
        }
        let (by_link, markings) = self.roads()?;
        if !by_link.is_empty() {
            notes.push(format!(
                "each of {} links is a road of its own with lanes of {DEFAULT_LANE_WIDTH_M} m, and a track ends where its link ends; \
                 the columns COORDFRONT and COORDREAR would join them",
                by_link.len()
            ));
        }
        // Changes within one step are as steady in one sense as in the other: they do not show which one holds.
        let grows_to_the_right = 2.0 * self.steps[1] < self.steps[0];
        for row in self.collected.rows_mut() {
            if let Position::Road { road, d_m, lane, .. } = &mut row.position
                && let Some(&LinkRoad { first_lane, shift_m, lanes }) = by_link.get(road)
            {
                if grows_to_the_right {
                    *d_m = DEFAULT_LANE_WIDTH_M * (2.0 * f64::from(*lane) - 1.0) - *d_m;
                }
                *d_m += shift_m - DEFAULT_LANE_WIDTH_M * f64::from(lanes);
                *lane = first_lane + lanes - *lane + 1;
            }
        }
        let source = self.collected.into_source(Facts {
            layout: Layout::Vissim,
            clock: Clock::Simulated,
            lane_width_m: None,
            markings,
            notes,
            mirrored: grows_to_the_right.then_some(AGAINST_LANES),
            unknown_classes: self.unknown_classes,
        })?;
        Ok(source.with_lane_sides(self.lane_sides))
    }

    /// Returns the road of each link, and the markings of all of them.
    fn roads(&self) -> Result<(BTreeMap<u32, LinkRoad>, Option<LaneMarkings>), ReadError> {
        let needed: u32 = self.lanes.values().map(|lanes| u32::from(*lanes) + 1).sum();
        if needed > MAX_LANES {
            let reason = format!(
                "its vehicles drive on {} links, which are too many to be roads of their own; the columns COORDFRONT and COORDREAR \
                 would join them",
                self.lanes.len()
            );
            return Err(ReadError::of_file(TrajectoryFileProblem::Unreadable { format: FORMAT, reason }));
        }
        let (mut first_lane, mut shift_m) = (0_u8, 0.0);
        let mut roads = BTreeMap::new();
        let mut edges = Vec::new();
        for (&link, &lanes) in &self.lanes {
            roads.insert(link, LinkRoad { first_lane, shift_m, lanes });
            // The unused number before a later link has that link's left edge as its right edge.
            let first = u8::from(first_lane == 0);
            edges.extend(
                (first..=lanes).map(|lane| (Lane(first_lane + lane), shift_m - DEFAULT_LANE_WIDTH_M * f64::from(lane))),
            );
            first_lane += lanes + 1;
            shift_m -= DEFAULT_LANE_WIDTH_M * f64::from(lanes) + SEPARATION_M;
        }
        Ok((roads, (!edges.is_empty()).then(|| LaneMarkings::from_right_edges(edges))))
    }
}

/// Puts the text of a field into an error that was made without it.
fn named(error: FieldError, text: &str) -> FieldError {
    match error.problem {
        TrajectoryFileProblem::Value { allowed, .. } => {
            let allowed = format!("{allowed}, in SI units,");
            FieldError { column: error.column, problem: wrong_value(text, allowed) }
        }
        problem => FieldError { column: error.column, problem },
    }
}

/// Parses a point `x y z` in `unit` metres.
fn point(text: &str, unit: f64) -> Result<(f64, f64), FieldError> {
    let mut parts = text.split_ascii_whitespace().map(|part| number(part, "COORDFRONT", allowed::PLANE_M));
    match (parts.next(), parts.next()) {
        (Some(x), Some(y)) => Ok((unit * x?, unit * y?)),
        _ => Err(FieldError::at("COORDFRONT", wrong_value(text, "a point such as `10.5 3.2 0.0`".to_owned()))),
    }
}

/// Returns the position and the length of a vehicle from the middle of its front and of its rear.
fn in_plane(front: (f64, f64), rear: (f64, f64)) -> Result<(Position, f64), FieldError> {
    let (dx, dy) = (front.0 - rear.0, front.1 - rear.1);
    let length_m = maths::hypot(dx, dy);
    if !allowed::LENGTH_M.contains(length_m) {
        let text = format!("{length_m} m from the front to the rear");
        return Err(FieldError::at("COORDREAR", wrong_value(&text, "a length above 0 and up to 60 m".to_owned())));
    }
    let point = (0.5 * (front.0 + rear.0), 0.5 * (front.1 + rear.1));
    let heading_rad = maths::atan2(dy, dx);
    Ok((Position::Plane { point, heading_rad, changes_lane: false, named_lane: None }, length_m))
}
