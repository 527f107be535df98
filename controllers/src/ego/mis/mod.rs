//! The margin increase system (MIS).
//!
//! A rear vehicle approaches the ego fast, closes to a very short time headway, and overtakes only
//! then. If the lead vehicle brakes at that moment, the ego must brake, and the rear vehicle hits
//! it. The MIS detects the rear vehicle early and slows the ego down gently beforehand, so that the
//! ego need not brake during the two critical seconds.
//!
//! ```text
//!            every condition holds           rear vehicle crosses, or at critical gap
//!  following ─────────────────────▶ increasing ──────────────────────────▶ holding
//!      ▲                                │ fell back, follows, lost, changed │ past, 2 s over,
//!      │                                │ lane early, passing lane occupied,│ no room, lost,
//!      │                                ▼ lead vehicle lost                 │ lead vehicle lost
//!      └──────── margin returned ── releasing ◀─────────────────────────────┘
//! ```
//!
//! # Conditions for engaging
//! The system engages at the first control step at which all of the following conditions hold.
//! While following, the reason of the command is the first condition that is missing, in this
//! order. The conditions use tracks only: the system assumes nothing that perception does not
//! report. In the tables d_R is the rear gap, Δv the closing speed of the rear vehicle, σ the
//! standard deviation of its speed, and THW_F the front time headway.
//!
//! | condition | holds if | reason otherwise |
//! |---|---|---|
//! | the ego is in automated mode | `automated` | `NotAutomated` |
//! | the system is available: no group of sensors has failed | front, surround and rear sensors work | `FrontSensorFailed`, `SurroundSensorsFailed`, `RearSensorsFailed` |
//! | the ego follows a lead vehicle at a short margin | a track is ahead in the lane of the ego, the ego moves, and THW_F < `short-thw-s` | `NoFront`, `FrontMarginLong` |
//! | a rear vehicle is present | a track is behind with at least half of its probability in the lane of the ego; nearer tracks that are not confirmed or not classified as vehicles do not hide it | `NoRear` |
//! | its track is established | confirmed, or coasting | `RearUnconfirmed` |
//! | it is a vehicle | car, truck or motorcycle: together at least as probable as not, and one of them more probable than background | `RearUnclassified` |
//! | it is near | d_R ≤ `engage-gap-m` | `RearFar` |
//! | it approaches | Δv − 1.645·σ ≥ `engage-closing-mps`: with confidence, judged by the covariance of its track | `RearNotApproaching` |
//! | it is not followed closely (the extended system only) | no vehicle is less than 1.5 s behind it in the lane of the ego | `RearFollowed` |
//! | it has a passing lane | the road has a lane on the overtaking side of the ego | `NoPassingLane` |
//! | the state of that lane is known | no unconfirmed track is in the way there | `PassingLaneUnknown` |
//! | that lane is free | no vehicle there is within 15 m of the rear vehicle while that uses it: from 40 m behind the ego until 10 m ahead of it, all at constant speed | `PassingLaneOccupied` |
//!
//! # Transitions
//! The system takes the first transition whose condition holds, from top to bottom.
//!
//! | from | to | if | reason |
//! |---|---|---|---|
//! | following, releasing | increasing | every condition for engaging holds | `Engaged`, `EngagedGoalOutOfReach` |
//! | increasing | releasing | the track of the lead vehicle has been gone for half a second | `FrontLost` |
//! | | releasing | the track of the rear vehicle has been gone for half a second (meanwhile it is extrapolated at its last speed; a new track at its position is taken for it) | `RearLost` |
//! | | releasing | the rear vehicle is entirely ahead of the ego | `RearPassed` |
//! | | releasing | the rear vehicle has left the lane of the ego at a time headway above 0.9 s | `RearChangedLane` |
//! | | holding | d_R ≤ `critical-gap-m`, in the lane of the ego or beside it, and there is room | `CriticalDistance` |
//! | | holding | the rear vehicle has left the lane of the ego, and there is room | `RearCrosses` |
//! | | releasing | d_R ≤ `critical-gap-m`, but there is no room, or `hold-s` is 0 | `NoRoomToHold`, `HoldExpired` |
//! | | releasing | d_R > 1.2 × `engage-gap-m` | `RearFellBack` |
//! | | releasing | Δv < ½ `engage-closing-mps` for 1 s | `RearFollows` |
//! | | releasing | another vehicle follows the rear vehicle closely (the extended system only) | `RearFollowed` |
//! | | releasing | the passing lane is occupied | `PassingLaneOccupied` |
//! | | releasing | the passing lane has not been known to be free for half a second; this includes sensor failures | `PassingLaneUnknown`, or which sensor has failed |
//! | holding | releasing | the lead vehicle is lost; the rear vehicle is entirely ahead; the rear vehicle is lost for half a second | as above |
//! | | releasing | `hold-s` has expired | `HoldExpired` |
//! | | releasing | there is no room any more | `NoRoomToHold` |
//! | releasing | following | the front gap is within 1.2 × the gap of the ACC, or the lead vehicle is lost | `MarginReturned` |
//! | any | emergency braking | only emergency braking avoids a collision with the lead vehicle; it overrides the command, and the states continue beneath it | `BrakingRequired` |
//!
//! There is *room* if the ego can stop 2 m behind the lead vehicle in the following case: the lead
//! vehicle brakes at `worst-front-braking-mps2` from now on to a standstill, and the ego brakes at
//! 5.9 m/s² (what a wet road allows) from 0.3 s later on.
//!
//! Hysteresis: the system engages at a rear gap of 100 m, and the rear vehicle has fallen back at
//! 120 m. It engages at a closing speed of 10 km/h, and the rear vehicle follows below 5 km/h for a
//! second. The margin must be short, below 1.5 s, only when engaging, because it is meant to grow.
//! Of two rear vehicles the nearer is the target. The target stays the same until it is past; the
//! system then judges the next vehicle afresh. A truck or a motorcycle is treated like a car, with
//! its own length.
//!
//! # Commands
//!
//! | state | command | acceleration | jerk |
//! |---|---|---|---|
//! | following | ACC | ACC's | ACC's: 2.5 m/s³ from 20 m/s on |
//! | increasing | the smaller of the ACC's acceleration and −a*, planned afresh at every step | a* ≤ `max-deceleration-mps2` | braking grows by `max-jerk-mps3`, falls by 3 m/s³ |
//! | holding | the brake is released; the ACC is ignored | 0 | the same |
//! | releasing | ACC, limited | ≤ 0.8 m/s² | rises by 3 m/s³ |
//!
//! Braking by the ACC, up to 3.5 m/s², passes in all states but holding; emergency braking always
//! passes, unless the extended system defers it. The jerk limits hold for the comfort command,
//! beneath emergency braking.
//!
//! *Holding* is the paper's critical time: for `hold-s` the ego uses up its margin instead of
//! braking for the lead vehicle. It begins when the centre of the rear vehicle crosses the marking,
//! or at the critical gap if that comes first.
//!
//! | limit | default | key |
//! |---|---|---|
//! | front time headway that is short | 1.5 s | `short-thw-s` |
//! | rear gap for engaging | 100 m | `engage-gap-m` |
//! | closing speed for engaging | 10 km/h | `engage-closing-mps` |
//! | gain of front time headway | 2 s | `thw-gain-s` |
//! | critical gap d_c | 5 m | `critical-gap-m` |
//! | braking | 1 m/s² | `max-deceleration-mps2` |
//! | jerk | 2 m/s³ | `max-jerk-mps3` |
//! | holding | 2 s | `hold-s` |
//! | worst braking of the lead vehicle while holding | 8 m/s² | `worst-front-braking-mps2` |
//! | time headway of a vehicle behind the rear vehicle in a free passing lane | 0 s: 15 m | `follower-headway-s` |
//!
//! # The plan
//! a* is the smallest braking with which THW_F, when the rear vehicle reaches d_c, equals the time
//! headway at engaging plus `thw-gain-s`. If no braking within the bound suffices, a* is the bound.
//! The goal is out of reach if the bound misses it by more than 0.08 s. [`Encounter`] has the
//! kinematics of the method and their closed-form solution for braking that takes effect at once.
//! [`BrakingResponse`] models how the ego's braking builds up instead, and [`ArrivalPrediction`]
//! solves the same problem with it by a bracketed search. All assume that the lead vehicle and the
//! rear vehicle keep their speeds; the plan is computed afresh at every step.
//!
//! The extended system brakes by the bound until no more braking is needed for the goal, since the
//! lead vehicle may brake before the rear vehicle arrives. It engages at the same rear gap. While a
//! rear vehicle in its lane would reach it within `hold-s` at present speeds, and its passing lane
//! is not occupied, the system defers all braking for the lead vehicle, emergency braking included,
//! if the 5.9 m/s² after 0.3 s still suffice for a lead vehicle that goes on braking as it does.
//! That is the risk that it takes: a lead vehicle that brakes harder from then on.
//!
//! With [`Horizon::Ttce`] a* is instead the braking that gains the headway within the time to
//! closest encounter at present speeds, as in the paper's text. The ego's own braking makes the
//! rear vehicle arrive earlier. This plan therefore brakes at 0.39 m/s² at the reference point and
//! misses the goal, which the paper's figure reaches at 1 m/s².
//!
//! The rear vehicle crosses the marking at a time headway of 0.15 to 0.4 s, mostly before it
//! reaches d_c. If there is room, the ego stops braking there, although the plan aims at a time
//! headway at d_c: from the marking on, the paper's ego does not brake in front of the rear
//! vehicle. Without room it continues its plan until d_c. A rear vehicle that leaves the lane at a
//! time headway of 0.9 s or more needs no margin.
//!
//! # Why 1 m/s², and d_c = 5 m
//! Both are the values of the paper.
//! `cargo run --release -p closecall-xtask -- validate-margin-increase 1000 1` measures what other
//! values would change: scenario `low-thw-overtake`, closing speed 10 to 50 km/h, true tracks, 1000
//! samples of tuning seed 1. Without the system, 233 samples end in a collision (23.3 %, 95 %
//! interval 20.7 to 26.0 %). With it:
//!
//! | bound | d_c | collisions | share | 95 % interval | prevented | induced | speed deficit |
//! |---|---|---|---|---|---|---|---|
//! | 1 m/s² | 5 m | 78 | 7.8 % | 6.2 to 9.6 % | 173 | 18 | 7.7 m/s |
//! | 2 m/s² | 5 m | 34 | 3.4 % | 2.4 to 4.7 % | 206 | 7 | 10.5 m/s |
//! | 3 m/s² | 5 m | 33 | 3.3 % | 2.3 to 4.6 % | 205 | 5 | 10.0 m/s |
//! | 1 m/s² | 10 m | 77 | 7.7 % | 6.1 to 9.5 % | 175 | 19 | 8.0 m/s |
//! | 2 m/s² | 10 m | 32 | 3.2 % | 2.2 to 4.5 % | 206 | 5 | 11.0 m/s |
//! | 3 m/s² | 10 m | 34 | 3.4 % | 2.4 to 4.7 % | 205 | 6 | 11.1 m/s |
//!
//! The speed deficit is the largest amount by which the ego is slower than the lead vehicle in a
//! run; 95 % of the samples stay below the value of the table. If the rear driver needs 2 s to
//! react, 462 samples end in a collision without the system, and 207, 129 and 117 with bounds of 1,
//! 2 and 3 m/s² (d_c = 5 m; 33, 18 and 12 of them induced). The same slow driver collides in none
//! of 1000 samples of `overtake-without-brake` with bounds of up to 2 m/s², and in two with 3 m/s².
//!
//! * d_c makes no difference that 1000 samples can show.
//! * A bound of 2 m/s² prevents more collisions than the paper's comfort limit of 1 m/s², and
//!   induces fewer. The price is a stronger and longer intervention: the ego becomes 10 m/s slower
//!   than the lead vehicle instead of 8 m/s.
//! * A bound of 3 m/s² shows no further gain over 2 m/s², and lets a slow rear driver collide
//!   without any event ahead.
//!
//! The default remains the comfort limit. A scenario that accepts stronger braking sets
//! `max-deceleration-mps2`. If the goal is out of reach, the bound is used in full: each tenth of a
//! second gained counts.
//!
//! The module `machine` has the states and transitions; `plan` has the plan that is reported.

mod config;
mod machine;
mod plan;
mod prediction;
mod response;
mod room;
mod solver;
mod target;
#[cfg(test)]
mod tests;

pub use config::{Horizon, MisConfig, MisSettings};
pub use machine::{ACTUATOR_LAG_S, BRAKE_RELEASE_JERK_MPS3, GOAL_TOLERANCE_S};
pub(crate) use machine::{Mis, Request, Situation};
pub use plan::MisPlan;
pub use prediction::ArrivalPrediction;
pub use response::BrakingResponse;
pub use solver::{Encounter, Solution};
