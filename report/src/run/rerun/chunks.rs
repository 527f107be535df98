//! The chunks of a recording, with identifiers that follow from their order.
//!
//! The library's own stream draws identifiers from the clock and collects rows until a timer ends. Two recordings of the
//! same run would then differ. Here a chunk has the number of its predecessor plus one, and the recording is named after
//! the hash of its contents, so that the same run gives the same bytes.

use std::cell::RefCell;

use rerun::external::re_log_encoding::Encoder;
use rerun::external::re_log_types::external::re_tuid::Tuid;
use rerun::external::re_log_types::{BlueprintActivationCommand, EntityPath, SetStoreInfo, StoreInfo, StoreSource};
use rerun::log::{Chunk, ChunkComponents, ChunkId, LogMsg};
use rerun::{AsComponents, SerializedComponentColumn, StoreId, StoreKind, TimeColumn};

use super::RecordingError;

/// Number of digits of the hash that names a recording.
const NAME_DIGITS: usize = 16;
/// Ends of the names of the two stores of a recording.
const LAYOUT_SUFFIX: &str = "-layout";
const DATA_SUFFIX: &str = "-data";
/// Largest number of attempts at an index in a stable order. Each succeeds with a probability of about one half.
const MAX_ATTEMPTS: u32 = 100;

/// The chunks of one store, in the order in which they are written.
#[derive(Default)]
pub(super) struct Chunks(RefCell<Vec<Chunk>>);

impl Chunks {
    /// Adds components that hold on all timelines at all times.
    pub(super) fn push_static(&self, entity: EntityPath, what: &dyn AsComponents) -> Result<(), RecordingError> {
        self.push_row(entity, Vec::new(), what)
    }

    /// Adds one row of components. Without timelines it holds at all times.
    pub(super) fn push_row(
        &self,
        entity: EntityPath,
        times: Vec<TimeColumn>,
        what: &dyn AsComponents,
    ) -> Result<(), RecordingError> {
        // A batch becomes a column with one row.
        self.push_columns(entity, times, what.as_serialized_batches().into_iter().map(SerializedComponentColumn::from))
    }

    /// Adds one row of components per time.
    pub(super) fn push_columns(
        &self,
        entity: EntityPath,
        times: Vec<TimeColumn>,
        columns: impl Iterator<Item = SerializedComponentColumn>,
    ) -> Result<(), RecordingError> {
        let times = times.into_iter().map(|column| (*column.timeline().name(), column)).collect();
        let components: ChunkComponents = columns.map(|column| (column.descriptor, column.list_array)).collect();
        let mut chunks = self.0.borrow_mut();
        let chunk = Chunk::from_auto_row_ids(chunk_id(chunks.len()), entity, times, components);
        chunks.push(chunk.map_err(RecordingError::encode)?);
        Ok(())
    }

    /// Returns the messages that make up the store `id`.
    fn messages(self, id: &StoreId) -> Result<Vec<LogMsg>, RecordingError> {
        let chunks = self.0.into_inner();
        let row_id = tuid(chunks.len());
        let info = StoreInfo::new(id.clone(), StoreSource::Other("closecall".to_owned()));
        let mut messages = vec![LogMsg::SetStoreInfo(SetStoreInfo { row_id, info })];
        // The viewer can show a view only when it knows the fixed properties of its entities.
        let (fixed, moving): (Vec<_>, Vec<_>) = chunks.into_iter().partition(Chunk::is_static);
        for chunk in fixed.iter().chain(&moving) {
            messages.push(LogMsg::ArrowMsg(id.clone(), chunk.to_arrow_msg().map_err(RecordingError::encode)?));
        }
        Ok(messages)
    }
}

/// Returns the messages of a recording: the layout first, then the data.
pub(super) fn recording(
    application: &'static str,
    layout: Chunks,
    data: Chunks,
) -> Result<Vec<LogMsg>, RecordingError> {
    let unnamed = StoreId::new(StoreKind::Recording, application, "unnamed");
    let draft = data.messages(&unnamed)?;
    let name = hash(&draft)?;
    let id = |kind, suffix| StoreId::new(kind, application, format!("{name}{suffix}"));
    let (blueprint, recording) = (id(StoreKind::Blueprint, LAYOUT_SUFFIX), id(StoreKind::Recording, DATA_SUFFIX));
    let mut messages = layout.messages(&blueprint)?;
    messages.push(LogMsg::BlueprintActivationCommand(BlueprintActivationCommand::make_active(blueprint)));
    messages.extend(draft.into_iter().map(|mut message| {
        message.set_store_id(recording.clone());
        message
    }));
    Ok(messages)
}

/// Returns the bytes of a recording file.
///
/// The index at the end of the file lists its two stores in the order of a hash table, which the library seeds by chance.
/// The file is therefore encoded until the layout comes first: twice on average.
pub(super) fn encode(messages: &[LogMsg]) -> Result<Vec<u8>, RecordingError> {
    for _ in 0..MAX_ATTEMPTS {
        let mut encoder = Encoder::local().map_err(RecordingError::encode)?;
        let mut length = 0;
        for message in messages {
            length += encoder.append(message).map_err(RecordingError::encode)?;
        }
        encoder.finish().map_err(RecordingError::encode)?;
        let bytes = encoder.into_inner().map_err(RecordingError::encode)?;
        // The header, which `append` does not count, is shorter than any message.
        let index = bytes.get(usize::try_from(length).unwrap_or(0)..).unwrap_or_default();
        if is_layout_first(index) {
            return Ok(bytes);
        }
    }
    Err(RecordingError::encode("the index of the file has no stable order"))
}

/// Returns true if the index names the layout before the data.
fn is_layout_first(index: &[u8]) -> bool {
    let position = |text: &str| index.windows(text.len()).position(|bytes| bytes == text.as_bytes());
    match (position(LAYOUT_SUFFIX), position(DATA_SUFFIX)) {
        (Some(layout), Some(data)) => layout < data,
        _ => true,
    }
}

/// Returns the first digits of the hash of the messages.
fn hash(messages: &[LogMsg]) -> Result<String, RecordingError> {
    let mut encoder = Encoder::local().map_err(RecordingError::encode)?;
    encoder.do_not_emit_footer();
    for message in messages {
        encoder.append(message).map_err(RecordingError::encode)?;
    }
    encoder.finish().map_err(RecordingError::encode)?;
    let bytes = encoder.into_inner().map_err(RecordingError::encode)?;
    Ok(blake3::hash(&bytes).to_hex().chars().take(NAME_DIGITS).collect())
}

/// Returns the identifier of the chunk of this index. The rows of a chunk have identifiers from its own on.
fn chunk_id(index: usize) -> ChunkId {
    ChunkId::from_tuid(tuid(index))
}

fn tuid(index: usize) -> Tuid {
    Tuid::from_nanos_and_inc(index as u64 + 1, 0)
}
