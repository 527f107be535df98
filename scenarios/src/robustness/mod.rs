//! Robustness of the lane change criteria: how much disturbance each of them tolerates.
//!
//! ```text
//!   recorded lateral position ─▶ + offset, + Brownian noise ─▶ filter ─▶ each criterion ─▶ comparison with reference
//! ```
//!
//! **Disturbances.** A constant lateral offset (m) represents a camera with a mounting or calibration error, or a map
//! error. Brownian noise (m/√s) represents a drift of the lateral position: its increment over Δt is normal with
//! standard deviation σ·√Δt, so that its standard deviation after one second is σ and its rate is white noise.
//! Positions and, in an in-car log, the distances to both markings are displaced alike, before the filter. Each track
//! has its own random stream, keyed by seed, repetition and track. The noise level scales the same path, so that levels
//! differ in nothing else.
//!
//! **Reference.** For an in-car log, the reference consists of the undisturbed lane changes by the gradient criterion.
//! For other trajectory data, it consists of the undisturbed lane changes by the peak criterion with recorded lanes. Of
//! these, each criterion must detect again those that it detects undisturbed: on short tracks it may not detect all of
//! them even without disturbance.
//!
//! **Matching.** A reference lane change counts as detected again if a detected one in the same direction on the same
//! track overlaps it in time. A detected lane change that overlaps no reference lane change is *invented*. The lanes
//! count as unreliable here: the recorded lane tells where the vehicle really was, which a disturbed sensor cannot
//! measure. Therefore the peak criterion uses the lateral shift alone, the distance criterion uses the disturbed
//! position relative to the markings, and the gradient criterion uses the disturbed distances ([`crate::lane_change`]).
//!
//! **Failure.** A criterion fails if it misses more than 5 % of the lane changes that it detects undisturbed, or if it
//! invents more than 5 % of their number.

mod disturb;
mod study;

pub use disturb::Disturbance;
pub use study::{CriterionCounts, Experiment, FAILING_SHARE, Measured, ReferenceKind, Robustness, Setup, Study};
