//! A Parquet table with one row for each point, in the layout in which a run writes its scans.

use std::path::Path;

use arrow::array::{Array, AsArray, RecordBatch};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Float32Type, Float64Type, UInt16Type, UInt32Type};
use arrow::util::display::array_value_to_string;
use closecall_sensors::lidar::{PointTimes, RecordedPoints};
use closecall_traffic::{Time, input};
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};

use super::cloud::{BEAM, OFFSET};
use super::error::{Origin, ScanFileError, ScanFileProblem};
use super::options::{ScanOptions, TakenScan, mirror_side};

/// The columns that are read. A column with another name is ignored.
const READ: [&str; 10] =
    ["sensor", "time_s", "mirror_side", "sensor_x_m", "x_m", "y_m", "z_m", "intensity", "beam", "offset_ns"];

/// The table, with the scan whose rows are being collected.
pub(super) struct TableRecording {
    origin: Origin,
    reader: ParquetRecordBatchReader,
    batch: Option<Rows>,
    /// The next row of the batch.
    row: usize,
    /// Number of rows in earlier batches.
    rows_before: usize,
}

/// The rows of one scan: its LiDAR, the number of its first row, its points, and the side of its
/// mirror.
struct PointRows {
    name: Option<String>,
    first_row: usize,
    points: RecordedPoints,
    side: Option<String>,
}

/// The columns of a batch of rows.
struct Rows {
    count: usize,
    sensor: Option<Vec<String>>,
    time_s: Vec<f64>,
    side: Option<Vec<Option<String>>>,
    sensor_x_m: Option<Vec<f32>>,
    at_m: [Vec<f32>; 3],
    intensity: Option<Vec<f32>>,
    beam: Option<Vec<u16>>,
    offset_ns: Option<Vec<u32>>,
}

impl TableRecording {
    pub(super) fn open(path: &Path) -> Result<Self, ScanFileError> {
        let origin = Origin::file(path);
        let file = input::open(path).map_err(|error| origin.error(error))?;
        let damaged = |error: parquet::errors::ParquetError| {
            origin.error(ScanFileProblem::Points(format!("it cannot be read as a table: {error}")))
        };
        let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(damaged)?;
        let fields = builder.schema().fields();
        if let Some(name) = READ.iter().find(|name| fields.iter().filter(|field| field.name() == *name).count() > 1) {
            return Err(origin.error(ScanFileProblem::Twice { what: "the column", name: (*name).to_owned() }));
        }
        let reader = builder.build().map_err(damaged)?;
        Ok(Self { reader, origin, batch: None, row: 0, rows_before: 0 })
    }

    pub(super) fn next_scan(&mut self, options: &ScanOptions) -> Result<Option<TakenScan>, ScanFileError> {
        loop {
            let Some(PointRows { name, first_row, mut points, side }) = self.next_rows()? else { return Ok(None) };
            let origin = self.origin.at(format_args!("from row {first_row} on"));
            let in_column =
                |column, problem| self.origin.at(format_args!("row {first_row}, column `{column}`")).error(problem);
            let sensor = match name {
                Some(name) => match options.sensor(&name) {
                    Ok(Some(sensor)) => sensor,
                    Ok(None) => continue,
                    Err(problem) => return Err(in_column("sensor", problem)),
                },
                None => options.only_sensor().map_err(|problem| origin.error(problem))?,
            };
            points.mirror_side = mirror_side(side.as_deref()).map_err(|problem| in_column("mirror_side", problem))?;
            let points = options.prepared(points).map_err(|problem| origin.error(problem))?;
            return Ok(Some(TakenScan { sensor, origin, points }));
        }
    }

    /// Returns the rows of the next scan: consecutive rows with the same sensor and time.
    fn next_rows(&mut self) -> Result<Option<PointRows>, ScanFileError> {
        let mut scan: Option<PointRows> = None;
        loop {
            if self.batch.as_ref().is_none_or(|rows| self.row == rows.count) && !self.next_batch()? {
                return Ok(scan);
            }
            let Some(rows) = &self.batch else { return Ok(scan) };
            while self.row < rows.count {
                let row = self.row;
                let (name, end) = (rows.sensor.as_ref().map(|names| &names[row]), Time::from_s(rows.time_s[row]));
                let current = scan.get_or_insert_with(|| rows.first(row, self.rows_before + row));
                if current.name.as_ref() != name || current.points.end != end {
                    return Ok(scan);
                }
                rows.append(row, &mut current.points);
                self.row += 1;
            }
        }
    }

    /// Reads the next batch. Returns whether there is one.
    fn next_batch(&mut self) -> Result<bool, ScanFileError> {
        self.rows_before += self.batch.as_ref().map_or(0, |rows| rows.count);
        self.row = 0;
        let Some(batch) = self.reader.next() else {
            self.batch = None;
            return Ok(false);
        };
        let damaged = |error: arrow::error::ArrowError| {
            self.origin.error(ScanFileProblem::Points(format!("it cannot be read as a table: {error}")))
        };
        let batch = batch.map_err(damaged)?;
        self.batch = Some(Rows::of(&batch, self.rows_before).map_err(|problem| self.origin.error(problem))?);
        Ok(true)
    }
}

