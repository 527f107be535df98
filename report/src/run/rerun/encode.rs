//! The bytes of a recording file.
//!
//! ```text
//!  header │ layout: store, chunks, activation │ data: store, chunks │ index of both stores
//! ```
//!
//! The library's own encoder lists the stores and the columns of the index in the order of hash maps that differ from
//! process to process. Here the layout comes before the data, and the columns are sorted, so that the same run gives the
//! same bytes.

use std::io::Write;

use crate::run::rerun::sdk::{StoreId, StoreKind};
use arrow::array::RecordBatch;
use arrow::datatypes::Schema;
use arrow::ipc::writer::StreamWriter;
use re_protos::common::v1alpha1::Compression as CompressionCode;
use re_protos::log_msg::v1alpha1::{ArrowMsg, Encoding, RrdFooter, RrdManifest, log_msg::Msg};
use re_sdk::external::re_log_encoding::external::lz4_flex;
use re_sdk::external::re_log_encoding::{
    Compression, CrateVersion, Encodable, EncodingOptions, MessageHeader, MessageKind, RRD_FOURCC, RrdManifestBuilder,
    StreamFooter, StreamHeader, ToTransport,
};
use re_sdk::external::re_log_types::{BlueprintActivationCommand, SetStoreInfo, StoreInfo, StoreSource};
use re_sdk::log::{Chunk, LogMsg};
use re_span::Span;

use super::RecordingError;
use super::chunks::{Chunks, tuid};
use crate::memory::return_free_memory;

/// Size of the written chunks whose memory is returned to the system together (B): some ten times for a recording, as each time takes a
/// fraction of a millisecond.
const RETURNED_AT_ONCE: u64 = 1 << 20;

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

    /// Writes the bytes of the file to `output`, chunk by chunk, so that never all of them are in memory.
    pub(super) fn encode(self, output: &mut dyn Write) -> Result<(), RecordingError> {
        let mut file = File::new(output)?;
        let id = |kind| StoreId::new(kind, self.application, self.name.as_str());
        let blueprint = id(StoreKind::Blueprint);
        let mut manifests = vec![file.store(&blueprint, self.layout)?];
        file.message(&LogMsg::BlueprintActivationCommand(BlueprintActivationCommand::make_active(blueprint)))?;
        manifests.push(file.store(&id(StoreKind::Recording), self.data)?);
        file.finish(manifests)
    }
}

/// A file that is being written.
struct File<'a> {
    output: &'a mut dyn Write,
    /// Number of bytes written.
    len: u64,
    /// The bytes of one message.
    buffer: Vec<u8>,
}

impl<'a> File<'a> {
    fn new(output: &'a mut dyn Write) -> Result<Self, RecordingError> {
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let header = StreamHeader { fourcc: RRD_FOURCC, version: CrateVersion::LOCAL.to_bytes(), options };
        let mut file = Self { output, len: 0, buffer: Vec::new() };
        file.push(&header)?;
        Ok(file)
    }

    fn push(&mut self, what: &impl Encodable) -> Result<(), RecordingError> {
        self.buffer.clear();
        what.to_rrd_bytes(&mut self.buffer).map_err(RecordingError::encode)?;
        self.output.write_all(&self.buffer)?;
        self.len += self.buffer.len() as u64;
        Ok(())
    }

    /// Appends a message without data.
    fn message(&mut self, message: &LogMsg) -> Result<(), RecordingError> {
        self.push(&message.to_transport(Compression::LZ4).map_err(RecordingError::encode)?)
    }

    /// Appends the columns of a chunk, and returns their size before compression (bytes).
    ///
    /// The library's own conversion parses all columns again to learn whether they are static.
    fn columns(&mut self, id: &StoreId, chunk: &Chunk, columns: &RecordBatch) -> Result<u64, RecordingError> {
        let mut stream = StreamWriter::try_new(Vec::new(), columns.schema_ref()).map_err(RecordingError::encode)?;
        stream.write(columns).map_err(RecordingError::encode)?;
        let bytes = stream.into_inner().map_err(RecordingError::encode)?;
        let (uncompressed_size, payload) = (bytes.len() as u64, lz4_flex::block::compress(&bytes));
        drop(bytes);
        self.push(&Msg::ArrowMsg(ArrowMsg {
            store_id: Some(id.clone().into()),
            chunk_id: Some(chunk.id().as_tuid().into()),
            compression: CompressionCode::Lz4 as i32,
            uncompressed_size,
            encoding: Encoding::ArrowIpc as i32,
            payload: payload.into(),
            is_static: Some(chunk.is_static()),
        }))?;
        Ok(uncompressed_size)
    }

    /// Appends the chunks of a store, and returns their index.
    fn store(&mut self, id: &StoreId, chunks: Vec<Chunk>) -> Result<RrdManifest, RecordingError> {
        let info = StoreInfo::new(id.clone(), StoreSource::Other("closecall".to_owned()));
        self.message(&LogMsg::SetStoreInfo(SetStoreInfo { row_id: tuid(chunks.len()), info }))?;
        let mut index = RrdManifestBuilder::default();
        let mut freed = 0;
        for chunk in chunks {
            let columns = chunk.to_chunk_batch().map_err(RecordingError::encode)?;
            let start = self.len + MessageHeader::ENCODED_SIZE_BYTES as u64;
            let uncompressed = self.columns(id, &chunk, &columns)?;
            let span = Span { start, len: self.len - start };
            index.append(&columns, span, uncompressed).map_err(RecordingError::encode)?;
            freed += uncompressed;
            if freed >= RETURNED_AT_ONCE {
                drop((chunk, columns));
                return_free_memory();
                freed = 0;
            }
        }
        // The index takes several megabytes while it is built.
        return_free_memory();
        let index = index.build(id.clone()).map_err(RecordingError::encode)?;
        let mut fields = index.sorbet_schema.fields().to_vec();
        fields.sort();
        let schema = Schema::new_with_metadata(fields, index.sorbet_schema.metadata);
        // The library's own conversion checks the index that the library has just built.
        Ok(RrdManifest {
            store_id: Some(index.store_id.into()),
            sorbet_schema: Some((&schema).try_into().map_err(RecordingError::encode)?),
            sorbet_schema_sha256: Some(index.sorbet_schema_sha256.to_vec().into()),
            data: Some(index.data.into()),
        })
    }

    /// Appends the index.
    fn finish(mut self, manifests: Vec<RrdManifest>) -> Result<(), RecordingError> {
        let mut bytes = Vec::new();
        RrdFooter { manifests }.to_rrd_bytes(&mut bytes).map_err(RecordingError::encode)?;
        self.push(&MessageHeader { kind: MessageKind::End, len: bytes.len() as u64 })?;
        self.output.write_all(&bytes)?;
        self.push(&StreamFooter::from_rrd_footer_bytes(self.len, &bytes))
    }
}
