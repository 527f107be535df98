//! Reads a Parquet file that has the columns of a text layout. The file becomes the text of that
//! layout: a header, and below it one line for each row.

use std::io::{self, BufRead, Read};

use parquet::basic::Compression;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::serialized_reader::ReadOptionsBuilder;
use parquet::record::Field;
use parquet::record::reader::RowIter;

use super::error::TrajectoryFileProblem;
use super::rows::io_problem;
use super::source::ReadError;

/// The first bytes of a Parquet file.
pub(super) const MAGIC: &[u8] = b"PAR1";

/// Largest size of a file (bytes). The whole file is held in memory.
const MAX_BYTES: u64 = 4 << 30;

/// The rows of a Parquet file as lines of text.
pub(super) struct ParquetText {
    rows: RowIter<'static>,
    /// Text that has not been read yet.
    text: Vec<u8>,
    position: usize,
}

impl ParquetText {
    /// Reads the file, and the names of its columns.
    ///
    /// # Errors
    /// The file is damaged, too large, or has columns that are not single values.
    pub(super) fn new(input: impl BufRead) -> Result<Self, ReadError> {
        let mut bytes = Vec::new();
        let read = input.take(MAX_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(|error| ReadError::of_file(io_problem(error)))?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(unreadable(format!("it is larger than {MAX_BYTES} bytes")));
        }
        let options = ReadOptionsBuilder::new().build();
        let reader = SerializedFileReader::new_with_options(bytes::Bytes::from(bytes), options);
        let reader = reader.map_err(|error| unreadable(error.to_string()))?;
        let chunks = reader.metadata().row_groups().iter().flat_map(|group| group.columns());
        let is_read =
            |codec: &Compression| !matches!(codec, Compression::LZO | Compression::BROTLI(_) | Compression::LZ4);
        if let Some(codec) = chunks.map(|chunk| chunk.compression()).find(|codec| !is_read(codec)) {
            let name = format!("{codec:?}");
            let name = name.split('(').next().unwrap_or_default();
            return Err(unreadable(format!(
                "its columns are compressed with {name}, but Snappy, Gzip, Zstandard, LZ4_RAW and no compression are read: write it \
                 again with the option compression='snappy', which pandas, pyarrow and polars have"
            )));
        }
        let schema = reader.metadata().file_metadata().schema_descr();
        let mut names = Vec::new();
        for column in schema.columns() {
            let path = column.path();
            if path.parts().len() != 1 || column.max_rep_level() > 0 {
                return Err(unreadable(format!(
                    "its column `{path}` holds lists or structures instead of single values"
                )));
            }
            names.push(quoted(column.name()));
        }
        let text = format!("{}\n", names.join(",")).into_bytes();
        Ok(Self { rows: RowIter::from_file_into(Box::new(reader)), text, position: 0 })
    }

    /// Replaces the text by the line of the next row. Returns `false` after the last one.
    fn next_line(&mut self) -> io::Result<bool> {
        let Some(row) = self.rows.next() else { return Ok(false) };
        let row = row.map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.to_string()))?;
        self.text.clear();
        self.position = 0;
        for (index, (_, field)) in row.get_column_iter().enumerate() {
            if index > 0 {
                self.text.push(b',');
            }
            self.text.extend_from_slice(text(field).as_bytes());
        }
        self.text.push(b'\n');
        Ok(true)
    }
}

impl Read for ParquetText {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.position == self.text.len() {
            if !self.next_line()? {
                return Ok(0);
            }
        }
        let rest = &self.text[self.position..];
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.position += count;
        Ok(count)
    }
}

fn unreadable(reason: String) -> ReadError {
    ReadError::of_file(TrajectoryFileProblem::Unreadable { format: "Parquet file", reason })
}

/// Returns a field as the text layouts write it.
fn text(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Float(value) => value.to_string(),
        Field::Double(value) => value.to_string(),
        Field::Str(value) => quoted(value),
        other => quoted(&other.to_string()),
    }
}

/// Puts text into quotes if it needs them. Quotes and line ends within the text become blanks,
/// because no text layout allows them.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace(['"', '\n', '\r'], " "))
    } else {
        text.to_owned()
    }
}
