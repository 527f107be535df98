//! The data types that the crates of Closecall share, the criticality metrics, and statistics.
//!
//! This crate defines every type that crosses a boundary between crates: time, identifiers, the
//! road, vehicles and their states, recorded trajectories, the tracks that a sensor reports, the
//! parameters of a scenario, and seeded random streams. It depends on none of the other crates,
//! except for the mathematical functions.
//!
//! # Conventions
//!
//! All quantities are in SI units. The name of every public field carries its unit (`speed_mps`,
//! `gap_m`). Three frames are used:
//!
//! ```text
//!  road frame       s along the road, d to the left; d = 0 is the left edge of the leftmost lane,
//!                   so that lane centres have negative d; lane 1 is the leftmost
//!  vehicle frame    ISO 8855: x forward, y left, z up; origin on the ground below the centre of the box
//!  plane            x, y of a flat Cartesian plane, in which the road frame's s = 0 points along +x
//! ```
//!
//! Gaps are measured bumper to bumper. A metric or margin that does not exist is an [`Absent`] with
//! its reason, never a sentinel number.
//!
//! # Glossary
//! *The paper* is the paper that Closecall's margin increase system follows. ISO 15622 is the
//! standard for adaptive cruise control (ACC). UN R157 is the UN Regulation on automated lane
//! keeping systems (ALKS). "-" means that the source has no such term, or that none is claimed
//! here. The paper's letters appear in formulas and in references to its figures only.
//!
//! | paper | name here | ISO 15622 / UN R157 | meaning |
//! |---|---|---|---|
//! | E | ego (vehicle), `ego` | subject vehicle / ALKS vehicle | The vehicle that carries the system under test. |
//! | F | lead vehicle, `lead`; in file keys `front` | forward vehicle / lead vehicle | The vehicle ahead of the ego in its lane. |
//! | R | rear vehicle, `rear` | - | A vehicle that approaches the ego from behind and overtakes it. |
//! | Opp₁ (MIS section) | rear vehicle, `rear` | - | Another name for R. |
//! | Opp₁ (sampling section) | overtaken vehicle | - | The vehicle that is overtaken. |
//! | Opp₂ (sampling section) | overtaking vehicle | - | The vehicle that overtakes. |
//! | g_F; d_R, g_R | front gap, rear gap, `gap_m` | clearance / following distance | Bumper-to-bumper distance along the lane: ego to lead vehicle, rear vehicle to ego. |
//! | d | distance, `distance_m` | - | Shortest Euclidean distance between the boxes of two vehicles. |
//! | THW | time headway, `thw_s`, [`metrics::time_headway_s`] | time gap / time gap | Gap divided by the follower's speed. Traffic engineering measures headway front to front; here it is bumper to bumper. |
//! | - | time gap, `time_gap_s` | time gap / minimum time gap | The time headway that the ACC keeps: a setting, not a measurement. |
//! | TTC | time to collision, [`metrics::time_to_collision_s`] | - / TTC | Time until contact if both vehicles keep their speeds. |
//! | TTCE | time to closest encounter, `ttce_s`, [`metrics::closest_encounter`] | - | Time until two vehicles are closest if both keep their velocities. |
//! | DCE | distance of closest encounter, `dce_m`, [`metrics::closest_encounter`] | - | Distance between two vehicles at that time; 0 on a collision course. |
//! | Δv | closing speed, `closing_mps` | - | Speed at which a gap shrinks. |
//! | t_c(a) | time to critical, [`metrics::arrival_time_s`] | - | Time until the rear vehicle reaches the critical gap while the ego brakes at a. |
//! | d_c | critical gap, `critical_gap_m` | - | Rear gap at which the critical phase begins. |
//! | a_lon, a_lat | longitudinal, lateral acceleration | - | Acceleration along and across the road. |
//! | MIS | margin increase system, `mis` | - | The system under test: it raises the ego's front time headway before a rear vehicle overtakes. |
//! | - | ACC, `acc` | adaptive cruise control / - | Keeps a set speed, or a time gap to the lead vehicle. |
//! | - | AEB, `aeb` | - | Automatic emergency braking. |
//! | - | cut-in | - / cut-in | A lane change of another vehicle into the lane of the ego, ahead of it. |
//! | - | cut-out | - / cut-out | A lane change out of the lane of the ego. UN R157 means the lead vehicle's; here it is mostly the rear vehicle's, to overtake. |
//! | - | passing lane | - | The lane next to the ego in which a rear vehicle overtakes. |
//! | - | road frame `s_m`, `d_m` | - | Position along the road, and across it to the left. |

mod absent;
mod acceleration_lane;
mod actor;
pub mod atomic;
pub mod bodies;
mod body_shape;
mod check;
mod constants;
pub mod ego_frame;
mod environment;
pub mod geometry;
pub mod guard_rail;
pub mod input;
mod lateral_path;
pub mod maths;
mod number;
mod optics;
mod parameters;
mod quintic;
mod random;
mod road;
pub mod roadside;
pub mod same_file;
mod scene;
mod seed;
pub mod shown;
mod time;
mod track;
mod trajectory;
mod vehicle;

pub mod metrics;
pub mod statistics;
pub mod suggest;
pub mod words;

pub use absent::{Absent, Measured};
pub use acceleration_lane::{AccelerationLane, AccelerationLaneConfig};
pub use actor::{ActorId, InvalidActorId, is_kebab_name, kebab_name};
pub use body_shape::BodyShape;
pub use check::{Check, ConfigError, KeyPath, Problem, Range, Segment};
pub use constants::{
    CONTROL_STEP, ENGAGEMENT_CLOSING_MPS, ENGAGEMENT_GAP_M, GRAVITY_MPS2, LARGEST_JERK_MPS3, PHYSICS_STEP,
};
pub use environment::{Environment, EnvironmentConfig, Light};
pub use lateral_path::LateralPath;
pub use number::{Choice, Num, ParameterName};
pub use optics::{KOSCHMIEDER, rain_db_per_km};
pub use parameters::{Parameters, Value, readable};
pub use quintic::{MINIMUM_JERK_PEAK, Quintic, minimum_jerk};
pub use random::{Exp1, StandardNormal};
pub use road::{
    Alignment, AlignmentPiece, AlignmentPoint, AlignmentPointConfig, CrossSectionConfig, Lane, LaneWidthsConfig,
    NoLaneBeside, PlanePose, Road, RoadConfig, Side,
};
pub use roadside::{Roadside, RoadsideConfig};
pub use scene::{Scene, SceneVehicle};
pub use seed::{Stream, stream};
pub use time::Time;
pub use track::{ClassScores, Source, Track, TrackId, TrackStatus};
pub use trajectory::{Trajectory, TrajectoryPoint};
pub use vehicle::{Appearance, Dimensions, Indicator, Plate, Vehicle, VehicleClass, VehicleConfig, VehicleState};
