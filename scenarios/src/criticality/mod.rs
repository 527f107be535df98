//! How critical is a lane change? Seven metrics, each with the opponent and the moment that make it worst.
//!
//! | metric       | what it is                                             | critical           |
//! |--------------|--------------------------------------------------------|--------------------|
//! | `distance_m` | Euclidean distance from box to box                     | < 1.0 m            |
//! | `speed_mps`  | speed of the vehicle that changes lanes                | > 1.3 · speed limit |
//! | `a_lon_mps2` | magnitude of its acceleration along the road           | > 8 m/s²           |
//! | `a_lat_mps2` | magnitude of its acceleration across the road          | > 8 m/s²           |
//! | `thw_s`      | its time headway                                       | < 0.9 s            |
//! | `dce_m`      | distance of closest encounter, where TTCE < 2.6 s      | < 1.0 m            |
//! | `ttce_s`     | time to closest encounter                              | < 2.6 s            |
//!
//! # What is evaluated, said once
//!
//! - **Window**: every instant of the common clock from the start to the end of the lane change, as far as recorded. Of
//!   all values in it, against all opponents, the most critical one is kept.
//! - **Opponents**: for distance, TTCE and DCE every other vehicle that is there at that instant. For THW the vehicle
//!   ahead in the lane that the centre is in, and, since within the window the lane change has begun, the one ahead in
//!   the target lane; of the two the smaller headway. A vehicle is ahead where its centre is, and its rear either is
//!   ahead of the front too or the two overlap across the road (which recordings contain; the headway is then 0). A
//!   vehicle alongside in the target lane has no headway: distance and encounter see it.
//! - **TTCE and DCE** are those of two oriented boxes at constant velocity, in continuous time. Vehicles that do not
//!   approach each other have none; nor does an encounter more than 10 s ahead. DCE is looked at only where
//!   TTCE < 2.6 s.
//! - **Magnitudes**: published thresholds for accelerations are signed, −8 m/s² for braking; here the magnitude counts.
//! - **Speed limit**: 120 km/h where it is not known.
//! - **Geometry**: the road frame is taken for a plane. Over the 50 m that matter, the bend of a motorway of 1 km radius
//!   turns two headings apart by 3°.
//! - Velocities and accelerations are those of the smoothed trajectories ([`crate::filters`]).
//!
//! A metric without a value is absent with its reason, and never counts as critical; the shares say how many there are.

mod evaluate;
mod record;
mod shares;
mod statistics;

pub use evaluate::{criticality, evaluate};
pub use record::{CriticalLaneChange, MetricRecord, Metrics};
pub use shares::{CriticalShare, CriticalShares, shares};
pub use statistics::{BoxNumbers, ClassStatistics, Correlation, Statistics, statistics};

/// Distance below which it is critical [m].
pub const CRITICAL_DISTANCE_M: f64 = 1.0;
/// Multiple of the speed limit above which the speed is critical.
pub const CRITICAL_SPEED_FACTOR: f64 = 1.3;
/// Magnitude above which the acceleration along the road is critical [m/s²].
pub const CRITICAL_A_LON_MPS2: f64 = 8.0;
/// Magnitude above which the acceleration across the road is critical [m/s²].
pub const CRITICAL_A_LAT_MPS2: f64 = 8.0;
/// Time headway below which it is critical [s].
pub const CRITICAL_THW_S: f64 = 0.9;
/// Distance of closest encounter below which it is critical [m].
pub const CRITICAL_DCE_M: f64 = 1.0;
/// Time to closest encounter below which it is critical [s].
pub const CRITICAL_TTCE_S: f64 = 2.6;
/// The speed limit where none is known [m/s]: 120 km/h.
pub const DEFAULT_SPEED_LIMIT_MPS: f64 = 120.0 / 3.6;
/// Encounters further ahead than this are not looked at [s].
pub const ENCOUNTER_HORIZON_S: f64 = 10.0;
