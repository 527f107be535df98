//! Extraction of an encounter from trajectory data: a recorded lane change with its rear, ego and
//! lead vehicle, on a road and a clock of its own.
//!
//! ```text
//!   target ────────────────────────────────────────╭────────▶
//!                                           ╭──────╯
//!   home   ── rear ─────────────────────────╯──▶  ego ──▶  lead ──▶
//!             │                             │
//!             start (time 0)                crossing
//! ```
//!
//! The *rear vehicle* is the vehicle that changes lanes. When its lane change begins, the *ego
//! vehicle* is the next vehicle ahead of it in the lane that it leaves (its *home* lane), and the
//! *lead vehicle* is the next vehicle ahead of the ego vehicle in that lane. Where no margin system
//! is simulated, the lead vehicle has no role ([`Lead::LeftOut`]).
//!
//! The encounter starts when the three vehicles are first recorded in this order without
//! interruption, at most [`LEAD_IN`] before the lane change begins. It ends [`LEAD_OUT`] after the
//! lane change, or with the track of the ego vehicle.
//!
//! **Frame.** Time is 0 at the start of the encounter, and s is 0 at the position of the ego
//! vehicle at that time. Trajectory data may hold several carriageways side by side, with continued
//! lane numbers. The road of the encounter consists of the contiguous lanes around the lanes of the
//! rear vehicle, renumbered from lane 1. All its lanes have the typical width of the trajectory
//! data. The marking that the rear vehicle crosses keeps its recorded lateral position.
//!
//! **Approach.** An [`Approach`] holds the values that a lane change gives for a logical scenario:
//! of the rear vehicle and of the vehicle that it overtakes, without their paths. It needs no lead
//! vehicle and no long recording, and [`most_relevant`] chooses among approaches.

mod approach;
mod choose;
mod find;
mod frame;
mod recorded;
mod relevance;
#[cfg(test)]
mod tests;

pub use approach::{Approach, ApproachValues, NoApproach, Party, approach};
pub use choose::{ChoiceError, Wanted, choose, choose_first};
pub use find::encounter;
pub use recorded::{
    EGO_INDEX, LEAD_IN, LEAD_INDEX, LEAD_OUT, LONGEST_THW_S, Lead, NoEncounter, Participant, REACH_M, REAR_INDEX,
    RecordedEncounter, SHORTEST_APPROACH,
};
pub use relevance::{Relevant, Variation, most_relevant};
