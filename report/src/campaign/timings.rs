//! The wall times of a campaign's samples, as Parquet. They have a file of their own because they
//! differ in each repetition.

use std::io;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow::datatypes::{DataType, Schema};
use parquet::arrow::ArrowWriter;

use crate::table::{ROWS_PER_BATCH, properties, required};
use closecall_traffic::atomic::{WriteError, write_file};

/// The wall time of one sample in one arm.
#[derive(Clone, Debug)]
pub struct Timing {
    /// The scenario's name.
    pub scenario: String,
    /// The sample's number.
    pub sample: u64,
    /// The controller's name.
    pub controller: String,
    /// Wall time (s).
    pub wall_s: f64,
}

/// Writes the table, one row for each sample and controller. The rows are written in groups, so
/// that memory is bounded.
///
/// # Errors
/// [`WriteError`] if the file cannot be written. An existing file then stays as it is.
pub fn write_timings(path: &Path, timings: impl Iterator<Item = Timing>) -> Result<(), WriteError> {
    let schema = Arc::new(Schema::new(vec![
        required("scenario", DataType::Utf8, None),
        required("sample", DataType::UInt64, None),
        required("controller", DataType::Utf8, None),
        required("wall_s", DataType::Float64, Some("s")),
    ]));
    let mut timings = timings.fuse();
    write_file(path, |file| {
        let mut writer = ArrowWriter::try_new(file, schema.clone(), Some(properties())).map_err(io::Error::other)?;
        loop {
            let group: Vec<Timing> = timings.by_ref().take(ROWS_PER_BATCH).collect();
            if group.is_empty() {
                break;
            }
            let batch = RecordBatch::try_new(schema.clone(), columns(&group)).map_err(io::Error::other)?;
            writer.write(&batch).map_err(io::Error::other)?;
        }
        writer.close().map_err(io::Error::other)?;
        Ok(())
    })
}

fn columns(timings: &[Timing]) -> Vec<ArrayRef> {
    vec![
        Arc::new(StringArray::from_iter_values(timings.iter().map(|timing| &timing.scenario))),
        Arc::new(UInt64Array::from_iter_values(timings.iter().map(|timing| timing.sample))),
        Arc::new(StringArray::from_iter_values(timings.iter().map(|timing| &timing.controller))),
        Arc::new(Float64Array::from_iter_values(timings.iter().map(|timing| timing.wall_s))),
    ]
}
