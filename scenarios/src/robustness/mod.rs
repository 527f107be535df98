//! How much does it take until a criterion no longer finds the lane changes?
//!
//! ```text
//!   recorded lateral position ─▶ + offset, + Brownian noise ─▶ filter ─▶ each criterion ─▶ held against the reference
//! ```
//!
//! **Disturbances.** A constant lateral offset [m] is that of a camera that is mounted or calibrated askew, or of a map
//! that is off. Brownian noise [m/√s] is a lateral position that drifts: its increment over Δt is normal with standard
//! deviation σ·√Δt, so that after a second it is σ away and its rate is white noise. Positions and, in an in-car log,
//! the distances to both markings are displaced alike, before the filter. Each track has its own random stream, keyed by
//! seed, repetition and track; a level scales the same path, so that levels differ in nothing else.
//!
//! **Reference.** In an in-car log the lane changes by the gradient criterion without disturbance; elsewhere those of the
//! recorded lanes, by the peak criterion without disturbance. Of these, each criterion has to find again what it finds
//! undisturbed: on short recorded tracks it may not see all of them to begin with.
//!
//! **Found again** is a lane change where one in the same direction on the same track overlaps it in time. One that
//! overlaps none of those that happened is *invented*. Lanes are in doubt here: the recorded ones say where the vehicle
//! really was, which a disturbed sensor does not know. The peak criterion therefore goes by the shift alone, the distance
//! criterion by where the disturbed position lies between the markings, the gradient criterion by the disturbed distances
//! ([`crate::lane_change`]).
//!
//! **Failing** is losing more than 5 % of what is found undisturbed, or inventing more than 5 % of its number.

mod disturb;
mod study;

pub use disturb::Disturbance;
pub use study::{Case, Cell, FAILING_SHARE, Measured, ReferenceKind, Robustness, Setup, Study};
