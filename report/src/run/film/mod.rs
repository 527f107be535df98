//! What a run looked like: kept in memory until its outcome is known, since only then is it known what mattered.
//!
//! ```text
//!  simulation ─▶ FilmRecorder ─(outcome)─┐
//!                                        ├─▶ Film ─▶ Rerun file │ static figure │ still picture
//!  recorded traffic: a lane change, ──────┘
//!  or an encounter that is re-enacted
//! ```
//!
//! A film is the same thing whether its vehicles were simulated or recorded on a road, so that both can be looked at in
//! the same views.

mod arms;
mod comparison;
mod encounter;
mod frames;
mod moments;
mod recorder;
mod scan;
mod story;
mod traffic;

pub use arms::film_arms;
pub use comparison::{Comparison, Course};
pub use encounter::film_encounter;
pub(super) use frames::Limit;
pub use frames::{Film, Frame, Level, Member};
pub use recorder::FilmRecorder;
pub(super) use scan::{NO_CLUSTER, Scan};
pub(super) use story::{collision_text, note_words, state_word};
pub use traffic::{TrafficFilmError, film_lane_change};
