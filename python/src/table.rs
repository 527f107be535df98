//! Tables that other libraries read without copying, by the Arrow PyCapsule interface
//! (<https://arrow.apache.org/docs/format/CDataInterface/PyCapsuleInterface.html>).

use std::collections::BTreeSet;
use std::ffi::CStr;
use std::sync::Arc;

use arrow::array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, NullArray, RecordBatch, RecordBatchIterator, StringArray,
};
use arrow::datatypes::{Schema, SchemaRef};
use arrow::error::ArrowError;
use arrow::ffi::FFI_ArrowSchema;
use arrow::ffi_stream::FFI_ArrowArrayStream;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use serde_json::{Map, Value};

const SCHEMA_NAME: &CStr = c"arrow_schema";
const STREAM_NAME: &CStr = c"arrow_array_stream";

/// A table. `pyarrow.table(t)`, `polars.DataFrame(t)` and `pandas.DataFrame.from_arrow(t)` read it without copying.
#[pyclass(frozen, module = "closecall")]
#[derive(Clone, Debug)]
pub(crate) struct Table {
    schema: SchemaRef,
    batches: Vec<RecordBatch>,
}

impl Table {
    pub(crate) fn new(schema: SchemaRef, batches: Vec<RecordBatch>) -> Self {
        Self { schema, batches }
    }

    fn rows(&self) -> usize {
        self.batches.iter().map(RecordBatch::num_rows).sum()
    }
}

impl From<RecordBatch> for Table {
    fn from(batch: RecordBatch) -> Self {
        Self::new(batch.schema(), vec![batch])
    }
}

#[pymethods]
impl Table {
    /// The names of the columns.
    #[getter]
    fn column_names(&self) -> Vec<String> {
        self.schema.fields().iter().map(|field| field.name().clone()).collect()
    }

    /// The number of rows.
    #[getter]
    fn num_rows(&self) -> usize {
        self.rows()
    }

    fn __len__(&self) -> usize {
        self.rows()
    }

    fn __repr__(&self) -> String {
        format!("Table({} rows, columns {})", self.rows(), self.column_names().join(", "))
    }

    /// Returns the schema as an Arrow capsule.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.schema.as_ref()).map_err(refused)?;
        PyCapsule::new_with_value(py, schema, SCHEMA_NAME)
    }

    /// Returns the rows as an Arrow capsule. Another schema cannot be requested, and is ignored as the interface allows.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        drop(requested_schema);
        let batches = self.batches.clone().into_iter().map(Ok::<_, ArrowError>);
        let stream = FFI_ArrowArrayStream::new(Box::new(RecordBatchIterator::new(batches, self.schema.clone())));
        PyCapsule::new_with_value(py, stream, STREAM_NAME)
    }
}

/// Returns the table of a JSON array of objects. A column has the type of its values: truth values, whole numbers, numbers or
/// text. Values of several types, and lists, become JSON text. A column without a value has Arrow's type null, which every
/// other one takes in if tables are joined.
#[pyfunction]
pub(crate) fn rows_table(rows: &str) -> PyResult<Table> {
    let rows: Vec<Map<String, Value>> =
        serde_json::from_str(rows).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let mut names: Vec<&String> = Vec::new();
    let mut names_so_far = BTreeSet::new();
    for name in rows.iter().flat_map(Map::keys) {
        if names_so_far.insert(name) {
            names.push(name);
        }
    }
    if names.is_empty() {
        return Ok(Table::new(SchemaRef::new(Schema::empty()), Vec::new()));
    }
    let columns = names.into_iter().map(|name| {
        let values: Vec<Option<&Value>> =
            rows.iter().map(|row| row.get(name).filter(|value| !value.is_null())).collect();
        (name, column(&values), true)
    });
    let batch = RecordBatch::try_from_iter_with_nullable(columns).map_err(refused)?;
    Ok(batch.into())
}

/// Returns the column of these values. `None` is absent.
fn column(values: &[Option<&Value>]) -> ArrayRef {
    let are = |is: fn(&Value) -> bool| values.iter().flatten().all(|value| is(value));
    if values.iter().all(Option::is_none) {
        Arc::new(NullArray::new(values.len()))
    } else if are(Value::is_boolean) {
        Arc::new(values.iter().map(|value| value.and_then(Value::as_bool)).collect::<BooleanArray>())
    } else if are(Value::is_i64) {
        Arc::new(values.iter().map(|value| value.and_then(Value::as_i64)).collect::<Int64Array>())
    } else if are(Value::is_number) {
        Arc::new(values.iter().map(|value| value.and_then(Value::as_f64)).collect::<Float64Array>())
    } else {
        let is_text = are(Value::is_string);
        let text = |value: &Value| match value {
            Value::String(text) if is_text => text.clone(),
            other => other.to_string(),
        };
        Arc::new(values.iter().map(|value| value.map(text)).collect::<StringArray>())
    }
}

fn refused(error: ArrowError) -> PyErr {
    PyValueError::new_err(error.to_string())
}
