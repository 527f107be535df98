//! The trace of a run: a table with one row per control step and actor, as CSV or Parquet.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray, UInt8Array};
use arrow::datatypes::{DataType, Schema};
use closecall_traffic::{Measured, Time};
use parquet::arrow::ArrowWriter;

use crate::tables::table::{field, properties, required};
use closecall_simulation::trajectories::{TraceRecorder, TraceRow};
use closecall_simulation::{Observer, RunEvent, StepView};
use closecall_traffic::atomic::{WriteError, check_writable, write_file};

/// The file format of a trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Csv,
    Parquet,
}

impl Format {
    /// Returns the format that the extension of `path` stands for.
    fn from_path(path: &Path) -> io::Result<Self> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("parquet") => Ok(Self::Parquet),
            _ => Err(io::Error::new(io::ErrorKind::InvalidInput, "a trace is a file *.csv or *.parquet")),
        }
    }
}

/// Observes a run and writes its trace. A value that does not exist is an empty cell in CSV and
/// null in Parquet.
pub struct TraceWriter {
    path: PathBuf,
    format: Format,
    trace: TraceRecorder,
}

impl TraceWriter {
    /// Creates a writer of the file `path`, whose extension gives the format.
    ///
    /// # Errors
    /// [`WriteError`] if the extension is neither `.csv` nor `.parquet`, or if no file can be
    /// created there.
    pub fn new(path: &Path) -> Result<Self, WriteError> {
        let format = Format::from_path(path).map_err(|error| WriteError::new(path, error))?;
        check_writable(path)?;
        Ok(Self { path: path.to_owned(), format, trace: TraceRecorder::default() })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be written completely.
    pub fn finish(self) -> Result<(), WriteError> {
        write_file(&self.path, |file| match self.format {
            Format::Csv => write_csv(file, &self.trace.rows),
            Format::Parquet => write_parquet(file, &self.trace.rows),
        })
    }
}

impl Observer for TraceWriter {
    fn step(&mut self, view: &StepView<'_>) {
        self.trace.step(view);
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}
}

/// Writes the rows as CSV. The names of actors need no quotes, because they consist of letters,
/// digits and hyphens. The numbers have enough digits to be read back to the same bits.
fn write_csv(file: &mut (impl Write + ?Sized), rows: &[TraceRow]) -> io::Result<()> {
    writeln!(file, "time_s,actor,lane,s_m,d_m,speed_mps,acceleration_mps2,gap_front_m,thw_front_s")?;
    for row in rows {
        write!(file, "{},{},{},{},{},", row.time.s(), row.actor, row.lane, row.s_m, row.d_m)?;
        write!(file, "{},{},", row.speed_mps, row.acceleration_mps2)?;
        let cell = |value: Measured| value.map_or_else(|_| String::new(), |value| value.to_string());
        writeln!(file, "{},{}", cell(row.gap_front_m), cell(row.thw_front_s))?;
    }
    Ok(())
}

/// Returns the rows as one record batch.
///
/// # Errors
/// An error of Arrow.
pub fn trace_batch(rows: &[TraceRow]) -> io::Result<RecordBatch> {
    let schema = Arc::new(Schema::new(vec![
        required("time_s", DataType::Float64, Some("s")),
        required("actor", DataType::Utf8, None),
        required("lane", DataType::UInt8, None),
        required("s_m", DataType::Float64, Some("m")),
        required("d_m", DataType::Float64, Some("m")),
        required("speed_mps", DataType::Float64, Some("m/s")),
        required("acceleration_mps2", DataType::Float64, Some("m/s²")),
        field("gap_front_m", DataType::Float64, Some("m")),
        field("thw_front_s", DataType::Float64, Some("s")),
    ]));
    let floats = |value: fn(&TraceRow) -> Option<f64>| -> ArrayRef {
        Arc::new(rows.iter().map(value).collect::<Float64Array>())
    };
    let columns = vec![
        floats(|row| Some(row.time.s())),
        Arc::new(rows.iter().map(|row| Some(row.actor.as_str())).collect::<StringArray>()),
        Arc::new(rows.iter().map(|row| Some(row.lane.0)).collect::<UInt8Array>()),
        floats(|row| Some(row.s_m)),
        floats(|row| Some(row.d_m)),
        floats(|row| Some(row.speed_mps)),
        floats(|row| Some(row.acceleration_mps2)),
        floats(|row| row.gap_front_m.ok()),
        floats(|row| row.thw_front_s.ok()),
    ];
    RecordBatch::try_new(schema, columns).map_err(io::Error::other)
}

/// Writes the rows as Parquet, in one record batch.
fn write_parquet(file: &mut (impl Write + Send + ?Sized), rows: &[TraceRow]) -> io::Result<()> {
    let batch = trace_batch(rows)?;
    let mut writer = ArrowWriter::try_new(file, batch.schema(), Some(properties())).map_err(io::Error::other)?;
    writer.write(&batch).map_err(io::Error::other)?;
    writer.close().map_err(io::Error::other)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{ActorId, Lane};

    use super::*;

    fn rows() -> Vec<TraceRow> {
        let row = |name: &str, gap_front_m: Measured, thw_front_s: Measured| TraceRow {
            time: Time::from_ms(40),
            actor: ActorId::new(name).unwrap(),
            lane: Lane(2),
            s_m: 500.1,
            d_m: -5.625,
            speed_mps: 30.0,
            acceleration_mps2: -0.25,
            gap_front_m,
            thw_front_s,
        };
        let no_lead = Err(closecall_traffic::Absent::NoLead);
        vec![row("ego", Ok(21.0), Ok(0.7)), row("front", no_lead, no_lead)]
    }

    #[test]
    fn an_absent_value_is_an_empty_cell() {
        let mut text = Vec::new();
        write_csv(&mut text, &rows()).unwrap();
        let expected = "time_s,actor,lane,s_m,d_m,speed_mps,acceleration_mps2,gap_front_m,thw_front_s\n\
                        0.04,ego,2,500.1,-5.625,30,-0.25,21,0.7\n\
                        0.04,front,2,500.1,-5.625,30,-0.25,,\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }

    #[test]
    fn equal_rows_give_equal_parquet_bytes() {
        let mut first = Vec::new();
        write_parquet(&mut first, &rows()).unwrap();
        let mut second = Vec::new();
        write_parquet(&mut second, &rows()).unwrap();
        assert_eq!(first, second);
        assert_eq!((&first[..4], &first[first.len() - 4..]), (&b"PAR1"[..], &b"PAR1"[..]));
    }

    #[test]
    fn the_extension_of_the_file_gives_its_format() {
        assert_eq!(Format::from_path(Path::new("a/b.csv")).unwrap(), Format::Csv);
        assert_eq!(Format::from_path(Path::new("b.parquet")).unwrap(), Format::Parquet);
        let error = TraceWriter::new(Path::new("trace.txt")).err().unwrap();
        assert_eq!(error.to_string(), "failed to write trace.txt: a trace is a file *.csv or *.parquet");
    }
}
