//! The records of an MCAP file, one after the other, also of its chunks.
//!
//! The reader of the crate `mcap` unpacks chunks itself, but it does not return from a chunk that
//! unpacks to another size than the chunk states. A chunk is therefore unpacked here, and its size
//! is compared.

use std::collections::VecDeque;
use std::io::Read;

use flate2::Crc;
use mcap::records::{ChunkHeader, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};

/// Bytes before the content of a record: its kind, and its length.
const BEFORE_CONTENT: usize = 9;

/// A record that is not parsed.
pub(crate) struct RawRecord {
    pub(crate) opcode: u8,
    pub(crate) data: Vec<u8>,
}

/// The records of a file.
pub(crate) struct McapRecords<R> {
    input: R,
    reader: LinearReader,
    /// Largest record, and largest chunk when it is unpacked (bytes).
    most: usize,
    /// The records of the last chunk that are not returned yet.
    of_chunk: VecDeque<RawRecord>,
}

impl<R: Read> McapRecords<R> {
    /// Reads a file whose records and unpacked chunks have at most `most` bytes: a damaged length
    /// must not take all memory.
    pub(crate) fn new(input: R, most: usize) -> Self {
        let options = LinearReaderOptions::default()
            .with_record_length_limit(most)
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true);
        Self { input, reader: LinearReader::new_with_options(options), most, of_chunk: VecDeque::new() }
    }

    /// Returns the next record that is not a chunk.
    ///
    /// # Errors
    /// [`McapError`], with `Io` if the input cannot be read.
    pub(crate) fn next(&mut self) -> Result<Option<RawRecord>, McapError> {
        loop {
            if let Some(record) = self.of_chunk.pop_front() {
                return Ok(Some(record));
            }
            let Some(event) = self.reader.next_event() else { return Ok(None) };
            match event? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let read = self.input.read(self.reader.insert(wanted))?;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode: op::CHUNK } => {
                    if let Record::Chunk { header, data } = parse_record(op::CHUNK, data)? {
                        self.of_chunk = records(&unpacked(&header, &data, self.most)?)?;
                    }
                }
                LinearReadEvent::Record { data, opcode } => {
                    return Ok(Some(RawRecord { opcode, data: data.to_vec() }));
                }
            }
        }
    }
}

/// Returns the content of a chunk. It has the size and the checksum that the chunk states.
fn unpacked(header: &ChunkHeader, packed: &[u8], most: usize) -> Result<Vec<u8>, McapError> {
    let stated = header.uncompressed_size;
    if stated > most as u64 {
        return Err(McapError::ChunkTooLarge(stated));
    }
    let decoder: Box<dyn Read + '_> = match header.compression.as_str() {
        "" => Box::new(packed),
        "lz4" => Box::new(lz4::Decoder::new(packed)?),
        "zstd" => Box::new(zstd::Decoder::with_buffer(packed)?),
        other => return Err(McapError::UnsupportedCompression(other.to_owned())),
    };
    let mut content = Vec::new();
    let result = decoder.take(stated + 1).read_to_end(&mut content);
    result.map_err(|error| McapError::DecompressionError(error.to_string()))?;
    if content.len() as u64 != stated {
        let more = if content.len() as u64 > stated { "more".to_owned() } else { content.len().to_string() };
        return Err(McapError::DecompressionError(format!("a chunk states {stated} bytes, and has {more}")));
    }
    let (saved, mut checksum) = (header.uncompressed_crc, Crc::new());
    checksum.update(&content);
    match checksum.sum() {
        calculated if saved != 0 && calculated != saved => Err(McapError::BadChunkCrc { saved, calculated }),
        _ => Ok(content),
    }
}

