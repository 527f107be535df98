//! The text of an OpenLABEL file: what a reader of traffic needs of it, and where it stands.
//!
//! A visitor for each level keeps the JSON path, so that an error names it beside line and column.
//! Members that no reader needs are read over without being held.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;

use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, Visitor};

use super::json_input::LineCounter;
use super::plain::allowed;
use crate::openlabel::names;

/// Largest number of vehicles in frames: they take about 2 GiB.
const MAX_ROWS: usize = 20_000_000;
/// Largest number of objects, frames or lanes.
const MAX_ELEMENTS: usize = 4_000_000;

/// `metadata`.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Metadata {
    pub(super) schema_version: Option<String>,
    pub(super) name: Option<String>,
    pub(super) frame_period_s: Option<f64>,
    pub(super) frame_rate: Option<f64>,
    #[serde(default)]
    pub(super) simulated: bool,
}

/// A number with a name.
#[derive(Debug, Deserialize)]
pub(super) struct Number {
    #[serde(default)]
    name: String,
    val: f64,
}

/// A cuboid, whose values may be missing.
#[derive(Debug, Deserialize)]
struct Cuboid {
    val: Option<Vec<f64>>,
    coordinate_system: Option<String>,
}

/// `object_data`.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct ObjectData {
    cuboid: Vec<Cuboid>,
    num: Vec<Number>,
    bbox: Option<IgnoredAny>,
    rbbox: Option<IgnoredAny>,
    poly2d: Option<IgnoredAny>,
    point2d: Option<IgnoredAny>,
}

impl ObjectData {
    fn number(&self, name: &str) -> Option<f64> {
        self.num.iter().find(|number| number.name == name).map(|number| number.val)
    }

    /// Returns the kind of the data that is in pixels, if there is some.
    fn pixels(&self) -> Option<&'static str> {
        let kinds =
            [("bbox", &self.bbox), ("rbbox", &self.rbbox), ("poly2d", &self.poly2d), ("point2d", &self.point2d)];
        kinds.into_iter().find(|(_, data)| data.is_some()).map(|(kind, _)| kind)
    }
}

#[derive(Debug, Deserialize)]
struct ObjectText {
    #[serde(rename = "type", default)]
    kind: String,
    coordinate_system: Option<String>,
    #[serde(default)]
    object_data: ObjectData,
}

#[derive(Debug, Default, Deserialize)]
struct FrameObject {
    #[serde(default)]
    object_data: ObjectData,
}

#[derive(Debug, Deserialize)]
struct ContextText {
    #[serde(default)]
    context_data: ObjectData,
}

#[derive(Debug, Deserialize)]
struct CoordinateSystem {
    #[serde(rename = "type")]
    kind: String,
}

#[derive(Debug, Default, Deserialize)]
struct StreamProperties {
    frame_rate: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
struct StreamText {
    #[serde(default)]
    stream_properties: StreamProperties,
}

/// The time of a frame.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Timestamp {
    Seconds(f64),
    Text(String),
}

#[derive(Debug, Default, Deserialize)]
struct FrameProperties {
    timestamp: Option<Timestamp>,
}

/// An object, from `objects`.
#[derive(Debug, Default)]
pub(super) struct LabelledObject {
    pub(super) uid: String,
    pub(super) kind: String,
    pub(super) vehicle_id: Option<f64>,
    coordinate_system: Option<String>,
}

/// A number that a file may leave out. It is NaN then, which JSON cannot state: files hold millions of
/// rows, and an `Option` takes twice the memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stated(f64);

impl Stated {
    fn new(value: Option<f64>) -> Self {
        Self(value.unwrap_or(f64::NAN))
    }

    /// Returns the number, or `None` if the file leaves it out.
    pub(super) fn get(self) -> Option<f64> {
        (!self.0.is_nan()).then_some(self.0)
    }
}

/// A vehicle in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct LabelledRow {
    /// Index of the object.
    pub(super) object: u32,
    pub(super) frame: i64,
    /// Index of the coordinate system; `None` if none is named.
    pub(super) system: Option<u16>,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) yaw_rad: f64,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) speed_mps: Stated,
    pub(super) acceleration_mps2: Stated,
    pub(super) lane: Stated,
    pub(super) time_s: Stated,
    pub(super) line: u64,
}

#[derive(Debug, Default, Deserialize)]
struct VcdMetadata {
    schema_version: Option<String>,
}

/// A file of OpenLABEL's predecessor.
#[derive(Debug, Default, Deserialize)]
struct VcdText {
    metadata: Option<VcdMetadata>,
    version: Option<String>,
}

