//! A measured value, or the reason for its absence.

use serde::{Deserialize, Serialize};

/// The reason why a metric or a margin has no value.
///
/// This is not an error: it says that the quantity is not defined in this situation. A computation
/// that fails is an error, so that it can never look safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
pub enum Absent {
    /// No vehicle is ahead in the lane.
    #[error("no vehicle ahead")]
    NoLead,
    /// No vehicle is behind in the lane.
    #[error("no vehicle behind")]
    NoFollower,
    /// The nearest vehicle ahead is leaving the lane or entering it.
    #[error("the vehicle ahead is between two lanes")]
    BetweenLanes,
    /// No other vehicle was present.
    #[error("no other vehicle")]
    NoOpponent,
    /// The vehicle stands still, so that its time headway is not defined.
    #[error("the vehicle stands")]
    Standstill,
    /// The two vehicles do not approach each other.
    #[error("the vehicles do not approach each other")]
    NotApproaching,
    /// The two vehicles never touch if they keep their velocities.
    #[error("on their present courses the vehicles never touch")]
    NoCollisionCourse,
    /// The two vehicles already touch or overlap.
    #[error("the vehicles touch already")]
    Touching,
    /// The encounter lies beyond the time horizon of the metric.
    #[error("the encounter lies beyond the horizon")]
    BeyondHorizon,
    /// The controller has no margin increase system.
    #[error("the controller has no margin increase system")]
    NoMis,
    /// The margin increase system never engaged.
    #[error("the margin increase system never engaged")]
    NeverEngaged,
    /// The controller never braked in an emergency.
    #[error("no emergency braking")]
    NoEmergencyBraking,
    /// The margin increase system had not released when the run ended.
    #[error("the margin increase system had not released when the run ended")]
    NotReleased,
    /// The critical phase was never reached.
    #[error("the critical phase was never reached")]
    NeverCritical,
    /// The vehicle behind never crossed the lane marking.
    #[error("the marking was never crossed")]
    NeverCrossed,
    /// The data does not contain the input of the value.
    #[error("not recorded")]
    NotRecorded,
    /// The recorded value is beyond what a vehicle can do.
    #[error("the recorded value is beyond what a vehicle can do")]
    Implausible,
}

/// A value, or the reason for its absence.
pub type Measured = Result<f64, Absent>;
