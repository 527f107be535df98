//! Reasons for the state of the ego stack.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::SensorAvailability;

/// The reason for the state of the stack: after a change of state, the cause of the change; while
/// following, the condition that keeps the margin increase system from engaging.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The controller has no margin increase system.
    NoMis,
    /// The ego is not in automated mode.
    NotAutomated,
    /// The system is not available, because the front radar has failed.
    FrontSensorFailed,
    /// The system is not available, because the surround sensors have failed.
    SurroundSensorsFailed,
    /// The system is not available, because the rear sensors have failed.
    RearSensorsFailed,
    /// There is no front time headway: no vehicle is ahead in the lane of the ego, or the ego stands.
    NoFront,
    /// The front time headway is already long enough.
    FrontMarginLong,
    /// No vehicle is known to be behind the ego in its lane.
    NoRear,
    /// The track of the rear vehicle is not confirmed yet.
    RearUnconfirmed,
    /// The track of the rear vehicle is not classified as a vehicle.
    RearUnclassified,
    /// The rear vehicle is too far away.
    RearFar,
    /// The rear vehicle does not approach fast enough.
    RearNotApproaching,
    /// No lane beside the ego allows the rear vehicle to overtake.
    NoPassingLane,
    /// The passing lane is not free.
    PassingLaneOccupied,
    /// It is not known whether the passing lane is free.
    PassingLaneUnknown,
    /// Another vehicle follows the rear vehicle closely.
    RearFollowed,
    /// All conditions for engaging hold, and the goal is in reach.
    Engaged,
    /// All conditions for engaging hold, but the goal is out of reach; the comfort limit is used in
    /// full.
    EngagedGoalOutOfReach,
    /// The rear vehicle crosses the marking in order to overtake.
    RearCrosses,
    /// The rear vehicle has reached the critical distance.
    CriticalDistance,
    /// The rear vehicle has left the lane of the ego while still far away.
    RearChangedLane,
    /// The rear vehicle has passed.
    RearPassed,
    /// The rear vehicle has fallen back.
    RearFellBack,
    /// The rear vehicle follows instead of overtaking.
    RearFollows,
    /// The track of the rear vehicle was lost.
    RearLost,
    /// The lead vehicle was lost, or left the lane.
    FrontLost,
    /// The time limit for holding has expired.
    HoldExpired,
    /// There is no room to keep holding if the lead vehicle brakes.
    NoRoomToHold,
    /// The margin has been returned.
    MarginReturned,
    /// Only emergency braking avoids a collision with the lead vehicle.
    BrakingRequired,
    /// Emergency braking is no longer needed.
    BrakingDone,
    /// A controller from outside Closecall has a reason of its own.
    External,
}

impl Reason {
    /// Returns the reason as a phrase.
    pub const fn text(self) -> &'static str {
        match self {
            Self::NoMis => "no margin increase system",
            Self::NotAutomated => "not in automated mode",
            Self::FrontSensorFailed => "not available: front radar failed",
            Self::SurroundSensorsFailed => "not available: surround sensors failed",
            Self::RearSensorsFailed => "not available: rear sensors failed",
            Self::NoFront => "no front time headway (none ahead, or the ego stands)",
            Self::FrontMarginLong => "front time headway long enough",
            Self::NoRear => "no vehicle behind in the lane",
            Self::RearUnconfirmed => "track behind not confirmed",
            Self::RearUnclassified => "track behind not classified as a vehicle",
            Self::RearFar => "vehicle behind too far away",
            Self::RearNotApproaching => "vehicle behind does not approach fast enough",
            Self::NoPassingLane => "no lane to overtake in",
            Self::PassingLaneOccupied => "passing lane occupied",
            Self::PassingLaneUnknown => "passing lane not known to be free",
            Self::RearFollowed => "vehicle behind is followed closely",
            Self::Engaged => "engaged, goal in reach",
            Self::EngagedGoalOutOfReach => "engaged, goal out of reach",
            Self::RearCrosses => "vehicle behind crosses the marking",
            Self::CriticalDistance => "vehicle behind at the critical distance",
            Self::RearChangedLane => "vehicle behind changed lanes early",
            Self::RearPassed => "vehicle behind is past",
            Self::RearFellBack => "vehicle behind fell back",
            Self::RearFollows => "vehicle behind follows instead of overtaking",
            Self::RearLost => "track behind lost",
            Self::FrontLost => "vehicle ahead lost",
            Self::HoldExpired => "holding time over",
            Self::NoRoomToHold => "no room to hold on",
            Self::MarginReturned => "margin given back",
            Self::BrakingRequired => "emergency braking required",
            Self::BrakingDone => "emergency braking done",
            Self::External => "the controller's own reason",
        }
    }
}

impl SensorAvailability {
    /// Returns the reason for which a system that needs all sensors is not available; `None` if all
    /// sensors work.
    pub const fn reason(&self) -> Option<Reason> {
        match self {
            Self { front: false, .. } => Some(Reason::FrontSensorFailed),
            Self { surround: false, .. } => Some(Reason::SurroundSensorsFailed),
            Self { rear: false, .. } => Some(Reason::RearSensorsFailed),
            Self { front: true, surround: true, rear: true } => None,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}