impl Rows {
    fn of(batch: &RecordBatch, before: usize) -> Result<Self, ScanFileProblem> {
        let needed = |name: &'static str| {
            let columns = "`time_s`, `x_m`, `y_m`, `z_m`".to_owned();
            batch.column_by_name(name).ok_or(ScanFileProblem::MissingColumn { name, needed: columns })
        };
        let as_type = |column: &dyn Array, kind: DataType, name: &'static str, needed: &'static str| {
            let wrong = || ScanFileProblem::ColumnType { name, actual: column.data_type().to_string(), needed };
            let values = cast(column, &kind).map_err(|_| wrong())?;
            // A cast that fails for a value gives a null, and a cast to a whole number cuts off decimals.
            let decimals = match column.data_type().is_floating() && kind.is_integer() {
                true => Some(cast(column, &DataType::Float64).map_err(|_| wrong())?),
                false => None,
            };
            let has_decimals = |row: usize| {
                let exact = decimals.as_ref().map(|values| values.as_primitive::<Float64Type>().value(row));
                exact.is_some_and(|value| value.fract() != 0.0)
            };
            match (0..values.len()).find(|row| values.is_null(*row) || has_decimals(*row)) {
                Some(row) if column.is_null(row) => Err(ScanFileProblem::Null { row: before + row, name }),
                Some(row) => {
                    let value = array_value_to_string(column, row).map_err(|_| wrong())?;
                    Err(ScanFileProblem::Value { row: before + row, name, value, needed })
                }
                None => Ok(values),
            }
        };
        let single = |column: &dyn Array, name| {
            let values = as_type(column, DataType::Float32, name, "a number")?;
            Ok::<Vec<f32>, ScanFileProblem>(values.as_primitive::<Float32Type>().values().to_vec())
        };
        let time_s = as_type(needed("time_s")?, DataType::Float64, "time_s", "a number")?;
        let time_s = time_s.as_primitive::<Float64Type>().values().to_vec();
        if let Some(row) = time_s.iter().position(|time_s| !time_s.is_finite()) {
            let message = format!("row {} has `time_s` = {}, but a finite number is needed", before + row, time_s[row]);
            return Err(ScanFileProblem::Points(message));
        }
        let optional = |name: &'static str| batch.column_by_name(name).map(|column| single(column, name)).transpose();
        let text = |name: &'static str| -> Result<Option<Vec<Option<String>>>, ScanFileProblem> {
            let Some(column) = batch.column_by_name(name) else { return Ok(None) };
            let actual = column.data_type().to_string();
            let texts = cast(column, &DataType::Utf8).map_err(|_| ScanFileProblem::ColumnType {
                name,
                actual,
                needed: "text",
            })?;
            Ok(Some(texts.as_string::<i32>().iter().map(|text| text.map(str::to_owned)).collect()))
        };
        let sensor = text("sensor")?.map(|names| {
            let name = |(row, name): (usize, Option<String>)| {
                name.ok_or(ScanFileProblem::Null { row: before + row, name: "sensor" })
            };
            names.into_iter().enumerate().map(name).collect::<Result<Vec<_>, _>>()
        });
        let beam = batch.column_by_name("beam").map(|column| {
            let values = as_type(column, DataType::UInt16, "beam", BEAM)?;
            Ok::<_, ScanFileProblem>(values.as_primitive::<UInt16Type>().values().to_vec())
        });
        let offset_ns = batch.column_by_name("offset_ns").map(|column| {
            let values = as_type(column, DataType::UInt32, "offset_ns", OFFSET)?;
            Ok::<_, ScanFileProblem>(values.as_primitive::<UInt32Type>().values().to_vec())
        });
        Ok(Self {
            count: batch.num_rows(),
            sensor: sensor.transpose()?,
            time_s,
            side: text("mirror_side")?,
            sensor_x_m: optional("sensor_x_m")?,
            at_m: [single(needed("x_m")?, "x_m")?, single(needed("y_m")?, "y_m")?, single(needed("z_m")?, "z_m")?],
            intensity: optional("intensity")?,
            beam: beam.transpose()?,
            offset_ns: offset_ns.transpose()?,
        })
    }

    /// Returns a scan without points that has the sensor and the time of a row, whose number in the
    /// table is `first_row`.
    fn first(&self, row: usize, first_row: usize) -> PointRows {
        let points = RecordedPoints {
            end: Time::from_s(self.time_s[row]),
            intensity: self.intensity.as_ref().map(|_| Vec::new()),
            beam: self.beam.as_ref().map(|_| Vec::new()),
            times: self.offset_ns.as_ref().map_or(PointTimes::Unknown, |_| PointTimes::SinceStart(Vec::new())),
            sensor_x_m: self.sensor_x_m.as_ref().map(|values| values[row]),
            ..RecordedPoints::default()
        };
        let side = self.side.as_ref().and_then(|sides| sides[row].clone());
        PointRows { name: self.sensor.as_ref().map(|names| names[row].clone()), first_row, points, side }
    }

    /// Appends the point of a row.
    fn append(&self, row: usize, points: &mut RecordedPoints) {
        for (values, column) in points.at_m.iter_mut().zip(&self.at_m) {
            values.push(column[row]);
        }
        if let (Some(values), Some(column)) = (&mut points.intensity, &self.intensity) {
            values.push(column[row]);
        }
        if let (Some(values), Some(column)) = (&mut points.beam, &self.beam) {
            values.push(column[row]);
        }
        if let (PointTimes::SinceStart(values), Some(column)) = (&mut points.times, &self.offset_ns) {
            values.push(column[row]);
        }
    }
}