/// The content of a file.
#[derive(Debug, Default)]
pub(super) struct OpenLabelText {
    pub(super) is_openlabel: bool,
    /// The version of VCD, the predecessor of OpenLABEL, if the file is of that format.
    pub(super) vcd_version: Option<String>,
    pub(super) metadata: Option<Metadata>,
    /// Types of the coordinate systems, by their names.
    pub(super) systems: BTreeMap<String, String>,
    /// Names of the coordinate systems of cuboids.
    pub(super) named_systems: Vec<String>,
    pub(super) stream_rate: Option<f64>,
    objects_by_uid: HashMap<String, u32>,
    pub(super) objects: Vec<LabelledObject>,
    /// The first cuboid that belongs to no frame: its path.
    pub(super) static_cuboid: Option<String>,
    /// The first data in pixels: its path.
    pub(super) pixels: Option<String>,
    pub(super) frames: usize,
    pub(super) timestamps: BTreeMap<i64, Timestamp>,
    pub(super) rows: Vec<LabelledRow>,
    /// Right edges of lanes, by the number of the lane (m).
    pub(super) right_edges_m: Vec<(f64, f64)>,
    pub(super) lines: LineCounter,
}

impl OpenLabelText {
    /// Reads a file.
    ///
    /// # Errors
    /// The JSON is damaged, or a member has the wrong type; the message ends with line and column.
    pub(super) fn read<'de, D: Deserializer<'de>>(lines: LineCounter, json: D) -> Result<Self, D::Error> {
        let mut text = Self { lines, ..Self::default() };
        Members { text: &mut text, level: Level::Root }.deserialize(json)?;
        Ok(text)
    }

    fn object(&mut self, uid: &str) -> Result<u32, String> {
        if let Some(index) = self.objects_by_uid.get(uid) {
            return Ok(*index);
        }
        let index = u32::try_from(self.objects.len()).unwrap_or(u32::MAX);
        if index as usize >= MAX_ELEMENTS {
            return Err(format!("there are more than {MAX_ELEMENTS} objects"));
        }
        self.objects_by_uid.insert(uid.to_owned(), index);
        self.objects.push(LabelledObject { uid: uid.to_owned(), ..LabelledObject::default() });
        Ok(index)
    }

    fn add_object(&mut self, uid: &str, text: ObjectText) -> Result<(), String> {
        let ObjectText { kind, coordinate_system, object_data } = text;
        let index = self.object(uid)?;
        let path = |data: &str| Some(format!("openlabel.objects.{uid}.object_data.{data}"));
        if !object_data.cuboid.is_empty() && self.static_cuboid.is_none() {
            self.static_cuboid = path("cuboid");
        }
        if let (None, Some(kind)) = (&self.pixels, object_data.pixels()) {
            self.pixels = path(kind);
        }
        let vehicle_id = object_data.number(names::VEHICLE);
        let uid = uid.to_owned();
        self.objects[index as usize] = LabelledObject { uid, kind, vehicle_id, coordinate_system };
        Ok(())
    }

    fn system(&mut self, name: &str) -> Result<u16, String> {
        let index = self.named_systems.iter().position(|named| named == name).unwrap_or_else(|| {
            self.named_systems.push(name.to_owned());
            self.named_systems.len() - 1
        });
        u16::try_from(index).map_err(|_| "there are more than 65536 coordinate systems".to_owned())
    }

    /// Returns the name of the coordinate system of a row.
    pub(super) fn system_of(&self, row: &LabelledRow) -> Option<&str> {
        let of_object = self.objects.get(row.object as usize).and_then(|object| object.coordinate_system.as_deref());
        row.system.map(|index| self.named_systems[usize::from(index)].as_str()).or(of_object)
    }

    /// Adds what a frame says of an object.
    fn add_row(&mut self, frame: i64, uid: &str, data: &ObjectData) -> Result<(), String> {
        let object = self.object(uid)?;
        let path = || format!("openlabel.frames.{frame}.objects.{uid}.object_data");
        let Some(cuboid) = data.cuboid.first() else {
            if let (None, Some(kind)) = (&self.pixels, data.pixels()) {
                self.pixels = Some(format!("{}.{kind}", path()));
            }
            return Ok(());
        };
        if data.cuboid.len() > 1 {
            let count = data.cuboid.len();
            return Err(format!("`{}.cuboid` has {count} cuboids, but one of each vehicle is needed", path()));
        }
        let value = cuboid.val.as_deref().unwrap_or_default();
        let (yaw_rad, size) = match *value {
            [_, _, _, _, _, yaw, length, width, _] => (yaw, (length, width)),
            [_, _, _, qx, qy, qz, qw, length, width, _] => {
                let (sin, cos) = (2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz));
                (closecall_traffic::maths::atan2(sin, cos), (length, width))
            }
            _ => {
                let count = value.len();
                return Err(format!(
                    "`{}.cuboid.0.val` has {count} numbers, but 9 (position, angles, size) or 10 (position, quaternion, size) are needed",
                    path()
                ));
            }
        };
        if self.rows.len() >= MAX_ROWS {
            return Err(format!("the frames hold more than {MAX_ROWS} vehicles"));
        }
        let system = cuboid.coordinate_system.as_deref().map(|name| self.system(name)).transpose()?;
        self.rows.push(LabelledRow {
            object,
            frame,
            system,
            x_m: value[0],
            y_m: value[1],
            yaw_rad,
            length_m: size.0,
            width_m: size.1,
            speed_mps: Stated::new(data.number(names::SPEED)),
            acceleration_mps2: Stated::new(data.number(names::ACCELERATION)),
            lane: Stated::new(data.number(names::LANE)),
            time_s: Stated::new(data.number(names::TIME)),
            line: self.lines.line(),
        });
        Ok(())
    }
}

