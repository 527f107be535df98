//! The bytes of a recording file.
//!
//! ```text
//!  header │ layout: store, chunks, activation │ data: store, chunks │ index of both stores
//! ```
//!
//! The library's own encoder lists the stores and the columns of the index in the order of hash maps that differ from
//! process to process. Here the layout comes before the data, and the columns are sorted, so that the same run gives the
//! same bytes.

use crate::run::rerun::sdk::{StoreId, StoreKind};
use arrow::datatypes::Schema;
use re_sdk::external::re_log_encoding::{
    Compression, CrateVersion, Encodable, EncodingOptions, MessageHeader, MessageKind, RRD_FOURCC, RawRrdManifest,
    RrdFooter, RrdManifestBuilder, StreamFooter, StreamHeader, ToTransport,
};
use re_sdk::external::re_log_types::{ArrowMsg, BlueprintActivationCommand, SetStoreInfo, StoreInfo, StoreSource};
use re_sdk::log::{Chunk, LogMsg};
use re_span::Span;

use super::RecordingError;
use super::chunks::{Chunks, tuid};

/// The contents of a recording file.
pub(super) struct Recording {
    /// Name of the application, after which the viewer keeps layouts apart.
    pub(super) application: &'static str,
    /// Name of the recording.
    pub(super) name: String,
    /// Chunks of the layout.
    pub(super) layout: Vec<Chunk>,
    /// Chunks of the data.
    pub(super) data: Vec<Chunk>,
}

impl Recording {
    pub(super) fn new((application, name): (&'static str, String), layout: Chunks, data: Chunks) -> Self {
        Self { application, name, layout: layout.into_ordered(), data: data.into_ordered() }
    }

    /// Returns the bytes of the file.
    pub(super) fn encode(&self) -> Result<Vec<u8>, RecordingError> {
        let mut file = File::new()?;
        let id = |kind| StoreId::new(kind, self.application, self.name.as_str());
        let blueprint = id(StoreKind::Blueprint);
        let mut manifests = vec![file.store(&blueprint, &self.layout)?];
        file.message(&LogMsg::BlueprintActivationCommand(BlueprintActivationCommand::make_active(blueprint)))?;
        manifests.push(file.store(&id(StoreKind::Recording), &self.data)?);
        file.finish(&manifests)
    }
}

/// A file that is being written.
struct File {
    bytes: Vec<u8>,
}

impl File {
    fn new() -> Result<Self, RecordingError> {
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let header = StreamHeader { fourcc: RRD_FOURCC, version: CrateVersion::LOCAL.to_bytes(), options };
        let mut file = Self { bytes: Vec::new() };
        file.push(&header)?;
        Ok(file)
    }

    fn push(&mut self, what: &impl Encodable) -> Result<(), RecordingError> {
        what.to_rrd_bytes(&mut self.bytes).map(|_| ()).map_err(RecordingError::encode)
    }

    /// Appends a message, and returns its size before compression (bytes).
    fn message(&mut self, message: &LogMsg) -> Result<u64, RecordingError> {
        let message = message.to_transport(Compression::LZ4).map_err(RecordingError::encode)?;
        self.push(&message)?;
        Ok(message.byte_size_uncompressed())
    }

    /// Appends the chunks of a store, and returns their index.
    fn store(&mut self, id: &StoreId, chunks: &[Chunk]) -> Result<RawRrdManifest, RecordingError> {
        let info = StoreInfo::new(id.clone(), StoreSource::Other("closecall".to_owned()));
        self.message(&LogMsg::SetStoreInfo(SetStoreInfo { row_id: tuid(chunks.len()), info }))?;
        let mut index = RrdManifestBuilder::default();
        for chunk in chunks {
            let columns = chunk.to_chunk_batch().map_err(RecordingError::encode)?;
            let before = self.bytes.len();
            let message = ArrowMsg { chunk_id: chunk.id().as_tuid(), batch: columns.clone().into(), on_release: None };
            let uncompressed = self.message(&LogMsg::ArrowMsg(id.clone(), message))?;
            let start = before + MessageHeader::ENCODED_SIZE_BYTES;
            let span = Span { start: start as u64, len: (self.bytes.len() - start) as u64 };
            index.append(&columns, span, uncompressed).map_err(RecordingError::encode)?;
        }
        let mut index = index.build(id.clone()).map_err(RecordingError::encode)?;
        let mut fields = index.sorbet_schema.fields().to_vec();
        fields.sort();
        index.sorbet_schema = Schema::new_with_metadata(fields, std::mem::take(&mut index.sorbet_schema.metadata));
        Ok(index)
    }

    /// Appends the index, and returns the bytes of the file.
    fn finish(mut self, manifests: &[RawRrdManifest]) -> Result<Vec<u8>, RecordingError> {
        let mut footer = RrdFooter::default().to_transport(()).map_err(RecordingError::encode)?;
        for manifest in manifests {
            footer.manifests.push(manifest.to_transport(()).map_err(RecordingError::encode)?);
        }
        let mut bytes = Vec::new();
        footer.to_rrd_bytes(&mut bytes).map_err(RecordingError::encode)?;
        self.push(&MessageHeader { kind: MessageKind::End, len: bytes.len() as u64 })?;
        let start = self.bytes.len() as u64;
        self.bytes.extend_from_slice(&bytes);
        self.push(&StreamFooter::from_rrd_footer_bytes(start, &bytes))?;
        Ok(self.bytes)
    }
}
