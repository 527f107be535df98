//! Campaigns whose samples run elsewhere, such as on a cluster. The campaign itself stays where it
//! was started. Its folder, its journal, its gates and its reports equal a campaign's on one
//! machine, byte for byte.
//!
//! ```text
//!  Campaign::run ─▶ RemoteWorkers ─▶ blocks of samples ─▶ Engine ─▶ BlockRunner on some machine
//!       ▲                │  ▲                                            │
//!    journal ◀─ in the order of the plan ◀─ each answer is checked ◀─────┘
//! ```
//!
//! | module | holds |
//! |---|---|
//! | `engine` | what an engine does, and the one that the program has |
//! | `shipment` | what a machine needs to run blocks of a campaign |
//! | `content` | what a block runs: samples, or points of the search for a rare event |
//! | `block` | runs blocks on such a machine |
//! | `answer` | the results of a block, and what is checked of them |
//! | `workers` | cuts a campaign into blocks, and puts their results in order |
//!
//! An engine may run a block several times, since machines fail. Equal samples give equal results,
//! and only one answer of each block counts. An answer that lacks a sample, or has one of another
//! seed, of other values, or of another version of the program, ends the campaign with an error;
//! the journal keeps what came before.

mod answer;
mod block;
mod content;
mod engine;
mod error;
mod shipment;
mod workers;

pub use block::BlockRunner;
pub use engine::{Cluster, Engine, connect, connect_points, set_engine};
pub use error::EngineError;
pub use error::RemoteError;
pub use shipment::{Shipment, ShippedFile};
pub use workers::RemoteWorkers;
