//! The layout of SUMO's floating car data (FCD): XML, and the tables of the same content.
//!
//! (Eclipse SUMO, documentation of the FCD output and of tabular outputs; defaults of vehicle
//! classes from its page "Vehicle Type Parameter Defaults".)
//!
//! ```text
//!   <fcd-export>
//!     <timestep time="0.10">
//!       <vehicle id="f.0" x="9.12" y="-1.60" angle="90.00" type="car" speed="40.20" pos="9.12" lane="e0_2"/>
//! ```
//!
//! - `x`, `y`: middle of the front bumper (m); `angle`: clockwise from north (°); `speed`: m/s.
//! - `lane`: edge and index, counted from the right. An edge ends at each junction, so the road is
//!   inferred from the traffic; see `inferred_road`. Vehicles that go from an edge to the next one, or
//!   through a junction, show which lanes follow one another; see `stated_lanes`. The distance between
//!   vehicles of neighbouring lanes gives the lane width.
//! - FCD states no sizes. A vehicle has the default size of the class that its type names; a note
//!   says so.
//! - Persons and containers are left out.

use std::collections::{BTreeMap, HashMap};
use std::io::BufRead;

use closecall_traffic::{Time, VehicleClass, maths};

use super::class_names::UnknownClasses;
use super::collected::{Collected, CollectedRow, CollectedSource, Facts, Position};
use super::error::TrajectoryFileProblem;
use super::fields::{Bounds, FieldError, number, optional_number, wrong_value};
use super::file_layout::Layout;
use super::header::Header;
use super::lane_sides::{Beside, LaneSides};
use super::markings::DEFAULT_LANE_WIDTH_M;
use super::plain::allowed;
use super::rows::{Lines, Separator, each_row};
use super::source::{Clock, ReadError};
use super::stated_lanes::StatedLane;
use super::xml::{Node, Xml};

/// The attributes of a vehicle, and of a time step, that the reader uses.
const ATTRIBUTES: &[&str] = &["time", "id", "x", "y", "angle", "type", "speed", "lane", "acceleration"];

const ANGLE_DEG: Bounds = Bounds::closed(-360.0, 720.0);

/// Names of classes and their sizes (m): SUMO's vehicle classes, and its types without a name.
const SIZES: [(&str, VehicleClass, f64, f64); 12] = [
    ("DEFAULT_VEHTYPE", VehicleClass::Car, 5.0, 1.8),
    ("DEFAULT_TAXITYPE", VehicleClass::Car, 5.0, 1.8),
    ("car", VehicleClass::Car, 5.0, 1.8),
    ("passenger", VehicleClass::Car, 5.0, 1.8),
    ("private", VehicleClass::Car, 5.0, 1.8),
    ("taxi", VehicleClass::Car, 5.0, 1.8),
    ("delivery", VehicleClass::Car, 6.5, 2.16),
    ("truck", VehicleClass::Truck, 7.1, 2.4),
    ("trailer", VehicleClass::Truck, 16.5, 2.55),
    ("bus", VehicleClass::Truck, 12.0, 2.5),
    ("coach", VehicleClass::Truck, 14.0, 2.6),
    ("motorcycle", VehicleClass::Motorcycle, 2.2, 0.9),
];

/// One vehicle at one time, as text.
struct Entry<'a> {
    time: &'a str,
    line: u64,
    field: &'a dyn Fn(&'static str) -> &'a str,
}

/// What is gathered while the file is read.
#[derive(Default)]
struct Reader {
    collected: Collected,
    unknown_classes: UnknownClasses,
    /// A number for each edge, by its name.
    edges: HashMap<String, u64>,
    /// Edge and lane index of the latest row of each vehicle.
    latest: BTreeMap<u32, (String, i64)>,
    lane_sides: LaneSides,
}

/// Reads the XML form.
///
/// # Errors
/// The XML is damaged or no FCD, or the traffic shows no road.
pub(super) fn read_xml(input: impl BufRead) -> Result<CollectedSource, ReadError> {
    let mut xml = Xml::new(input, ATTRIBUTES, "floating car data (FCD) of SUMO");
    let mut reader = Reader::default();
    let mut time = String::new();
    loop {
        match xml.next()? {
            Node::Begin { name, attributes } => {
                let attribute = |wanted: &'static str| {
                    attributes.iter().find(|(name, _)| *name == wanted).map_or("", |(_, value)| value.as_str())
                };
                match (xml.path().len(), name.as_str()) {
                    (1, "fcd-export") => {}
                    (1, other) => return xml.fail(format!("its root is `{other}`, but `fcd-export` is needed")),
                    (2, "timestep") => attribute("time").clone_into(&mut time),
                    (3, "vehicle") => reader.push(&Entry { time: &time, line: xml.line(), field: &attribute })?,
                    _ => {}
                }
            }
            Node::End { .. } => {
                let path = xml.leave();
                xml.back_to(path);
            }
            Node::EndOfFile => break,
        }
    }
    reader.finish()
}

/// Returns `true` if `header` belongs to a table of FCD. Its columns are named after the element
/// and its attribute, or after the attribute alone.
pub(super) fn is_table(header: &Header) -> bool {
    header.find("timestep_time").is_some() || header.count(&["time", "id", "x", "y", "angle", "speed", "lane"]) == 7
}

