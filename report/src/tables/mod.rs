//! The tables that one run leaves behind, as CSV or Parquet.
//!
//! ```text
//!   StepView ─▶ TraceWriter    one row per control step and actor
//!           ├─▶ ScanWriter     one row per LiDAR return
//!           ├─▶ ClusterWriter  one row per cluster and box of a scan
//!           └─▶ TrackWriter    one row per control step and track
//! ```

mod clusters;
mod companions;
mod pcd;
mod run_tables;
mod scan_columns;
mod scans;
pub mod table;
mod trace;
mod tracks;

pub use clusters::{ClusterRecorder, ClusterWriter};
pub use companions::companion_files;
pub use run_tables::{RunTables, TableFiles};
pub use scans::ScanWriter;
pub use trace::{TraceWriter, trace_batch};
pub use tracks::{TrackRecorder, TrackWriter};
