//! Robustness of the lane change criteria: how much disturbance each of them tolerates.
//!
//! ```text
//!   recorded lateral position ─▶ + offset, + Brownian noise ─▶ filter ─▶ each criterion ─▶ comparison with undisturbed
//! ```
//!
//! **Disturbances.** A constant lateral offset (m) represents a camera with a mounting or
//! calibration error, or a map error. Brownian noise (m/√s) represents a drift of the lateral
//! position: its increment over Δt is normal with standard deviation σ·√Δt. Its standard deviation
//! after one second is σ, and its rate is white noise. Positions and, in an in-car log, the
//! distances to both markings are displaced alike, before the filter. Each track has its own random
//! stream, keyed by seed, repetition and track. The noise level scales the same path: levels differ
//! in nothing else.
//!
//! **Reference.** For an in-car log, the reference consists of the undisturbed lane changes by the
//! gradient criterion. For other trajectory data, it consists of the undisturbed lane changes by
//! the peak criterion with recorded lanes; without them, with estimated lanes or by the lateral shift.
//! It tells how many of the lane changes that each criterion detects undisturbed are true. The
//! reference of each criterion is its own detection on undisturbed data: its misses and inventions
//! there say nothing about disturbances.
//!
//! **Matching.** A lane change counts as detected again if a detected lane change in the same
//! direction on the same track overlaps it in time. Each lane change belongs to at most one pair,
//! and there are as many pairs as possible. A detected lane change without a partner is *invented*.
//! The lanes count as unreliable here: the recorded lane tells where the vehicle really was, which
//! a disturbed sensor cannot measure. Therefore the peak criterion uses the lateral shift alone,
//! the distance criterion uses the disturbed position relative to the markings, and the gradient
//! criterion uses the disturbed distances ([`crate::lane_change`]).
//!
//! **Failure.** A criterion fails if it misses more than 5 % of the lane changes that it detects
//! undisturbed, or if it invents more than 5 % of their number. The result keeps the counts of each
//! repetition of the noise, which show their spread.

mod disturb;
mod matching;
mod study;

pub use disturb::Disturbance;
pub use study::{
    CriterionCounts, Experiment, FAILING_SHARE, FEWEST_LANE_CHANGES, Measured, ReferenceKind, Robustness, Setup, Study,
};
