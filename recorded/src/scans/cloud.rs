//! The fields of a point cloud, of whatever file.

use closecall_sensors::lidar::{PointTimes, RecordedPoints};
use closecall_traffic::Time;

use super::error::ScanFileProblem;
use super::options::{NS_PER_S, ScanOptions};

/// The type of a number in a point cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    /// Returns the number of bytes.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns the little-endian number at the start of some bytes; `None` if they are too few.
    pub(super) fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::I8 => i8::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U8 => u8::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I16 => i16::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U16 => u16::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::I32 => i32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::U32 => u32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::F32 => f32::from_le_bytes(*bytes.first_chunk()?).into(),
            Self::F64 => f64::from_le_bytes(*bytes.first_chunk()?),
        })
    }
}

/// A field of each point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) number: Number,
    /// Position in the bytes of a point.
    pub(super) offset: usize,
}

/// The values of one field of all points.
#[derive(Clone, Debug, PartialEq)]
struct Column {
    name: String,
    number: Number,
    values: Vec<f64>,
}

/// The bytes of points that follow one another.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointBytes<'a> {
    pub(super) bytes: &'a [u8],
    /// Number of points.
    pub(super) count: usize,
    /// Number of bytes of each point.
    pub(super) stride: usize,
}

/// A point cloud, with the fields that are of use.
#[derive(Clone, Debug, Default)]
pub(super) struct Cloud {
    columns: Vec<Column>,
    /// The names of all fields.
    names: Vec<String>,
}

/// The fields that are read. A field with another name is ignored, also if there are several.
const READ: [&str; 9] = ["x", "y", "z", "intensity", "beam", "time", "timestamp", "offset_ns", "t"];

/// The values of `beam`.
pub(super) const BEAM: &str = "a whole number from 0 to 65,535, column · layers + layer,";
/// The values of a time after the start of the sweep.
pub(super) const OFFSET: &str = "a whole number of ns from 0 to 1,000,000,000, after the start of the sweep,";

impl Cloud {
    /// Returns the points that lie in these bytes.
    pub(super) fn of_bytes(fields: &[Field], points: PointBytes<'_>) -> Result<Self, ScanFileProblem> {
        let PointBytes { bytes, count: points, stride } = points;
        refuse_doubled(fields)?;
        let size = ScanFileProblem::Size { actual: bytes.len(), points, stride };
        if points.checked_mul(stride) != Some(bytes.len()) {
            return Err(size);
        }
        let mut columns = Vec::new();
        for field in fields.iter().filter(|field| READ.contains(&&*field.name)) {
            let values: Option<Vec<f64>> = (0..points)
                .map(|point| field.number.read(bytes.get(point * stride + field.offset..(point + 1) * stride)?))
                .collect();
            let Some(values) = values else {
                let stated = format!("the field `{}` does not lie within a point of {stride} bytes", field.name);
                return Err(ScanFileProblem::Points(stated));
            };
            columns.push(Column { name: field.name.clone(), number: field.number, values });
        }
        Ok(Self { columns, names: fields.iter().map(|field| field.name.clone()).collect() })
    }

    /// Returns the points whose values are listed point by point.
    pub(super) fn of_rows(fields: &[Field], rows: &[Vec<f64>]) -> Result<Self, ScanFileProblem> {
        refuse_doubled(fields)?;
        let read = fields.iter().enumerate().filter(|(_, field)| READ.contains(&&*field.name));
        let columns = read.map(|(index, field)| Column {
            name: field.name.clone(),
            number: field.number,
            values: rows.iter().map(|row| row[index]).collect(),
        });
        Ok(Self { columns: columns.collect(), names: fields.iter().map(|field| field.name.clone()).collect() })
    }

    fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Returns the points of a scan with this stamp.
    pub(super) fn into_points(self, stamp: Time, options: &ScanOptions) -> Result<RecordedPoints, ScanFileProblem> {
        let needed = |name: &'static str| {
            self.column(name).ok_or_else(|| ScanFileProblem::MissingField { name, fields: self.names.join(", ") })
        };
        let times = match self.column("time").or_else(|| self.column("timestamp")) {
            Some(column) if column.number == Number::F64 => PointTimes::Absolute(column.values.clone()),
            Some(column) => PointTimes::Absolute(column.values.iter().map(|after_s| stamp.s() + after_s).collect()),
            None => match self.column("offset_ns").or_else(|| self.column("t")) {
                Some(column) => PointTimes::SinceStart(offsets(column)?),
                None => PointTimes::Unknown,
            },
        };
        options.prepared(RecordedPoints {
            end: stamp,
            at_m: [single(needed("x")?), single(needed("y")?), single(needed("z")?)],
            intensity: self.column("intensity").map(single),
            beam: self.column("beam").map(beams).transpose()?,
            times,
            ..RecordedPoints::default()
        })
    }
}

/// Refuses two fields with the same name, if the field is read.
fn refuse_doubled(fields: &[Field]) -> Result<(), ScanFileProblem> {
    let doubled = READ.iter().find(|name| fields.iter().filter(|field| field.name == **name).count() > 1);
    match doubled {
        Some(name) => Err(ScanFileProblem::Twice { what: "the field", name: (*name).to_owned() }),
        None => Ok(()),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
fn single(column: &Column) -> Vec<f32> {
    column.values.iter().map(|value| *value as f32).collect()
}

fn whole(column: &Column, most: f64, needed: &'static str) -> Result<(), ScanFileProblem> {
    let is_wrong = |value: &f64| !(*value >= 0.0 && *value <= most && value.fract() == 0.0);
    match column.values.iter().position(is_wrong) {
        Some(point) => {
            let (name, value) = (&column.name, column.values[point]);
            Err(ScanFileProblem::Points(format!("point {point} has `{name}` = {value}, but {needed} is needed")))
        }
        None => Ok(()),
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
fn beams(column: &Column) -> Result<Vec<u16>, ScanFileProblem> {
    whole(column, f64::from(u16::MAX), BEAM)?;
    Ok(column.values.iter().map(|value| *value as u16).collect())
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
fn offsets(column: &Column) -> Result<Vec<u32>, ScanFileProblem> {
    whole(column, NS_PER_S, OFFSET)?;
    Ok(column.values.iter().map(|value| *value as u32).collect())
}
