//! Settings that all Parquet tables share.

use std::collections::HashMap;

use arrow::datatypes::{DataType, Field};
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;

/// Number of rows in a row group: the unit that a writer holds in memory and that a reader can skip.
pub(crate) const ROWS_PER_GROUP: usize = 8_192;

/// Returns the writer properties of every table.
///
/// The file names neither a time nor a place nor a library version, so that equal rows give equal bytes.
pub(crate) fn properties() -> WriterProperties {
    WriterProperties::builder()
        .set_created_by("closecall".to_owned())
        .set_compression(Compression::SNAPPY)
        .set_max_row_group_row_count(Some(ROWS_PER_GROUP))
        .build()
}

/// Returns a column whose cells may be null. Its metadata holds its unit, if it has one.
pub(crate) fn field(name: &str, data_type: DataType, unit: Option<&str>) -> Field {
    let metadata: HashMap<String, String> = unit.map(|unit| ("unit".to_owned(), unit.to_owned())).into_iter().collect();
    Field::new(name, data_type, true).with_metadata(metadata)
}

/// Returns a column in which every row has a value.
pub(crate) fn required(name: &str, data_type: DataType, unit: Option<&str>) -> Field {
    field(name, data_type, unit).with_nullable(false)
}
