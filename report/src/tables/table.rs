//! Settings that all Parquet tables share.

use std::collections::HashMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field, Schema};
use closecall_traffic::atomic::{WriteError, write_file};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;

/// Number of rows in a row group: the unit that a writer holds in memory and that a reader can
/// skip.
pub const ROWS_PER_GROUP: usize = 8_192;

/// Number of rows that are encoded at once: a batch of outcomes takes about 4 kB of memory for each
/// row. It divides the group.
pub const ROWS_PER_BATCH: usize = 256;

/// Size from which on a column has no dictionary (bytes). Most columns hold numbers that hardly
/// repeat: 2,048 of them fill it.
const DICTIONARY_BYTES: usize = 16_384;

/// Returns the writer properties of every table.
///
/// The file names neither a time nor a place nor a library version, so equal rows give equal bytes.
pub fn properties() -> WriterProperties {
    WriterProperties::builder()
        .set_created_by("closecall".to_owned())
        .set_compression(Compression::SNAPPY)
        .set_max_row_group_row_count(Some(ROWS_PER_GROUP))
        .set_dictionary_page_size_limit(DICTIONARY_BYTES)
        .build()
}

/// Returns a column whose cells may be null. Its metadata holds its unit, if it has one.
pub fn field(name: &str, data_type: DataType, unit: Option<&str>) -> Field {
    let metadata: HashMap<String, String> = unit.map(|unit| ("unit".to_owned(), unit.to_owned())).into_iter().collect();
    Field::new(name, data_type, true).with_metadata(metadata)
}

/// Returns a column in which every row has a value.
pub fn required(name: &str, data_type: DataType, unit: Option<&str>) -> Field {
    field(name, data_type, unit).with_nullable(false)
}

/// Checks that a path names a Parquet file.
///
/// # Errors
/// [`WriteError`] with `message` if its extension is another.
pub fn check_parquet(path: &Path, message: &'static str) -> Result<(), WriteError> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("parquet") => Ok(()),
        _ => Err(WriteError::new(path, io::Error::new(io::ErrorKind::InvalidInput, message))),
    }
}

/// Writes a record batch as a Parquet file.
///
/// # Errors
/// [`WriteError`] if there is no batch, or if the file cannot be written. An existing file then
/// stays as it is.
pub fn write_batch(path: &Path, batch: impl FnOnce() -> io::Result<RecordBatch>) -> Result<(), WriteError> {
    let batch = batch().map_err(|error| WriteError::new(path, error))?;
    write_file(path, |file| {
        let mut writer = ArrowWriter::try_new(file, batch.schema(), Some(properties())).map_err(io::Error::other)?;
        writer.write(&batch).and_then(|()| writer.close()).map(drop).map_err(io::Error::other)
    })
}

/// A column of a small table.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Texts.
    Text(Vec<String>),
    /// Numbers, which may be missing.
    Number(Vec<Option<f64>>),
}

/// Writes a small table, whose columns have a name and a unit (empty if they have none).
///
/// # Errors
/// [`WriteError`] if the columns differ in length or the file cannot be written. An existing file
/// then stays as it is.
pub fn write_columns(path: &Path, columns: Vec<(&str, &str, Column)>) -> Result<(), WriteError> {
    let (mut fields, mut arrays): (Vec<Field>, Vec<ArrayRef>) = (Vec::new(), Vec::new());
    for (name, unit, column) in columns {
        let unit = Some(unit).filter(|unit| !unit.is_empty());
        let (kind, array): (DataType, ArrayRef) = match column {
            Column::Text(texts) => (DataType::Utf8, Arc::new(StringArray::from(texts))),
            Column::Number(numbers) => (DataType::Float64, Arc::new(Float64Array::from(numbers))),
        };
        fields.push(field(name, kind, unit));
        arrays.push(array);
    }
    let schema = Arc::new(Schema::new(fields));
    write_file(path, |file| {
        let batch = RecordBatch::try_new(schema.clone(), arrays).map_err(io::Error::other)?;
        let mut writer = ArrowWriter::try_new(file, schema, Some(properties())).map_err(io::Error::other)?;
        writer.write(&batch).and_then(|()| writer.close()).map(drop).map_err(io::Error::other)
    })
}
