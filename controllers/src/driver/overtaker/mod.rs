//! A human driver who approaches fast, closes to a very short time headway, and only then changes
//! lanes to overtake.
//!
//! ```text
//!                  ┌─────────── passing lane not free ────────────┐
//!                  ▼                                              │
//! start ──▶ approaching ── pulls out ──▶ changing ── centre in passing lane, clear ──▶ overtaking ──▶ passed
//!                  ▲                        │                                                          │
//!                  ├── back in lane ── aborting ◀── passing lane not free, own lane not yet left       │ if the
//!                  └── back in lane ── returning ◀── gap in the original lane ─────────────────────────┘ scenario asks
//! ```
//!
//! A driver overtakes only for a least gain of speed. In the phase *approaching* with a free
//! passing lane, it keeps its speed: it does not slow down behind a vehicle that it is about to
//! overtake. It times the lane change by prediction: when its centre crosses the lane marking, the
//! time headway has the value that the scenario gives. It pulls out earlier where its gap would
//! otherwise fall below its own safe gap, cc0 + cc1·v (s₀ + T·v with the Intelligent Driver Model).
//! On a quintic path of duration T, the centre crosses the marking T/2 after pulling out. While the
//! passing lane is not free, the driver follows by its car-following model (Wiedemann 99 or the
//! Intelligent Driver Model). It signals from two seconds before it pulls out.
//!
//! The brake light of the vehicle ahead makes the driver release the accelerator, unless it is
//! already pulling out. If the gap closes so fast that drivers brake (a time to collision below 10
//! s), the driver brakes at least as strongly as that vehicle, one reaction time after the light.
//!
//! In all phases, the driver predicts whether its present course would collide with the vehicle
//! ahead before the two are laterally clear of each other ([`conflict`]). If so, it brakes as
//! strongly as necessary, up to the limit of a human, and continues to steer. The gap that it tries
//! to keep is its own safe gap, cc0 + cc1·v.

pub(super) mod acceptance;
mod config;
mod conflict;
mod driver;
mod follow;
mod path;
mod returning;

pub use config::{Overtaker, OvertakerConfig};
pub use follow::{Follow, FollowConfig};
pub use returning::{Return, ReturnConfig};
