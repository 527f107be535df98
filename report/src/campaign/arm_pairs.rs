//! The pairs of arms of a campaign, as Parquet: one row for each scenario and pair.

use std::io;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow::datatypes::{DataType, Schema};
use closecall_campaign::arm_pairs::{PairResult, pair_results};
use closecall_campaign::summary::Summary;
use closecall_traffic::atomic::{WriteError, write_file};
use parquet::arrow::ArrowWriter;

use crate::table::{field, properties, required};

/// Writes the table.
///
/// # Errors
/// [`WriteError`] if the file cannot be written. An existing file then stays as it is.
pub(super) fn write_arm_pairs(path: &Path, summary: &Summary) -> Result<(), WriteError> {
    let text = |name| required(name, DataType::Utf8, None);
    let count = |name| required(name, DataType::UInt64, None);
    let number = |name| required(name, DataType::Float64, None);
    let schema = Arc::new(Schema::new(vec![
        text("scenario"),
        text("baseline"),
        text("tested"),
        count("prevented"),
        number("prevented_low_95"),
        number("prevented_high_95"),
        count("induced"),
        number("induced_low_95"),
        number("induced_high_95"),
        count("both"),
        count("neither"),
        number("prevented_harm"),
        number("induced_harm"),
        field("mcnemar_p", DataType::Float64, None),
        field("mcnemar_p_corrected", DataType::Float64, None),
    ]));
    let of_scenario = |(name, counts)| pair_results(summary, counts).into_iter().map(move |result| (name, result));
    let rows: Vec<(&String, PairResult<'_>)> =
        summary.scenarios.iter().map(|(name, counts)| (name, counts)).flat_map(of_scenario).collect();
    write_file(path, |file| {
        let mut writer = ArrowWriter::try_new(file, schema.clone(), Some(properties())).map_err(io::Error::other)?;
        let batch = RecordBatch::try_new(schema.clone(), columns(&rows)).map_err(io::Error::other)?;
        writer.write(&batch).map_err(io::Error::other)?;
        writer.close().map_err(io::Error::other)?;
        Ok(())
    })
}

fn columns(rows: &[(&String, PairResult<'_>)]) -> Vec<ArrayRef> {
    let count = |value: fn(&PairResult<'_>) -> u64| -> ArrayRef {
        Arc::new(UInt64Array::from_iter_values(rows.iter().map(|(_, result)| value(result))))
    };
    let number = |value: fn(&PairResult<'_>) -> f64| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(rows.iter().map(|(_, result)| value(result))))
    };
    let optional = |value: fn(&PairResult<'_>) -> Option<f64>| -> ArrayRef {
        Arc::new(rows.iter().map(|(_, result)| value(result)).collect::<Float64Array>())
    };
    vec![
        Arc::new(StringArray::from_iter_values(rows.iter().map(|(name, _)| name))),
        Arc::new(StringArray::from_iter_values(rows.iter().map(|(_, result)| result.baseline))),
        Arc::new(StringArray::from_iter_values(rows.iter().map(|(_, result)| result.tested))),
        count(|result| result.pairs.prevented),
        optional(|result| Some(result.prevented_95?[0])),
        optional(|result| Some(result.prevented_95?[1])),
        count(|result| result.pairs.induced),
        optional(|result| Some(result.induced_95?[0])),
        optional(|result| Some(result.induced_95?[1])),
        count(|result| result.pairs.both),
        count(|result| result.pairs.neither),
        number(|result| result.pairs.prevented_harm),
        number(|result| result.pairs.induced_harm),
        optional(|result| result.mcnemar_p),
        optional(|result| result.corrected_p),
    ]
}