/// Reads the tabular form, after its header.
///
/// # Errors
/// The traffic shows no road, or a column is missing.
pub(super) fn read_table<R: BufRead>(
    mut lines: Lines<R>,
    (header, separator, width): (&Header, Separator, usize),
) -> Result<CollectedSource, ReadError> {
    let column = |name: &str| {
        let element = if name == "time" { "timestep" } else { "vehicle" };
        header.find(&format!("{element}_{name}")).or_else(|| header.find(name))
    };
    let columns: Vec<(&'static str, Option<usize>)> = ATTRIBUTES.iter().map(|name| (*name, column(name))).collect();
    for &(name, index) in &columns {
        if index.is_none() && !matches!(name, "type" | "lane" | "acceleration") {
            let problem = TrajectoryFileProblem::MissingColumn { name, layout: "SUMO's FCD" };
            return Err(ReadError::new(1, problem));
        }
    }
    let mut reader = Reader::default();
    each_row(&mut lines, separator, width, |(number, split)| {
        let (line, fields) = match split {
            Ok(split) => split,
            Err(problem) => return reader.collected.push(Err(ReadError::new(number, problem))),
        };
        let field = |wanted: &'static str| {
            let index = columns.iter().find(|(name, _)| *name == wanted).and_then(|(_, index)| *index);
            index.map_or("", |index| fields.get(line, index))
        };
        // A time step without vehicles, or a row of a person, names no vehicle.
        if field("id").is_empty() {
            return Ok(());
        }
        reader.push(&Entry { time: field("time"), line: number, field: &field })
    })?;
    reader.finish()
}

impl Reader {
    fn push(&mut self, entry: &Entry<'_>) -> Result<(), ReadError> {
        let row = self.row(entry).map_err(|error| ReadError::new(entry.line, error));
        self.collected.push(row)
    }

    fn row(&mut self, entry: &Entry<'_>) -> Result<CollectedRow, FieldError> {
        let Entry { time, line, field } = entry;
        let real = |name: &'static str, bounds| number(field(name), name, bounds);
        if field("id").is_empty() {
            return Err(FieldError::at("id", wrong_value("", "the name of a vehicle".to_owned())));
        }
        let time = Time::from_s(number(time, "time", allowed::TIME_S)?);
        let (class, length_m, width_m) = self.size(field("type"));
        let heading_rad = (90.0 - real("angle", ANGLE_DEG)?).to_radians();
        let (front_x_m, front_y_m) = (real("x", allowed::PLANE_M)?, real("y", allowed::PLANE_M)?);
        let half_m = 0.5 * length_m;
        let point = (front_x_m - half_m * maths::cos(heading_rad), front_y_m - half_m * maths::sin(heading_rad));
        let speed_mps = real("speed", allowed::SPEED_MPS)?;
        let acceleration_mps2 = optional_number(field("acceleration"), "acceleration", allowed::ACCELERATION_MPS2)?;
        let vehicle = self.collected.vehicle(field("id"));
        let lane = field("lane").rsplit_once('_').and_then(|(edge, index)| Some((edge, index.parse().ok()?)));
        let changes_lane = lane.is_some_and(|(edge, index): (&str, i64)| {
            let (road, point) = (edge.to_owned(), (front_x_m, front_y_m));
            self.lane_sides.add(time, Beside { vehicle, road, index, point, heading_rad });
            let before = self.latest.insert(vehicle, (edge.to_owned(), index));
            before.is_some_and(|(before_edge, before_index)| before_edge == edge && before_index != index)
        });
        let named_lane = lane.map(|(edge, index)| StatedLane { edge: self.edge(edge), index: Some(index) });
        let position = Position::Plane { point, heading_rad, changes_lane, named_lane };
        Ok(CollectedRow {
            vehicle,
            time,
            position,
            speed_mps,
            acceleration_mps2,
            length_m,
            width_m,
            class,
            line: *line,
        })
    }

    /// Returns the number of the edge with this name.
    fn edge(&mut self, name: &str) -> u64 {
        if let Some(number) = self.edges.get(name) {
            return *number;
        }
        let number = self.edges.len() as u64;
        self.edges.insert(name.to_owned(), number);
        number
    }

    /// Returns the class that a type names, and its size.
    fn size(&mut self, name: &str) -> (VehicleClass, f64, f64) {
        let stated = SIZES.iter().find(|(listed, ..)| name.is_empty() || listed.eq_ignore_ascii_case(name));
        if let Some(&(_, class, length_m, width_m)) = stated {
            return (class, length_m, width_m);
        }
        let class = self.unknown_classes.nearest_of(name);
        let size = SIZES.iter().rev().find(|(_, listed, ..)| *listed == class && class != VehicleClass::Truck);
        match size {
            Some(&(_, _, length_m, width_m)) if class == VehicleClass::Motorcycle => (class, length_m, width_m),
            Some(_) => (class, SIZES[0].2, SIZES[0].3),
            None => {
                let typical = class.typical_dimensions();
                (class, typical.length_m, typical.width_m)
            }
        }
    }

    fn finish(self) -> Result<CollectedSource, ReadError> {
        let lane_width_m = self.lane_sides.lane_width_m();
        let sizes = "the file states no sizes of vehicles: they have the default size of the class that their type names in SUMO";
        let mut notes = vec![sizes.to_owned()];
        if lane_width_m.is_none() {
            notes.push(format!(
                "no two vehicles drive beside each other in neighbouring lanes of one edge: a lane width of {DEFAULT_LANE_WIDTH_M} m is \
                 assumed"
            ));
        }
        let source = self.collected.into_source(Facts {
            layout: Layout::Sumo,
            clock: Clock::Simulated,
            lane_width_m,
            markings: None,
            notes,
            mirrored: None,
            unknown_classes: self.unknown_classes,
        })?;
        Ok(source.with_lane_sides(self.lane_sides))
    }
}
