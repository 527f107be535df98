//! Why the ego stack does what it does.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Why the stack is in its state: at a change of state the cause of the change; while following, the condition that
/// keeps the margin increase system from engaging.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The controller has no margin increase system.
    NoMis,
    /// E is not in automated mode.
    NotAutomated,
    /// There is no vehicle ahead in E's lane.
    NoFront,
    /// The front time headway is long enough already.
    FrontMarginLong,
    /// No vehicle is known behind E in its lane.
    NoRear,
    /// The track behind is not confirmed yet.
    RearUnconfirmed,
    /// The track behind is not classified as a vehicle.
    RearUnclassified,
    /// The vehicle behind is too far away.
    RearFar,
    /// The vehicle behind does not approach fast enough.
    RearNotApproaching,
    /// There is no lane beside E in which the vehicle behind could overtake.
    NoPassingLane,
    /// The passing lane is not free.
    PassingLaneOccupied,
    /// Whether the passing lane is free is not known.
    PassingLaneUnknown,
    /// All conditions for engaging hold; the goal is in reach.
    Engaged,
    /// All conditions for engaging hold; the goal is out of reach, and the comfort limit is used in full.
    EngagedGoalOutOfReach,
    /// The vehicle behind has come to the critical distance.
    CriticalDistance,
    /// The vehicle behind has left E's lane while it was still far away.
    RearChangedLane,
    /// The vehicle behind is past.
    RearPassed,
    /// The vehicle behind has fallen back.
    RearFellBack,
    /// The vehicle behind follows instead of overtaking.
    RearFollows,
    /// The track of the vehicle behind was lost.
    RearLost,
    /// The vehicle ahead was lost, or left the lane.
    FrontLost,
    /// The time allowed for holding is over.
    HoldExpired,
    /// A braking of the vehicle ahead would leave no room for holding on.
    NoRoomToHold,
    /// The margin has been given back.
    MarginReturned,
    /// Only emergency braking avoids running into the vehicle ahead.
    BrakingRequired,
    /// Emergency braking is no longer needed.
    BrakingDone,
    /// A controller that does not ship has reasons of its own.
    External,
}

impl Reason {
    /// What the reason says, as a phrase.
    pub const fn text(self) -> &'static str {
        match self {
            Self::NoMis => "no margin increase system",
            Self::NotAutomated => "not in automated mode",
            Self::NoFront => "no vehicle ahead",
            Self::FrontMarginLong => "front time headway long enough",
            Self::NoRear => "no vehicle behind in the lane",
            Self::RearUnconfirmed => "track behind not confirmed",
            Self::RearUnclassified => "track behind not classified as a vehicle",
            Self::RearFar => "vehicle behind too far away",
            Self::RearNotApproaching => "vehicle behind does not approach fast enough",
            Self::NoPassingLane => "no lane to overtake in",
            Self::PassingLaneOccupied => "passing lane occupied",
            Self::PassingLaneUnknown => "passing lane not known to be free",
            Self::Engaged => "engaged, goal in reach",
            Self::EngagedGoalOutOfReach => "engaged, goal out of reach",
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

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}
