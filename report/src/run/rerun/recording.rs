//! A recording while it is written: its messages in memory, in three streams of the rerun library.
//!
//! ```text
//!  layout │ what holds for the whole run │ what changes in time     the order in the file
//! ```
//!
//! The viewer can show a view only when it knows the fixed properties of its entities. Rows that
//! hold for the whole run therefore precede the others, whenever they are logged.
//!
//! The library's own sink for files writes on a thread, and at most logs an error of the disk as a
//! line. Here the messages stay in memory until the recording is complete. They are then encoded
//! into the file one by one.

use std::io::Write;

use rerun::log::{ChunkBatcherConfig, LogMsg};
use rerun::sink::MemorySinkStorage;
use rerun::{
    AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamError, SerializedComponentColumn,
    StoreId, StoreKind, TimeColumn,
};

use super::RecordingError;
use super::parts::{BlueprintActivationCommand, EncodeError, Encoder, EncodingOptions};

/// Number of digits of the hash that names a recording.
const NAME_DIGITS: usize = 32;

/// The contents of a recording file.
pub(super) struct Recording {
    layout: Stream,
    fixed: Stream,
    moving: Stream,
}

impl Recording {
    /// Creates an empty recording. The viewer keeps one layout for each `application`.
    pub(super) fn new(application: &'static str, name: &str) -> Result<Self, RecordingError> {
        let stream = |kind| Stream::new(&StoreId::new(kind, application, name));
        // The threads of the largest stream start first and end last. The allocator then gives them
        // the memory that the threads of the previous recording have left.
        let moving = stream(StoreKind::Recording)?;
        let fixed = stream(StoreKind::Recording)?;
        Ok(Self { layout: stream(StoreKind::Blueprint)?, fixed, moving })
    }

    /// Adds components that hold on all timelines at all times.
    pub(super) fn log_static(&self, entity: EntityPath, archetype: &dyn AsComponents) -> Result<(), RecordingError> {
        Ok(self.fixed.stream.log_static(entity, archetype)?)
    }

    /// Adds a property of the whole recording.
    pub(super) fn send_property(&self, name: &str, archetype: &dyn AsComponents) -> Result<(), RecordingError> {
        Ok(self.fixed.stream.send_property(name, archetype)?)
    }

    /// Sets the title under which the viewer lists the recording.
    pub(super) fn send_title(&self, title: &str) -> Result<(), RecordingError> {
        Ok(self.fixed.stream.send_recording_name(title)?)
    }

    /// Adds one row of components.
    pub(super) fn send_row(
        &self,
        entity: EntityPath,
        times: Vec<TimeColumn>,
        archetype: &dyn AsComponents,
    ) -> Result<(), RecordingError> {
        self.send_columns(entity, times, as_columns(archetype))
    }

    /// Adds one row of components per time.
    pub(super) fn send_columns(
        &self,
        entity: EntityPath,
        times: Vec<TimeColumn>,
        columns: impl Iterator<Item = SerializedComponentColumn>,
    ) -> Result<(), RecordingError> {
        Ok(self.moving.stream.send_columns(entity, times, columns)?)
    }

    /// Adds components of the layout, at a moment of the layout's own timeline.
    pub(super) fn send_layout(
        &self,
        entity: EntityPath,
        time: TimeColumn,
        archetype: &dyn AsComponents,
    ) -> Result<(), RecordingError> {
        Ok(self.layout.stream.send_columns(entity, [time], as_columns(archetype))?)
    }

    /// Tells the viewer that the layout is complete.
    pub(super) fn activate_layout(&self) -> Result<(), RecordingError> {
        let stream = &self.layout.stream;
        // The message would overtake rows that the stream has not passed on.
        stream.flush_blocking().map_err(RecordingError::encode)?;
        if let Some(info) = stream.store_info() {
            stream.record_msg(BlueprintActivationCommand::make_active(info.store_id).into());
        }
        Ok(())
    }

    /// Waits until the streams have passed on all rows.
    pub(super) fn complete(&self) -> Result<(), RecordingError> {
        let mut streams = [&self.layout, &self.fixed, &self.moving].into_iter();
        streams.try_for_each(|stream| stream.stream.flush_blocking()).map_err(RecordingError::encode)
    }

    /// Writes the [complete](Self::complete) recording into `file`. Each message is dropped once it
    /// is written.
    pub(super) fn encode(self, file: impl Write) -> Result<(), EncodeError> {
        let version = rerun::build_info().version;
        let mut encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, file)?;
        for stream in [&self.layout, &self.fixed, &self.moving] {
            for message in stream.storage.take() {
                encoder.append(&message)?;
            }
        }
        encoder.finish()
    }
}

#[cfg(test)]
impl Recording {
    /// Returns the name of the recording.
    pub(super) fn name(&self) -> String {
        self.fixed.stream.store_info().map(|info| info.recording_id().to_string()).unwrap_or_default()
    }

    /// Takes the chunks of the layout or of the data out of the recording, in the order of the
    /// file.
    pub(super) fn take_chunks(&self, kind: StoreKind) -> Vec<rerun::log::Chunk> {
        let streams = match kind {
            StoreKind::Blueprint => vec![&self.layout],
            StoreKind::Recording => vec![&self.fixed, &self.moving],
        };
        let messages = streams.into_iter().flat_map(|stream| stream.storage.take());
        let chunk = |message| match message {
            rerun::log::LogMsg::ArrowMsg(_, columns) => {
                Some(rerun::log::Chunk::from_arrow_msg(&columns).expect("a chunk"))
            }
            _ => None,
        };
        messages.filter_map(chunk).collect()
    }
}

/// A stream of the library with the messages that came out of it.
pub(super) struct Stream {
    stream: RecordingStream,
    storage: MemorySinkStorage,
}

impl Stream {
    pub(super) fn new(id: &StoreId) -> Result<Self, RecordingStreamError> {
        // Without a timer, the same run gives the same chunks.
        let builder = RecordingStreamBuilder::from_store_id(id).batcher_config(ChunkBatcherConfig::NEVER);
        let (stream, storage) = builder.send_properties(false).enabled(true).memory()?;
        Ok(Self { stream, storage })
    }

    /// Adds one row of components.
    pub(super) fn send(
        &self,
        entity: EntityPath,
        time: TimeColumn,
        archetype: &dyn AsComponents,
    ) -> Result<(), RecordingError> {
        Ok(self.stream.send_columns(entity, [time], as_columns(archetype))?)
    }

    /// Waits for all messages, and takes them out of the stream.
    pub(super) fn taken(&self) -> Result<Vec<LogMsg>, RecordingError> {
        self.stream.flush_blocking().map_err(RecordingError::encode)?;
        Ok(self.storage.take())
    }
}

impl Drop for Stream {
    /// Ends the threads of the stream. The memory sink holds the stream, and the stream's thread
    /// the sink: neither would ever end.
    fn drop(&mut self) {
        self.stream.disconnect();
    }
}

/// Returns a column with one row for each component.
fn as_columns(archetype: &dyn AsComponents) -> impl Iterator<Item = SerializedComponentColumn> {
    archetype.as_serialized_batches().into_iter().map(SerializedComponentColumn::from)
}

/// Returns the name of a recording: the first digits of the hash of its texts, which hold all
/// results. The viewer takes two recordings of the same name for one.
pub(super) fn name(texts: &[String]) -> String {
    let mut hasher = blake3::Hasher::new();
    for text in texts {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.finalize().to_hex().chars().take(NAME_DIGITS).collect()
}
