//! The margin increase system (MIS).
//!
//! A vehicle R comes up fast behind E, closes to a very low headway and overtakes only then. If F brakes in that moment,
//! E has to brake, and R runs into it. The MIS sees R coming, and slows E gently beforehand, so that for the critical
//! two seconds E need not brake at all.
//!
//! ```text
//!            every condition holds             R at the critical distance, or cuts out
//!  following ─────────────────────▶ increasing ─────────────────────▶ holding
//!      ▲                                │ fell back, follows, lost,      │ past, 2 s over,
//!      │                                ▼ lane occupied, F lost          ▼ no room, lost
//!      └──────── margin returned ── releasing ◀──────────────────────────┘
//! ```
//!
//! | state | entered when | command |
//! |---|---|---|
//! | following | at the start; the gap is back at the ACC's own | ACC |
//! | increasing | automated; THW_F below the threshold; track behind confirmed, classified, in lane, d_R ≤ 100 m, Δv ≥ 10 km/h; passing lane free | the smaller of ACC and −a* |
//! | holding | d_R ≤ d_c, or R leaves the lane for the passing lane | keeps the speed; ACC's braking is suppressed |
//! | releasing | R past, fallen back, lost; hold over | ACC, its acceleration bounded |
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
//! Hysteresis: R has fallen back at 1.2 times the engaging distance; it follows instead of overtaking once it has not
//! approached at half of the engaging speed for a second; a lost track is waited for half a second.
//!
//! [`Encounter`] is the kinematics with its closed-form solution, `machine` the states, `plan` what is reported.

mod config;
mod machine;
mod plan;
mod solver;

pub use config::{MisConfig, MisSettings};
pub(crate) use machine::{Mis, Situation, Wish};
pub use plan::MisPlan;
pub use solver::{Encounter, Solution};
