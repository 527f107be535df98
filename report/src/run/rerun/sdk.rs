//! The types of the rerun library that recordings use, from the two crates that write files.
//!
//! The crate `rerun` holds the same types, and also builds the viewer's database and its network client.

pub(super) use re_sdk::log::TimeColumn;
pub(super) use re_sdk::{
    AsComponents, ComponentDescriptor, ComponentIdentifier, RecordingStreamError, SerializationResult,
    SerializedComponentBatch, SerializedComponentColumn, StoreId, StoreKind,
};
pub(super) use re_sdk_types::archetypes::*;
pub(super) use re_sdk_types::components::{FillMode, MediaType, TextLogLevel};
pub(super) use re_sdk_types::datatypes::{ChannelDatatype, ImageFormat, Quaternion, Rgba32};
