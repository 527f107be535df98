//! The messages of ASAM Open Simulation Interface (OSI) 3.8 that Closecall reads and writes.
//!
//! `osi3.proto` lists their fields. Names and numbers are the published ones, and the meaning of
//! each is in the standard.

#[expect(missing_docs, reason = "the standard documents the fields")]
mod messages;

pub use messages::*;

/// The compiled `osi3.proto`, for a reader without a definition of its own.
pub static DESCRIPTORS: &[u8] = include_bytes!("osi3.desc");
