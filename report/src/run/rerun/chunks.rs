//! The chunks of a recording, with identifiers that follow from their order.
//!
//! The library's own stream draws identifiers from the clock and collects rows until a timer ends. Two recordings of the
//! same run would then differ. Here a chunk has the number of its predecessor plus one, and the recording is named after
//! the hash of its texts, so that the same run gives the same bytes.

use std::cell::RefCell;

use crate::run::rerun::sdk::{AsComponents, SerializedComponentColumn, TimeColumn};
use re_sdk::external::re_log_types::EntityPath;
use re_sdk::external::re_log_types::external::re_tuid::Tuid;
use re_sdk::log::{Chunk, ChunkComponents, ChunkId};

use super::RecordingError;

/// Number of digits of the hash that names a recording.
const NAME_DIGITS: usize = 32;

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

    /// Returns the chunks, those without timelines first: the viewer can show a view only when it knows the fixed
    /// properties of its entities.
    pub(super) fn into_ordered(self) -> Vec<Chunk> {
        let (mut chunks, moving): (Vec<_>, Vec<_>) = self.0.into_inner().into_iter().partition(Chunk::is_static);
        chunks.extend(moving);
        chunks
    }
}

/// Returns the name of a recording: the first digits of the hash of its texts, which hold all results.
pub(super) fn name(texts: &[String]) -> String {
    let mut hasher = blake3::Hasher::new();
    for text in texts {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.finalize().to_hex().chars().take(NAME_DIGITS).collect()
}

/// Returns the identifier of the chunk of this index. The rows of a chunk have identifiers from its own on.
fn chunk_id(index: usize) -> ChunkId {
    ChunkId::from_tuid(tuid(index))
}

/// Returns the identifier of this number.
pub(super) fn tuid(index: usize) -> Tuid {
    Tuid::from_nanos_and_inc(index as u64 + 1, 0)
}
