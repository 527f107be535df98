//! What all Parquet tables have in common.

use std::collections::HashMap;

use arrow::datatypes::{DataType, Field};
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;

/// Rows that are held in memory at a time, and that a reader can skip at a time.
pub(crate) const ROWS_PER_GROUP: usize = 8_192;

/// How every table is written: nothing in it depends on when, where, or by which version of a library.
pub(crate) fn properties() -> WriterProperties {
    WriterProperties::builder()
        .set_created_by("closecall".to_owned())
        .set_compression(Compression::SNAPPY)
        .set_max_row_group_row_count(Some(ROWS_PER_GROUP))
        .build()
}

/// A nullable column; its unit, where it has one, stands in its metadata.
pub(crate) fn field(name: &str, of: DataType, unit: Option<&str>) -> Field {
    let metadata: HashMap<String, String> = unit.map(|unit| ("unit".to_owned(), unit.to_owned())).into_iter().collect();
    Field::new(name, of, true).with_metadata(metadata)
}
