//! What one run ends in: collisions, margins, and what the margin increase system did.

use closecall_controllers::Reason;
use closecall_traffic::geometry::BoxSide;
pub use closecall_traffic::metrics::CRITICAL_THW_S;
use closecall_traffic::{Absent, ActorId, Measured, Parameters, Time};
use serde::{Deserialize, Serialize};

/// Which of two vehicles closed the gap between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClosedBy {
    /// The first of the two moved towards the second.
    First,
    /// The second of the two moved towards the first.
    Second,
    /// Each moved towards the other.
    Both,
}

/// The larger of two, where one that is not a number is the largest of all: it must never look safe.
pub fn worse(one: f64, other: f64) -> f64 {
    if one.is_nan() || one >= other { one } else { other }
}

/// Part of an encounter with a vehicle that comes up from behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// It is still far behind, or there is none.
    #[default]
    Approach,
    /// It is in E's path at a time headway below [`CRITICAL_THW_S`].
    Critical,
    /// It has left E's path and is not past E yet.
    Overtaking,
    /// It is past.
    After,
}

/// Two vehicles touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Collision {
    /// When they first touched.
    pub time: Time,
    /// Who, in the order of their names.
    pub between: [ActorId; 2],
    /// Which side of each was struck.
    pub struck_side: [BoxSide; 2],
    /// Who closed the gap.
    pub closed_by: ClosedBy,
    /// The part of the encounter it happened in.
    pub phase: Phase,
    /// Magnitude of the relative velocity at first touch [m/s].
    pub relative_speed_mps: f64,
    /// Magnitude of each vehicle's change of velocity through the impact [m/s].
    pub delta_v_mps: [f64; 2],
}

impl Collision {
    /// Returns true if `actor` is one of the two vehicles.
    pub fn involves(&self, actor: &ActorId) -> bool {
        self.between.contains(actor)
    }

    /// Returns the change of velocity of `actor` (m/s), or `None` if it is not one of the two vehicles.
    pub fn delta_v_of(&self, actor: &ActorId) -> Option<f64> {
        let index = self.between.iter().position(|id| id == actor)?;
        Some(self.delta_v_mps[index])
    }
}

/// A moment of the encounter with a vehicle R that comes up from behind E while E follows F: the paper's figure names
/// five of them, (a) to (e).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Moment {
    /// (a) R is within 100 m of E, in E's lane, and approaches at 10 km/h or more.
    RearNear,
    /// (b) R starts to change lanes in order to overtake.
    CutOut,
    /// (c) R is at the critical distance behind E.
    CriticalDistance,
    /// (d) The brake light of F, the vehicle ahead of E, goes on.
    FrontBrakes,
    /// (e) R is past E: it has concluded its overtaking, and E is free to brake.
    Concluded,
}

impl Moment {
    /// All of them, in their order.
    pub const ALL: [Self; 5] =
        [Self::RearNear, Self::CutOut, Self::CriticalDistance, Self::FrontBrakes, Self::Concluded];

    /// Its letter in the paper's figure.
    pub const fn letter(self) -> char {
        match self {
            Self::RearNear => 'a',
            Self::CutOut => 'b',
            Self::CriticalDistance => 'c',
            Self::FrontBrakes => 'd',
            Self::Concluded => 'e',
        }
    }

    /// What happens then, as a phrase.
    pub const fn text(self) -> &'static str {
        match self {
            Self::RearNear => "R comes near",
            Self::CutOut => "R pulls out",
            Self::CriticalDistance => "R is at the critical distance",
            Self::FrontBrakes => "F brakes",
            Self::Concluded => "R has concluded",
        }
    }
}

/// A moment with its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MomentAt {
    /// What happens.
    pub moment: Moment,
    /// The control step at which it was first so.
    pub time: Time,
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EndReason {
    /// The scenario's duration was over.
    Duration,
    /// E and every vehicle near it had come to a stand.
    Standstill,
    /// Two seconds had passed since the first collision.
    Collision,
}

