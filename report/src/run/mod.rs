//! Output of one run, or of a pair of runs.
//!
//! ```text
//!  simulation ─▶ FilmRecorder ─▶ Film ─▶ rerun (to view) │ figure (to print)
//!             ├▶ `tables` ─▶ CSV or Parquet (to evaluate)
//!             └▶ Outcome ─▶ text
//! ```

pub mod figure;
pub mod film;
pub mod observers;
pub mod rerun;
pub mod text;
