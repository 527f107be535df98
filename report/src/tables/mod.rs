//! The tables that one run leaves behind, as CSV or Parquet.
//!
//! ```text
//!   StepView ─▶ TraceWriter   one row per control step and actor
//!           └─▶ ScanWriter    one row per LiDAR return
//! ```

mod pcd;
mod run_tables;
mod scan_columns;
mod scans;
pub mod table;
mod trace;

pub use run_tables::RunTables;
pub use scans::ScanWriter;
pub use trace::{TraceWriter, trace_batch};
