//! A study of perception without a controller: its range, its errors, and the effect of faults.
//!
//! ```text
//!  scenario ─▶ sensors ─┐
//!  cases ───────────────┼─▶ approaches (in parallel) ─▶ observations ─▶ curves, figures ─▶ text │ JSON │ Parquet │ page
//!  seed ────────────────┘
//! ```
//!
//! Each case varies one condition: class, paint, lateral offset, weather, light, traffic in between, or a fault. In each of its
//! approaches, a vehicle comes from 150 m behind to 5 m at a closing speed of its own. The ego keeps its speed and its lane.
//!
//! * [`cases`]: the conditions
//! * [`agreement`]: verdicts with object-level sensors against verdicts with the full chain
//! * [`approach`]: one approach
//! * [`study`]: all approaches of all cases
//! * [`recorded`]: the chain on a recording
//! * [`fit`]: the fit of the object-level sensor to the full chain
//! * [`behaviour`]: errors, delays and misses of the tracks of a vehicle
//! * [`validation`]: the object-level sensor against the full chain, by this behaviour
//! * [`figures`]: the figures of the approaches of a case, with intervals

pub mod agreement;
pub mod approach;
pub mod behaviour;
pub mod cases;
pub mod figures;
pub mod fit;
pub mod recorded;
pub mod study;
pub mod validation;

pub use study::{Extent, Study, StudyError};
