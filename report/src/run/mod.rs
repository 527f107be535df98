//! One run, or a pair of them.
//!
//! ```text
//!  simulation ─▶ FilmRecorder ─▶ Film ─▶ rerun (to look at) │ figure (to print)
//!             └▶ TraceWriter ─▶ CSV or Parquet (to compute with)
//! ```

pub mod figure;
pub mod film;
pub mod rerun;
pub mod trace;
