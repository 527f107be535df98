//! The shared nouns of Closecall, and the criticality metrics.
//!
//! Everything that crosses a boundary between the crates is defined here once: time, ids, the road, vehicles and
//! their states, recorded trajectories, the tracks a sensor reports, parameters of a scenario, and seeded random
//! streams. This crate imports none of its users.
//!
//! # Conventions
//!
//! SI units, named in every public field (`speed_mps`, `gap_m`). Three frames are used:
//!
//! ```text
//!  road frame       s along the road, d to the left; d = 0 is the left edge of the leftmost lane,
//!                   so that lane centres have negative d; lane 1 is the leftmost
//!  vehicle frame    ISO 8855: x forward, y left, z up; origin on the ground below the centre of the box
//!  plane            x, y of a flat Cartesian plane, in which the road frame's s = 0 points along +x
//! ```
//!
//! Gaps are bumper to bumper. A metric or margin that does not exist is an [`Absent`] with its reason, never a
//! sentinel number.

mod absent;
mod actor;
mod check;
mod environment;
pub mod geometry;
mod number;
mod parameters;
mod quintic;
mod road;
mod seed;
mod time;
mod track;
mod trajectory;
mod vehicle;

pub mod metrics;

pub use absent::{Absent, Measured};
pub use actor::{ActorId, InvalidActorId};
pub use check::{Check, ConfigError, KeyPath, Problem, Range, Segment};
pub use environment::{Environment, EnvironmentConfig, Light};
pub use number::{Choice, Num, ParameterName};
pub use parameters::{Parameters, Value};
pub use quintic::Quintic;
pub use road::{Lane, PlanePose, Road, RoadConfig, Side};
pub use seed::{Stream, stream};
pub use time::Time;
pub use track::{ClassScores, Source, Track, TrackId, TrackStatus};
pub use trajectory::{Trajectory, TrajectoryPoint};
pub use vehicle::{Appearance, Dimensions, Indicator, Vehicle, VehicleClass, VehicleConfig, VehicleState};
