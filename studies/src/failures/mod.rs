//! The failures of a campaign with their causes: the table of the report, and the file
//! `causes.json` of a campaign's folder.
//!
//! ```text
//!  journal ─▶ rows: which vehicle struck which, in which phase ─▶ + attribution ─▶ + explanation ─▶ table, causes.json
//! ```
//!
//! The rows follow from the journal. An attribution needs two runs of the sample, which is done for
//! every failure unless the rear sensors are simulated in full. An explanation needs about ten
//! runs; `closecall explain` makes it.

mod collect;
mod errors;
mod html;
mod row;
mod store;

pub(crate) use collect::passes;
pub use collect::{Failures, campaign_failures, explain_failures};
pub use errors::SampleErrors;
pub use html::{section, without_section};
pub use row::{FailureRow, order};
pub use store::{CAUSES, read_rows, write_rows};
