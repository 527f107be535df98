//! A film: all data that the views of one run show, held in memory.
//!
//! A run is kept as a whole until its end, because the outcome decides at which moment the views
//! open.
//!
//! ```text
//!  simulation ─▶ FilmRecorder ─(outcome)─┐
//!                                        ├─▶ Film ─▶ Rerun recording │ static figure │ still picture
//!  recorded traffic: a lane change, ──────┘
//!  or an encounter to be re-enacted
//! ```
//!
//! Films of simulated and of recorded traffic have the same type, so that the same views show both.

mod arms;
mod cause;
mod comparison;
mod encounter;
mod frames;
mod knowledge;
mod moments;
mod recorder;
mod scan;
mod story;
mod traffic;
mod verdict;

pub use arms::film_arms;
pub use comparison::{EncounterComparison, EncounterMetrics};
pub use encounter::film_encounter;
pub(super) use frames::Limit;
pub use frames::{Film, FilmActor, Frame, Level, Part};
pub(super) use knowledge::KnownSpan;
pub use recorder::FilmRecorder;
pub(super) use scan::{NO_CLUSTER, Scan};
pub(super) use story::{driver_note_text, ego_state_name};
pub use traffic::{TrafficFilmError, film_lane_change};
pub(super) use verdict::{fate_word, headway_text};