/// Returns the records in the content of a chunk.
fn records(mut content: &[u8]) -> Result<VecDeque<RawRecord>, McapError> {
    let mut list = VecDeque::new();
    while let Some((before, rest)) = content.split_first_chunk::<BEFORE_CONTENT>() {
        let [opcode, length @ ..] = *before;
        // The standard reserves the kind 0.
        if opcode == 0 || opcode == op::CHUNK {
            return Err(McapError::DecompressionError(format!("a chunk has a record of the kind {opcode}")));
        }
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let (data, behind) = rest.split_at_checked(length).ok_or(McapError::UnexpectedEoc)?;
        list.push_back(RawRecord { opcode, data: data.to_vec() });
        content = behind;
    }
    if content.is_empty() { Ok(list) } else { Err(McapError::UnexpectedEoc) }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    /// A file with one chunk, which states `size` bytes and has `packed`.
    fn file(compression: &str, size: u64, packed: &[u8]) -> Vec<u8> {
        fn record(opcode: u8, parts: &[&[u8]]) -> Vec<u8> {
            let data = parts.concat();
            [&[opcode][..], &(data.len() as u64).to_le_bytes(), &data].concat()
        }
        let name_length = u32::try_from(compression.len()).unwrap().to_le_bytes();
        let packed_length = (packed.len() as u64).to_le_bytes();
        let chunk: [&[u8]; 6] = [
            &[0; 16],
            &size.to_le_bytes(),
            &[0; 4],
            &[&name_length[..], compression.as_bytes()].concat(),
            &packed_length,
            packed,
        ];
        [
            mcap::MAGIC,
            &record(op::HEADER, &[&[0; 8]]),
            &record(op::CHUNK, &chunk),
            &record(op::DATA_END, &[&[0; 4]]),
            &record(op::FOOTER, &[&[0; 20]]),
            mcap::MAGIC,
        ]
        .concat()
    }

    fn packed(compression: &str, content: &[u8]) -> Vec<u8> {
        match compression {
            "zstd" => zstd::encode_all(content, 0).unwrap(),
            "lz4" => {
                let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
                encoder.write_all(content).unwrap();
                encoder.finish().0
            }
            _ => content.to_vec(),
        }
    }

    fn kinds(file: &[u8], most: usize) -> Result<Vec<u8>, String> {
        let (mut records, mut kinds) = (McapRecords::new(file, most), Vec::new());
        while let Some(record) = records.next().map_err(|error| error.to_string())? {
            kinds.push(record.opcode);
        }
        Ok(kinds)
    }

    #[test]
    fn a_chunk_that_unpacks_to_another_size_than_it_states_is_refused() {
        let content = [&[op::METADATA][..], &8u64.to_le_bytes(), &[0; 8]].concat();
        let size = content.len() as u64;
        for compression in ["", "lz4", "zstd"] {
            let packed = packed(compression, &content);
            let whole = kinds(&file(compression, size, &packed), 1_000).unwrap();
            assert_eq!(whole, [op::HEADER, op::METADATA, op::DATA_END, op::FOOTER], "{compression}");
            for (stated, word) in [
                (size - 1, "a chunk states 16 bytes, and has more"),
                (size + 1, "a chunk states 18 bytes, and has 17"),
                (1_001, "exceeds limit"),
                (u64::MAX, "exceeds limit"),
            ] {
                let refused = kinds(&file(compression, stated, &packed), 1_000).unwrap_err();
                assert!(refused.contains(word), "{compression} {stated}: {refused}");
            }
        }
    }

    #[test]
    fn records_that_do_not_fill_a_chunk_are_refused() {
        let long = [&[op::METADATA][..], &u64::MAX.to_le_bytes()].concat();
        for (content, word) in [
            (&long[..], "middle of a record"),
            (&[op::METADATA; 5][..], "middle of a record"),
            (&[0; 900][..], "the kind 0"),
        ] {
            for compression in ["", "lz4", "zstd"] {
                let file = file(compression, content.len() as u64, &packed(compression, content));
                let refused = kinds(&file, 1_000).unwrap_err();
                assert!(refused.contains(word), "{compression}: {refused}");
            }
        }
    }
}
