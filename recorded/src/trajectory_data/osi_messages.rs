//! The messages of a file of OSI, one after the other: a trace file, or a channel of an MCAP file.

use std::collections::BTreeMap;
use std::io::{BufRead, Read};

use mcap::McapError;
use mcap::parse_record;
use mcap::records::Record;

use super::error::TrajectoryFileProblem;
use super::rows::io_problem;
use super::source::ReadError;
use crate::mcap_records::{McapRecords, RawRecord};

pub(super) const FORMAT: &str = "file of OSI messages";

/// The type of the messages that are read, as in MCAP files.
const MESSAGE: &str = "osi3.GroundTruth";
/// The encoding of these messages.
const PROTOBUF: &str = "protobuf";

/// Largest message or record (bytes): a damaged length must not take all memory. A message with
/// 10,000 objects has some megabytes, an MCAP chunk some more.
const MAX_MESSAGE_BYTES: usize = 1 << 28;

pub(super) fn refused(reason: String) -> ReadError {
    ReadError::of_file(TrajectoryFileProblem::Unreadable { format: FORMAT, reason })
}

/// The messages of a file.
pub(super) enum Messages<R> {
    Trace(R),
    Mcap(Box<McapMessages<R>>),
}

impl<R: BufRead> Messages<R> {
    pub(super) fn of_mcap(input: R) -> Self {
        let (records, schemas, topics) = (McapRecords::new(input, MAX_MESSAGE_BYTES), BTreeMap::new(), BTreeMap::new());
        Self::Mcap(Box::new(McapMessages { records, schemas, topics, read: None, others: Vec::new() }))
    }

    /// Returns the next message; its number is `number`.
    ///
    /// # Errors
    /// The file cannot be read, is damaged or has messages of another type alone.
    pub(super) fn next(&mut self, number: u64) -> Result<Option<Vec<u8>>, ReadError> {
        match self {
            Self::Trace(input) => next_of_trace(input, number),
            Self::Mcap(messages) => messages.next(),
        }
    }
}

/// Reads a message of a trace file: its length in four bytes, the lowest first, and its bytes.
fn next_of_trace(input: &mut impl BufRead, number: u64) -> Result<Option<Vec<u8>>, ReadError> {
    let io = |error| ReadError::of_file(io_problem(error));
    let mut length = Vec::new();
    input.by_ref().take(4).read_to_end(&mut length).map_err(io)?;
    let Ok(bytes) = <[u8; 4]>::try_from(length.as_slice()) else {
        let is_over = length.is_empty();
        return if is_over {
            Ok(None)
        } else {
            Err(refused(format!("message {number}: the file is cut in its length")))
        };
    };
    let wanted = u32::from_le_bytes(bytes) as usize;
    if wanted > MAX_MESSAGE_BYTES {
        let reason =
            format!("message {number}: its length is {wanted} bytes, but at most {MAX_MESSAGE_BYTES} are read");
        return Err(refused(reason));
    }
    let mut message = Vec::new();
    input.by_ref().take(wanted as u64).read_to_end(&mut message).map_err(io)?;
    if message.len() < wanted {
        let reason = format!("message {number}: the file is cut after {} of its {wanted} bytes", message.len());
        return Err(refused(reason));
    }
    Ok(Some(message))
}

/// The messages of one channel of an MCAP file.
pub(super) struct McapMessages<R> {
    records: McapRecords<R>,
    /// Name and encoding of each schema.
    schemas: BTreeMap<u16, String>,
    /// Topic of each channel with `GroundTruth`.
    topics: BTreeMap<u16, String>,
    /// The channel that is read.
    read: Option<u16>,
    /// Types of the messages of other channels.
    others: Vec<String>,
}

impl<R: BufRead> McapMessages<R> {
    fn next(&mut self) -> Result<Option<Vec<u8>>, ReadError> {
        while let Some(RawRecord { opcode, data }) = self.records.next().map_err(of_mcap)? {
            match parse_record(opcode, &data).map_err(of_mcap)? {
                Record::Schema { header, .. } => {
                    self.schemas.insert(header.id, header.name);
                }
                Record::Channel(channel) => {
                    let message = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                    if message != MESSAGE {
                        self.others.push(message);
                        continue;
                    }
                    if channel.message_encoding != PROTOBUF {
                        return Err(refused(format!(
                            "the topic {} has the encoding `{}`, but `{PROTOBUF}` is needed",
                            channel.topic, channel.message_encoding
                        )));
                    }
                    self.topics.insert(channel.id, channel.topic);
                }
                Record::Message { header, data } => {
                    if !self.topics.contains_key(&header.channel_id) {
                        continue;
                    }
                    let read = *self.read.get_or_insert(header.channel_id);
                    if read != header.channel_id {
                        let topics: Vec<&str> = self.topics.values().map(String::as_str).collect();
                        let topics = topics.join("` and `");
                        return Err(refused(format!("the topics `{topics}` both hold {MESSAGE}; one is needed")));
                    }
                    return Ok(Some(data.into_owned()));
                }
                _ => {}
            }
        }
        if self.read.is_none() {
            let others: Vec<&str> = self.others.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
            let others = if others.is_empty() { String::new() } else { format!(", only {}", others.join(", ")) };
            return Err(refused(format!("it has no message {MESSAGE}{others}")));
        }
        Ok(None)
    }
}

fn of_mcap(error: McapError) -> ReadError {
    refused(match error {
        McapError::Io(error) => return ReadError::of_file(io_problem(error)),
        McapError::UnsupportedCompression(kind) => {
            format!("a chunk has the compression `{kind}`, but `lz4`, `zstd` and none are read")
        }
        McapError::BadMagic => "it does not begin or end as MCAP files do".to_owned(),
        other => other.to_string(),
    })
}