/// The smallest and largest values of E's margins over a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// Smallest time headway to the vehicle ahead [s].
    pub min_thw_front_s: Measured,
    /// Smallest time headway of the vehicle behind to E [s].
    pub min_thw_rear_s: Measured,
    /// Smallest gap to the vehicle ahead [m].
    pub min_gap_front_m: Measured,
    /// Smallest gap to the vehicle behind [m].
    pub min_gap_rear_m: Measured,
    /// Smallest time to collision with the vehicle behind [s].
    pub min_ttc_rear_s: Measured,
    /// Largest deceleration of E before any collision of its own [m/s²].
    pub max_deceleration_mps2: f64,
    /// Largest change of E's acceleration before any collision of its own [m/s³].
    pub max_jerk_mps3: f64,
    /// Most by which E was slower than the vehicle ahead, or than at the start where nobody is ahead [m/s]: what a
    /// margin costs. A controller that brakes without need cannot hide it behind collisions that it avoids.
    pub max_speed_deficit_mps: f64,
}

/// What the margin increase system did.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MisSummary {
    /// When it first engaged [s].
    pub engaged_at_s: Measured,
    /// When it released after that [s].
    pub released_at_s: Measured,
    /// Front time headway at the engagement [s].
    pub thw_front_at_engagement_s: Measured,
    /// Front time headway when the vehicle behind was at the critical distance [s].
    pub thw_front_at_critical_s: Measured,
    /// Mean deceleration of E from the engagement to the critical distance, or to the release [m/s²].
    pub mean_deceleration_mps2: Measured,
    /// Whether the goal was in reach when it engaged; nothing where it never engaged.
    pub goal_in_reach: Option<bool>,
    /// Why it engaged, or why it did not at the last control step.
    pub reason: Reason,
}

/// The result of one run. A collision is a result; whatever stops a run from having one is a
/// [`SampleError`](crate::SampleError).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The scenario's name.
    pub scenario: String,
    /// The campaign's seed.
    pub seed: u64,
    /// The sample's number.
    pub sample: u64,
    /// The ego controller's name.
    pub controller: String,
    /// The ego vehicle's name.
    pub ego: ActorId,
    /// The sampled values.
    pub parameters: Parameters,
    /// Why the run ended.
    pub end: EndReason,
    /// How long it was.
    pub duration: Time,
    /// Every first touch of two vehicles, in order of time.
    pub collisions: Vec<Collision>,
    /// The moments of the encounter that were reached before E collided, in order of time.
    #[serde(default)]
    pub moments: Vec<MomentAt>,
    /// E's margins.
    pub margins: Margins,
    /// What the margin increase system did, where the controller has one.
    pub mis: Result<MisSummary, Absent>,
}

impl Outcome {
    /// True where two outcomes are the same to the last bit, signs of zero included.
    pub fn has_same_bits(&self, other: &Self) -> bool {
        // Floats are written so that they read back exactly: the same text is the same bits.
        matches!((serde_json::to_string(self), serde_json::to_string(other)), (Ok(one), Ok(two)) if one == two)
    }

    /// When `moment` was, if it was reached.
    pub fn moment(&self, moment: Moment) -> Option<Time> {
        self.moments.iter().find(|noted| noted.moment == moment).map(|noted| noted.time)
    }

    /// Returns the collisions of the ego, in order of time.
    pub fn ego_collisions(&self) -> impl Iterator<Item = &Collision> {
        self.collisions.iter().filter(|collision| collision.involves(&self.ego))
    }

    /// Returns the ego's largest change of velocity in a collision (m/s), or `None` if it did not collide.
    pub fn ego_delta_v_mps(&self) -> Option<f64> {
        self.ego_collisions().filter_map(|collision| collision.delta_v_of(&self.ego)).reduce(worse)
    }

    /// Returns true if the ego itself was in a collision: what gates count.
    pub fn ego_collided(&self) -> bool {
        self.ego_collisions().next().is_some()
    }
}
