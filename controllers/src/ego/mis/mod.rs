//! The margin increase system (MIS).
//!
//! A vehicle R comes up fast behind E, closes to a very low headway and overtakes only then. If F brakes in that moment,
//! E has to brake, and R runs into it. The MIS sees R coming, and slows E gently beforehand, so that for the critical
//! two seconds E need not brake at all.
//!
//! ```text
//!            every condition holds             R at the critical distance
//!  following ─────────────────────▶ increasing ─────────────────────▶ holding
//!      ▲                                │ fell back, follows, lost, lane  │ past, 2 s over,
//!      │                                ▼ occupied, changed early, F lost ▼ no room, lost
//!      └──────── margin returned ── releasing ◀──────────────────────────┘
//! ```
//!
//! # Conditions for engaging
//! All must hold at one control step; it engages at that very step. While following, the command's reason is the first that
//! is missing, in this order. "Track" is what perception says: what it does not say is not assumed.
//!
//! | condition | holds where | else |
//! |---|---|---|
//! | E is in automated mode | `automated` | `NotAutomated` |
//! | E follows F at a short margin | a track ahead in E's lane, THW_F < `short-thw-s` | `NoFront`, `FrontMarginLong` |
//! | somebody is behind | the nearest vehicle behind with at least half of its probability in E's lane; nearer things that are not established or no vehicles do not hide it | `NoRear` |
//! | it is established | confirmed, or coasting | `RearUnconfirmed` |
//! | it is a vehicle | car, truck or motorcycle: together at least as probable as not, and one of them more so than background | `RearUnclassified` |
//! | it is near | d_R ≤ `engage-gap-m` | `RearFar` |
//! | it approaches | Δv − 1.645·σ ≥ `engage-closing-mps`: surely, by its own covariance | `RearNotApproaching` |
//! | it has a lane to pass in | the road has one on the overtaking side | `NoPassingLane` |
//! | that lane is known | front, surround and rear sensors work, and nothing unconfirmed is in R's way there | `PassingLaneUnknown` |
//! | that lane is free | no vehicle there within 15 m of R while R uses it: from 40 m behind E until 10 m past it, all at constant speed | `PassingLaneOccupied` |
//!
//! # Transitions
//! The first that holds is taken, from top to bottom.
//!
//! | from | to | where | reason |
//! |---|---|---|---|
//! | following, releasing | increasing | every condition for engaging holds | `Engaged`, `EngagedGoalOutOfReach` |
//! | increasing | releasing | F's track is gone, and half a second has passed | `FrontLost` |
//! | | releasing | R's track is gone for half a second (meanwhile it is carried on at its last speed; a new track at its place is taken for it) | `RearLost` |
//! | | releasing | R is wholly ahead of E | `RearPassed` |
//! | | releasing | R has left E's lane at a headway above 0.9 s | `RearChangedLane` |
//! | | holding | d_R ≤ `critical-gap-m`, in E's lane or beside it, and there is room | `CriticalDistance` |
//! | | releasing | the same, but there is no room | `NoRoomToHold` |
//! | | releasing | d_R > 1.2 × `engage-gap-m` | `RearFellBack` |
//! | | releasing | Δv < ½ `engage-closing-mps` for 1 s | `RearFollows` |
//! | | releasing | the passing lane is in use | `PassingLaneOccupied` |
//! | | releasing | the passing lane is not known to be free for half a second; so also where a sensor fails | `PassingLaneUnknown` |
//! | holding | releasing | F is gone; R is wholly ahead; R is lost for half a second | as above |
//! | | releasing | `hold-s` is over | `HoldExpired` |
//! | | releasing | there is no room any more | `NoRoomToHold` |
//! | releasing | following | the gap is within 1.2 × the ACC's own, or F is gone | `MarginReturned` |
//! | any | emergency braking | only that avoids running into F; it overrides, and the states go on beneath it | `BrakingRequired` |
//!
//! There is *room* where E could stop 2 m behind F if F braked at `worst-front-braking-mps2` from now on to a stand, and E at
//! 6 m/s² (a wet road's) from 0.3 s later on.
//!
//! Hysteresis: R engages at 100 m and falls back at 120 m; engages at 10 km/h and follows below 5 km/h for a second; the
//! margin is short below 1.5 s at engaging only, as it is meant to grow. Of two vehicles behind the nearer counts; the one
//! engaged for stays the one that counts until it is past, and the next is judged afresh. A truck or a motorcycle counts
//! like a car, with its own length.
//!
//! # Commands
//!
//! | state | command | acceleration | jerk |
//! |---|---|---|---|
//! | following | ACC | ACC's | ACC's |
//! | increasing | the smaller of ACC and −a*, planned afresh at every step | a* ≤ `max-deceleration-mps2` | braking grows by `max-jerk-mps3`, falls by 3 m/s³ |
//! | holding | the brake is let go; what ACC wants is ignored | 0 | the same |
//! | releasing | ACC, bounded | ≤ 0.8 m/s² | rises by 3 m/s³ |
//!
//! ACC's own braking, up to 3.5 m/s², passes in all states but holding; emergency braking passes always.
//!
//! | bound | value | key |
//! |---|---|---|
//! | front headway that is short | 1.5 s | `short-thw-s` |
//! | rear distance for engaging | 100 m | `engage-gap-m` |
//! | approach for engaging | 10 km/h | `engage-closing-mps` |
//! | gain of front headway | 2 s | `thw-gain-s` |
//! | critical distance d_c | 5 m | `critical-gap-m` |
//! | braking | 1 m/s² | `max-deceleration-mps2` |
//! | jerk | 2 m/s³ | `max-jerk-mps3` |
//! | holding | 2 s | `hold-s` |
//! | worst braking of F while holding | 8 m/s² | `worst-front-braking-mps2` |
//!
//! # The plan
//! a* is the smallest braking with which THW_F, when R comes to d_c, is the headway at engaging plus `thw-gain-s`; where the
//! bound does not suffice, the bound. The goal is out of reach where that misses it by more than 0.08 s. [`Encounter`] is the method's
//! kinematics and their solution in closed form, for braking that is there at once. E's is not: [`Response`] is how it builds
//! up, and [`Foresight`] solves the same problem with it, by a bracketed search. All assume that F and R drive on as they do;
//! the plan is worked out afresh at every step.
//!
//! R crosses the marking at a headway of 0.15 to 0.4 s, which is mostly before it comes to d_c. E goes on with its plan
//! until d_c all the same: stopping at the marking leaves as many collisions, but reaches the goal in half as many samples
//! (16 % instead of 34 %, tuning seeds). An R that leaves the lane at a headway of 0.9 s or more needs no margin.
//!
//! # Why 1 m/s², and d_c = 5 m
//! Tuning seed 1, n = 1000, perfect tracks, approach 10 to 50 km/h (`examples/validate_margin_increase.rs`): without the
//! system 23.0 % of samples end in a collision.
//!
//! | bound | d_c = 5 m | d_c = 10 m |
//! |---|---|---|
//! | 1 m/s² | 4.2 % | 4.0 % |
//! | 2 m/s² | 2.8 % | 2.5 % |
//! | 3 m/s² | 2.6 % | 2.2 % |
//!
//! At 1 m/s² three samples in 1000 are induced, at more one. The gain beyond 1 m/s² is small, and rests on a rear driver
//! who foresees E's braking: with one who does not anticipate at all, 3 m/s² induced 17 % (n = 300) where 1 m/s² induced 12 %. So the
//! paper's comfort limit stands. Where the goal is out of reach the bound is used in full: each tenth of a second gained
//! counts.
//!
//! `machine` has the states, `plan` what is reported.

mod config;
mod foresight;
mod machine;
mod plan;
mod response;
mod solver;
#[cfg(test)]
mod tests;

pub use config::{MisConfig, MisSettings};
pub use foresight::Foresight;
pub(crate) use machine::{LETTING_GO_MPS3, Mis, Situation, Wish};
pub use plan::MisPlan;
pub use response::Response;
pub use solver::{Encounter, Solution};
