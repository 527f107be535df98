//! A measured value, or the reason why there is none.

use serde::{Deserialize, Serialize};

/// Why a metric or a margin has no value.
///
/// This is not an error: it says that the question does not apply to this situation. A computation that failed is an
/// error, so that it can never look safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "kebab-case")]
pub enum Absent {
    /// There is no vehicle ahead in the lane.
    #[error("no vehicle ahead")]
    NoLead,
    /// There is no vehicle behind in the lane.
    #[error("no vehicle behind")]
    NoFollower,
    /// The nearest vehicle ahead is on its way out of the lane, or into it.
    #[error("the vehicle ahead is between two lanes")]
    BetweenLanes,
    /// No other vehicle was present at all.
    #[error("no other vehicle")]
    NoOpponent,
    /// The vehicle stands, so that a time headway is not defined.
    #[error("the vehicle stands")]
    Standstill,
    /// The two vehicles do not approach each other.
    #[error("the vehicles do not approach each other")]
    NotApproaching,
    /// On their present courses the two vehicles never touch.
    #[error("on their present courses the vehicles never touch")]
    NoCollisionCourse,
    /// The two vehicles touch or overlap already.
    #[error("the vehicles touch already")]
    Touching,
    /// The encounter lies further ahead than the metric looks.
    #[error("the encounter lies beyond the horizon")]
    BeyondHorizon,
    /// The controller has no margin increase system.
    #[error("the controller has no margin increase system")]
    NoMis,
    /// The margin increase system never engaged.
    #[error("the margin increase system never engaged")]
    NeverEngaged,
    /// The margin increase system had not released when the run ended.
    #[error("the margin increase system had not released when the run ended")]
    NotReleased,
    /// The critical phase was never reached.
    #[error("the critical phase was never reached")]
    NeverCritical,
    /// The vehicle behind never crossed the lane marking.
    #[error("the marking was never crossed")]
    NeverCrossed,
    /// The recording does not carry what the value needs.
    #[error("not recorded")]
    NotRecorded,
}

/// A value, or the reason why there is none.
pub type Measured = Result<f64, Absent>;
