//! A human who comes up fast, closes to a very low headway, and only then changes lanes to overtake.
//!
//! ```text
//!                    ┌──────────── passing lane not free ───────────┐
//!                    ▼                                              │
//!   start ──▶ approaching ── pull out ──▶ changing ── own centre over the marking, clear ──▶ overtaking ──▶ passed
//!                    ▲                        │                                                          │
//!                    ├── back in lane ── aborting ◀── passing lane closes while still in the own lane   │ if the
//!                    └── back in lane ── returning ◀── gap in the lane that it came from ───────────────┘ scenario says so
//! ```
//!
//! While *approaching* with the passing lane free, the driver keeps its speed: it does not slow down for a vehicle that
//! it is about to overtake. It pulls out so that its time headway is the one asked for when its centre crosses the lane
//! marking, as far as it can foresee that: with a quintic path of duration T that is T/2 after pulling out. Where the
//! passing lane is not free it follows by its own Wiedemann 99. It signals from two seconds before it pulls out.
//!
//! In all phases the driver foresees whether on its present course it would run into the vehicle ahead before being
//! clear of it sideways ([`conflict`]), and brakes as hard as that needs, up to the limit of a human, while it keeps
//! steering. The gap that it wants to keep in doing so is its own safe gap, cc0 + cc1·v.

mod acceptance;
mod config;
mod conflict;
mod driver;
mod path;
mod returning;

pub use config::{FollowConfig, Overtaker, OvertakerConfig};
pub use returning::{Return, ReturnConfig};
