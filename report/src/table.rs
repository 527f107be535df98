//! Settings that all Parquet tables share.

use std::collections::HashMap;

use arrow::datatypes::{DataType, Field};
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;

/// Number of rows in a row group: as many are held in memory while writing.
pub(crate) const ROWS_PER_GROUP: usize = 8_192;

/// Returns the settings of a table. None depends on the time, the machine or the version of a library.
pub(crate) fn properties() -> WriterProperties {
    WriterProperties::builder()
        .set_created_by("closecall".to_owned())
        .set_compression(Compression::SNAPPY)
        .set_max_row_group_row_count(Some(ROWS_PER_GROUP))
        .build()
}

/// Returns a nullable column, with its unit in the metadata if it has one.
pub(crate) fn field(name: &str, of: DataType, unit: Option<&str>) -> Field {
    let metadata: HashMap<String, String> = unit.map(|unit| ("unit".to_owned(), unit.to_owned())).into_iter().collect();
    Field::new(name, of, true).with_metadata(metadata)
}