/// The JSON object that is being read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Root,
    File,
    CoordinateSystems,
    Streams,
    Objects,
    Contexts,
    Frames,
    Frame(i64),
    FrameObjects(i64),
}

impl Level {
    fn path(self, member: &str) -> String {
        match self {
            Self::Root => member.to_owned(),
            Self::File => format!("openlabel.{member}"),
            Self::CoordinateSystems => format!("openlabel.coordinate_systems.{member}"),
            Self::Streams => format!("openlabel.streams.{member}"),
            Self::Objects => format!("openlabel.objects.{member}"),
            Self::Contexts => format!("openlabel.contexts.{member}"),
            Self::Frames => format!("openlabel.frames.{member}"),
            Self::Frame(frame) => format!("openlabel.frames.{frame}.{member}"),
            Self::FrameObjects(frame) => format!("openlabel.frames.{frame}.objects.{member}"),
        }
    }
}

/// The members of a JSON object.
struct Members<'t> {
    text: &'t mut OpenLabelText,
    level: Level,
}

impl<'de> DeserializeSeed<'de> for Members<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Members<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<(), A::Error> {
        let mut members: HashSet<String> = HashSet::new();
        while let Some(member) = map.next_key::<String>()? {
            let path = self.level.path(&member);
            if members.contains(&member) {
                return Err(Error::custom(format!("`{path}` stands there twice")));
            }
            self.read_member(&member, &mut map).map_err(|error| at(&path, error))?;
            // The vehicles of a frame are compared when their rows are put in order.
            if !matches!(self.level, Level::FrameObjects(_)) {
                members.insert(member);
            }
            if members.len() > MAX_ELEMENTS {
                return Err(Error::custom(format!("`{path}` is one of more than {MAX_ELEMENTS} elements")));
            }
        }
        Ok(())
    }
}

/// Names the place of an error, unless an inner one is named.
fn at<E: Error>(path: &str, error: E) -> E {
    let message = error.to_string();
    if message.starts_with('`') { error } else { E::custom(format!("`{path}`: {message}")) }
}

impl Members<'_> {
    fn read_member<'de, A: MapAccess<'de>>(&mut self, member: &str, map: &mut A) -> Result<(), A::Error> {
        let Self { text, level } = self;
        let inner = match (*level, member) {
            (Level::Root, "openlabel") => {
                text.is_openlabel = true;
                Level::File
            }
            (Level::Root, "vcd") => {
                let VcdText { metadata, version } = map.next_value()?;
                let version = metadata.and_then(|metadata| metadata.schema_version).or(version);
                text.vcd_version = Some(version.unwrap_or_default());
                return Ok(());
            }
            (Level::File, "metadata") => {
                text.metadata = Some(map.next_value()?);
                return Ok(());
            }
            (Level::File, "coordinate_systems") => Level::CoordinateSystems,
            (Level::File, "streams") => Level::Streams,
            (Level::File, "objects") => Level::Objects,
            (Level::File, "contexts") => Level::Contexts,
            (Level::File, "frames") => Level::Frames,
            (Level::CoordinateSystems, _) => {
                let CoordinateSystem { kind } = map.next_value()?;
                text.systems.insert(member.to_owned(), kind);
                return Ok(());
            }
            (Level::Streams, _) => {
                let StreamText { stream_properties } = map.next_value()?;
                text.stream_rate = text.stream_rate.or(stream_properties.frame_rate);
                return Ok(());
            }
            (Level::Objects, _) => {
                let object = map.next_value()?;
                return text.add_object(member, object).map_err(Error::custom);
            }
            (Level::Contexts, _) => {
                let ContextText { context_data } = map.next_value()?;
                let edge = context_data.number(names::LANE).zip(context_data.number(names::RIGHT_EDGE));
                text.right_edges_m.extend(edge);
                return Ok(());
            }
            (Level::Frames, _) => {
                let (first, last) = allowed::FRAMES;
                let frame = member.parse().ok().filter(|frame| (first..=last).contains(frame));
                let allowed = || {
                    format!("the number of a frame is `{member}`, but a whole number from {first} to {last} is needed")
                };
                Level::Frame(frame.ok_or_else(|| Error::custom(allowed()))?)
            }
            (Level::Frame(frame), "frame_properties") => {
                let FrameProperties { timestamp } = map.next_value()?;
                text.timestamps.extend(timestamp.map(|timestamp| (frame, timestamp)));
                return Ok(());
            }
            (Level::Frame(frame), "objects") => Level::FrameObjects(frame),
            (Level::FrameObjects(frame), _) => {
                let FrameObject { object_data } = map.next_value()?;
                return text.add_row(frame, member, &object_data).map_err(Error::custom);
            }
            _ => return map.next_value::<IgnoredAny>().map(|_| ()),
        };
        if let Level::Frame(_) = inner {
            text.frames += 1;
        }
        map.next_value_seed(Members { text, level: inner })
    }
}
