//! Wall times of a campaign's samples, as Parquet: in a file of their own, since they differ from run to run.

use std::io;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;

use super::write::{WriteError, write_atomically};

/// What one sample cost in one arm.
#[derive(Clone, Debug)]
pub struct Timing {
    /// The scenario's name.
    pub scenario: Arc<str>,
    /// Number of the sample.
    pub sample: u64,
    /// The controller's name.
    pub controller: Arc<str>,
    /// Wall time [s].
    pub wall_s: f64,
}

/// Writes the table, one row for each sample and controller.
///
/// # Errors
/// [`WriteError`] where the file cannot be written; a file of that name is then as it was.
pub fn write_timings(path: &Path, timings: &[Timing]) -> Result<(), WriteError> {
    let schema = Arc::new(Schema::new(vec![
        Field::new("scenario", DataType::Utf8, false),
        Field::new("sample", DataType::UInt64, false),
        Field::new("controller", DataType::Utf8, false),
        Field::new("wall_s", DataType::Float64, false),
    ]));
    write_atomically(path, |file| {
        let scenarios = timings.iter().map(|timing| Some(timing.scenario.as_ref()));
        let controllers = timings.iter().map(|timing| Some(timing.controller.as_ref()));
        let batch = RecordBatch::try_new(
            schema.clone(),
            vec![
                Arc::new(scenarios.collect::<StringArray>()),
                Arc::new(timings.iter().map(|timing| timing.sample).collect::<UInt64Array>()),
                Arc::new(controllers.collect::<StringArray>()),
                Arc::new(timings.iter().map(|timing| timing.wall_s).collect::<Float64Array>()),
            ],
        )
        .map_err(io::Error::other)?;
        let mut writer = ArrowWriter::try_new(file, schema.clone(), None).map_err(io::Error::other)?;
        writer.write(&batch).map_err(io::Error::other)?;
        writer.close().map_err(io::Error::other)?;
        Ok(())
    })
}
